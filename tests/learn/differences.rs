//! Every operator's way back against central differences of the CPU reference's way there.

use super::{common, error, hashed, learner};
use bouncelight::net::cpu::{self, Tensor};
use bouncelight::net::format::Weights;
use bouncelight::net::graph::{Graph, Op, Shape};
use bouncelight::net::learn::{Gradients, LearnError, Learner};
use safetensors::SafeTensors;
use serde_json::json;
use std::path::Path;

/// Largest error of a tensor's gradients, relative to the largest of them: rounding of the
/// differences.
const ALLOWED: f32 = 1e-3;
/// Step of a weight. The networks are piecewise linear in each, so that nothing but a bend within
/// the step makes a difference wrong.
const STEP: f32 = 3e-3;
/// Weights of a tensor that are looked at, spread evenly.
const LOOKED_AT: usize = 16;

/// A network's file.
struct Case {
    name: String,
    bytes: Vec<u8>,
    sizes: Vec<[u32; 2]>,
}

fn fixture(name: &str) -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("weights-format/fixtures/{name}.safetensors"));
    Case { name: name.into(), bytes: std::fs::read(path).unwrap(), sizes: vec![[13, 9], [5, 3], [1, 1]] }
}

/// What fixtures do not hold: a picture that is made smaller, a sum with what is its own summand, a
/// convolution without bias, sides of other widths, a kernel that is not square, a tensor that
/// three operators read.
fn odd() -> Case {
    let ops = [
        json!({"op": "conv2d", "name": "a", "input": "input", "output": "a", "in_channels": 3, "out_channels": 5,
               "kernel": [3, 2], "padding": [1, 2, 0, 1], "activation": {"leaky_relu": 0.3}}),
        json!({"op": "conv2d", "name": "b", "input": "a", "output": "b", "in_channels": 5, "out_channels": 5,
               "kernel": [2, 3], "stride": 2, "padding": 1, "bias": false}),
        json!({"op": "upsample_bilinear", "name": "down", "input": "a", "output": "down", "size_as": "b"}),
        json!({"op": "add", "name": "sum", "inputs": ["down", "b"], "output": "sum",
            "activation": {"leaky_relu": 0.1}}),
        json!({"op": "add", "name": "twice", "inputs": ["sum", "sum"], "output": "twice"}),
        json!({"op": "upsample_bilinear", "name": "up", "input": "twice", "output": "up", "size_as": "a"}),
        json!({"op": "add", "name": "end", "inputs": ["up", "a"], "output": "y"}),
    ];
    let parse = |mut op: serde_json::Value| {
        let kind = op.as_object_mut().unwrap().remove("op").unwrap();
        Op::parse(kind.as_str().unwrap(), op).unwrap().unwrap()
    };
    let graph = Graph { input_channels: 3, ops: ops.map(parse).to_vec(), output: "y".into() };
    Case { name: "odd".into(), bytes: hashed::file(&graph, 5), sizes: vec![[11, 8], [6, 5]] }
}

/// Σ slopes · output of the CPU reference with one number of the file moved by `by`.
fn moved(bytes: &[u8], at: usize, by: f32, input: &Tensor, slopes: &[f32]) -> (f64, f32) {
    let mut bytes = bytes.to_vec();
    let number: [u8; 4] = bytes[at..at + 4].try_into().unwrap();
    let value = f32::from_le_bytes(number) + by;
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    let output = cpu::run(&Weights::from_bytes(&bytes).unwrap(), input).unwrap();
    (output.data.iter().zip(slopes).map(|(y, s)| f64::from(*y) * f64::from(*s)).sum(), value)
}

/// Worst error of all tensors' gradients (what is looked at of `found` is turned by `sign`), and
/// the share of the weights looked at that have no bend within the step: only these are compared.
fn worst(bytes: &[u8], found: &Gradients, input: &Tensor, slopes: &[f32], sign: f32) -> (f32, f32) {
    let (header, metadata) = SafeTensors::read_metadata(bytes).unwrap();
    let (mut worst, mut straight, mut all) = (0f32, 0, 0);
    for (name, gradients) in found {
        let first = 8 + header + metadata.info(name).unwrap().data_offsets.0;
        let (mut compared, mut largest) = ((Vec::new(), Vec::new()), f32::MIN_POSITIVE);
        for i in (0..gradients.len()).step_by(gradients.len().div_ceil(LOOKED_AT)) {
            let [low, here, high] = [-STEP, 0.0, STEP].map(|by| moved(bytes, first + 4 * i, by, input, slopes));
            let [below, above] = [(low, here), (here, high)].map(|(a, b)| ((b.0 - a.0) / f64::from(b.1 - a.1)) as f32);
            largest = largest.max(below.abs()).max(above.abs());
            all += 1;
            if (above - below).abs() <= ALLOWED * largest {
                straight += 1;
                compared.0.push(sign * gradients[i]);
                compared.1.push(0.5 * (below + above));
            }
        }
        if !compared.0.is_empty() {
            worst = worst.max(error(&compared.0, &compared.1));
        }
    }
    (worst, straight as f32 / all as f32)
}

#[test]
fn every_operators_way_back_is_the_slope_of_its_way_there() {
    let Some(gpu) = common::gpu() else { return };
    let names = ["conv3x3", "conv3x3_relu", "conv3x3_s2", "conv1x1", "conv5x5_s3", "upsample", "upsample4", "add"];
    let cases: Vec<Case> = names.into_iter().map(fixture).chain([odd()]).collect();
    let mut seen = std::collections::BTreeSet::new();
    for Case { name, bytes, sizes } in cases {
        let weights = Weights::from_bytes(&bytes).unwrap();
        seen.extend(weights.graph.ops.iter().map(Op::kind));
        for size in sizes {
            let input = hashed::input("learn.input", weights.graph.input_channels, size);
            let output = cpu::run(&weights, &input).unwrap();
            let slopes = hashed::values("learn.slopes", output.data.len());
            let found = learner(&gpu, &weights, size).gradients(&input.data, &slopes).unwrap();
            let (right, straight) = worst(&bytes, &found, &input, &slopes, 1.0);
            println!("{name} at {}x{}: {right:.1e}, {:.0} % compared", size[0], size[1], 100.0 * straight);
            assert!(right <= ALLOWED && straight > 0.5, "{name} at {size:?}: {right}, {straight} compared");
            // Negative control: the same gradients with their sign turned.
            assert!(worst(&bytes, &found, &input, &slopes, -1.0).0 > 1.0, "{name}: a turned sign must be noticed");
        }
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), ["add", "conv2d", "upsample_bilinear"]);
}

#[test]
fn what_has_no_way_back_is_refused_by_name() {
    let Some(gpu) = common::gpu() else { return };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights-format/fixtures/conv_add_before.safetensors");
    let refused = |weights: &Weights, cells| Learner::new(&gpu.device, &gpu.queue, weights, cells).err().unwrap();
    let add = refused(&Weights::load(&path).unwrap(), [13, 9]);
    assert!(matches!(&add, LearnError::Operator { name, .. } if name == "c"), "{add}");
    assert!(add.to_string().contains("add"), "{add}");
    let shipped = Weights::corrector().unwrap();
    let wide = refused(&shipped, [16384, 16384]);
    assert!(matches!(wide, LearnError::Size { .. }), "{wide}");
    let learner = learner(&gpu, &shipped, [4, 4]);
    let shape = Shape { channels: 24, height: 4, width: 5 };
    let short = learner.gradients(&Tensor::zeros(shape).data, &[0.0; 96]).unwrap_err();
    assert!(matches!(short, LearnError::Picture { wanted: 384, .. }), "{short}");
}
