//! The weights that come with the program. `bouncelight weights info` shows where they come from.

use super::format::{Weights, WeightsError};

/// Name and file of each, smallest first.
static FILES: [(&str, &[u8]); 3] = [
    ("small", include_bytes!("../../assets/weights/small.safetensors")),
    ("medium", include_bytes!("../../assets/weights/medium.safetensors")),
    ("large", include_bytes!("../../assets/weights/large.safetensors")),
];

/// The one that is taken where nobody chose.
const DEFAULT: &str = "small";

impl Weights {
    /// The shipped network that is used by default. It corrects what method `cache` answers.
    ///
    /// # Errors
    /// Never for an unmodified build; the file is checked as any other.
    pub fn shipped() -> Result<Self, WeightsError> {
        Self::shipped_as(DEFAULT).expect("the default is one of the files")
    }

    /// The shipped network of that name, see [`Weights::shipped_names`].
    pub fn shipped_as(name: &str) -> Option<Result<Self, WeightsError>> {
        FILES.iter().find(|(n, _)| *n == name).map(|(_, bytes)| Self::from_bytes(bytes))
    }

    /// The weights in `path`, or the shipped ones of that name where there is no such file; without a path the default.
    ///
    /// # Errors
    /// As [`Weights::load`].
    pub fn find(path: Option<&std::path::Path>) -> Result<Self, WeightsError> {
        let Some(path) = path else { return Self::shipped() };
        let named = path.to_str().filter(|_| !path.exists()).and_then(Self::shipped_as);
        named.unwrap_or_else(|| Self::load(path))
    }

    /// Names of the shipped networks, smallest first.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        FILES.iter().map(|(name, _)| *name)
    }
}
