//! The path tracer: the same scene, camera and materials as the rasteriser, converging to the truth on the same GPU.

mod accel_stub;
pub mod job;
pub mod scene;

use accel_stub as accel;

pub use job::Job;
pub use scene::{PackError, ReferenceScene};
