//! A tiny weights file in memory: a 1×1 and a 3×3 convolution on all features of the G-buffer.

use bouncelight::gi::features::{FEATURES, FeatureSet};
use safetensors::tensor::{Dtype, TensorView};

use crate::shot::Random;

/// The bytes of the file. `replace` changes one word of its document, for files that must be refused.
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
pub fn weights() -> bouncelight::net::format::Weights {
    bouncelight::net::format::Weights::from_bytes(&bytes(None)).expect("a sound file")
}

/// Weights that answer the same six numbers everywhere: a gain and a rest on what method `gather` says.
pub fn constant_gain(answer: [f32; 6]) -> bouncelight::net::format::Weights {
    let inputs: Vec<String> = FEATURES
        .iter()
        .zip(bouncelight::net::format::SCREEN_V1)
        .map(|(f, row)| {
            format!(r#"{{"name": "{}", "channels": {}, "encoding": "{}"}}"#, f.name, f.channels, row.encodings[0])
        })
        .collect();
    let document = format!(
        r#"{{"version": 2, "licence": "CC0-1.0", "table": {{"name": "screen", "version": 1}}, "inputs": [{}],
            "cell": 4, "output": {{"tensor": "y", "meaning": "gain_and_rest_on_guess", "channels": 6}},
            "graph": [{{"op": "conv2d", "name": "a", "input": "input", "output": "y", "in_channels": 24,
                "out_channels": 6, "kernel": [1, 1]}}]}}"#,
        inputs.join(", ")
    );
    let bytes = |v: &[f32]| -> Vec<u8> { v.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let tensors = [("a.weight", vec![6, 24, 1, 1], bytes(&[0.0; 144])), ("a.bias", vec![6], bytes(&answer))];
    let views = tensors
        .iter()
        .map(|(name, shape, data)| (*name, TensorView::new(Dtype::F32, shape.clone(), data).expect("sizes agree")));
    let metadata = std::collections::HashMap::from([("bouncelight".to_string(), document)]);
    let file = safetensors::serialize(views, Some(metadata)).expect("serialises");
    bouncelight::net::format::Weights::from_bytes(&file).expect("a sound file")
}
