//! The path tracer: the same scene, camera and materials as the rasteriser, converging to the truth
//! on the same GPU.

pub mod error;
pub mod film;
pub mod job;
mod kernel;
mod layers;
mod noise;
pub mod preview;
pub mod scene;
pub mod schedule;
mod traced;
mod tracer;

pub use error::TracerError;
pub use job::Job;
pub use kernel::Kernel;
pub use layers::Layer;
pub use noise::{Noise, Tally};
pub use scene::{PackError, ReferenceScene};
pub use traced::{JUDGED, NO_DEPTH, Traced};
pub use tracer::{DEFAULT_CAP, Subject, Tracer, TracerOptions};
