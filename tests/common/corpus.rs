//! The sound files that mutations start from.

#![allow(dead_code, reason = "each test binary uses a part")]

use bouncelight::net::format::KEY;
use serde_json::{Value, json};

/// A tensor's name, type, shape and bytes.
pub type Tensor = (String, String, Vec<u64>, Vec<u8>);

/// A file in pieces that mutations can get at.
#[derive(Clone)]
pub struct File {
    /// The JSON document; none in a state dict.
    pub document: Option<Value>,
    /// Tensors in the order in which they lie.
    pub tensors: Vec<Tensor>,
}

impl File {
    /// Names and offsets as they should be.
    pub fn entries(&self) -> Vec<(String, Value)> {
        let mut end = 0;
        let entry = |(name, dtype, shape, bytes): &Tensor| {
            let from = end;
            end += bytes.len();
            (name.clone(), json!({"dtype": dtype, "shape": shape, "data_offsets": [from, end]}))
        };
        self.tensors.iter().map(entry).collect()
    }

    /// The file.
    pub fn bytes(&self) -> Vec<u8> {
        self.with(&self.entries(), self.document.as_ref().map(Value::to_string))
    }

    /// The file with a spoilt header.
    pub fn with(&self, entries: &[(String, Value)], document: Option<String>) -> Vec<u8> {
        let metadata = document.map(|d| ("__metadata__".to_string(), json!({ KEY: d })));
        let pairs: Vec<String> =
            metadata.iter().chain(entries).map(|(k, v)| format!("{}:{v}", Value::from(k.as_str()))).collect();
        let header = format!("{{{}}}", pairs.join(","));
        let data = self.tensors.iter().flat_map(|t| &t.3);
        (header.len() as u64).to_le_bytes().into_iter().chain(header.bytes()).chain(data.copied()).collect()
    }
}

fn tensor(name: &str, dtype: &str, shape: &[u64]) -> Tensor {
    let values: u64 = shape.iter().product();
    // Small positive numbers in every type.
    let each: &[u8] = match dtype {
        "F32" => &[0, 0, 0, 0x3d],
        "F16" => &[0, 0x2c],
        "I64" => &[1, 0, 0, 0, 0, 0, 0, 0],
        _ => &[17],
    };
    (name.into(), dtype.into(), shape.into(), each.repeat(values as usize))
}

/// Two small networks: one of plain convolutions on what cells remember, one with every operator
/// and number type.
pub fn weights() -> Vec<File> {
    let small = json!({
        "version": 1, "licence": "CC0-1.0", "table": {"name": "cells", "version": 1}, "cell": 4,
        "inputs": [{"name": "normal", "channels": 3}, {"name": "hit", "channels": 1}],
        "output": {"tensor": "y", "meaning": "plain", "channels": 3},
        "graph": [
            {"op": "conv2d", "name": "a", "input": "input", "output": "h", "in_channels": 4, "out_channels": 4,
             "kernel": [3, 3], "stride": 1, "padding": 1, "activation": "relu", "add": "input",
             "add_at": "after_activation"},
            {"op": "conv2d", "name": "b", "input": "h", "output": "y", "in_channels": 4, "out_channels": 3,
                "kernel": [1, 1]}
        ],
        "provenance": {"command": "none", "seed": 1}
    });
    let tensors = vec![
        tensor("a.weight", "F32", &[4, 4, 3, 3]),
        tensor("a.bias", "F32", &[4]),
        tensor("b.weight", "F16", &[3, 4, 1, 1]),
        tensor("b.bias", "F16", &[3]),
    ];
    vec![File { document: Some(small), tensors }, every_operator()]
}

fn every_operator() -> File {
    let signed = |name: &str| json!({"name": name, "channels": 3, "encoding": "signed"});
    let document = json!({
        "version": 2, "name": "every operator", "licence": "CC0-1.0", "table": {"name": "images", "version": 1},
        "cell": 1,
        "inputs": [signed("depth"), signed("direct")],
        "output": {"tensor": "y", "meaning": "display_signed", "channels": 3},
        "graph": [
            {"op": "conv2d", "name": "a", "input": "input", "output": "a", "in_channels": 6, "out_channels": 8,
             "kernel": [3, 3], "padding": 1, "groups": 2, "bias": false},
            {"op": "group_norm", "name": "g", "input": "a", "output": "g", "channels": 8, "groups": 2, "eps": 1e-5,
             "activation": {"leaky_relu": 0.2}},
            {"op": "conv2d", "name": "down", "input": "g", "output": "d", "in_channels": 8, "out_channels": 4,
             "kernel": [4, 4], "stride": 2, "padding": [1, 1, 1, 1], "activation": "silu"},
            {"op": "conv_transpose2d", "name": "up", "input": "d", "output": "u", "in_channels": 4, "out_channels": 8,
             "kernel": [4, 4], "stride": 2, "padding": 1, "activation": "softplus"},
            {"op": "concat", "name": "cat", "inputs": ["u", "g"], "output": "c"},
            {"op": "batch_norm", "name": "n", "input": "c", "output": "n", "channels": 16, "activation": "sigmoid"},
            {"op": "instance_norm", "name": "i", "input": "n", "output": "i", "channels": 16},
            {"op": "pad", "name": "p", "input": "i", "output": "p", "padding": [1, 1, 0, 0]},
            {"op": "upsample_nearest", "name": "un", "input": "p", "output": "un", "scale": 2},
            {"op": "upsample_bilinear", "name": "ub", "input": "un", "output": "ub", "size_as": "input"},
            {"op": "conv2d", "name": "o", "input": "ub", "output": "o", "in_channels": 16, "out_channels": 6,
                "kernel": [1, 1]},
            {"op": "add", "name": "sum", "inputs": ["o", "input"], "output": "s", "activation": "exp"},
            {"op": "dropout", "name": "drop", "input": "s", "output": "dr", "p": 0.5},
            {"op": "activation", "name": "act", "input": "dr", "output": "t", "activation": "tanh"},
            {"op": "conv2d", "name": "head", "input": "t", "output": "y", "in_channels": 6, "out_channels": 3,
             "kernel": [1, 3], "padding": [1, 0, 1, 0], "activation": "tanh"}
        ]
    });
    let tensors = vec![
        tensor("a.weight", "F16", &[8, 3, 3, 3]),
        tensor("g.weight", "F32", &[8]),
        tensor("g.bias", "F32", &[8]),
        tensor("down.weight_scale", "F32", &[4]),
        tensor("up.weight_scale", "F32", &[8]),
        tensor("down.bias", "F16", &[4]),
        tensor("up.bias", "F32", &[8]),
        tensor("n.weight", "F32", &[16]),
        tensor("n.bias", "F32", &[16]),
        tensor("n.running_mean", "F32", &[16]),
        tensor("n.running_var", "F32", &[16]),
        tensor("o.weight", "F32", &[6, 16, 1, 1]),
        tensor("o.bias", "F32", &[6]),
        tensor("head.weight", "F16", &[3, 6, 1, 3]),
        tensor("head.bias", "F16", &[3]),
        tensor("down.weight", "I8", &[4, 8, 4, 4]),
        tensor("up.weight", "I8", &[4, 8, 4, 4]),
    ];
    File { document: Some(document), tensors }
}

/// The state of a published generator of base width 1 with batch norm.
pub fn state_dicts() -> Vec<File> {
    let mut tensors = Vec::new();
    let norm = |module: &str, channels: u64, tensors: &mut Vec<Tensor>| {
        for leaf in ["weight", "bias", "running_mean", "running_var"] {
            tensors.push(tensor(&format!("{module}.1.{leaf}"), "F32", &[channels]));
        }
        tensors.push(tensor(&format!("{module}.1.num_batches_tracked"), "I64", &[]));
    };
    let multiple = |step: u32| 1u64 << (step - 1).min(3);
    for i in 1..=8 {
        let from = if i == 1 { 12 } else { multiple(i - 1) };
        tensors.push(tensor(&format!("down{i}.model.0.weight"), "F16", &[multiple(i), from, 4, 4]));
        if i != 1 && i != 8 {
            norm(&format!("down{i}.model"), multiple(i), &mut tensors);
        }
    }
    for i in 1..=7 {
        let from = if i == 1 { 8 } else { 2 * multiple(9 - i) };
        tensors.push(tensor(&format!("up{i}.model.0.weight"), "F16", &[from, multiple(8 - i), 4, 4]));
        norm(&format!("up{i}.model"), multiple(8 - i), &mut tensors);
    }
    tensors.push(tensor("final.2.weight", "F32", &[3, 2, 4, 4]));
    tensors.push(tensor("final.2.bias", "F32", &[3]));
    vec![File { document: None, tensors }]
}
