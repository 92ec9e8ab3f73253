//! Conformance of networks: PyTorch's fixtures ↔ the CPU reference ↔ the WGSL kernels, per operator
//! and whole, at odd sizes and with padded channels. Relative error is max |Δ| / max |reference|.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/corpus.rs"]
mod corpus;
mod hashed;
mod life;
#[path = "../common/mutate.rs"]
mod mutate;
mod norms;
mod operators;
mod plan;
mod python;
#[path = "../common/spoil.rs"]
mod spoil;
mod tap;
mod tune;
mod weights;
mod whole;

use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{KernelConfig, Network, Options, Source, Variant};
use bouncelight::net::graph::Shape;
use bouncelight_lab::network::cpu::{self, Tensor};
use safetensors::SafeTensors;
use std::path::PathBuf;

const TOLERANCE: f32 = 1e-4;
const NAMES: [&str; 13] = [
    "conv3x3",
    "conv3x3_relu",
    "conv3x3_wide",
    "conv3x3_s2",
    "conv1x1",
    "conv5x5_s3",
    "conv3x3_head",
    "conv_add_before",
    "conv_add_after",
    "upsample",
    "upsample4",
    "add",
    "unet",
];

fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("weights-format/fixtures").join(name)
}

fn tensor(file: &SafeTensors<'_>, name: &str) -> Tensor {
    let view = file.tensor(name).unwrap();
    let [channels, height, width] = [0, 1, 2].map(|i| view.shape()[i] as u32);
    let data = view.data().chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    Tensor { shape: Shape { channels, height, width }, data }
}

/// One permutation of the convolutions.
fn fixed(weights: Source, vectors: u32) -> Variant {
    Variant::Fixed(KernelConfig::new(weights, vectors))
}

/// Inputs and PyTorch's outputs of a fixture.
fn cases(name: &str) -> Vec<(Tensor, Tensor)> {
    let bytes = std::fs::read(fixture(&format!("{name}.case.safetensors"))).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let mut sizes: Vec<String> =
        file.names().into_iter().filter_map(|n| n.strip_suffix(".input").map(String::from)).collect();
    sizes.sort();
    sizes.iter().map(|s| (tensor(&file, &format!("{s}.input")), tensor(&file, &format!("{s}.output")))).collect()
}

/// max |Δ| / max |reference|; infinite for other shapes and for anything not finite.
fn error(found: &Tensor, reference: &Tensor) -> f32 {
    let finite = found.data.iter().chain(&reference.data).all(|v| v.is_finite());
    if found.shape != reference.shape || found.data.len() != reference.data.len() || !finite {
        return f32::INFINITY;
    }
    let delta = found.data.iter().zip(&reference.data).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    delta / reference.data.iter().map(|v| v.abs()).fold(f32::MIN_POSITIVE, f32::max)
}

fn run_gpu(gpu: &Gpu, weights: &Weights, input: &Tensor, options: Options) -> Tensor {
    let size = [input.shape.width, input.shape.height];
    run_network(gpu, &Network::new(&gpu.device, &gpu.queue, weights, size, options).unwrap(), input)
}

fn run_network(gpu: &Gpu, network: &Network, input: &Tensor) -> Tensor {
    // Garbage everywhere but in the zeros at the beginning: nothing may depend on a fresh arena.
    let arena = network.input().buffer;
    let zeros = network.plan().zero_bytes;
    gpu.queue.write_buffer(arena, zeros, &vec![0x4e; (arena.size() - zeros) as usize]);
    gpu.queue.write_buffer(arena, network.input().offset, bytemuck::cast_slice(&input.to_padded()));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    network.record(&mut Recorder::new(&mut encoder));
    gpu.queue.submit([encoder.finish()]);
    let out = network.output();
    let bytes = readback::buffer(&gpu.device, &gpu.queue, out.buffer, out.offset, out.size).unwrap();
    let plan = network.plan();
    let padded: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
    let shape = plan.tensors[plan.output].shape;
    let channels = shape.channels as usize;
    let padding = padded.chunks_exact(channels.next_multiple_of(4)).flat_map(|p| &p[channels..]);
    assert!(padding.clone().all(|v| *v == 0.0), "padding channels stay zero");
    Tensor::from_padded(shape, &padded)
}

#[test]
fn the_cpu_reference_agrees_with_pytorch() {
    let mut seen = 0;
    for name in NAMES {
        let weights = Weights::load(&fixture(&format!("{name}.safetensors"))).unwrap();
        for (input, reference) in cases(name) {
            let e = error(&cpu::run(&weights, &input).unwrap(), &reference);
            println!("cpu {name} {}: {e:.1e}", input.shape);
            assert!(e <= TOLERANCE, "{name} {}: relative error {e}", input.shape);
            seen += 1;
        }
    }
    assert_eq!(seen, 40);
}

#[test]
fn every_kernel_agrees_with_pytorch_and_with_the_cpu_reference() {
    let Some(gpu) = common::gpu() else { return };
    let mut seen = 0;
    for variant in [Variant::Plain, fixed(Source::Storage, 2), Variant::Auto] {
        let mut worst = 0f32;
        for name in NAMES {
            let weights = Weights::load(&fixture(&format!("{name}.safetensors"))).unwrap();
            // The other variants need the whole net at one size only.
            let few = name == "unet" && variant != Variant::Auto;
            for (input, reference) in cases(name).into_iter().take(if few { 1 } else { usize::MAX }) {
                let found = run_gpu(&gpu, &weights, &input, Options { variant, ..Options::default() });
                let by_cpu = cpu::run(&weights, &input).unwrap();
                let e = error(&found, &reference).max(error(&found, &by_cpu));
                assert!(e <= TOLERANCE, "{variant:?} {name} {}: relative error {e}", input.shape);
                worst = worst.max(e);
                seen += 1;
            }
        }
        println!("{variant:?}: worst relative error {worst:.1e}");
    }
    assert_eq!(seen, 116);
}

/// Negative control: one weight with its sign turned must show, on the CPU and on the GPU.
#[test]
fn a_perturbed_weight_is_noticed() {
    let gpu = common::gpu();
    for (name, tensor) in [("conv3x3", "c.weight"), ("conv1x1", "c.weight"), ("unet", "head.weight")] {
        let mut bytes = std::fs::read(fixture(&format!("{name}.safetensors"))).unwrap();
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let view = file.tensor(tensor).unwrap();
        let place = view.data().as_ptr() as usize - bytes.as_ptr() as usize;
        let each = view.data().len() / view.shape().iter().product::<usize>();
        // The kernel's centre, first channels: the tap that every pixel meets. The sign is in the
        // value's last byte.
        let centre = view.shape()[2] * view.shape()[3] / 2;
        bytes[place + (centre + 1) * each - 1] ^= 0x80;
        let weights = Weights::from_bytes(&bytes).unwrap();
        let (input, reference) = cases(name).into_iter().max_by_key(|c| c.0.data.len()).unwrap();
        assert!(error(&cpu::run(&weights, &input).unwrap(), &reference) > TOLERANCE, "{name} on the CPU");
        if let Some(gpu) = &gpu {
            let found = run_gpu(gpu, &weights, &input, Options::default());
            assert!(error(&found, &reference) > TOLERANCE, "{name} on the GPU");
        }
    }
}

#[test]
fn recording_twice_gives_the_same_and_labels_name_the_layers() {
    let Some(gpu) = common::gpu() else { return };
    let weights = Weights::load(&fixture("unet.safetensors")).unwrap();
    let network = Network::new(&gpu.device, &gpu.queue, &weights, [37, 21], Options::default()).unwrap();
    let (input, _) = cases("unet").into_iter().find(|c| c.0.shape.width == 37).unwrap();
    let mut results = Vec::new();
    for _ in 0..2 {
        gpu.queue.write_buffer(
            network.input().buffer,
            network.input().offset,
            bytemuck::cast_slice(&input.to_padded()),
        );
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        network.record(&mut Recorder::new(&mut encoder));
        gpu.queue.submit([encoder.finish()]);
        let out = network.output();
        results.push(readback::buffer(&gpu.device, &gpu.queue, out.buffer, out.offset, out.size).unwrap());
    }
    assert_eq!(results[0], results[1]);
    assert_eq!(network.plan().rows().len(), 19);
    assert!(network.bytes() > network.plan().arena_bytes);
}
