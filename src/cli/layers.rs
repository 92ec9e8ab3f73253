//! `bench --layers`: each step of the network alone, against what the device can do at best.

use super::args::Global;
use super::stdout::say;
use crate::gi::inputs::cells_of;
use crate::gpu::Gpu;
use crate::net::format::Weights;
use crate::net::gpu::{Network, Options};
use crate::net::{peak, tune};
use anyhow::Result;
use serde::{Deserialize, Serialize};

/// Turns through all layers; the fastest of each counts.
const TURNS: usize = 5;

/// All layers of a network.
#[derive(Debug, Serialize, Deserialize)]
pub struct Layers {
    /// How the times were taken.
    timing: String,
    /// Measured on this device, a second.
    peak_flops: f64,
    peak_bytes: f64,
    layers: Vec<Layer>,
}

/// One step.
#[derive(Debug, Serialize, Deserialize)]
struct Layer {
    name: String,
    kind: String,
    shape: String,
    /// Which permutation ran.
    kernel: String,
    ms: f64,
    flops: u64,
    bytes: u64,
    /// Of the greater of the two peaks' shares: the bound that the layer is nearer to.
    fraction_of_peak: f64,
}

/// Times the layers for a picture of `size`.
pub fn measure(global: &Global, gpu: &Gpu, weights: &Weights, size: [u32; 2]) -> Result<Layers> {
    let tuned = super::tuned::of(&gpu.device, global.quiet);
    let options = Options { precision: global.precision.precision(), ..Options::default() };
    let network = Network::tuned(&gpu.device, &gpu.queue, weights, cells_of(size), options, tuned)?;
    let peak = peak::measure(&gpu.device, &gpu.queue);
    let times = tune::layers((&gpu.device, &gpu.queue), &network, TURNS);
    let layer = |((row, kernel), ms): ((crate::net::plan::Row, _), f64)| {
        let kernel: &crate::net::gpu::Kernel = kernel;
        let share = (row.flops as f64 / peak.flops).max(row.traffic as f64 / peak.bytes);
        Layer {
            name: row.name,
            kind: row.kind,
            shape: row.shape.to_string(),
            kernel: kernel.permutation.map_or_else(|| kernel.shader.clone(), |p| p.to_string()),
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
    /// The table.
    pub fn print(&self) {
        say!("\nnetwork's layers, {}", self.timing);
        let (flops, bytes) = (self.peak_flops / 1e9, self.peak_bytes / 1e9);
        say!(
            "peak of this device, measured: {flops:.1} GFLOP/s of multiplications and additions, {bytes:.1} GB/s copied"
        );
        let head = ["ms", "GFLOP", "GFLOP/s", "GB/s", "of peak"].map(|h| format!("{h:>10}")).concat();
        say!("  {:<16}{:<28}{:<16}{head}  kernel", "layer", "kind", "shape");
        for l in &self.layers {
            let s = l.ms * 1e-3;
            let (flops, bytes) = (l.flops as f64 / 1e9, l.bytes as f64 / 1e9);
            say!(
                "  {:<16}{:<28}{:<16}{:>10.3}{flops:>10.3}{:>10.2}{:>10.2}{:>9.0}%  {}",
                l.name,
                l.kind,
                l.shape,
                l.ms,
                flops / s,
                bytes / s,
                l.fraction_of_peak * 100.0,
                l.kernel
            );
        }
        let (ms, flops) = self.layers.iter().fold((0.0, 0), |(m, f), l| (m + l.ms, f + l.flops));
        say!("  {:<60}{ms:>10.3}{:>10.3}{:>10.2}", "all", flops as f64 / 1e9, flops as f64 / ms / 1e6);
    }
}
