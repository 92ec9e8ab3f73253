//! The path tracer: the same scene, camera and materials as the rasteriser, converging to the truth on the same GPU.

pub mod accel;
pub mod job;
pub mod scene;

pub use job::Job;
pub use scene::{PackError, ReferenceScene};
