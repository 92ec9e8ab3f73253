//! Norms that measure the picture: what a convolution measures in passing against a step of its
//! own, against the CPU reference, and with means far from zero.

use crate::hashed::{self, error};
use crate::operators::{TOLERANCE, TOLERANCE_HALF};
use crate::{common, fixed, run_gpu, run_network};
use bouncelight::gpu::Gpu;
use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{KernelConfig, Network, Options, Source, Variant};
use bouncelight::net::graph::Graph;
use bouncelight::net::plan::Precision;
use bouncelight_lab::network::cpu::{self, Tensor};
use serde_json::{Value, json};

fn graph(input_channels: u32, ops: Value) -> Graph {
    hashed::graphs(&json!({"g": {"input_channels": input_channels, "ops": ops}})).remove("g").unwrap()
}

fn norm(input: &str, channels: u32, groups: u32) -> Value {
    json!({"op": "group_norm", "name": "y", "input": input, "output": "y", "channels": channels, "groups": groups})
}

fn conv(i: u32, o: u32, kernel: u32, stride: u32) -> Value {
    json!({"op": "conv2d", "name": "c", "input": "input", "output": "c", "in_channels": i, "out_channels": o,
           "kernel": [kernel, kernel], "stride": stride, "padding": kernel / 2})
}

fn up(i: u32, o: u32, kernel: u32, stride: u32) -> Value {
    json!({"op": "conv_transpose2d", "name": "c", "input": "input", "output": "c", "in_channels": i, "out_channels": o,
           "kernel": [kernel, kernel], "stride": stride})
}

fn run(gpu: &Gpu, weights: &Weights, input: &Tensor, options: Options) -> (Tensor, usize) {
    let size = [input.shape.width, input.shape.height];
    let network = Network::new(&gpu.device, &gpu.queue, weights, size, options).unwrap();
    let measured = network.plan().steps.iter().filter(|s| s.moments.is_some()).count();
    (run_network(gpu, &network, input), measured)
}

/// In every family of kernels, in parts and whole, with channels that pad, groups that begin within
/// a vector, phases, and pictures that no workgroup fills.
#[test]
fn what_a_convolution_measures_is_what_a_step_of_its_own_does() {
    let Some(gpu) = common::gpu() else { return };
    let cases = [
        (6, json!([conv(6, 12, 3, 1), norm("c", 12, 2)])),
        (8, json!([conv(8, 18, 3, 1), norm("c", 18, 3)])),
        (12, json!([conv(12, 7, 4, 2), norm("c", 7, 7)])),
        (8, json!([conv(8, 36, 1, 1), norm("c", 36, 1)])),
        (8, json!([up(8, 20, 4, 2), norm("c", 20, 2)])),
        (5, json!([up(5, 6, 2, 3), norm("c", 6, 6)])),
    ];
    let staged = |vectors, parts| KernelConfig { parts, ..KernelConfig::new(Source::Staged, vectors) };
    let full = Options::default();
    let half = Options { precision: Precision::F16, ..full };
    let plain = Options { variant: Variant::Plain, ..full };
    let mut worst = [0f32; 2];
    for (i, (channels, ops)) in cases.into_iter().enumerate() {
        let weights = hashed::network(&graph(channels, ops));
        // Each case meets half of the ways, and each way three cases.
        let variants = match i % 2 {
            0 => [Variant::Fixed(staged(2, 2)), fixed(Source::Uniform, 2), fixed(Source::Storage, 2)],
            _ => [Variant::Fixed(staged(1, 1)), fixed(Source::Storage, 4), fixed(Source::Uniform, 3)],
        };
        let ways = variants.map(|variant| Options { variant, ..full }).into_iter().chain([full, plain, half]);
        let ways = ways.chain([Options { variant: variants[0], ..half }]);
        for (size, options) in [[37, 29], [1, 3], [70, 2]].into_iter().flat_map(|s| ways.clone().map(move |w| (s, w))) {
            let input = hashed::input("x", channels, size);
            let by_cpu = cpu::run(&weights, &input).unwrap();
            let (found, measured) = run(&gpu, &weights, &input, options);
            assert_eq!(measured, 1);
            let mut e = error(&found.data, &by_cpu.data);
            if options.variant == Variant::Auto {
                let (apart, measured) = run(&gpu, &weights, &input, Options { fuse: false, ..options });
                assert_eq!(measured, 0);
                e = e.max(error(&found.data, &apart.data));
            }
            let in_half = options.precision == Precision::F16;
            let tolerance = if in_half { TOLERANCE_HALF } else { TOLERANCE };
            assert!(e <= tolerance, "case {i} {size:?} {options:?}: relative error {e}");
            worst[usize::from(in_half)] = worst[usize::from(in_half)].max(e);
        }
    }
    println!("worst {worst:?}");
    // Negative control: moments of other groups, as a wrong tile would make them.
    let [two, three] = [2, 3].map(|n| hashed::network(&graph(6, json!([conv(6, 12, 3, 1), norm("c", 12, n)]))));
    let input = hashed::input("x", 6, [37, 29]);
    let apart = error(&run_gpu(&gpu, &two, &input, full).data, &cpu::run(&three, &input).unwrap().data);
    assert!(apart > TOLERANCE_HALF, "{apart}");
}

/// A convolution that only adds 4000 to each value, so that the norm after it sees values far from
/// zero.
fn far(groups: u32, conv: Value) -> Weights {
    let graph = graph(6, json!([conv, norm("c", 6, groups)]));
    let mut bytes = hashed::file(&graph, 6);
    let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let place = |name: &str| file.tensor(name).unwrap().data().as_ptr() as usize - bytes.as_ptr() as usize;
    let (bias, weight) = (place("c.bias"), place("c.weight"));
    for o in 0..6 {
        bytes[bias + 4 * o..][..4].copy_from_slice(&4000f32.to_le_bytes());
        for i in 0..6 {
            bytes[weight + 4 * (6 * o + i)..][..4].copy_from_slice(&f32::from(i == o).to_le_bytes());
        }
    }
    Weights::from_bytes(&bytes).unwrap()
}

/// Where a sum of squares in f32 has lost the variance: measured by a step of its own, by a
/// convolution, and by the sum of its parts.
#[test]
fn norms_of_large_means_are_sound() {
    let mut input = hashed::input("x", 6, [83, 59]);
    let near = input.clone();
    input.data.iter_mut().for_each(|v| *v += 4000.0);
    let n = input.data.len() as f32 / 2.0;
    let group = &input.data[..n as usize];
    let (sum, squares) = group.iter().fold((0f32, 0f32), |(s, q), v| (s + v, q + v * v));
    let naive = squares / n - (sum / n) * (sum / n);
    assert!((naive * 3.0 - 1.0).abs() > 0.1, "negative control: the variance, 1/3, comes out as {naive}");
    let Some(gpu) = common::gpu() else { return };
    for groups in [1, 2, 6] {
        let weights = hashed::network(&graph(6, json!([norm("input", 6, groups)])));
        let by_cpu = cpu::run(&weights, &input).unwrap();
        let e = error(&run_gpu(&gpu, &weights, &input, Options::default()).data, &by_cpu.data);
        println!("{groups} groups: {e:.1e}");
        // The mean itself, 4000, is known to a few 1e-4 only in f32.
        assert!(e <= 2e-3, "{groups} groups: {e}");
        let far = far(groups, conv(6, 6, 1, 1));
        let by_cpu = cpu::run(&far, &near).unwrap();
        let parts = Variant::Fixed(KernelConfig { parts: 2, ..KernelConfig::new(Source::Staged, 2) });
        for variant in [Variant::Auto, fixed(Source::Uniform, 2), parts] {
            let (found, measured) = run(&gpu, &far, &near, Options { variant, ..Options::default() });
            let e = error(&found.data, &by_cpu.data);
            println!("{groups} groups after a convolution, {variant:?}: {e:.1e}");
            assert!(measured == 1 && e <= 2e-3, "{groups} groups, {variant:?}: {e}");
        }
        // Negative control: the same values without the 4000 are normed to something else by no
        // more than rounding, other weights are not.
        let plain = hashed::network(&graph(6, json!([conv(6, 6, 1, 1), norm("c", 6, groups)])));
        assert!(error(&cpu::run(&plain, &near).unwrap().data, &by_cpu.data) > 0.1);
    }
}

/// Two norms of one picture, one of them after another reader has seen it, and dropout before the
/// norm.
#[test]
fn what_is_measured_once_serves_two_norms() {
    let Some(gpu) = common::gpu() else { return };
    let ops = json!([
        conv(6, 12, 3, 1),
        {"op": "dropout", "name": "d", "input": "c", "output": "d", "p": 0.3},
        {"op": "group_norm", "name": "n", "input": "d", "output": "n", "channels": 12, "groups": 3,
            "activation": "relu"},
        {"op": "instance_norm", "name": "m", "input": "d", "output": "m", "channels": 12},
        {"op": "concat", "name": "y", "inputs": ["n", "d", "m"], "output": "y"},
    ]);
    let weights = hashed::network(&graph(6, ops));
    let input = hashed::input("x", 6, [41, 23]);
    let by_cpu = cpu::run_with(&weights, &input, Some(5)).unwrap();
    let options = Options { dropout: Some(5), ..Options::default() };
    let (found, measured) = run(&gpu, &weights, &input, options);
    assert_eq!(measured, 1);
    assert!(error(&found.data, &by_cpu.data) <= TOLERANCE);
    // Negative control: another seed is other moments.
    let other = cpu::run_with(&weights, &input, Some(6)).unwrap();
    assert!(error(&other.data, &by_cpu.data) > 100.0 * TOLERANCE);
}
