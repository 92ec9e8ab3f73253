//! What a network learns: the light that a GI method must add, path-traced at the very points that
//! its cells look at.

use super::error::DatasetError;
use crate::{
    gi::inputs::{cells_of, sample_pixel},
    gpu::Gpu,
    reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions},
    scene::Camera,
};

/// Light at the cells of one picture.
#[derive(Debug, Clone)]
pub struct Target {
    /// E/π, three planes; without bias, with `noise`.
    pub light: Vec<f32>,
    /// Root mean square error of a cell relative to the mean light.
    pub noise: f32,
    /// Samples for each cell.
    pub samples: u32,
}

/// Cycles' settings, which the pictures that the tables are made against follow: bounces, clamp and
/// "Filter Glossy".
pub fn options(samples: u32, seed: u32) -> TracerOptions {
    TracerOptions {
        samples,
        seed,
        bounces: 12,
        diffuse_bounces: 4,
        glossy_bounces: 4,
        clamp: 10.0,
        filter_glossy: 1.0,
        layers: vec![Layer::Gi],
        ..TracerOptions::default()
    }
}

/// Traces the light at each cell's sample point in a picture of `size` pixels. Blocks; `go_on` is
/// asked between dispatches.
///
/// # Errors
/// What the tracer reports; `None` where `go_on` said no.
pub fn target(
    gpu: &Gpu,
    kernel: &Kernel,
    scene: &ReferenceScene,
    camera: &Camera,
    size: [u32; 2],
    options: TracerOptions,
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Target>, DatasetError> {
    let [w, h] = cells_of(size);
    let cells = (0..h).flat_map(|y| (0..w).map(move |x| [x, y]));
    let points: Vec<[f32; 2]> = cells.map(|c| sample_pixel(c, size).map(|p| p as f32 + 0.5)).collect();
    let subject = Subject { camera, size, points: Some(&points) };
    let mut tracer = Tracer::new(&gpu.device, &gpu.queue, kernel, scene, subject, options)?;
    while tracer.step()? {
        if !go_on() {
            return Ok(None);
        }
    }
    let traced = tracer.finish()?;
    let gi = traced.layer(Layer::Gi).unwrap_or_default();
    let light = (0..3).flat_map(|c| gi.iter().skip(c).step_by(3).copied()).collect();
    let noise = traced.noise_of(Layer::Gi).map_or(f64::INFINITY, |n| n.pixel) as f32;
    Ok(Some(Target { light, noise, samples: traced.samples[0] }))
}
