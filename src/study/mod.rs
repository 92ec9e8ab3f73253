//! What is measured over methods and scenes.

pub mod bench;
#[cfg(all(feature = "io", feature = "reference"))]
mod changes;
#[cfg(all(feature = "io", feature = "reference"))]
pub mod chart;
#[cfg(feature = "reference")]
pub mod count;
#[cfg(all(feature = "io", feature = "reference"))]
mod error;
#[cfg(all(feature = "io", feature = "reference"))]
pub mod fit;
#[cfg(feature = "reference")]
pub mod hardware;
#[cfg(feature = "io")]
pub mod hash;
#[cfg(all(feature = "io", feature = "reference"))]
pub mod judge;
pub mod layers;
#[cfg(all(feature = "io", feature = "reference"))]
pub mod moments;
pub mod projection;
pub mod rays;
#[cfg(all(feature = "io", feature = "reference"))]
pub mod stability;
#[cfg(all(feature = "io", feature = "reference"))]
pub mod trial;
#[cfg(all(feature = "io", feature = "reference"))]
pub mod truth;
#[cfg(feature = "io")]
pub mod varied;
pub mod views;
#[cfg(all(feature = "io", feature = "reference"))]
mod wrap;
