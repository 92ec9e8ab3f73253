//! The path tracer: the same scene, camera and materials as the rasteriser, converging to the truth on the same GPU.

pub mod error;
pub mod film;
pub mod job;
mod layers;
mod noise;
pub mod schedule;

pub use error::TracerError;
pub use layers::Layer;
pub use noise::{Noise, Tally};
