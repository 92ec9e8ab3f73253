//! Weights files made in memory: one 1×1 convolution on a whole table.

use bouncelight::net::format::FeatureRow;
use safetensors::tensor::{Dtype, TensorView};

/// The bytes of such a file.
pub fn linear_bytes(table: &str, rows: &[FeatureRow], meaning: &str, weight: &[f32], bias: &[f32]) -> Vec<u8> {
    let row = |r: &FeatureRow| {
        format!(r#"{{"name": "{}", "channels": {}, "encoding": "{}"}}"#, r.name, r.channels, r.encodings[0])
    };
    let inputs: Vec<String> = rows.iter().map(row).collect();
    let channels: u32 = rows.iter().map(|r| r.channels).sum();
    let outputs = bias.len();
    // The newest version of which these are rows.
    let tables = bouncelight::net::format::TABLES;
    let is_newest = |t: &&bouncelight::net::format::FeatureTable| t.name == table && t.features.starts_with(rows);
    let version = tables.iter().find(is_newest).map_or(1, |t| t.version);
    let document = format!(
        r#"{{"version": 2, "licence": "CC0-1.0", "table": {{"name": "{table}", "version": {version}}}, "inputs": [{}],
            "cell": {}, "output": {{"tensor": "y", "meaning": "{meaning}", "channels": {outputs}}},
            "graph": [{{"op": "conv2d", "name": "a", "input": "input", "output": "y", "in_channels": {channels},
                "out_channels": {outputs}, "kernel": [1, 1]}}]}}"#,
        inputs.join(", "),
        if table == "images" { 1 } else { 4 }
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
