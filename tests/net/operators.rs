//! Every operator: PyTorch ↔ CPU reference ↔ kernels, fused and unfused, in 32 and 16 bits.

use crate::hashed::{self, cases, graphs};
use crate::{common, fixed, run_network};
use bouncelight::gpu::Gpu;
use bouncelight::net::gpu::{KernelConfig, Network, Options, Source, Variant};
use bouncelight::net::graph::Graph;
use bouncelight::net::op::Op;
use bouncelight::net::op_facts::KINDS;
use bouncelight::net::plan::Precision;
use bouncelight_lab::network::cpu;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;

pub const TOLERANCE: f32 = 1e-4;
pub const TOLERANCE_HALF: f32 = 5e-3;

#[test]
fn the_cpu_reference_agrees_with_pytorch_on_every_operator() {
    let (cases, metadata) = cases("operators.safetensors");
    let graphs = graphs(&metadata.unwrap());
    assert_eq!(graphs.keys().collect::<Vec<_>>(), cases.keys().collect::<Vec<_>>());
    let mut worst = (0f32, String::new());
    for (name, graph) in &graphs {
        let weights = hashed::network(graph);
        for case in &cases[name] {
            let input = hashed::input(name, graph.input_channels, case.size);
            let e = case.error(&cpu::run(&weights, &input).unwrap());
            assert!(e <= TOLERANCE, "{name} {:?}: relative error {e}", case.size);
            worst = if e > worst.0 { (e, name.clone()) } else { worst };
        }
    }
    let kinds: BTreeSet<&str> = graphs.values().flat_map(|g| &g.ops).map(|op| op.kind()).collect();
    assert_eq!(kinds, KINDS.into_iter().collect(), "every operator is in some graph");
    println!("{} graphs, {} cases, worst {worst:?}", graphs.len(), cases.values().map(Vec::len).sum::<usize>());
}

/// Runs the graphs that `wanted` picks at up to `sizes` sizes in the way that `options` say, with
/// compiled kernels shared.
fn check_kernels(gpu: &Gpu, options: Options, sizes: usize, wanted: impl Fn(usize, &Graph) -> bool) {
    let (cases, metadata) = cases("operators.safetensors");
    let tolerance = if options.precision == Precision::F16 { TOLERANCE_HALF } else { TOLERANCE };
    let start = std::time::Instant::now();
    let mut faults = Vec::new();
    let mut worst = (0f32, String::new());
    for (_, (name, graph)) in graphs(&metadata.unwrap()).iter().enumerate().filter(|(i, (_, g))| wanted(*i, g)) {
        let weights = hashed::network(graph);
        let mut network: Option<Network> = None;
        for case in cases[name].iter().rev().take(sizes) {
            let input = hashed::input(name, graph.input_channels, case.size);
            let next = match network.take() {
                None => Network::new(&gpu.device, &gpu.queue, &weights, case.size, options),
                Some(last) => last.rebuilt(&gpu.device, &gpu.queue, &weights, case.size),
            };
            let found = run_network(gpu, network.insert(next.unwrap()), &input);
            let by_cpu = cpu::run(&weights, &input).unwrap();
            let e = case.error(&found).max(hashed::error(&found.data, &by_cpu.data));
            if e > tolerance || found.shape != by_cpu.shape {
                faults.push(format!("{name} {:?}: relative error {e}", case.size));
            }
            worst = if e > worst.0 { (e, name.clone()) } else { worst };
        }
    }
    println!("{options:?}: worst {worst:?}, {:.1} s", start.elapsed().as_secs_f64());
    assert!(faults.is_empty(), "{options:?}\n{}", faults.join("\n"));
}

const FULL: Options =
    Options { variant: Variant::Auto, precision: Precision::F32, packed_input: false, dropout: None, fuse: true };

/// Each kind of weights with each width. Uniform weights do not exist in 16 bits: storage takes
/// their place.
fn permutations() -> Vec<Variant> {
    let blocked = (1..=4).flat_map(|vectors| [Source::Uniform, Source::Storage].map(|weights| fixed(weights, vectors)));
    let staged =
        [(1, 1, false), (2, 1, false), (2, 3, false), (1, 1, true), (2, 4, true)].map(|(vectors, parts, half)| {
            Variant::Fixed(KernelConfig { parts, half, ..KernelConfig::new(Source::Staged, vectors) })
        });
    blocked.chain(staged).collect()
}

/// What a permutation of the convolutions may get wrong: their taps, steps, sides, groups, and
/// channels that pad.
fn shapes(graph: &Graph) -> BTreeSet<String> {
    let enlarged = graph.ops.iter().any(|op| op.kind() == "upsample_nearest");
    let shape = |op: &Op| match op {
        Op::Conv2d(o) => {
            let padded = [o.in_channels, o.out_channels].map(|n| n % 4 != 0);
            Some(format!("{:?} {} {:?} {} {padded:?} {enlarged}", o.kernel, o.stride, o.padding, o.groups))
        }
        Op::ConvTranspose2d(o) => Some(format!("{:?} {} {} up", o.kernel, o.stride, o.padding)),
        _ => None,
    };
    graph.ops.iter().filter_map(shape).collect()
}

/// Of the ways to run a graph beside the usual one, the share that the ordinary run takes. Most of the
/// time goes into compiling kernels, of which each way has its own.
const SHARE: usize = 10;

/// Every graph at every size by the kernels that are chosen here, fused; then unfused, by the plain
/// kernels, and in every permutation as many graphs as it takes to meet every shape of convolution:
/// in the ordinary run a tenth of these, so that every permutation and nearly every shape has its turn.
/// Kernels of the same text are compiled once for all of them.
fn check_permutations(precision: Precision) {
    let Some(gpu) = common::gpu() else { return };
    let whole = common::whole();
    let full = Options { precision, ..FULL };
    check_kernels(&gpu, full, usize::MAX, |_, _| true);
    let plain = Options { variant: Variant::Plain, ..full };
    for (k, options) in [Options { fuse: false, ..full }, plain, Options { fuse: false, ..plain }].iter().enumerate() {
        check_kernels(&gpu, *options, usize::MAX, |i, _| whole || (i + k).is_multiple_of(SHARE));
    }
    for (k, variant) in permutations().into_iter().enumerate() {
        let seen = RefCell::new(BTreeSet::new());
        let found = Cell::new(0);
        let new = |_, graph: &Graph| {
            let (shapes, mut seen) = (shapes(graph), seen.borrow_mut());
            let before = seen.len();
            seen.extend(shapes);
            let new = seen.len() > before;
            found.set(found.get() + usize::from(new));
            new && (whole || (found.get() + k).is_multiple_of(SHARE))
        };
        check_kernels(&gpu, Options { variant, ..full }, usize::MAX, new);
    }
}

#[test]
fn the_kernels_agree_on_every_operator() {
    check_permutations(Precision::F32);
}

#[test]
fn the_kernels_agree_on_every_operator_in_16_bits() {
    check_permutations(Precision::F16);
}

#[test]
#[ignore = "half an hour: every graph in every way; run it after a change of kernels"]
fn the_kernels_agree_in_every_way() {
    let Some(gpu) = common::gpu() else { return };
    for variant in permutations() {
        for precision in [Precision::F32, Precision::F16] {
            let options = Options { variant, precision, ..FULL };
            check_kernels(&gpu, options, usize::MAX, |_, _| true);
            check_kernels(&gpu, Options { fuse: false, ..options }, usize::MAX, |_, _| true);
        }
    }
}

/// Groups read the vectors that they touch only, in every kind of kernel: whole vectors, parts of
/// them, and single channels.
#[test]
fn groups_read_their_own() {
    let Some(gpu) = common::gpu() else { return };
    // Input and output channels, groups, kernel, stride; vectors that an output reads, and whether
    // groups are whole vectors.
    for ([inputs, outputs, groups, kernel, stride], read, whole) in [
        ([16, 24, 2, 3, 1], 2, true),
        ([16, 48, 4, 3, 2], 1, true),
        ([16, 24, 2, 1, 1], 2, true),
        ([22, 22, 22, 3, 1], 1, false),
        ([22, 44, 22, 4, 2], 1, false),
        ([30, 20, 10, 3, 1], 2, false),
        ([36, 60, 12, 1, 1], 3, false),
        // More than half of all: as one.
        ([18, 18, 3, 3, 1], 5, false),
    ] {
        let name = "grouped";
        let ops = serde_json::json!([{"op": "conv2d", "name": "c", "input": "input", "output": "y",
            "in_channels": inputs,
            "out_channels": outputs, "kernel": [kernel, kernel], "stride": stride, "padding": kernel / 2,
            "groups": groups}]);
        let graph =
            hashed::graphs(&serde_json::json!({name: {"input_channels": inputs, "ops": ops}})).remove(name).unwrap();
        let weights = hashed::network(&graph);
        let input = hashed::input(name, inputs, [7, 9]);
        let by_cpu = cpu::run(&weights, &input).unwrap();
        for variant in [
            fixed(Source::Uniform, 3),
            fixed(Source::Storage, 2),
            // Staged kernels do not do groups.
            fixed(Source::Staged, 1),
            Variant::Plain,
        ] {
            let options = Options { variant, ..FULL };
            let network = Network::new(&gpu.device, &gpu.queue, &weights, [7, 9], options).unwrap();
            let kernel = network.kernels().find(|k| k.filter.is_some()).unwrap();
            let filter = kernel.filter.unwrap();
            let dense = variant == Variant::Plain;
            assert_eq!(filter.in_vectors, if dense { inputs.div_ceil(4) } else { read }, "{variant:?}");
            assert!(whole || dense || kernel.vectors == 1 || read == inputs.div_ceil(4), "{variant:?}");
            let found = run_network(&gpu, &network, &input);
            let e = hashed::error(&found.data, &by_cpu.data);
            assert!(e <= TOLERANCE && found.shape == by_cpu.shape, "{groups} groups, {variant:?}: relative error {e}");
        }
        // Negative control: neighbours' channels moved by one group are not what is read.
        let mut moved = input.clone();
        moved.data.rotate_right((inputs / groups) as usize * 63);
        assert!(hashed::error(&cpu::run(&weights, &moved).unwrap().data, &by_cpu.data) > 100.0 * TOLERANCE);
    }
}

/// Negative control: weights of another name are other weights, and that shows.
#[test]
fn other_weights_are_noticed() {
    let (cases, metadata) = cases("operators.safetensors");
    let graphs = graphs(&metadata.unwrap());
    for name in ["conv4x4_s2", "up4x4_s2", "group_norm", "batch_norm"] {
        let mut graph = graphs[name].clone();
        let text = serde_json::to_string(&graph.ops).unwrap().replace("\"name\":\"", "\"name\":\"x");
        let ops: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
        graph.ops = hashed::graphs(&serde_json::json!({name: {"input_channels": graph.input_channels, "ops": ops}}))
            [name]
            .ops
            .clone();
        let case = &cases[name][0];
        let input = hashed::input(name, graph.input_channels, case.size);
        assert!(case.error(&cpu::run(&hashed::network(&graph), &input).unwrap()) > 100.0 * TOLERANCE, "{name}");
    }
}
