//! What is measured over methods and scenes.

pub mod bench;
mod changes;
pub mod chart;
pub mod count;
pub mod device;
mod error;
pub mod fit;
pub mod fitted;
pub mod hardware;
pub mod hash;
pub mod judge;
pub mod layers;
pub mod moments;
pub mod projection;
pub mod rays;
pub mod session;
pub mod stability;
pub mod truth;
pub mod varied;
pub mod views;
mod wrap;
