//! The published generators, narrow, whole: PyTorch ↔ CPU reference ↔ kernels.

use crate::hashed::{self, cases};
use crate::operators::{TOLERANCE, TOLERANCE_HALF};
use crate::{common, fixed, run_network};
use bouncelight::net::gpu::{Choice, Facts, Kernel, KernelConfig, Network, Options, Source, Tuned, Variant};
use bouncelight::net::graph::Graph;
use bouncelight::net::plan::{self, Plan, Precision};
use bouncelight_lab::network::convert::published;
use bouncelight_lab::network::convert::{Arch, Norm};
use bouncelight_lab::network::cpu;

fn generator(name: &str, width: u32) -> Graph {
    match name {
        "pix2pix_group" => published::graph(Arch::Pix2pix, Norm::Group, width, true),
        "pix2pix_instance" => published::graph(Arch::Pix2pix, Norm::Instance, width, true),
        "pix2pix_batch" => published::graph(Arch::Pix2pix, Norm::Batch, width, true),
        _ => published::graph(Arch::DeepIllumination, Norm::Batch, width, true),
    }
}

/// Each generator on the CPU; on the GPU in `ways`.
fn check_generators(ways: &[Options]) {
    let gpu = common::gpu();
    let mut faults = Vec::new();
    let (cases, _) = cases("networks.safetensors");
    for (name, cases) in cases {
        let weights = hashed::network(&generator(&name, 4));
        for case in cases {
            let input = hashed::input(&name, 12, case.size);
            let by_cpu = cpu::run(&weights, &input).unwrap();
            let e = case.error(&by_cpu);
            println!("{name} {:?}: CPU {e:.1e}", case.size);
            assert!(e <= TOLERANCE, "{name} {:?} on the CPU: relative error {e}", case.size);
            let Some(gpu) = &gpu else { continue };
            for &options in ways {
                let tolerance = if options.precision == Precision::F16 { TOLERANCE_HALF } else { TOLERANCE };
                let network = Network::new(&gpu.device, &gpu.queue, &weights, case.size, options).unwrap();
                let found = run_network(gpu, &network, &input);
                let e = case.error(&found).max(hashed::error(&found.data, &by_cpu.data));
                println!("{name} {:?}: {options:?} {e:.2e}", case.size);
                if e > tolerance {
                    faults.push(format!("{name} {:?} {options:?}: relative error {e}", case.size));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

const HALF: Options =
    Options { variant: Variant::Auto, precision: Precision::F16, packed_input: false, dropout: None, fuse: true };

#[test]
fn the_generators_agree_with_pytorch() {
    let full = Options::default();
    check_generators(&[full, HALF, Options { fuse: false, ..full }, Options { fuse: false, ..HALF }]);
}

/// Needs what `make_operators.py --full` has written, named by `BOUNCELIGHT_FULL`. Times and errors
/// are in docs/internals/network.md.
#[test]
#[ignore = "218 MB of weights and 26 GFLOP"]
fn the_papers_generator_at_full_width() {
    let Some(path) = std::env::var_os("BOUNCELIGHT_FULL") else {
        return common::skip(common::Need::Generator, "BOUNCELIGHT_FULL is not set");
    };
    let Some(gpu) = common::gpu() else { return };
    let (cases, _) = hashed::cases_at(path.as_ref());
    let weights = hashed::network(&generator("pix2pix_group", 64));
    for case in &cases["pix2pix_group"] {
        let input = hashed::input("pix2pix_group", 12, case.size);
        for (options, tolerance) in [(Options::default(), TOLERANCE), (HALF, TOLERANCE_HALF)] {
            let network = Network::new(&gpu.device, &gpu.queue, &weights, case.size, options).unwrap();
            let start = std::time::Instant::now();
            let found = run_network(&gpu, &network, &input);
            let (e, seconds) = (case.error(&found), start.elapsed().as_secs_f64());
            let rate = network.plan().flops() as f64 / seconds / 1e9;
            println!(
                "{:?} {:?}: error {e:.1e}, {seconds:.2} s, {rate:.2} GFLOP/s, {} bytes on the GPU",
                case.size,
                options.precision,
                network.bytes()
            );
            assert!(e <= tolerance, "{options:?}: {e}");
        }
    }
}

/// Negative control: the same network without its skips' order, or with another norm, is another
/// network.
#[test]
fn another_norm_is_noticed() {
    let (cases, _) = cases("networks.safetensors");
    let case = &cases["pix2pix_instance"][0];
    let input = hashed::input("pix2pix_instance", 12, case.size);
    let other = hashed::network(&generator("pix2pix_group", 4));
    assert!(case.error(&cpu::run(&other, &input).unwrap()) > 100.0 * TOLERANCE_HALF);
}

/// On a GPU every convolution of the paper's generator, down to 4×2 pixels, has a permutation of at
/// least 128 workgroups in one dispatch, and its parts of sums, written and read, move less than it
/// moves anyhow. What is taken without timing has 48.
#[test]
fn small_pictures_can_fill_a_gpu() {
    let plan = Plan::new(&generator("pix2pix_group", 64), 1024, 512).unwrap();
    let facts = Facts { software: false, half: false };
    let (mut starved, mut small) = (0, 0);
    for step in &plan.steps {
        let way = |variant| Kernel::choose(&plan, step, &Choice { variant, tuned: &Tuned::new(), facts });
        let Some(layer) = way(Variant::Auto).layer else { continue };
        let groups = |p: &KernelConfig| {
            let kernel = way(Variant::Fixed(*p));
            assert_eq!(kernel.config, Some(*p));
            kernel.parts.iter().map(|part| kernel.workgroups(part).iter().product::<u32>()).max().unwrap_or(0)
        };
        let candidates = layer.candidates(&plan, facts);
        let whole = candidates.iter().filter(|p| p.parts == 1).map(groups).max().unwrap();
        let best = candidates.iter().max_by_key(|p| groups(p)).unwrap();
        let sum = way(Variant::Fixed(*best)).sum.map_or(0, |s| s.bytes);
        println!(
            "{:<16}{layer}: guess {}, whole {whole}, {best} {}, parts {sum} bytes",
            step.name,
            groups(&candidates[0]),
            groups(best)
        );
        assert!(groups(best) >= 128, "{}", step.name);
        assert!(2 * sum < step.traffic, "{}: {sum} bytes of parts", step.name);
        assert!(groups(&candidates[0]) >= 48, "{}", step.name);
        small += u32::from(candidates[0].parts > 1);
        starved += u32::from(whole <= 128);
    }
    // Negative control: without parts there are layers that hardly can.
    assert!(small > 2 && starved > 2, "{small} {starved}");
}

/// Weights of all phases of a transposed convolution that are more than one binding holds go into
/// several dispatches.
#[test]
fn weights_are_bound_in_pieces_that_fit() {
    let up = serde_json::json!({"op": "conv_transpose2d", "name": "u", "input": "input", "output": "y",
        "in_channels": 2048,
        "out_channels": 1024, "kernel": [4, 4], "stride": 2, "padding": 1});
    let graph = hashed::graphs(&serde_json::json!({"g": {"input_channels": 2048, "ops": [up]}})).remove("g").unwrap();
    let plan = Plan::new(&graph, 4, 2).unwrap();
    let facts = Facts { software: false, half: false };
    for variant in [Variant::Auto, Variant::Plain, fixed(Source::Storage, 1), fixed(Source::Staged, 2)] {
        let kernel = Kernel::choose(&plan, &plan.steps[0], &Choice { variant, tuned: &Tuned::new(), facts });
        let mut blocks = 0;
        for part in &kernel.parts {
            assert_eq!(part.first_block, blocks);
            blocks += part.blocks;
        }
        assert_eq!(blocks, 4 * 256u32.div_ceil(kernel.vectors), "{variant:?}: every phase once");
        let all: u64 = kernel.bound_bytes() * kernel.parts.len() as u64;
        assert!(all > 128 << 20, "{variant:?}: {all}");
        assert!(kernel.bound_bytes() <= 128 << 20, "{variant:?}: {} bytes", kernel.bound_bytes());
    }
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
    // No tensor is copied to be joined or enlarged, and none read again to be measured: 16
    // convolutions and 13 norms of two steps each.
    assert_eq!(plan.steps.len(), 16 + 13 * 2);
    // Everything lives in one binding of WebGPU's default size, and in half of it in 16 bits.
    let half = plan::Options { precision: Precision::F16, ..plan::Options::default() };
    let small = Plan::with(&graph, 1024, 512, &half).unwrap();
    println!("arenas {} and {}, weights {}", plan.arena_bytes, small.arena_bytes, 4 * graph.parameters());
    assert!(plan.arena_bytes <= plan::MAX_ARENA && small.arena_bytes < plan.arena_bytes);
}
