//! The path tracer: the same scene, camera and materials as the rasteriser, converging to the truth on the same GPU.

pub mod accel;
