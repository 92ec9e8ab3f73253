//! Each step of a network alone, against what the device can do at best.

use crate::network::peak::Peak;
use bouncelight::gpu::Gpu;
use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{Kernel, NetError, Network, Options, Setup, Tuned};
use bouncelight::net::tune;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Turns through all layers; the fastest of each counts.
const TURNS: usize = 5;

/// All layers of a network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layers {
    /// How the times were taken.
    pub timing: String,
    /// Operations a second that this device was measured to do at best.
    pub peak_flops: f64,
    /// Bytes a second that it was measured to copy at best.
    pub peak_bytes: f64,
    /// In the order in which they run.
    pub layers: Vec<Layer>,
}

/// One step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// Its name in the weights file.
    pub name: String,
    /// What it does.
    pub kind: String,
    /// Shape of what it makes.
    pub shape: String,
    /// Which permutation ran.
    pub kernel: String,
    /// Milliseconds by the clock.
    pub ms: f64,
    /// Floating-point operations by the plan's count.
    pub flops: u64,
    /// Bytes moved by the plan's count.
    pub bytes: u64,
    /// Of the greater of the two peaks' shares: the bound that the layer is nearer to.
    pub fraction_of_peak: f64,
}

/// Times the layers of `weights` for an input of `cells`, with the permutations that `tuned` knows.
///
/// # Errors
/// [`NetError`] when the network does not run on this device.
pub fn measure(
    gpu: &Gpu,
    weights: &Weights,
    cells: [u32; 2],
    options: Options,
    tuned: Arc<Tuned>,
    peak: Peak,
) -> Result<Layers, NetError> {
    let setup = Setup { options, tuned };
    let network = Network::new(&gpu.device, &gpu.queue, weights, cells, setup)?;
    let times = tune::layers((&gpu.device, &gpu.queue), &network, TURNS);
    let layer = |((row, kernel), ms): ((bouncelight::net::plan::Row, &Kernel), f64)| {
        let share = (row.flops as f64 / peak.flops).max(row.traffic as f64 / peak.bytes);
        Layer {
            name: row.name,
            kind: row.kind,
            shape: row.shape.to_string(),
            kernel: kernel.config.map_or_else(|| kernel.shader.name(), |p| p.to_string()),
            ms,
            flops: row.flops,
            bytes: row.traffic,
            fraction_of_peak: share / (ms * 1e-3),
        }
    };
    let layers = network.plan().rows().into_iter().zip(network.kernels()).zip(times).map(layer).collect();
    let timing = "each layer alone, by the clock, waited for; fastest of 5 turns".into();
    Ok(Layers { timing, peak_flops: peak.flops, peak_bytes: peak.bytes, layers })
}

impl Layers {
    /// Milliseconds of all layers, one after the other.
    pub fn ms(&self) -> f64 {
        self.layers.iter().map(|l| l.ms).sum()
    }

    /// Floating-point operations of all layers.
    pub fn flops(&self) -> f64 {
        self.layers.iter().map(|l| l.flops as f64).sum()
    }

    /// Milliseconds that the two measured peaks allow at best, layer by layer.
    pub fn least_ms(&self) -> f64 {
        self.layers.iter().map(|l| l.ms * l.fraction_of_peak).sum()
    }
}
