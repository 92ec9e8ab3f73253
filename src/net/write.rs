//! Writer of weights files: the reader's counterpart, for networks that come from elsewhere.

use super::format::{Dtype, KEY, SCALE_SUFFIX, VERSION, WeightTensor, Weights};
use super::format::{Feature, Output, Provenance, Table};
use super::op::Op;
use std::collections::BTreeMap;

/// The JSON document as it is written; `document.rs` reads it.
#[derive(serde::Serialize)]
struct Document<'a> {
    version: u32,
    name: &'a str,
    licence: &'a str,
    table: &'a Table,
    inputs: &'a [Feature],
    cell: u32,
    output: &'a Output,
    graph: &'a [Op],
    provenance: &'a Provenance,
}

#[derive(serde::Serialize)]
struct Entry<'a> {
    dtype: &'static str,
    shape: &'a [usize],
    data_offsets: [usize; 2],
}

/// One tensor as it will lie in the file.
struct Stored<'a> {
    name: String,
    dtype: Dtype,
    shape: &'a [usize],
    bytes: Vec<u8>,
}

impl Weights {
    /// The file's bytes, each tensor in the number type that it says ([`WeightTensor::stored`]).
    /// Nothing is checked: [`Weights::from_bytes`] does that.
    pub fn to_bytes(&self) -> Vec<u8> {
        let Self { name, licence, table, inputs, cell, output, graph, provenance, .. } = self;
        let graph = &graph.ops;
        let document =
            Document { version: VERSION, name, licence, table, inputs, cell: *cell, output, graph, provenance };
        let mut tensors: Vec<Stored<'_>> = Vec::new();
        for (name, tensor) in self.tensors() {
            let axis = axis_of_outputs(graph, name);
            store(name, tensor, axis, &mut tensors);
        }
        // Wide numbers first, so that each lies at a multiple of its size.
        tensors.sort_by(|a, b| (b.dtype.bytes(), &a.name).cmp(&(a.dtype.bytes(), &b.name)));
        container(&json(&document), tensors)
    }
}

/// The axis that counts output channels in a weight of a convolution; 0 for every other tensor.
fn axis_of_outputs(graph: &[Op], tensor: &str) -> usize {
    let transposed =
        |op: &Op| matches!(op, Op::ConvTranspose2d(_)) && tensor.strip_suffix(".weight") == Some(op.name());
    usize::from(graph.iter().any(transposed))
}

fn store<'a>(name: &str, tensor: &'a WeightTensor, axis: usize, to: &mut Vec<Stored<'a>>) {
    let WeightTensor { shape, data, stored } = tensor;
    let name = name.to_string();
    let bytes = match stored {
        Dtype::F32 => data.iter().flat_map(|v| v.to_le_bytes()).collect(),
        Dtype::F16 => data.iter().flat_map(|v| half::f16::from_f32(*v).to_le_bytes()).collect(),
        Dtype::I8 => {
            let below = shape[axis + 1..].iter().product::<usize>().max(1);
            let channel = |i: usize| i / below % shape[axis].max(1);
            let mut scale = vec![0f32; shape[axis]];
            for (i, v) in data.iter().enumerate() {
                scale[channel(i)] = scale[channel(i)].max(v.abs() / 127.0);
            }
            // A channel of zeros, or of values that no scale makes, still needs one.
            scale.iter_mut().filter(|s| **s < f32::MIN_POSITIVE).for_each(|s| *s = f32::MIN_POSITIVE);
            let bytes = data.iter().enumerate().map(|(i, v)| ((v / scale[channel(i)]).round() as i8).cast_unsigned());
            let bytes = bytes.collect();
            let scales = scale.iter().flat_map(|v| v.to_le_bytes()).collect();
            let shape = &shape[axis..=axis];
            to.push(Stored { name: format!("{name}{SCALE_SUFFIX}"), dtype: Dtype::F32, shape, bytes: scales });
            bytes
        }
    };
    to.push(Stored { name, dtype: *stored, shape, bytes });
}

fn container(document: &str, tensors: Vec<Stored<'_>>) -> Vec<u8> {
    let mut header = format!("{{\"__metadata__\":{}", json(&BTreeMap::from([(KEY, document)])));
    let mut end = 0;
    for t in &tensors {
        let data_offsets = [end, end + t.bytes.len()];
        end = data_offsets[1];
        let entry = Entry { dtype: t.dtype.name(), shape: t.shape, data_offsets };
        header.push_str(&format!(",{}:{}", json(&t.name), json(&entry)));
    }
    header.push('}');
    while header.len() % 8 != 0 {
        header.push(' ');
    }
    let mut bytes = Vec::with_capacity(8 + header.len() + end);
    bytes.extend((header.len() as u64).to_le_bytes());
    bytes.extend(header.as_bytes());
    tensors.into_iter().for_each(|t| bytes.extend(t.bytes));
    bytes
}

fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).expect("keys are texts, and writing to memory does not fail")
}
