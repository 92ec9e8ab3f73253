//! The weights that come with the program. `bouncelight weights info filter` shows where they come
//! from.

use super::format::{Weights, WeightsError};
use std::path::Path;

/// What `--weights` may call them.
const NAME: &str = "filter";
static FILE: &[u8] = include_bytes!("../../assets/weights/filter.safetensors");

impl Weights {
    /// The shipped network of method `neural`, `filter`: it says which light `gather` averages.
    ///
    /// # Errors
    /// Never for an unmodified build; the file is checked as any other.
    pub fn shipped() -> Result<Self, WeightsError> {
        Self::from_bytes(FILE)
    }

    /// The weights in `path`, or the shipped ones if it is their name and there is no such file;
    /// without a path [`Weights::shipped`].
    ///
    /// # Errors
    /// As [`Weights::load`].
    pub fn find(path: Option<&Path>) -> Result<Self, WeightsError> {
        let shipped = |path: &&Path| path.to_str() == Some(NAME) && !path.exists();
        match path.filter(|path| !shipped(path)) {
            Some(path) => Self::load(path),
            None => Self::shipped(),
        }
    }
}
