//! The weights that come with the program. `bouncelight weights info` shows where they come from.

use super::format::{Weights, WeightsError};

static FILE: &[u8] = include_bytes!("../../assets/weights/small.safetensors");

/// What `--weights` may call them.
const NAME: &str = "small";

impl Weights {
    /// The shipped network. It corrects what method `gather` answers.
    ///
    /// # Errors
    /// Never for an unmodified build; the file is checked as any other.
    pub fn shipped() -> Result<Self, WeightsError> {
        Self::from_bytes(FILE)
    }

    /// The weights in `path`; the shipped ones without a path, and for `small` where there is no
    /// such file.
    ///
    /// # Errors
    /// As [`Weights::load`].
    pub fn find(path: Option<&std::path::Path>) -> Result<Self, WeightsError> {
        match path.filter(|path| path.to_str() != Some(NAME) || path.exists()) {
            Some(path) => Self::load(path),
            None => Self::shipped(),
        }
    }
}
