//! The published generators, narrow, whole: PyTorch ↔ CPU twin ↔ kernels.

use crate::hashed::{self, cases};
use crate::operators::{TOLERANCE, TOLERANCE_HALF};
use crate::{common, run_gpu};
use bouncelight::net::arch;
use bouncelight::net::convert::{Arch, Norm};
use bouncelight::net::cpu;
use bouncelight::net::gpu::Options;
use bouncelight::net::graph::Graph;
use bouncelight::net::plan::{self, Plan, Precision};

fn generator(name: &str, width: u32) -> Graph {
    match name {
        "pix2pix_group" => arch::graph(Arch::Pix2pix, Norm::Group, width, true),
        "pix2pix_instance" => arch::graph(Arch::Pix2pix, Norm::Instance, width, true),
        "pix2pix_batch" => arch::graph(Arch::Pix2pix, Norm::Batch, width, true),
        _ => arch::graph(Arch::DeepIllumination, Norm::Batch, width, true),
    }
}

#[test]
fn the_generators_agree_with_pytorch() {
    let gpu = common::gpu();
    let (cases, _) = cases("networks.safetensors");
    let half = Options { precision: Precision::F16, ..Options::default() };
    let mut seen = 0;
    for (name, cases) in cases {
        let graph = generator(&name, 4);
        let weights = hashed::network(&graph);
        for case in cases {
            let input = hashed::input(&name, 12, case.size);
            let twin = cpu::run(&weights, &input).unwrap();
            let e = case.error(&twin);
            assert!(e <= TOLERANCE, "{name} {:?} on the CPU: relative error {e}", case.size);
            println!("{name} {:?}: CPU {e:.1e}", case.size);
            let Some(gpu) = &gpu else { continue };
            for (options, tolerance) in [(Options::default(), TOLERANCE), (half, TOLERANCE_HALF)] {
                let found = run_gpu(gpu, &weights, &input, options);
                let e = case.error(&found).max(hashed::error(&found.data, &twin.data));
                println!("{name} {:?}: {:?} {e:.1e}", case.size, options.precision);
                assert!(e <= tolerance, "{name} {:?} {options:?}: relative error {e}", case.size);
            }
            seen += 1;
        }
    }
    assert!(seen == 5 || gpu.is_none());
}

/// Negative control: the same network without its skips' order, or with another norm, is another network.
#[test]
fn another_norm_is_noticed() {
    let (cases, _) = cases("networks.safetensors");
    let case = &cases["pix2pix_instance"][0];
    let input = hashed::input("pix2pix_instance", 12, case.size);
    let other = hashed::network(&generator("pix2pix_group", 4));
    assert!(case.error(&cpu::run(&other, &input).unwrap()) > 100.0 * TOLERANCE_HALF);
}

#[test]
fn the_papers_generator_counted_by_hand() {
    let graph = generator("pix2pix_group", 64);
    let downs = [(12u64, 64u64), (64, 128), (128, 256), (256, 512), (512, 512), (512, 512), (512, 512), (512, 512)];
    let ups = [(512u64, 512u64), (1024, 512), (1024, 512), (1024, 512), (1024, 256), (512, 128), (256, 64)];
    let convolutions: u64 = downs.iter().chain(&ups).map(|(i, o)| i * o * 16).sum::<u64>() + 128 * 3 * 16 + 3;
    assert_eq!(convolutions, 54_413_315);
    // Weight and bias of the norms of six down and seven up steps.
    let norms: u64 = 2 * (128 + 256 + 4 * 512) + 2 * (4 * 512 + 256 + 128 + 64);
    assert_eq!(graph.parameters(), convolutions + norms);
    let pixels = 1024 * 512u64;
    let down = downs.iter().zip(1..).map(|((i, o), level)| 2 * i * o * 16 * (pixels >> (2 * level))).sum::<u64>();
    let up = ups.iter().zip(0..).map(|((i, o), level)| 2 * i * o * 16 * (pixels >> (16 - 2 * level))).sum::<u64>();
    let last = 2 * 128 * 3 * 16 * pixels;
    println!("{:.3} GFLOP", (down + up + last) as f64 / 1e9);
    let plan = Plan::new(&graph, 1024, 512).unwrap();
    let of = |word: &str| plan.rows().iter().filter(|r| r.kind.contains(word)).map(|r| r.flops).sum::<u64>();
    assert_eq!(of("conv") + of("transposed"), down + up + last);
    // No tensor is copied to be joined or enlarged: 16 convolutions and 13 norms of three steps each.
    assert_eq!(plan.steps.len(), 16 + 13 * 3);
    // Everything lives in one binding of WebGPU's default size, and in half of it in 16 bits.
    let half = plan::Options { precision: Precision::F16, ..plan::Options::default() };
    let small = Plan::with(&graph, 1024, 512, &half).unwrap();
    println!("arenas {} and {}, weights {}", plan.arena_bytes, small.arena_bytes, 4 * graph.parameters());
    assert!(plan.arena_bytes <= plan::MAX_ARENA && small.arena_bytes < plan.arena_bytes);
}
