//! Time and memory of one method: GPU milliseconds per pass from timestamps, synchronised wall
//! clock beside them.

use crate::study::projection::{Card, Cost, GTX_1050, GTX_1650, Modelled, is_indirect, modelled};
use bouncelight::gpu::{
    Gpu,
    timing::{self, Recorder},
};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{DrawnCount, RenderError, Renderer, View};
use bouncelight::scene::Camera;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Instant;
use thiserror::Error;
use wgpu_profiler::{GpuProfiler, GpuProfilerSettings};

/// How long to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BenchOptions {
    /// Frames that are counted, at least 1.
    pub frames: u32,
    /// Frames before them that are not: pipelines warm up, clocks rise.
    pub warmup: u32,
}

/// Median and 95th percentile over the counted frames, milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median.
    pub median: f64,
    /// 95th percentile.
    pub p95: f64,
}

/// One pass's GPU time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PassTime {
    /// Label of the pass (`render.gbuffer`, `net.enc0.0`, …).
    pub pass: String,
    /// GPU time, milliseconds.
    pub ms: Spread,
}

/// What one method costs on one device.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// GI method.
    pub method: String,
    /// Per pass, in frame order; empty when the adapter has no timestamps.
    pub passes: Vec<PassTime>,
    /// Sum of all passes' GPU time in a frame, milliseconds; absent without timestamps.
    pub gpu_ms: Option<Spread>,
    /// From before recording until the device is idle, milliseconds.
    pub wall_ms: Spread,
    /// Resident GPU bytes by owner.
    pub bytes: Vec<(String, u64)>,
    /// What passes of a steady frame do, where somebody has counted it (`study::count`).
    #[serde(default)]
    pub costs: Vec<Cost>,
    /// What the counted passes that find and add indirect light are modelled to take on cards that
    /// nobody has measured, by [`Card::key`].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub modelled: BTreeMap<String, Modelled>,
    /// The same once the picture rests ([`Method::frames_to_rest`](bouncelight::gi::Method::frames_to_rest)):
    /// the mean of a round of frames, in which one is drawn.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub modelled_at_rest: BTreeMap<String, Modelled>,
    /// Draw calls, triangles and shadow maps of the last frame.
    #[serde(default)]
    pub drawn: DrawnCount,
}

/// What the passes that find and add indirect light are modelled to take on cards that nobody has
/// measured, in the mean of `frames`.
fn on_cards(frames: &[Vec<Cost>]) -> BTreeMap<String, Modelled> {
    let own = || frames.iter().flatten().filter(|c| is_indirect(&c.pass));
    let mean = |card: Card| (card.key.to_owned(), modelled(own(), &card) / frames.len() as f64);
    [GTX_1050, GTX_1650].map(mean).into()
}

impl Measurement {
    /// The same with what was counted of it, and of the frames of a picture that rests.
    #[must_use]
    pub fn with_costs(mut self, costs: Vec<Cost>, at_rest: &[Vec<Cost>]) -> Self {
        self.modelled = on_cards(std::slice::from_ref(&costs));
        self.modelled_at_rest = on_cards(at_rest);
        self.costs = costs;
        self
    }

    /// How far GPU time and wall clock are apart, as [`disagreement`] says. A driver that lets
    /// passes run on past their timestamps shows itself here.
    pub fn disagreement(&self) -> Option<f64> {
        disagreement(self.wall_ms.median, self.gpu_ms?.median)
    }

    /// GPU milliseconds of the passes that find and add indirect light (medians, added up); none
    /// where there are no timestamps or they do not agree with the clock.
    pub fn own_ms(&self) -> Option<f64> {
        self.gpu_ms.filter(|_| self.disagreement().is_none())?;
        // A sum of nothing is -0.
        Some(self.passes.iter().filter(|p| is_indirect(&p.pass)).map(|p| p.ms.median).sum::<f64>() + 0.0)
    }

    /// Resident GPU bytes in all.
    pub fn total_bytes(&self) -> u64 {
        self.bytes.iter().map(|(_, b)| b).sum()
    }
}

/// Timestamps and synchronised wall clock should agree within this share, or one of them is not to
/// be trusted.
pub const AGREEMENT: f64 = 0.1;
/// What a frame takes by the clock beside its passes, milliseconds: it is recorded, sent to the
/// card and waited for. 0.2 to 1.0 on an H100.
pub const ROUND_TRIP: f64 = 1.0;

/// How far two times of a frame are apart, as a share of that by the clock, where it is more than
/// [`AGREEMENT`] beyond a [`ROUND_TRIP`].
pub fn disagreement(wall_ms: f64, gpu_ms: f64) -> Option<f64> {
    let apart = if gpu_ms > wall_ms { gpu_ms - wall_ms } else { (wall_ms - gpu_ms - ROUND_TRIP).max(0.0) } / wall_ms;
    (apart > AGREEMENT).then_some(apart)
}

/// Why a measurement failed.
#[derive(Debug, Error)]
pub enum BenchError {
    /// The device stopped answering.
    #[error("the GPU stopped answering: {0}")]
    Device(String),
    /// The profiler refused.
    #[error("GPU timing failed: {0}")]
    Profiler(String),
    /// A frame could not be drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Nothing to measure.
    #[error("at least one frame is needed to measure")]
    NoFrames,
}

/// Draws `options.warmup + options.frames` frames of the same view, waiting for each, and measures
/// the latter. `cuts`: each frame is the first after a cut, on which methods with a history may spend
/// more.
///
/// # Errors
/// [`BenchError`].
pub fn measure(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &SceneGpu,
    camera: &Camera,
    options: BenchOptions,
    cuts: bool,
) -> Result<Measurement, BenchError> {
    if options.frames == 0 {
        return Err(BenchError::NoFrames);
    }
    let profiler_error = |e: &dyn std::fmt::Display| BenchError::Profiler(e.to_string());
    let mut profiler =
        GpuProfiler::new(&gpu.device, GpuProfilerSettings { enable_debug_groups: false, ..Default::default() })
            .map_err(|e| profiler_error(&e))?;
    let view = View::new(camera, renderer.size(), [0.0; 2]);
    let mut frames: Vec<Vec<(String, f64)>> = Vec::new();
    let mut wall = Vec::new();
    for frame in 0..options.warmup + options.frames {
        if cuts {
            renderer.reset_history();
        }
        let start = Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer.record(&mut Recorder::timed(&mut encoder, &profiler), &gpu.queue, scene, &view)?;
        profiler.resolve_queries(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        profiler.end_frame().map_err(|e| profiler_error(&e))?;
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| BenchError::Device(e.to_string()))?;
        let elapsed = start.elapsed().as_secs_f64() * 1e3;
        let finished = profiler.process_finished_frame(gpu.queue.get_timestamp_period());
        if frame >= options.warmup {
            wall.push(elapsed);
            frames.extend(finished.map(|f| timing::milliseconds(&f)));
        }
    }
    let sums: Vec<f64> = frames.iter().filter(|f| !f.is_empty()).map(|f| f.iter().map(|(_, ms)| ms).sum()).collect();
    Ok(Measurement {
        method: renderer.method_name().into(),
        passes: per_pass(&frames),
        gpu_ms: (!sums.is_empty()).then(|| spread(sums)),
        wall_ms: spread(wall),
        drawn: renderer.drawn(),
        bytes: renderer
            .bytes()
            .into_iter()
            .chain([("scene", scene.bytes())])
            .map(|(n, b)| (n.to_string(), b))
            .collect(),
        ..Measurement::default()
    })
}

/// Collects each pass over the frames. Passes that share a label within a frame (shadow faces, say)
/// are added up.
fn per_pass(frames: &[Vec<(String, f64)>]) -> Vec<PassTime> {
    let mut order: Vec<&str> = Vec::new();
    for (label, _) in frames.iter().flatten() {
        if !order.contains(&label.as_str()) {
            order.push(label);
        }
    }
    let total =
        |frame: &Vec<(String, f64)>, pass: &str| frame.iter().filter(|(l, _)| l == pass).map(|(_, ms)| ms).sum();
    order
        .iter()
        .map(|pass| PassTime { pass: pass.to_string(), ms: spread(frames.iter().map(|f| total(f, pass)).collect()) })
        .collect()
}

/// Median and nearest-rank 95th percentile of a non-empty list.
pub(super) fn spread(mut values: Vec<f64>) -> Spread {
    values.sort_by(f64::total_cmp);
    let at = |q: f64| values[((values.len() as f64 * q).ceil() as usize).clamp(1, values.len()) - 1];
    Spread { median: at(0.5), p95: at(0.95) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_nearest_rank() {
        let s = spread((1..=100).rev().map(f64::from).collect());
        assert_eq!(s, Spread { median: 50.0, p95: 95.0 });
        assert_eq!(spread(vec![7.0]), Spread { median: 7.0, p95: 7.0 });
    }

    #[test]
    fn passes_with_one_label_are_added_up_within_a_frame() {
        let frame = |a: f64| vec![("shadow".to_string(), a), ("gbuffer".to_string(), 5.0), ("shadow".to_string(), 1.0)];
        let passes = per_pass(&[frame(1.0), frame(2.0), frame(3.0)]);
        assert_eq!(passes.iter().map(|p| p.pass.as_str()).collect::<Vec<_>>(), ["shadow", "gbuffer"]);
        assert_eq!(passes[0].ms, Spread { median: 3.0, p95: 4.0 });
    }
}
