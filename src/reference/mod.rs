//! The path tracer: the same scene, camera and materials as the rasteriser, converging to the truth on the same GPU.

mod accel_stub;
pub mod error;
pub mod film;
pub mod job;
mod layers;
mod noise;
pub mod scene;
pub mod schedule;

use accel_stub as accel;

pub use error::TracerError;
pub use job::Job;
pub use layers::Layer;
pub use noise::{Noise, Tally};
pub use scene::{PackError, ReferenceScene};
