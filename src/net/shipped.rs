//! The weights that come with the program. `bouncelight weights info` shows where they come from.

use super::format::{Weights, WeightsError};

static COMPACT: &[u8] = include_bytes!("../../assets/weights/compact.safetensors");

impl Weights {
    /// The shipped compact network: 21 feature channels, 16→24→32→48 channels inside, 0.9 GFLOP for a 1024×512 picture.
    ///
    /// # Errors
    /// Never for an unmodified build; the file is checked as any other.
    pub fn shipped() -> Result<Self, WeightsError> {
        Self::from_bytes(COMPACT)
    }
}
