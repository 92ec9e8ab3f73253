//! What the passes of a frame do, counted by the shaders themselves while they draw it.

use crate::{
    accel::AccelError,
    gi::technique::Cost,
    gpu::{Gpu, GpuError, count::Count, readback::ReadbackError, timing::Recorder},
    render::{RenderError, Renderer, RendererOptions, View},
    scene::{
        Camera, Scene,
        upload::{SceneGpu, UploadError},
    },
};
use thiserror::Error;

/// Why nothing could be counted.
#[derive(Debug, Error)]
pub enum CountError {
    /// A device with room for the sums was refused.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The scene does not fit.
    #[error(transparent)]
    Upload(#[from] UploadError),
    /// Rays cannot have it.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// The frame could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The sums could not be read.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
}

/// Draws `frames` frames of a still camera, and says what the compute passes of the last did. On a device of its own,
/// with shaders that are slower than those that do not count. The layers of a network are left out
/// ([`Plan`](crate::net::plan::Plan) has them), and so are passes that draw triangles.
///
/// Operations are those of [`Cost::flops`], with what threads of a warp of 32 wait for the slowest of them; bytes are
/// what shaders ask of each binding, but of none more than it has: what caches cannot spare them.
///
/// # Errors
/// [`CountError`].
pub fn frame(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    size: [u32; 2],
    options: RendererOptions,
    frames: u32,
) -> Result<Vec<Cost>, CountError> {
    let gpu = gpu.for_counting()?;
    let rays = options.method.needs_rays();
    let mut count = Count::start(&gpu.device);
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene)?;
    if rays {
        uploaded.trace(&gpu.device, &gpu.queue, scene)?;
    }
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, options)?;
    let view = View::new(camera, size, [0.0; 2]);
    for _ in 0..frames.max(1) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        count.clear(&mut encoder);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view)?;
        gpu.queue.submit([encoder.finish()]);
    }
    let mut costs: Vec<Cost> = Vec::new();
    for dispatch in count.take(&gpu.device, &gpu.queue)? {
        let at = costs.iter().position(|c| c.pass == dispatch.label).unwrap_or_else(|| {
            costs.push(Cost::new(&dispatch.label, 0.0, 0.0));
            costs.len() - 1
        });
        costs[at].flops += dispatch.operations[1];
        costs[at].bytes += dispatch.bytes;
        costs[at].rays += dispatch.rays;
    }
    Ok(costs)
}
