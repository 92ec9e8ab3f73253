//! Method `neural`: `gather`, whose spatial filter a U-Net guides by cells' histories.
//!
//! ```
//! use bouncelight::gi::{Method, Neural};
//! use bouncelight::net::format::Weights;
//! let neural = Neural::from(Weights::shipped()?);
//! assert_eq!(Method::Neural(Box::new(neural)).name(), "neural");
//! # Ok::<_, bouncelight::net::format::WeightsError>(())
//! ```

#[doc(hidden)]
pub mod filter;
pub mod memory;
mod trained;

pub use trained::Neural;

use crate::net::plan::Precision;

/// Shaders of the method, each with examples of its prelude.
pub(super) fn preludes() -> Vec<(&'static str, String)> {
    [Precision::F32, Precision::F16].map(|precision| ("gi.features", memory::prelude(precision))).into()
}
