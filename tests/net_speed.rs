//! Speed of the kernels on the machine at hand; prints, asserts nothing about time. Run with
//! `cargo test --release --test net_speed -- --ignored --nocapture`.

mod common;

use bouncelight::gpu::timing::Recorder;
use bouncelight::net::cpu;
use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{Network, Options, Permutation, Source, Variant};
use std::time::Instant;

/// The compact network at a 1024×512 picture, each family of kernels, minimum of several
/// synchronised runs, interleaved so that other work on the machine hits all alike.
#[test]
#[ignore = "a measurement"]
fn compact_network_at_256x128() {
    let Some(gpu) = common::gpu() else { return };
    println!("{}", gpu.sentence());
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/weights-format/fixtures/unet.safetensors");
    let weights = Weights::load(path.as_ref()).unwrap();
    let variants = [Variant::Plain, Variant::Fixed(Permutation::new(Source::Uniform, 2)), Variant::Auto];
    let networks = variants.map(|v| {
        let options = Options { variant: v, ..Options::default() };
        Network::new(&gpu.device, &gpu.queue, &weights, [256, 128], options).unwrap()
    });
    let mut best = [f64::INFINITY; 3];
    for _ in 0..10 {
        for (network, best) in networks.iter().zip(&mut best) {
            let start = Instant::now();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            network.record(&mut Recorder::new(&mut encoder));
            gpu.queue.submit([encoder.finish()]);
            gpu.device.poll(bouncelight::wgpu::PollType::wait_indefinitely()).unwrap();
            *best = best.min(start.elapsed().as_secs_f64());
        }
    }
    let plan = networks[0].plan();
    let input = cpu::Tensor::zeros(plan.tensors[0].shape);
    let start = Instant::now();
    cpu::run(&weights, &input).unwrap();
    println!("CPU reference: {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    println!(
        "{:.1} MFLOP, arena {} bytes, traffic {} bytes",
        plan.flops() as f64 / 1e6,
        plan.arena_bytes,
        plan.traffic()
    );
    for (variant, seconds) in variants.iter().zip(best) {
        println!("{variant:?}: {:.2} ms, {:.2} GFLOP/s", seconds * 1e3, plan.flops() as f64 / seconds / 1e9);
    }
}
