//! Everything that the documentation projects for cards that nobody here owns, measured on the
//! device at hand within a given time: frames of every method by size, the network's layers as
//! tuned and not, rays by kind, the path tracer, in both precisions.
//!
//! Beside each measured time stands the projection of the same counted work: once for this device,
//! by the peaks that it was measured to have and the efficiency that [`projection`] assumes, so
//! that the ratio of the two tells how good that assumption is; and once for the target card, as
//! assumed and as this device reached. What did not fit into the time, or failed, is listed.

mod frames;
mod network;
mod parts;
mod table;

pub use frames::FrameRow;
pub use network::NetworkRow;
pub use parts::{RayRow, TracerRow};

use super::projection::{self, Card, Cost, EFFICIENCY, GTX_1050};
use crate::network::peak;
use bouncelight::gpu::Gpu;
use bouncelight::net::format::{Weights, WeightsError};
use bouncelight::scene::Scene;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};
use thiserror::Error;

/// What to measure.
pub struct HardwareOptions {
    /// Scenes by name, the most usual first: all sizes are measured in that one, the others at the
    /// second size.
    pub scenes: Vec<(String, Scene)>,
    /// Sizes of pictures, pixels, the smallest first.
    pub sizes: Vec<[u32; 2]>,
    /// When to stop.
    pub time: Duration,
    /// Triangles of the scenes of spheres that rays are sent into.
    pub triangles: Vec<usize>,
}

/// The record: `docs/measured/DEVICE.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HardwareReport {
    /// Version of this record: 1.
    pub schema: u32,
    /// Version of the program.
    pub version: String,
    /// Of the source, where it is known.
    #[serde(default)]
    pub commit: Option<String>,
    /// Hash of the shipped weights.
    pub weights: String,
    /// The adapter's name.
    pub adapter: String,
    /// Graphics API.
    pub backend: String,
    /// The driver's name and version.
    pub driver: String,
    /// It runs on the processor.
    pub software: bool,
    /// It tells when passes begin and end.
    pub timestamps: bool,
    /// The program was built without optimisation for release: what runs on the processor is slower
    /// than it need be.
    pub debug_build: bool,
    /// Other work before the beginning, in busy threads, where Linux tells: where it is near the
    /// number of cores, clocks count it, too.
    #[serde(default)]
    pub load: Option<f64>,
    /// How long the measurement took, seconds.
    pub seconds: f64,
    /// Operations a second, multiplications and additions without a load between them, measured.
    pub peak_flops: f64,
    /// Bytes read and written a second by copies of 32 MiB, measured. On devices with large caches
    /// that is no memory's rate.
    pub peak_bytes: f64,
    /// Methods by scene and size.
    pub frames: Vec<FrameRow>,
    /// The shipped network's layers.
    pub network: Vec<NetworkRow>,
    /// Rays.
    pub rays: Vec<RayRow>,
    /// The path tracer.
    pub tracer: Vec<TracerRow>,
    /// What another runtime needs for the network, as its measuring script says; text says why
    /// there is none.
    #[serde(default)]
    pub pytorch: serde_json::Value,
    /// What was left out or failed, and why.
    pub left_out: Vec<String>,
}

/// Why nothing could be measured at all.
#[derive(Debug, Error)]
pub enum HardwareError {
    /// The shipped weights could not be read.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// Neither scene nor size.
    #[error("there is nothing to measure: name at least one scene and one size")]
    Nothing,
}

/// A run under way: the clock, and who hears of progress.
struct Run<'a> {
    gpu: &'a Gpu,
    weights: &'a Weights,
    until: Instant,
    told: &'a mut dyn FnMut(&str),
    left_out: Vec<String>,
}

impl Run<'_> {
    /// Seconds that are left.
    fn left(&self) -> f64 {
        self.until.saturating_duration_since(Instant::now()).as_secs_f64()
    }

    /// Whether there is time for something that takes about `seconds`; where not, `what` is listed
    /// as left out.
    fn affords(&mut self, what: &str, seconds: f64) -> bool {
        // Nothing is begun once the time is up, however short it is.
        let enough = seconds < self.left();
        if enough {
            (self.told)(what);
        } else {
            self.left_out.push(format!("{what}: no time left for about {seconds:.0} s"));
        }
        enough
    }

    /// The result, or none with the reason listed.
    fn kept<T, E: std::fmt::Display>(&mut self, what: &str, result: Result<T, E>) -> Option<T> {
        result.map_err(|e| self.left_out.push(format!("{what}: {e}"))).ok()
    }
}

/// Measures. Blocks for up to `options.time`, or as long as the last thing begun takes; `told`
/// hears what is being measured.
///
/// # Errors
/// [`HardwareError`]; anything that fails alone is listed in the record instead.
pub fn measure(
    gpu: &Gpu,
    options: &HardwareOptions,
    told: &mut dyn FnMut(&str),
) -> Result<HardwareReport, HardwareError> {
    let started = Instant::now();
    let (Some(usual), Some(size)) = (options.scenes.first(), options.sizes.get(1).or(options.sizes.first())) else {
        return Err(HardwareError::Nothing);
    };
    let weights = Weights::shipped()?;
    let load = std::fs::read_to_string("/proc/loadavg").ok().and_then(|t| t.split(' ').next()?.parse().ok());
    told("the device's peaks");
    let peak = peak::measure(&gpu.device, &gpu.queue);
    let card = Card { name: "this device", flops: peak.flops, bandwidth: peak.bytes };
    let mut run = Run { gpu, weights: &weights, until: started + options.time, told, left_out: Vec::new() };

    // What matters most comes first: where time runs out, it is the rest that lacks.
    let mut network = network::untuned(&mut run, *size, peak);
    let mut frames = frames::methods(&mut run, usual, *size, &card);
    let rays = parts::rays(&mut run, options);
    for scene in &options.scenes[1..] {
        frames.extend(frames::methods(&mut run, scene, *size, &card));
    }
    for other in options.sizes.iter().filter(|s| *s != size) {
        frames.extend(frames::methods(&mut run, usual, *other, &card));
    }
    frames.extend(frames::half_precision(&mut run, usual, *size, &card));
    let tracer = options.scenes.iter().filter_map(|scene| parts::tracer(&mut run, scene)).collect();
    network.extend(network::tuned(&mut run, *size, peak));

    let left_out = run.left_out;
    Ok(HardwareReport {
        schema: 1,
        version: env!("CARGO_PKG_VERSION").into(),
        commit: None,
        weights: weights.hash_text(),
        adapter: gpu.info.name.clone(),
        backend: format!("{:?}", gpu.info.backend).to_lowercase(),
        driver: format!("{} {}", gpu.info.driver, gpu.info.driver_info).trim().into(),
        software: gpu.is_software(),
        timestamps: gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY),
        debug_build: cfg!(debug_assertions),
        load,
        seconds: started.elapsed().as_secs_f64(),
        peak_flops: peak.flops,
        peak_bytes: peak.bytes,
        frames,
        network,
        rays,
        tracer,
        pytorch: serde_json::Value::Null,
        left_out,
    })
}

impl HardwareReport {
    /// A file name of small letters, digits and hyphens for the adapter: `nvidia-geforce-gtx-1050`.
    pub fn file_stem(&self) -> String {
        let words = self.adapter.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
        let name = words.collect::<Vec<_>>().join("-").to_ascii_lowercase();
        if name.is_empty() { "device".into() } else { name }
    }
}

/// What counted work would take, and what it took: milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Projected {
    /// By this device's measured peaks at [`EFFICIENCY`].
    pub here_ms: f64,
    /// Measured time over that: above 1 the projection was too hopeful.
    pub ratio: f64,
    /// By the target card's peaks at [`EFFICIENCY`], as the documentation has it.
    pub gtx_1050_ms: f64,
    /// The same at the efficiency that this device reached.
    pub gtx_1050_as_here_ms: f64,
}

impl Projected {
    /// Of `costs` that took `measured` milliseconds on a device with the peaks of `card`; none
    /// where nothing was counted or timed.
    fn of(costs: &[Cost], measured: f64, card: &Card) -> Option<Self> {
        let here_ms = projection::total_ms(costs, card, EFFICIENCY);
        let gtx_1050_ms = projection::total_ms(costs, &GTX_1050, EFFICIENCY);
        let ratio = measured / here_ms;
        (here_ms > 0.0 && ratio > 0.0 && ratio.is_finite()).then_some(Self {
            here_ms,
            ratio,
            gtx_1050_ms,
            gtx_1050_as_here_ms: gtx_1050_ms * ratio,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projection_is_set_against_what_was_measured() {
        let card = Card { name: "test", flops: 1e12, bandwidth: 1e12 };
        let costs = [Cost::new("a", 0.35e9, 0.0), Cost::new("b", 0.0, 0.35e9)];
        // Two passes of 1 ms at 35 % of the peak took 4 ms together.
        let p = Projected::of(&costs, 4.0, &card).unwrap();
        assert!((p.here_ms - 2.0).abs() < 1e-9 && (p.ratio - 2.0).abs() < 1e-9, "{p:?}");
        assert!((p.gtx_1050_as_here_ms / p.gtx_1050_ms - 2.0).abs() < 1e-9);
        assert_eq!(Projected::of(&[], 4.0, &card), None, "nothing counted, nothing to divide by");
        assert_eq!(Projected::of(&costs, f64::NAN, &card), None);
    }
}
