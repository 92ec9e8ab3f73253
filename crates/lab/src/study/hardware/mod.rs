//! Everything that the documentation projects for cards that nobody here owns, measured on the
//! device at hand within a given time: frames of every method by size, the network's layers as
//! tuned and not, rays by kind, the path tracer, in both precisions.
//!
//! Beside each measured time stands what the model ([`projection`](super::projection)) says of the
//! same counted work, for this device, where its data sheet is known, and for the target cards. What
//! did not fit into the time, or failed, is listed.

mod frames;
mod network;
mod parts;
mod share;
mod table;

pub use frames::FrameRow;
pub use network::NetworkRow;
pub use parts::{RayRow, TracerRow};

use super::device::Device;
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
    /// What was measured.
    #[serde(flatten)]
    pub device: Device,
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
    let mut run = Run { gpu, weights: &weights, until: started + options.time, told, left_out: Vec::new() };

    // What matters most comes first: where time runs out, it is the rest that lacks.
    let mut network = network::untuned(&mut run, *size, peak);
    let mut frames = frames::methods(&mut run, usual, *size);
    let rays = parts::rays(&mut run, options);
    for scene in &options.scenes[1..] {
        frames.extend(frames::methods(&mut run, scene, *size));
    }
    for other in options.sizes.iter().filter(|s| *s != size) {
        frames.extend(frames::methods(&mut run, usual, *other));
    }
    frames.extend(frames::half_precision(&mut run, usual, *size));
    let tracer = options.scenes.iter().filter_map(|scene| parts::tracer(&mut run, scene)).collect();
    network.extend(network::tuned(&mut run, *size, peak));

    let left_out = run.left_out;
    Ok(HardwareReport {
        schema: 1,
        version: env!("CARGO_PKG_VERSION").into(),
        commit: None,
        weights: weights.hash_text(),
        device: Device::of(gpu),
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
        let words = self.device.adapter.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
        let name = words.collect::<Vec<_>>().join("-").to_ascii_lowercase();
        if name.is_empty() { "device".into() } else { name }
    }
}
