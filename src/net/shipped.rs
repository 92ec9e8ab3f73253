//! The weights that come with the program. `bouncelight weights info` shows where they come from.

use super::format::{Weights, WeightsError};

static FILTER: &[u8] = include_bytes!("../../assets/weights/filter.safetensors");
static SMALL: &[u8] = include_bytes!("../../assets/weights/small.safetensors");

impl Weights {
    /// The shipped network, `filter`: it guides the filter of method `gather`.
    ///
    /// # Errors
    /// Never for an unmodified build; the file is checked as any other.
    pub fn shipped() -> Result<Self, WeightsError> {
        Self::from_bytes(FILTER)
    }

    /// The shipped network `small`, which corrects what method `gather` answers: what `fit --learn` starts from.
    ///
    /// # Errors
    /// As [`Weights::shipped`].
    pub fn small() -> Result<Self, WeightsError> {
        Self::from_bytes(SMALL)
    }

    /// The weights in `path`; the shipped ones without a path, and of the names `filter` and `small` where there is no such file.
    ///
    /// # Errors
    /// As [`Weights::load`].
    pub fn find(path: Option<&std::path::Path>) -> Result<Self, WeightsError> {
        match path.map(|path| (path, path.to_str())) {
            Some((path, Some("filter"))) if !path.exists() => Self::shipped(),
            Some((path, Some("small"))) if !path.exists() => Self::small(),
            Some((path, _)) => Self::load(path),
            None => Self::shipped(),
        }
    }
}
