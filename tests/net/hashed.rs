//! Networks and inputs whose numbers are a hash of their names, as
//! `weights-format/fixtures/operators` describes them.

use bouncelight::net::format::{KEY, Weights};
use bouncelight::net::graph::{Graph, Op, Shape};
use bouncelight_lab::network::cpu::Tensor;
use serde_json::{Value, json};
use std::collections::BTreeMap;

const SAMPLES: usize = 1024;
const STRIDE: usize = 7919;

fn pcg(v: u32) -> u32 {
    let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Uniform in [−1, 1), a function of name and flat index alone.
pub fn values(name: &str, count: usize) -> Vec<f32> {
    let seed = name.bytes().fold(2_166_136_261u32, |h, b| (h ^ u32::from(b)).wrapping_mul(16_777_619));
    (0..count as u32).map(|i| (pcg(pcg(i) ^ seed) >> 8) as f32 / 8_388_608.0 - 1.0).collect()
}

fn trained(op: &Op, name: &str, shape: &[u64]) -> Vec<f32> {
    let mut v = values(name, shape.iter().product::<u64>() as usize);
    let (scale, offset) = match (shape, name.rsplit('.').next()) {
        ([o, i, h, w], _) => {
            let fan = if matches!(op, Op::ConvTranspose2d(_)) { (o * h * w) as f64 / 4.0 } else { (i * h * w) as f64 };
            ((6.0 / fan).sqrt() as f32, 0.0)
        }
        (_, Some("weight" | "running_var")) => (0.5, 1.0),
        _ => (0.3, 0.0),
    };
    v.iter_mut().for_each(|v| *v = offset + *v * scale);
    v
}

/// The bytes of a weights file for `graph`.
pub fn file(graph: &Graph, output_channels: u32) -> Vec<u8> {
    let document = json!({
        "version": 1, "licence": "CC0-1.0", "table": {"name": "free", "version": 1}, "cell": 1,
        "inputs": [{"name": "x", "channels": graph.input_channels}],
        "output": {"tensor": graph.output, "meaning": "plain", "channels": output_channels},
        "graph": graph.ops,
    });
    let (mut header, mut data) = (serde_json::Map::new(), Vec::new());
    header.insert("__metadata__".into(), json!({ KEY: document.to_string() }));
    for op in &graph.ops {
        for (name, shape) in op.tensors() {
            let begin = data.len();
            data.extend(trained(op, &name, &shape).iter().flat_map(|v| v.to_le_bytes()));
            header.insert(name, json!({"dtype": "F32", "shape": shape, "data_offsets": [begin, data.len()]}));
        }
    }
    let header = Value::Object(header).to_string();
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &data].concat()
}

/// The network of `graph` with hashed numbers.
pub fn network(graph: &Graph) -> Weights {
    let [w, h] = graph.inner_size(16, 16).unwrap();
    let shapes = graph.shapes(w, h).unwrap();
    let at = graph.ops.iter().position(|op| op.output() == graph.output).unwrap();
    Weights::from_bytes(&file(graph, shapes[at].channels)).unwrap()
}

/// The hashed input `name` for a size.
pub fn input(name: &str, channels: u32, [width, height]: [u32; 2]) -> Tensor {
    let shape = Shape { channels, height, width };
    Tensor { shape, data: values(&format!("{name}.{width}x{height}"), (channels * width * height) as usize) }
}

/// PyTorch's answer to a network and a size.
pub struct Case {
    pub size: [u32; 2],
    samples: bool,
    values: Vec<f32>,
}

impl Case {
    /// max |Δ| / max |reference|; infinite for another number of values and for anything not
    /// finite.
    pub fn error(&self, found: &Tensor) -> f32 {
        let picked = |i| found.data[i * STRIDE % found.data.len()];
        let found = if self.samples { (0..SAMPLES).map(picked).collect() } else { found.data.clone() };
        error(&found, &self.values)
    }
}

/// max |Δ| / max |reference|; infinite for another number of values and for anything not finite.
pub fn error(found: &[f32], reference: &[f32]) -> f32 {
    if found.len() != reference.len() || found.iter().chain(reference).any(|v| !v.is_finite()) {
        return f32::INFINITY;
    }
    let delta = found.iter().zip(reference).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    delta / reference.iter().map(|v| v.abs()).fold(f32::MIN_POSITIVE, f32::max)
}

/// Cases by network, and the file's metadata.
pub fn cases(file: &str) -> (BTreeMap<String, Vec<Case>>, Option<Value>) {
    cases_at(format!("{}/weights-format/fixtures/operators/{file}", env!("CARGO_MANIFEST_DIR")).as_ref())
}

/// As [`cases`], of a file anywhere.
pub fn cases_at(path: &std::path::Path) -> (BTreeMap<String, Vec<Case>>, Option<Value>) {
    let bytes = std::fs::read(path).unwrap();
    let (_, header) = safetensors::SafeTensors::read_metadata(&bytes).unwrap();
    let graphs = header.metadata().as_ref().and_then(|m| serde_json::from_str(m.get("graphs")?).ok());
    let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
    let mut cases = BTreeMap::<String, Vec<Case>>::new();
    for name in tensors.names() {
        let (network, size) = name.rsplit_once('.').unwrap();
        let (w, h) = size.split_once('x').unwrap();
        let view = tensors.tensor(name).unwrap();
        let values = view.data().chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        let case = Case { size: [w, h].map(|n| n.parse().unwrap()), samples: view.shape().len() == 1, values };
        cases.entry(network.into()).or_default().push(case);
    }
    (cases, graphs)
}

/// The graphs of `operators.safetensors` by name.
pub fn graphs(metadata: &Value) -> BTreeMap<String, Graph> {
    let graph = |(name, value): (&String, &Value)| {
        let op = |fields: &Value| {
            let mut fields = fields.clone();
            let kind = fields.as_object_mut().unwrap().remove("op").unwrap();
            Op::parse(kind.as_str().unwrap(), fields).unwrap().unwrap()
        };
        let ops: Vec<Op> = value["ops"].as_array().unwrap().iter().map(op).collect();
        let output = ops.last().unwrap().output().to_string();
        (name.clone(), Graph { input_channels: value["input_channels"].as_u64().unwrap() as u32, ops, output })
    };
    metadata.as_object().unwrap().iter().map(graph).collect()
}
