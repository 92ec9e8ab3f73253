//! What the passes of a frame do, counted by the shaders themselves while they draw it.

use super::projection::Cost;
use crate::count::{Count, Counted};
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, GpuError, readback::ReadbackError, timing::Recorder};
use bouncelight::gpu_scene::{SceneGpu, UploadError};
use bouncelight::render::{RenderError, Renderer, RendererOptions, View};
use bouncelight::scene::{Camera, Scene};
use thiserror::Error;

/// Why nothing could be counted.
#[derive(Debug, Error)]
pub enum CountError {
    /// A device with room for the sums was refused.
    #[error("shaders cannot count here: {0}")]
    Gpu(#[from] GpuError),
    /// The scene does not fit.
    #[error(transparent)]
    Upload(#[from] UploadError),
    /// The frame could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The sums could not be read.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
    /// Another method draws the scene in the place of the one that was asked for.
    #[error("nothing is counted of a method that does not draw: {0}")]
    Fallback(String),
}

/// What a camera sees.
#[derive(Debug, Clone, Copy)]
pub struct Still<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// From where.
    pub camera: &'a Camera,
    /// Pixels of the picture.
    pub size: [u32; 2],
}

/// What the compute passes of a frame do, the last of `frames` of a still camera: see [`frames`].
///
/// # Errors
/// [`CountError`].
pub fn frame(gpu: &Gpu, still: Still<'_>, options: RendererOptions, frames: u32) -> Result<Vec<Cost>, CountError> {
    Ok(self::frames(gpu, still, options, &[frames.max(1)])?.pop().unwrap_or_default())
}

/// Draws frames of a still camera, and says what the compute passes of those numbered `at`, from 1
/// on in rising order, do, in their order; on a device of its own, which has room for the sums.
/// Passes that draw triangles are left out, and the layers of a network are those of its plan
/// ([`Plan`](bouncelight::net::plan::Plan)).
///
/// # Errors
/// [`CountError`].
pub fn frames(gpu: &Gpu, still: Still<'_>, options: RendererOptions, at: &[u32]) -> Result<Vec<Vec<Cost>>, CountError> {
    let gpu = gpu.for_counting()?;
    let Still { scene, camera, size } = still;
    let rays = options.method.needs_rays();
    let paints = matches!(options.method, Method::Generator(_));
    let mut count = Count::start();
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene)?;
    if rays && let Err(e) = uploaded.trace(&gpu.device, &gpu.queue, scene) {
        return Err(CountError::Fallback(e.to_string()));
    }
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, options)?;
    let view = View::new(camera, size, [0.0; 2]);
    let mut found = Vec::new();
    for number in 1..=at.last().copied().unwrap_or(0) {
        let counts = at.contains(&number);
        if counts {
            count.begin(&gpu.device);
        }
        let before = renderer.settled();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view)?;
        gpu.queue.submit([encoder.finish()]);
        // Drivers let frames pile up otherwise.
        let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
        if let Some(fallback) = renderer.fallback() {
            return Err(CountError::Fallback(fallback.why.to_owned()));
        }
        if counts {
            let mut costs = added_up(count.take(&gpu)?);
            // A frame at rest that shows the last one's cells runs no network, unless it paints.
            let rests = !paints && before.is_some() && renderer.settled() == before;
            if let Some(plan) = renderer.plan().filter(|_| !rests) {
                costs.extend(plan.steps.iter().map(|s| Cost::of_step(plan, s, &s.name)));
            }
            found.push(costs);
        }
    }
    Ok(found)
}

/// Costs of passes, of what their dispatches did.
fn added_up(dispatches: Vec<Counted>) -> Vec<Cost> {
    let mut costs: Vec<Cost> = Vec::new();
    for dispatch in dispatches {
        let at = costs.iter().position(|c| c.pass == dispatch.label).unwrap_or_else(|| {
            costs.push(Cost::new(&dispatch.label, 0.0, 0.0));
            costs.len() - 1
        });
        let [done, slowest] = dispatch.operations;
        costs[at].flops += done;
        costs[at].waited += slowest - done;
        costs[at].bytes += dispatch.bytes;
        costs[at].rays += dispatch.rays;
        costs[at].dispatches += 1.0;
        costs[at].threads += dispatch.threads;
        costs[at].links += dispatch.links;
        costs[at].longest += dispatch.longest[0];
        costs[at].steps += dispatch.longest[1];
        costs[at].barriers += dispatch.barriers;
    }
    costs
}
