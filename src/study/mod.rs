//! What is measured over methods and scenes.

pub mod bench;
pub mod dataset;
pub mod guides;
#[cfg(feature = "io")]
pub mod motion;
pub mod projection;
#[cfg(feature = "reference")]
pub mod target;
#[cfg(feature = "io")]
pub mod varied;
pub mod views;
