//! The weights that come with the program. `bouncelight weights info` shows where they come from.

use super::format::{Weights, WeightsError};

/// What `--weights` may call them, and the files; the first is method `neural`'s own.
static FILES: [(&str, &[u8]); 2] = [
    ("filter", include_bytes!("../../assets/weights/filter.safetensors")),
    ("small", include_bytes!("../../assets/weights/small.safetensors")),
];

impl Weights {
    /// The shipped network of method `neural`, `filter`: it says which light `gather` averages.
    ///
    /// # Errors
    /// Never for an unmodified build; the file is checked as any other.
    pub fn shipped() -> Result<Self, WeightsError> {
        Self::from_bytes(FILES[0].1)
    }

    /// The shipped network that corrects what `gather` answers, `small`: what `fit --learn` begins
    /// with.
    ///
    /// # Errors
    /// As [`Weights::shipped`].
    pub fn corrector() -> Result<Self, WeightsError> {
        Self::from_bytes(FILES[1].1)
    }

    /// The weights in `path`, or the shipped ones of that name where there is no such file; without
    /// a path [`Weights::shipped`].
    ///
    /// # Errors
    /// As [`Weights::load`].
    pub fn find(path: Option<&std::path::Path>) -> Result<Self, WeightsError> {
        let Some(path) = path else { return Self::shipped() };
        let named = FILES.iter().find(|(name, _)| path.to_str() == Some(name) && !path.exists());
        named.map_or_else(|| Self::load(path), |(_, file)| Self::from_bytes(file))
    }
}
