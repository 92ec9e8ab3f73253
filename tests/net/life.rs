//! Networks in use: any size, several at once, other weights and sizes between frames, dropout, and
//! norms of awkward numbers.

use crate::hashed::{self, error};
use crate::operators::{TOLERANCE, TOLERANCE_HALF};
use crate::{common, run_gpu, run_network};
use bouncelight::gpu::Gpu;
use bouncelight::gpu::timing::Recorder;
use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{KernelConfig, NetError, Network, Options, Source, Variant};
use bouncelight::net::graph::{Graph, Shape};
use bouncelight::net::plan::Precision;
use bouncelight_lab::network::convert::published;
use bouncelight_lab::network::convert::{Arch, Norm};
use bouncelight_lab::network::cpu::{self, Tensor};
use serde_json::{Value, json};

fn graph(input_channels: u32, ops: Value) -> Graph {
    hashed::graphs(&json!({"g": {"input_channels": input_channels, "ops": ops}})).remove("g").unwrap()
}

fn conv(name: &str, input: &str, i: u32, o: u32, k: u32, stride: u32) -> Value {
    json!({"op": "conv2d", "name": name, "input": input, "output": name, "in_channels": i, "out_channels": o,
           "kernel": [k, k], "stride": stride, "padding": k / 2 - u32::from(k == 4), "activation": {"leaky_relu": 0.2}})
}

fn up(name: &str, input: &str, i: u32, o: u32) -> Value {
    json!({"op": "conv_transpose2d", "name": name, "input": input, "output": name, "in_channels": i, "out_channels": o,
           "kernel": [4, 4], "stride": 2, "padding": 1})
}

/// A U-Net with two halvings and concatenated skips: takes multiples of four only.
fn unet() -> Graph {
    graph(
        5,
        json!([
            conv("d1", "input", 5, 8, 4, 2),
            conv("d2", "d1", 8, 12, 4, 2),
            up("u1", "d2", 12, 8),
            {"op": "concat", "name": "j", "inputs": ["u1", "d1"], "output": "j"},
            {"op": "group_norm", "name": "n", "input": "j", "output": "n", "channels": 16, "groups": 2},
            up("u2", "n", 16, 6),
        ]),
    )
}

/// The last column and row repeated up to `size`.
fn extended(input: &Tensor, [width, height]: [u32; 2]) -> Tensor {
    let Shape { channels, width: w, height: h } = input.shape;
    let at = |c, y: u32, x: u32| input.data[((c * h + y.min(h - 1)) * w + x.min(w - 1)) as usize];
    let rows = |c| (0..height).flat_map(move |y| (0..width).map(move |x| at(c, y, x)));
    Tensor { shape: Shape { channels, width, height }, data: (0..channels).flat_map(rows).collect() }
}

#[test]
fn any_size_is_padded_inside() {
    let pix2pix = published::graph(Arch::Pix2pix, Norm::Group, 4, true);
    for (size, inner) in
        [([1, 1], [256, 256]), ([300, 200], [512, 256]), ([256, 512], [256, 512]), ([640, 384], [768, 512])]
    {
        assert_eq!(pix2pix.inner_size(size[0], size[1]).unwrap(), inner);
    }
    let compact = Weights::shipped().unwrap().graph;
    assert_eq!(compact.inner_size(37, 21).unwrap(), [37, 21], "a network that takes any size is not padded");
    let gpu = common::gpu();
    let weights = hashed::network(&unet());
    let mut network: Option<Network> = None;
    for size in [[13, 9], [1, 1], [8, 4], [7, 6], [2, 33]] {
        let input = hashed::input("x", 5, size);
        let inner = size.map(|n: u32| n.next_multiple_of(4));
        let whole = cpu::run(&weights, &extended(&input, inner)).unwrap();
        let found = cpu::run(&weights, &input).unwrap();
        assert_eq!((found.shape.width, found.shape.height), (size[0], size[1]));
        for (i, v) in found.data.iter().enumerate() {
            let [w, h] = size.map(|n| n as usize);
            let (c, y, x) = (i / (w * h), i / w % h, i % w);
            assert_eq!(*v, whole.data[(c * inner[1] as usize + y) * inner[0] as usize + x]);
        }
        let Some(gpu) = &gpu else { continue };
        let next = match network.take() {
            None => Network::new(&gpu.device, &gpu.queue, &weights, size, Options::default()),
            Some(last) => last.rebuilt(&gpu.device, &gpu.queue, &weights, size),
        };
        let e = error(&run_network(gpu, network.insert(next.unwrap()), &input).data, &found.data);
        assert!(e <= TOLERANCE, "{size:?}: {e}");
    }
}

#[test]
fn several_networks_live_at_once() {
    let Some(gpu) = common::gpu() else { return };
    let weights = hashed::network(&unet());
    let inputs = [[8, 8], [4, 12]].map(|size| hashed::input("x", 5, size));
    let networks = [[8, 8], [4, 12]]
        .map(|size| Network::new(&gpu.device, &gpu.queue, &weights, size, Options::default()).unwrap());
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    for (network, input) in networks.iter().zip(&inputs) {
        let place = network.input();
        gpu.queue.write_buffer(place.buffer, place.offset, bytemuck::cast_slice(&input.to_padded()));
        network.record(&mut Recorder::new(&mut encoder));
    }
    gpu.queue.submit([encoder.finish()]);
    for (network, input) in networks.iter().zip(&inputs) {
        let out = network.output();
        let bytes =
            bouncelight::gpu::readback::buffer(&gpu.device, &gpu.queue, out.buffer, out.offset, out.size).unwrap();
        let by_cpu = cpu::run(&weights, input).unwrap();
        let found = Tensor::from_padded(by_cpu.shape, &bytemuck::pod_collect_to_vec::<u8, f32>(&bytes));
        assert!(error(&found.data, &by_cpu.data) <= TOLERANCE);
    }
}

/// What the device holds once it has let go of what is no longer used.
fn held(gpu: &Gpu) -> Option<u64> {
    gpu.device.poll(bouncelight::wgpu::PollType::wait_indefinitely()).unwrap();
    gpu.device.generate_allocator_report().map(|r| r.total_allocated_bytes)
}

#[test]
fn a_thousand_changes_leak_nothing() {
    let Some(gpu) = common::own_gpu() else { return };
    let graph = graph(4, json!([conv("a", "input", 4, 4, 1, 1), conv("b", "a", 4, 4, 1, 1)]));
    let weights = hashed::network(&graph);
    let mut bytes = hashed::file(&graph, 4);
    let last = bytes.len() - 1;
    bytes[last] ^= 0x80;
    let other = Weights::from_bytes(&bytes).unwrap();
    let sizes = [[16, 8], [3, 5], [40, 30], [1, 1]];
    let mut network = Network::new(&gpu.device, &gpu.queue, &weights, sizes[0], Options::default()).unwrap();
    let mut after_a_round = None;
    for change in 0..1000usize {
        // Alternately other weights in place, and another size with the first weights.
        if change % 2 == 0 {
            network.set_weights(&gpu.queue, &other).unwrap();
        } else {
            network = network.rebuilt(&gpu.device, &gpu.queue, &weights, sizes[change / 2 % 4]).unwrap();
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        network.record(&mut Recorder::new(&mut encoder));
        gpu.queue.submit([encoder.finish()]);
        if change % 40 == 39 {
            // The allocator's own books wobble by some tens of bytes; a forgotten buffer of 256
            // bytes a change would not.
            let now = held(&gpu).unwrap_or(0);
            let first = *after_a_round.get_or_insert(now);
            assert!(now.abs_diff(first) < 4096, "{now} bytes after {} changes, {first} after 40", change + 1);
        }
    }
    // And it still runs, with the weights it was given last.
    let input = hashed::input("x", 4, sizes[3]);
    let mut results = Vec::new();
    for set in [&weights, &other] {
        network.set_weights(&gpu.queue, set).unwrap();
        let found = run_network(&gpu, &network, &input);
        assert!(error(&found.data, &cpu::run(set, &input).unwrap().data) <= TOLERANCE);
        results.push(found);
    }
    assert!(error(&results[0].data, &results[1].data) > TOLERANCE, "the weights differ");
    let foreign = hashed::network(&unet());
    assert!(matches!(network.set_weights(&gpu.queue, &foreign), Err(NetError::OtherGraph)));
}

#[test]
fn dropout_drops_the_same_values_everywhere() {
    // Alone, and behind a convolution and a norm whose kernels do it in passing.
    let dropout = |input: &str, output: &str, p: f32| json!({"op": "dropout", "name": output, "input": input, "output": output, "p": p});
    let alone = graph(6, json!([dropout("input", "y", 0.3)]));
    let norm = json!({"op": "instance_norm", "name": "n", "input": "d", "output": "n", "channels": 5});
    let fused =
        graph(6, json!([conv("c", "input", 6, 5, 1, 1), dropout("c", "d", 0.5), norm, dropout("n", "y", 0.25)]));
    let gpu = common::gpu();
    for (graph, p) in [(alone, 0.3), (fused, 0.25)] {
        let weights = hashed::network(&graph);
        let input = hashed::input("x", 6, [61, 47]);
        let by_cpu = cpu::run_with(&weights, &input, Some(7)).unwrap();
        let dropped = by_cpu.data.iter().filter(|v| **v == 0.0).count() as f32 / by_cpu.data.len() as f32;
        assert!((dropped - p).abs() < 0.02, "{dropped} of the values are dropped, {p} was asked for");
        let other = cpu::run_with(&weights, &input, Some(8)).unwrap();
        let same = by_cpu.data.iter().zip(&other.data).filter(|(a, b)| (**a == 0.0) == (**b == 0.0)).count();
        let expected = (p * p + (1.0 - p) * (1.0 - p)) * by_cpu.data.len() as f32;
        assert!((same as f32 / expected - 1.0).abs() < 0.05, "another seed, an independent mask");
        assert!(cpu::run(&weights, &input).unwrap().data.iter().all(|v| *v != 0.0), "off by default");
        let Some(gpu) = &gpu else { continue };
        let options = Options { dropout: Some(8), ..Options::default() };
        let mut network = Network::new(&gpu.device, &gpu.queue, &weights, [61, 47], options).unwrap();
        assert!(error(&run_network(gpu, &network, &input).data, &other.data) <= TOLERANCE);
        network.set_seed(&gpu.queue, 7);
        let found = run_network(gpu, &network, &input);
        assert!(
            found.data.iter().zip(&by_cpu.data).all(|(a, b)| (*a == 0.0) == (*b == 0.0)),
            "the masks agree to the bit"
        );
        assert!(error(&found.data, &by_cpu.data) <= TOLERANCE);
        let unfused = run_gpu(gpu, &weights, &input, Options { fuse: false, dropout: Some(7), ..Options::default() });
        assert!(error(&unfused.data, &by_cpu.data) <= TOLERANCE);
    }
}

/// Layers as wide as the paper's, whose weights fit no uniform binding: as chosen here, staged, and
/// with their sums in parts.
#[test]
fn wide_layers_agree_with_the_cpu_reference() {
    let Some(gpu) = common::gpu() else { return };
    let norm = |c: u32| {
        json!([{"op": "group_norm", "name": "y", "input": "input", "output": "y", "channels": c,
        "groups": 2}])
    };
    let joined = |c: u32| {
        json!([conv("a", "input", c, c, 1, 1),
        {"op": "concat", "name": "j", "inputs": ["a", "input"], "output": "j"}, up("u", "j", 2 * c, 8)])
    };
    let cases = [
        ("conv", 512, json!([conv("c", "input", 512, 64, 4, 2)]), [8, 4]),
        ("conv odd", 516, json!([conv("c", "input", 516, 20, 4, 2)]), [6, 6]),
        ("conv many", 128, json!([conv("c", "input", 128, 512, 4, 2)]), [8, 4]),
        ("conv3x3", 640, json!([conv("c", "input", 640, 24, 3, 1)]), [5, 3]),
        ("transposed", 1024, json!([up("u", "input", 1024, 32)]), [4, 2]),
        ("transposed many", 256, json!([up("u", "input", 256, 128)]), [4, 4]),
        ("norm", 512, norm(512), [32, 16]),
        ("joined", 256, joined(256), [4, 4]),
    ];
    for (name, channels, ops, size) in cases {
        let weights = hashed::network(&graph(channels, ops));
        let input = hashed::input("x", channels, size);
        let by_cpu = cpu::run(&weights, &input).unwrap();
        let staged = |vectors, parts, half| {
            Variant::Fixed(KernelConfig { parts, half, ..KernelConfig::new(Source::Staged, vectors) })
        };
        let full = Options::default();
        let half = Options { precision: Precision::F16, ..full };
        for options in [
            full,
            Options { variant: staged(2, 1, false), ..full },
            Options { variant: staged(2, 16, false), ..full },
            Options { variant: staged(1, 7, false), ..half },
            Options { variant: staged(2, 4, true), ..half },
        ] {
            let network = Network::new(&gpu.device, &gpu.queue, &weights, size, options).unwrap();
            let e = error(&run_network(&gpu, &network, &input).data, &by_cpu.data);
            let ways: Vec<_> = network.kernels().filter_map(|k| k.config).map(|p| p.to_string()).collect();
            println!("{name}, {}: {e:.1e}", ways.join(", "));
            let tolerance = if options.precision == Precision::F16 { TOLERANCE_HALF } else { TOLERANCE };
            assert!(e <= tolerance, "{name} {options:?}: {e}");
        }
    }
}
