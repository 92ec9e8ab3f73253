//! Why the path tracer cannot do what it was asked.

use thiserror::Error;

/// Errors of [`Tracer`](super::Tracer).
#[derive(Debug, Error)]
pub enum TracerError {
    /// A picture without pixels, or more points than fit.
    #[error("{points} points of a {width}×{height} picture: {reason}")]
    Points {
        /// How many points were asked for.
        points: u64,
        /// Width of the picture, pixels.
        width: u32,
        /// Height of the picture, pixels.
        height: u32,
        /// What is wrong with that.
        reason: String,
    },
    /// A point or a camera with coordinates that are no numbers.
    #[error("{0} is not finite")]
    Input(String),
    /// Options that cannot be met, such as no samples.
    #[error("{0}")]
    Option(String),
    /// A layer with values that are no numbers, in spite of all care.
    #[error("layer {layer} has {count} points that are not finite, the first is number {first}")]
    NotFinite {
        /// The layer's name.
        layer: &'static str,
        /// How many points.
        count: usize,
        /// The first of them.
        first: usize,
    },
    /// Reading the film failed.
    #[error(transparent)]
    Readback(#[from] bouncelight::gpu::readback::ReadbackError),
    /// The device was lost or did not answer.
    #[error("waiting for the GPU failed while tracing: {0}")]
    Wait(String),
}
