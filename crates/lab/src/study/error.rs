//! Why samples and trials fail.

use bouncelight::gpu::readback;
use bouncelight::render::RenderError;
use thiserror::Error;

/// Why a sample could not be made.
#[derive(Debug, Error)]
pub enum DatasetError {
    /// The frame could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The GPU did not give the data.
    #[error(transparent)]
    Readback(#[from] readback::ReadbackError),
    /// What changes in a scene could not be uploaded.
    #[error(transparent)]
    Upload(#[from] bouncelight::gpu_scene::UploadError),
    /// The GI pass did not give its inputs.
    #[error(transparent)]
    Gi(#[from] bouncelight::gi::GiError),
    /// Serialisation failed.
    #[error("cannot serialise the sample: {0}")]
    Serialize(String),
}

/// Why a trial failed.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum SessionError {
    /// The scene does not fit.
    #[error(transparent)]
    Upload(#[from] bouncelight::gpu_scene::UploadError),
    /// The path tracer cannot have the scene.
    #[error(transparent)]
    Pack(#[from] crate::reference::PackError),
    /// The path tracer failed.
    #[error(transparent)]
    Tracer(#[from] crate::reference::TracerError),
    /// A frame could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A measurement failed.
    #[error(transparent)]
    Bench(#[from] super::bench::BenchError),
    /// Nothing could be counted.
    #[error(transparent)]
    Count(#[from] super::count::CountError),
    /// A file could not be written.
    #[error(transparent)]
    Image(#[from] bouncelight_scene::image_io::ImageError),
    /// A reference could not be kept.
    #[error("{}: the reference cannot be kept: {reason}", path.display())]
    Kept { path: std::path::PathBuf, reason: String },
    /// An edit of what is not there.
    #[error("the scene has {count} instances, so there is no number {index}")]
    Instance { index: usize, count: usize },
    /// The watching function said so.
    #[error("stopped")]
    Stopped,
}
