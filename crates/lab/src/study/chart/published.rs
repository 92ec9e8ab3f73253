//! What the paper printed, and its generator as it runs here.

use super::ChartError;
use crate::network::convert::{self, Arch, Norm};
use crate::study::{
    bench::{self, BenchOptions, Spread},
    projection::{Cost, GTX_1050, Modelled, modelled},
};
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::net::{
    format::Weights,
    gpu::{Network, Options},
};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// L1 of the network in the authors' table: the mean over their own 375 pictures of 1024×512.
pub const PRINTED_L1: f64 = 45_178.0;
/// Milliseconds that their table leaves for the network on a GTX 1050: 0.275 s with it, 0.27 s
/// without. It was read from a wall clock that did not wait for the GPU.
pub const PRINTED_MS: f64 = 5.0;
/// Base width of their generator.
const WIDTH: u32 = 64;
/// Pixels of their pictures, which sums over pixels are scaled to.
pub const PIXELS: f64 = 1024.0 * 512.0;

/// Their generator, with numbers that nobody trained, run here: time does not depend on the
/// numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Generator {
    /// Everything that decides the result, as [`Unit::key`](super::Unit::key).
    pub key: String,
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Trained numbers.
    pub parameters: u64,
    /// Counted cost of its steps.
    pub costs: Vec<Cost>,
    /// Milliseconds by the clock, waited for; absent where it could not be run.
    pub wall_ms: Option<Spread>,
    /// Why it could not.
    pub failed: Option<String>,
}

impl Generator {
    /// What a GTX 1050 would take by the model; none where threads were not counted.
    pub fn modelled(&self) -> Option<Modelled> {
        self.costs.iter().all(Cost::has_threads).then(|| modelled(&self.costs, &GTX_1050))
    }

    /// Arithmetic, GFLOP.
    pub fn gflop(&self) -> f64 {
        self.costs.iter().map(|c| c.flops).sum::<f64>() / 1e9
    }
}

/// Builds and times the generator for a picture of `size`.
pub(super) fn generator(gpu: &Gpu, size: [u32; 2], options: BenchOptions, key: String) -> Generator {
    let weights = convert::untrained(Arch::Pix2pix, Norm::Group, WIDTH);
    let parameters = weights.tensors().values().map(|t| t.data.len() as u64).sum();
    let mut found = Generator { key, size, parameters, costs: Vec::new(), wall_ms: None, failed: None };
    match network(gpu, &weights, size) {
        Ok(network) => {
            found.costs = costs(&network);
            match time(gpu, &network, options) {
                Ok(wall) => found.wall_ms = Some(wall),
                Err(e) => found.failed = Some(e.to_string()),
            }
        }
        Err(e) => found.failed = Some(e.to_string()),
    }
    found
}

/// A network on a picture of `size`.
pub(super) fn network(gpu: &Gpu, weights: &Weights, size: [u32; 2]) -> Result<Network, ChartError> {
    Ok(Network::new(&gpu.device, &gpu.queue, weights, size, Options::default())?)
}

/// Counted cost of a network's steps.
pub(super) fn costs(network: &Network) -> Vec<Cost> {
    let plan = network.plan();
    plan.steps.iter().zip(plan.rows()).map(|(step, row)| Cost::of_step(plan, step, &row.name)).collect()
}

/// Milliseconds of one run by the clock, waited for.
pub(super) fn time(gpu: &Gpu, network: &Network, options: BenchOptions) -> Result<Spread, ChartError> {
    let mut times = Vec::new();
    for run in 0..options.warmup.min(2) + options.frames.max(1) {
        let start = Instant::now();
        // Step by step: a large network at once may keep a slow device longer than its watchdog
        // likes.
        for step in 0..network.plan().steps.len() {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            network.record_step(step, &mut Recorder::new(&mut encoder));
            gpu.queue.submit([encoder.finish()]);
        }
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| BenchLost(e.to_string()))?;
        if run >= options.warmup.min(2) {
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    Ok(bench::spread(times))
}

/// The device stopped answering.
struct BenchLost(String);

impl From<BenchLost> for ChartError {
    fn from(lost: BenchLost) -> Self {
        ChartError::Bench(bench::BenchError::Device(lost.0))
    }
}
