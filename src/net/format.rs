//! Reader of weights files (`weights-format/README.md` is the specification): a safetensors file whose metadata key
//! `bouncelight` holds one JSON document with inputs, output, graph and provenance.
//!
//! Everything is checked before a tensor is copied, and all faults are reported at once. No input makes it panic.

use super::graph::{Graph, GraphError};
use super::header;
use super::op::Op;
pub use super::problem::{Problem, WeightsError};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Version of the JSON document that this reader knows.
pub const VERSION: u32 = 1;
/// Metadata key of the JSON document.
pub const KEY: &str = "bouncelight";
/// Files larger than this are refused; the networks this is for take well under a hundredth of it.
pub const MAX_FILE: u64 = 1 << 30;
/// Features of table `screen`, version 1, with their channels, in the order in which a network may use them.
pub const SCREEN_V1: &[(&str, u32)] = &[
    ("direct", 3),
    ("outgoing", 3),
    ("albedo", 3),
    ("normal", 3),
    ("position", 3),
    ("depth", 1),
    ("spread", 1),
    ("hit", 1),
    ("sky", 3),
];
/// Meanings of the output that exist. `plain` is for tests: numbers without a unit.
pub const MEANINGS: &[&str] = &["log_irradiance_over_exposure", "plain"];

/// One group of input channels.
#[derive(Debug, Clone, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Name in the feature table.
    pub name: String,
    /// Channels.
    pub channels: u32,
}

/// The feature table that the inputs refer to.
#[derive(Debug, Clone, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// `screen`, or `free` for a network outside the renderer.
    pub name: String,
    /// Version of the table.
    pub version: u64,
}

/// What the network's output means.
#[derive(Debug, Clone, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Tensor of the graph.
    pub tensor: String,
    /// One of [`MEANINGS`].
    pub meaning: String,
    /// Channels.
    pub channels: u32,
}

/// A tensor of trained numbers, widened to f32, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightTensor {
    /// Edges.
    pub shape: Vec<usize>,
    /// Values.
    pub data: Vec<f32>,
}

/// The document's fields, before they are judged.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    version: u64,
    #[serde(default)]
    name: String,
    licence: String,
    table: Table,
    inputs: Vec<Feature>,
    cell: u32,
    output: Output,
    graph: Vec<serde_json::Value>,
    #[serde(default)]
    provenance: serde_json::Map<String, serde_json::Value>,
}

/// A network that has passed every check.
#[derive(Debug, Clone)]
pub struct Weights {
    /// Where it was read from.
    pub path: PathBuf,
    /// Name in words.
    pub name: String,
    /// Licence of the trained numbers (SPDX).
    pub licence: String,
    /// Feature table.
    pub table: Table,
    /// Features used, in channel order.
    pub inputs: Vec<Feature>,
    /// Picture pixels along the edge of one network pixel.
    pub cell: u32,
    /// What comes out.
    pub output: Output,
    /// Topology.
    pub graph: Graph,
    /// How the numbers were made; free-form.
    pub provenance: serde_json::Map<String, serde_json::Value>,
    /// 64-bit FNV-1a of the file's bytes: identifies the file in a picture's metadata, protects against nothing.
    pub content_hash: u64,
    tensors: BTreeMap<String, WeightTensor>,
}

impl Weights {
    /// Reads and checks a file.
    pub fn load(path: &Path) -> Result<Self, WeightsError> {
        let io = |source| WeightsError::Io { path: path.into(), source };
        let meta = std::fs::metadata(path).map_err(io)?;
        if !meta.is_file() {
            return Err(WeightsError::NotAFile { path: path.into() });
        }
        if meta.len() > MAX_FILE {
            return Err(WeightsError::TooLarge { path: path.into(), bytes: meta.len() });
        }
        Self::parse(path, &std::fs::read(path).map_err(io)?)
    }

    /// Checks a file that is in memory already.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        Self::parse(Path::new("(memory)"), bytes)
    }

    /// Values of tensor `NAME.LEAF`; empty where the graph has none, as the bias of a convolution without.
    pub fn values(&self, name: &str, leaf: &str) -> &[f32] {
        self.tensors.get(&format!("{name}.{leaf}")).map_or(&[], |t| &t.data)
    }

    /// Every tensor by its PyTorch name.
    pub fn tensors(&self) -> &BTreeMap<String, WeightTensor> {
        &self.tensors
    }

    /// The content hash as it is printed.
    pub fn hash_text(&self) -> String {
        format!("{:016x}", self.content_hash)
    }

    fn parse(path: &Path, bytes: &[u8]) -> Result<Self, WeightsError> {
        let mut problems = Vec::new();
        let header = header::parse(path, bytes, &mut problems)?;
        let document = document(&header.metadata, &mut problems);
        let Some((document, graph)) = document else {
            return Err(WeightsError::Invalid { path: path.into(), problems });
        };
        check_tensors(&header, &graph, &mut problems);
        if !problems.is_empty() {
            return Err(WeightsError::Invalid { path: path.into(), problems });
        }
        let mut tensors = BTreeMap::new();
        for (name, info) in &header.tensors {
            let [from, to] = info.data_offsets.map(|o| o as usize);
            let data = widen(&info.dtype, &header.data[from..to]);
            let bad = data.iter().filter(|v| !v.is_finite()).count();
            if let Some(index) = data.iter().position(|v| !v.is_finite()) {
                problems.push(Problem::NotFinite { tensor: name.clone(), count: bad, index });
            }
            tensors
                .insert(name.clone(), WeightTensor { shape: info.shape.iter().map(|e| *e as usize).collect(), data });
        }
        if !problems.is_empty() {
            return Err(WeightsError::Invalid { path: path.into(), problems });
        }
        let Document { name, licence, table, inputs, cell, output, provenance, .. } = document;
        let content_hash = fnv1a(bytes);
        Ok(Self {
            path: path.into(),
            name,
            licence,
            table,
            inputs,
            cell,
            output,
            graph,
            provenance,
            content_hash,
            tensors,
        })
    }
}

/// Document and graph, or `None` when there is too little to judge the tensors by.
fn document(metadata: &BTreeMap<String, String>, problems: &mut Vec<Problem>) -> Option<(Document, Graph)> {
    let Some(text) = metadata.get(KEY) else {
        problems.push(Problem::Document("the key is missing, so this file holds no bouncelight network".into()));
        return None;
    };
    // The version decides what the rest may look like, so it is judged first and alone.
    let loose: serde_json::Value = match serde_json::from_str(text) {
        Ok(value) => value,
        Err(e) => {
            problems.push(Problem::Document(e.to_string()));
            return None;
        }
    };
    match loose.get("version").and_then(serde_json::Value::as_u64) {
        Some(found) if found != u64::from(VERSION) => {
            problems.push(Problem::Version { what: "the document".into(), found, known: VERSION });
            return None;
        }
        _ => {}
    }
    let document: Document = match serde_json::from_str(text) {
        Ok(document) => document,
        Err(e) => {
            problems.push(Problem::Document(e.to_string()));
            return None;
        }
    };
    debug_assert_eq!(document.version, u64::from(VERSION));
    check_inputs(&document, problems);
    if !MEANINGS.contains(&document.output.meaning.as_str()) {
        let meaning = &document.output.meaning;
        problems
            .push(Problem::Document(format!("output meaning `{meaning}` is unknown; known: {}", MEANINGS.join(", "))));
    }
    if !(1..=64).contains(&document.cell) {
        problems.push(Problem::Document(format!("cell is {}, allowed are 1 to 64", document.cell)));
    }
    let ops: Vec<Op> = document.graph.iter().enumerate().filter_map(|(i, v)| operator(i, v, problems)).collect();
    if ops.len() != document.graph.len() {
        return None;
    }
    let input_channels = document.inputs.iter().fold(0u32, |sum, f| sum.saturating_add(f.channels));
    let graph = Graph { input_channels, ops, output: document.output.tensor.clone() };
    let errors = graph.check();
    if errors.is_empty() {
        check_output(&document.output, &graph, problems);
        Some((document, graph))
    } else {
        problems.extend(errors.into_iter().map(Problem::Graph));
        // Operators of sound dimensions still say which tensors there should be.
        (!problems.iter().any(|p| matches!(p, Problem::Graph(GraphError::Range { .. })))).then_some((document, graph))
    }
}

/// Sizes are judged at an odd probe size, because a mistake in the levels of a U-Net shows only there.
fn check_output(output: &Output, graph: &Graph, problems: &mut Vec<Problem>) {
    match graph.shapes(253, 131) {
        Err(e) => problems.push(Problem::Graph(e)),
        Ok(shapes) => {
            let index = graph.ops.iter().position(|op| op.output() == graph.output);
            if let Some(shape) = index.map(|i| shapes[i])
                && shape.channels != output.channels
            {
                let (found, wanted) = (shape.channels, output.channels);
                let (op, tensor) = ("output".into(), output.tensor.clone());
                problems.push(Problem::Graph(GraphError::Channels { op, tensor, found, wanted }));
            }
        }
    }
}

fn check_inputs(document: &Document, problems: &mut Vec<Problem>) {
    let Table { name, version } = &document.table;
    if *version != 1 {
        problems.push(Problem::Version { what: format!("feature table `{name}`"), found: *version, known: 1 });
        return;
    }
    match name.as_str() {
        "free" => return,
        "screen" => {}
        _ => {
            problems.push(Problem::Document(format!("feature table `{name}` is unknown; known: screen, free")));
            return;
        }
    }
    let mut next = 0;
    for Feature { name, channels } in &document.inputs {
        let mut fault = |reason: String| problems.push(Problem::Feature { feature: name.clone(), reason });
        match SCREEN_V1.iter().position(|(known, _)| known == name) {
            None => fault("table `screen` version 1 has no such feature".into()),
            Some(at) if SCREEN_V1[at].1 != *channels => {
                fault(format!("it has {} channels in table `screen`, not {channels}", SCREEN_V1[at].1));
            }
            Some(at) if at < next => fault("it stands twice or out of the table's order".into()),
            Some(at) => next = at + 1,
        }
    }
}

fn operator(index: usize, value: &serde_json::Value, problems: &mut Vec<Problem>) -> Option<Op> {
    let text = |key: &str| value.get(key).and_then(serde_json::Value::as_str);
    let name = text("name").unwrap_or("?").to_string();
    let Some(op) = text("op") else {
        problems.push(Problem::Operator { index, name, reason: "field `op` is missing or no string".into() });
        return None;
    };
    let mut fields = value.clone();
    if let Some(map) = fields.as_object_mut() {
        map.remove("op");
    }
    let Some(parsed) = Op::parse(op, fields) else {
        problems.push(Problem::UnknownOperator { index, name, op: op.into() });
        return None;
    };
    parsed.map_err(|e| problems.push(Problem::Operator { index, name, reason: e.to_string() })).ok()
}

fn check_tensors(header: &header::Header<'_>, graph: &Graph, problems: &mut Vec<Problem>) {
    let wanted: BTreeMap<String, Vec<u64>> = graph.ops.iter().flat_map(Op::tensors).collect();
    // A tensor whose place was wrong has been reported already and is not missing as well.
    let reported: BTreeSet<String> = problems
        .iter()
        .filter_map(|p| if let Problem::Size { tensor, .. } = p { Some(tensor.clone()) } else { None })
        .collect();
    for (tensor, shape) in &wanted {
        match header.tensors.get(tensor) {
            None if reported.contains(tensor) => {}
            None => problems.push(Problem::Missing { tensor: tensor.clone() }),
            Some(info) => {
                if !matches!(info.dtype.as_str(), "F32" | "F16") {
                    problems.push(Problem::Dtype { tensor: tensor.clone(), dtype: info.dtype.clone() });
                }
                if info.shape != *shape {
                    let (found, wanted) = (info.shape.clone(), shape.clone());
                    problems.push(Problem::Shape { tensor: tensor.clone(), found, wanted });
                }
            }
        }
    }
    for tensor in header.tensors.keys().filter(|t| !wanted.contains_key(*t)) {
        problems.push(Problem::Unexpected { tensor: tensor.clone() });
    }
}

fn widen(dtype: &str, bytes: &[u8]) -> Vec<f32> {
    if dtype == "F16" {
        let (pairs, _) = bytes.as_chunks::<2>();
        return pairs.iter().map(|b| half::f16::from_le_bytes(*b).to_f32()).collect();
    }
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|b| f32::from_le_bytes(*b)).collect()
}

fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, b| (hash ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}
