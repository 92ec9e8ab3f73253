//! Whole frames of every method.

use super::Run;
use crate::study::{
    bench::{BenchError, BenchOptions, Measurement, measure},
    count,
    projection::is_indirect,
};
use bouncelight::gi::{Method, Neural, name::MethodName};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::plan::Precision;
use bouncelight::render::{Renderer, RendererOptions};
use bouncelight::scene::{Camera, Scene};
use serde::{Deserialize, Serialize};
use std::convert::Infallible;

/// Frames that count and those before them, where time allows: methods with a history settle within
/// them.
const MOST: BenchOptions = BenchOptions { frames: 60, warmup: 32 };
const LEAST: BenchOptions = BenchOptions { frames: 5, warmup: 3 };
/// How much of the time that is left one row may take.
const SHARE: f64 = 0.04;

/// One method at one size in one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameRow {
    /// The scene's name.
    pub scene: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Triangles that the scene shows.
    pub triangles: u64,
    /// `f32` or `f16`: how a network's numbers are stored.
    pub precision: String,
    /// Frames that counted.
    pub frames: u32,
    /// Passes, sums, memory, counts.
    pub measured: Measurement,
    /// Milliseconds of the passes that find and add indirect light.
    pub own_ms: f64,
    /// How `own_ms` was found.
    pub timing: Timing,
}

/// Where the time of a method's own passes comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Timing {
    /// The passes' timestamps, whose sum agrees with the synchronised clock.
    Timestamps,
    /// The synchronised clock, less that of `direct`: there are no timestamps, or they do not agree
    /// with it.
    Clock,
}

/// All real-time methods in `scene` at `size`.
pub(super) fn methods(run: &mut Run<'_>, scene: &(String, Scene), size: [u32; 2]) -> Vec<FrameRow> {
    rows(run, scene, size, MethodName::LIGHT, Precision::F32)
}

/// The network in 16 bits.
pub(super) fn half_precision(run: &mut Run<'_>, scene: &(String, Scene), size: [u32; 2]) -> Vec<FrameRow> {
    // `direct` gives the clock something to be compared with.
    let mut rows = rows(run, scene, size, &[MethodName::Direct, MethodName::Neural], Precision::F16);
    rows.retain(|r| r.measured.method == MethodName::Neural.name());
    rows
}

fn rows(
    run: &mut Run<'_>,
    (name, scene): &(String, Scene),
    size: [u32; 2],
    methods: &[MethodName],
    precision: Precision,
) -> Vec<FrameRow> {
    let what = format!("{name} at {}x{}", size[0], size[1]);
    let gpu = run.gpu;
    let Some(camera) = run.kept(&what, scene.cameras.first().ok_or("the scene has no camera")) else {
        return Vec::new();
    };
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene);
    let Some(mut uploaded) = run.kept(&what, uploaded) else { return Vec::new() };
    let traced = uploaded.trace(&gpu.device, &gpu.queue, scene);
    let rays = run.kept(&format!("{what}, methods that send rays"), traced).is_some();
    let mut rows: Vec<FrameRow> = Vec::new();
    for &method in methods.iter().filter(|m| rays || !m.needs_rays()) {
        let what = format!("{what}, {}, {}", method.name(), label(precision));
        // Whatever came before is a fair guess for what comes next; the methods are listed cheapest
        // first.
        let before = rows.last().map_or(0.0, |r| r.measured.wall_ms.median * 1e-3);
        if !run.affords(&what, before * f64::from(LEAST.frames + LEAST.warmup)) {
            continue;
        }
        let network = || Ok::<_, Infallible>(Neural::from(run.weights.clone()).stored(Some(precision)));
        let Ok(Some(with)) = method.method(network) else { continue };
        let seconds = SHARE * run.left();
        let measured = one(gpu, with.clone(), &uploaded, camera, size, seconds);
        let Some((mut measured, frames)) = run.kept(&what, measured) else { continue };
        let steady = with.frames_to_steady();
        let options = RendererOptions { method: with, ..Default::default() };
        let counted = count::frame(gpu, count::Still { scene, camera, size }, options, steady);
        measured.costs = run.kept(&format!("{what}, counts"), counted).unwrap_or_default();
        measured.costs.retain(|c| is_indirect(&c.pass));
        let direct = rows.first().map_or(measured.wall_ms.median, |r| r.measured.wall_ms.median);
        let (own_ms, timing) = own(&measured, direct);
        rows.push(FrameRow {
            scene: name.clone(),
            size,
            triangles: triangles(scene),
            precision: label(precision).into(),
            frames,
            own_ms,
            timing,
            measured,
        });
    }
    rows
}

/// A method measured, in about `seconds`, and in how many frames.
fn one(
    gpu: &Gpu,
    method: Method,
    uploaded: &SceneGpu,
    camera: &Camera,
    size: [u32; 2],
    seconds: f64,
) -> Result<(Measurement, u32), BenchError> {
    let options = RendererOptions { method: method.without_rest(), ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, options)?;
    // Drivers compile at a shader's first use.
    let pilot = measure(gpu, &mut renderer, uploaded, camera, BenchOptions { frames: 1, warmup: 1 }, false)?;
    let affordable = seconds / (pilot.wall_ms.median * 1e-3).max(1e-6);
    let within = |share: f64, least: u32, most: u32| ((affordable * share) as u32).clamp(least, most);
    let options = BenchOptions {
        frames: within(0.65, LEAST.frames, MOST.frames),
        warmup: within(0.35, LEAST.warmup, MOST.warmup),
    };
    Ok((measure(gpu, &mut renderer, uploaded, camera, options, false)?, options.frames))
}

/// Milliseconds of the passes that find and add indirect light.
fn own(m: &Measurement, direct_wall_ms: f64) -> (f64, Timing) {
    match m.own_ms() {
        Some(ms) => (ms, Timing::Timestamps),
        None => ((m.wall_ms.median - direct_wall_ms).max(0.0), Timing::Clock),
    }
}

fn triangles(scene: &Scene) -> u64 {
    scene.instances.iter().map(|i| scene.meshes[i.mesh].indices.len() as u64 / 3).sum()
}

fn label(precision: Precision) -> &'static str {
    match precision {
        Precision::F32 => "f32",
        Precision::F16 => "f16",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::bench::{PassTime, Spread};

    #[test]
    fn a_methods_own_passes_find_and_add_indirect_light() {
        let at = |ms| Spread { median: ms, p95: ms };
        let pass = |pass: &str, ms| PassTime { pass: pass.into(), ms: at(ms) };
        let mut m = Measurement {
            method: "ambient".into(),
            passes: vec![pass("render.gbuffer", 3.0), pass("gi.ambient", 1.0), pass("gi.ssr", 0.5)],
            gpu_ms: Some(at(4.5)),
            wall_ms: at(4.6),
            ..Measurement::default()
        };
        assert_eq!(own(&m, 3.0), (1.5, Timing::Timestamps));
        // A frame is waited for, too.
        m.wall_ms = at(5.4);
        assert_eq!(own(&m, 3.0), (1.5, Timing::Timestamps));
        // Timestamps that do not add up to the clock are not believed.
        m.wall_ms = at(9.0);
        assert_eq!(own(&m, 3.0), (6.0, Timing::Clock));
        m.gpu_ms = None;
        assert_eq!(own(&m, 10.0), (0.0, Timing::Clock), "noise is no negative time");
    }
}
