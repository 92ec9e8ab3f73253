//! A tiny weights file in memory: a 1×1 and a 3×3 convolution on all features of the G-buffer.

use bouncelight::gi::features::{FEATURES, FeatureSet};
use bouncelight::net::format::{CELLS_V1, FeatureRow, SCREEN_V1, Weights};
use safetensors::tensor::{Dtype, TensorView};

use crate::shot::Random;

/// The bytes of the file. `replace` changes one word of its document, for files that must be
/// refused.
pub fn bytes(replace: Option<(&str, &str)>) -> Vec<u8> {
    let screen = FeatureSet::screen();
    let used = FEATURES.iter().filter(|f| screen.offset(f.name).is_some());
    let inputs: Vec<String> =
        used.map(|f| format!(r#"{{"name": "{}", "channels": {}}}"#, f.name, f.channels)).collect();
    let mut document = format!(
        r#"{{"version": 1, "licence": "CC0-1.0", "table": {{"name": "screen", "version": 1}}, "inputs": [{}],
            "cell": 4, "output": {{"tensor": "y", "meaning": "log_irradiance_over_exposure", "channels": 3}},
            "graph": [
                {{"op": "conv2d", "name": "a", "input": "input", "output": "x", "in_channels": 21, "out_channels": 8,
                  "kernel": [1, 1], "activation": "relu"}},
                {{"op": "conv2d", "name": "b", "input": "x", "output": "y", "in_channels": 8, "out_channels": 3,
                  "kernel": [3, 3], "padding": 1}}]}}"#,
        inputs.join(", ")
    );
    if let Some((from, to)) = replace {
        assert!(document.contains(from), "the document has `{from}`");
        document = document.replace(from, to);
    }
    let mut random = Random(42);
    let mut floats = |n: usize, scale: f32| -> Vec<u8> {
        (0..n).flat_map(|_| (scale * (random.unit() - 0.5)).to_le_bytes()).collect()
    };
    let tensors = [
        ("a.weight", vec![8, 21, 1, 1], floats(8 * 21, 0.8)),
        ("a.bias", vec![8], floats(8, 0.5)),
        ("b.weight", vec![3, 8, 3, 3], floats(3 * 8 * 9, 0.5)),
        ("b.bias", vec![3], floats(3, 0.5)),
    ];
    let views = tensors
        .iter()
        .map(|(name, shape, data)| (*name, TensorView::new(Dtype::F32, shape.clone(), data).expect("sizes agree")));
    let metadata = std::collections::HashMap::from([("bouncelight".to_string(), document)]);
    safetensors::serialize(views, Some(metadata)).expect("serialises")
}

/// The loaded file.
pub fn weights() -> Weights {
    Weights::from_bytes(&bytes(None)).expect("a sound file")
}

/// Weights that answer the same six numbers everywhere: a gain and a rest on what method `gather`
/// says.
pub fn constant_gain(answer: [f32; 6]) -> Weights {
    linear("screen", SCREEN_V1, "gain_and_rest_on_guess", &[0.0; 6 * 24], &answer)
}

/// Weights of a filter that answer the same twelve numbers everywhere.
pub fn constant_filter(answer: [f32; 12]) -> Weights {
    linear("cells", CELLS_V1, "filter", &[0.0; 12 * 15], &answer)
}

/// Weights of a filter that answer what chance makes of a cell, up to `most`.
pub fn random_filter(most: f32) -> Weights {
    let mut random = Random(7);
    let numbers: Vec<f32> = (0..12 * 15).map(|_| most * (2.0 * random.unit() - 1.0)).collect();
    linear("cells", CELLS_V1, "filter", &numbers, &[0.0; 12])
}

/// One 1×1 convolution on a whole table.
fn linear(table: &str, rows: &[FeatureRow], meaning: &str, weight: &[f32], bias: &[f32]) -> Weights {
    Weights::from_bytes(&linear_bytes(table, rows, meaning, weight, bias)).expect("a sound file")
}

/// The bytes of such a file.
pub fn linear_bytes(table: &str, rows: &[FeatureRow], meaning: &str, weight: &[f32], bias: &[f32]) -> Vec<u8> {
    let row = |r: &FeatureRow| {
        format!(r#"{{"name": "{}", "channels": {}, "encoding": "{}"}}"#, r.name, r.channels, r.encodings[0])
    };
    let inputs: Vec<String> = rows.iter().map(row).collect();
    let channels: u32 = rows.iter().map(|r| r.channels).sum();
    let outputs = bias.len();
    let document = format!(
        r#"{{"version": 2, "licence": "CC0-1.0", "table": {{"name": "{table}", "version": 1}}, "inputs": [{}],
            "cell": 4, "output": {{"tensor": "y", "meaning": "{meaning}", "channels": {outputs}}},
            "graph": [{{"op": "conv2d", "name": "a", "input": "input", "output": "y", "in_channels": {channels},
                "out_channels": {outputs}, "kernel": [1, 1]}}]}}"#,
        inputs.join(", ")
    );
    let bytes = |v: &[f32]| -> Vec<u8> { v.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let shape = vec![outputs, channels as usize, 1, 1];
    let tensors = [("a.weight", shape, bytes(weight)), ("a.bias", vec![outputs], bytes(bias))];
    let views = tensors
        .iter()
        .map(|(name, shape, data)| (*name, TensorView::new(Dtype::F32, shape.clone(), data).expect("sizes agree")));
    let metadata = std::collections::HashMap::from([("bouncelight".to_string(), document)]);
    safetensors::serialize(views, Some(metadata)).expect("serialises")
}
