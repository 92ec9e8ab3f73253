//! `bench --layers`: the table of [`study::layers`](bouncelight_lab::study::layers).

use super::args::Global;
use super::stdout::say;
use anyhow::Result;
use bouncelight::gi::{Neural, inputs::cells_of};
use bouncelight::gpu::Gpu;
use bouncelight::net::format::Weights;
use bouncelight_lab::network::peak;
use bouncelight_lab::study::layers::{self, Layers};

/// Times the layers for a picture of `size`.
pub fn measure(global: &Global, gpu: &Gpu, weights: &Weights, size: [u32; 2]) -> Result<Layers> {
    let tuned = super::tuned::of(&gpu.device, global.quiet);
    // As a frame runs it.
    let options = Neural::from(weights.clone()).stored(global.precision()).network;
    let peak = peak::measure(&gpu.device, &gpu.queue);
    Ok(layers::measure(gpu, weights, cells_of(size), options, tuned, peak)?)
}

/// The table.
pub fn print(network: &Layers) {
    say!("\nnetwork's layers, {}", network.timing);
    let (flops, bytes) = (network.peak_flops / 1e9, network.peak_bytes / 1e9);
    say!("peak of this device, measured: {flops:.1} GFLOP/s of multiplications and additions, {bytes:.1} GB/s copied");
    let head = ["ms", "GFLOP", "GFLOP/s", "GB/s", "of peak"].map(|h| format!("{h:>10}")).concat();
    say!("  {:<16}{:<28}{:<16}{head}  kernel", "layer", "kind", "shape");
    for l in &network.layers {
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
    let (ms, flops) = (network.ms(), network.flops());
    say!("  {:<60}{ms:>10.3}{:>10.3}{:>10.2}", "all", flops / 1e9, flops / ms / 1e6);
}
