//! The JSON document of a weights file: what its fields may say, checked before the tensors are
//! looked at.

use super::graph::{Graph, GraphError};
use super::op::Op;
use super::problem::Problem;
use super::spec::{KEY, KNOWN_VERSIONS, MAX_OPS, MEANINGS, TABLES, VERSION};
use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use std::collections::{BTreeMap, BTreeSet};

/// How the numbers were made; free-form.
pub type Provenance = serde_json::Map<String, serde_json::Value>;

/// One group of input channels.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Feature {
    /// Name in the feature table.
    pub name: String,
    /// Channels.
    pub channels: u32,
    /// How the field's values become channels, normalisation included. Files of version 1 leave it
    /// out; it is then filled in from the table, `plain` in table `free`.
    #[serde(default)]
    pub encoding: String,
}

/// The feature table that the inputs refer to.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// `cells`, `images`, or `free` for a network outside the renderer.
    pub name: String,
    /// Version of the table.
    pub version: u64,
}

/// What the network's output means.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Tensor of the graph.
    pub tensor: String,
    /// One of [`MEANINGS`].
    pub meaning: String,
    /// Channels.
    pub channels: u32,
}

/// The document's fields, before they are judged.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document<'a> {
    version: u64,
    #[serde(default)]
    pub name: String,
    pub licence: String,
    pub table: Table,
    pub inputs: Vec<Feature>,
    pub cell: u32,
    pub output: Output,
    /// Text, not values: a value takes up to 32 times its text, and most of a document is its
    /// graph.
    #[serde(borrow)]
    graph: Vec<&'a RawValue>,
    /// Text for the same reason.
    #[serde(borrow, default)]
    provenance: Option<&'a RawValue>,
}

/// Longest provenance, bytes of text.
const MAX_PROVENANCE: usize = 1 << 20;

impl Document<'_> {
    /// The provenance, read.
    pub fn provenance(&self) -> Result<Provenance, String> {
        match self.provenance.map(RawValue::get) {
            None => Ok(Provenance::new()),
            Some(text) if text.len() > MAX_PROVENANCE => {
                Err(format!("provenance has {} bytes, more than the {MAX_PROVENANCE} allowed", text.len()))
            }
            Some(text) => serde_json::from_str(text).map_err(|e| format!("provenance: {}", plain(&e))),
        }
    }
}

/// The one field that decides what the others may be.
#[derive(Deserialize)]
struct Versioned {
    #[serde(default)]
    version: Option<serde_json::Number>,
}

/// Document and graph, or `None` when there is too little to judge the tensors by.
pub(super) fn parse<'a>(
    metadata: &'a BTreeMap<String, String>,
    problems: &mut Vec<Problem>,
) -> Option<(Document<'a>, Graph)> {
    let Some(text) = metadata.get(KEY) else {
        problems.push(Problem::Document("the key is missing, so this file holds no bouncelight network".into()));
        return None;
    };
    // What is skipped or kept as text below is not looked at in full, and a half of a surrogate
    // pair is no JSON.
    if text.contains("\\u")
        && let Err(e) = serde_json::from_str::<serde_json::Value>(text)
    {
        problems.push(Problem::Document(e.to_string()));
        return None;
    }
    // The version is judged first and alone: a document of another version may look like anything.
    if let Ok(Versioned { version: Some(version) }) = serde_json::from_str(text)
        && let Some(found) = version.as_u64()
        && !KNOWN_VERSIONS.contains(&found)
    {
        problems.push(Problem::Version { what: "the document".into(), found, known: VERSION });
        return None;
    }
    let mut document: Document<'a> = match serde_json::from_str(text) {
        Ok(document) => document,
        Err(e) => {
            problems.push(Problem::Document(e.to_string()));
            return None;
        }
    };
    check_inputs(&mut document, problems);
    check_fields(&document, problems);
    if document.graph.len() > MAX_OPS {
        let found = document.graph.len();
        problems.push(Problem::Document(format!("the graph has {found} operators, more than the {MAX_OPS} allowed")));
        return None;
    }
    let ops: Vec<Op> = document.graph.iter().enumerate().filter_map(|(i, v)| operator(i, v.get(), problems)).collect();
    if ops.len() != document.graph.len() {
        return None;
    }
    let input_channels = document.inputs.iter().fold(0u32, |sum, f| sum.saturating_add(f.channels));
    let graph = Graph { input_channels, ops, output: document.output.tensor.clone() };
    let errors = graph.check();
    if errors.is_empty() {
        check_output(&document.output, &graph, problems);
        return Some((document, graph));
    }
    // Operators of sound dimensions still say which tensors there should be.
    let sized = !errors.iter().any(|e| matches!(e, GraphError::Range { .. } | GraphError::Divide { .. }));
    problems.extend(errors.into_iter().map(Problem::Graph));
    sized.then_some((document, graph))
}

fn check_fields(document: &Document<'_>, problems: &mut Vec<Problem>) {
    let mut fault = |text: String| problems.push(Problem::Document(text));
    let meaning = &document.output.meaning;
    if !MEANINGS.contains(&meaning.as_str()) {
        fault(format!("output meaning `{meaning}` is unknown; known: {}", MEANINGS.join(", ")));
    }
    if !(1..=64).contains(&document.cell) {
        fault(format!("cell is {}, allowed are 1 to 64", document.cell));
    }
    if document.licence.trim().is_empty() {
        fault("licence is empty; write an SPDX expression, or LicenseRef-unknown".into());
    }
}

/// Every feature against its table; fills in the encodings that version 1 does not write.
fn check_inputs(document: &mut Document<'_>, problems: &mut Vec<Problem>) {
    let Table { name, version } = &document.table;
    let newest = TABLES.iter().find(|t| t.name == name).map_or(1, |t| t.version);
    if *version == 0 || *version > u64::from(newest) {
        problems.push(Problem::Version { what: format!("feature table `{name}`"), found: *version, known: newest });
        return;
    }
    let Some(table) = TABLES.iter().find(|t| t.name == name && u64::from(t.version) == *version) else {
        let mut known: Vec<_> = TABLES.iter().map(|t| t.name).collect();
        known.dedup();
        problems.push(Problem::Document(format!("feature table `{name}` is unknown; known: {}", known.join(", "))));
        return;
    };
    if document.inputs.is_empty() {
        problems.push(Problem::Document("there is no input feature".into()));
    }
    let first = document.version == 1;
    let mut next = 0;
    let mut seen = BTreeSet::new();
    for Feature { name, channels, encoding } in &mut document.inputs {
        let mut fault = |reason: String| problems.push(Problem::Feature { feature: name.clone(), reason });
        if !seen.insert(name.clone()) {
            fault("it stands twice".into());
            continue;
        }
        match (first, encoding.is_empty()) {
            (true, false) => fault("field `encoding` came with version 2 of the document".into()),
            (false, true) => fault("field `encoding` is missing or empty".into()),
            _ => {}
        }
        if table.features.is_empty() {
            if encoding.is_empty() {
                *encoding = "plain".into();
            }
            continue;
        }
        let Some(at) = table.features.iter().position(|f| f.name == name.as_str()) else {
            fault(format!("table `{}` version {} has no such feature", table.name, table.version));
            continue;
        };
        let row = &table.features[at];
        if row.channels != *channels {
            fault(format!("it has {} channels in table `{}`, not {channels}", row.channels, table.name));
        }
        if encoding.is_empty() {
            *encoding = row.encodings[0].into();
        } else if !row.encodings.contains(&encoding.as_str()) {
            let known = row.encodings.join(", ");
            fault(format!("encoding `{encoding}` is unknown in table `{}`; known: {known}", table.name));
        }
        if table.ordered && at < next {
            fault("it stands out of the table's order".into());
        }
        next = at + 1;
    }
}

/// Sizes are judged at an odd probe size, because a mistake in the levels of a U-Net shows only
/// there.
fn check_output(output: &Output, graph: &Graph, problems: &mut Vec<Problem>) {
    match graph.inner_size(253, 131).and_then(|[w, h]| graph.shapes(w, h)) {
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

/// Longest text of one operator: it becomes values before it becomes an [`Op`].
const MAX_OP_TEXT: usize = 64 << 10;

/// An operator's kind and name; refuses a field that stands twice, which reading into values would
/// hide.
#[derive(Default)]
struct Keys {
    op: Option<String>,
    name: Option<String>,
    twice: Option<String>,
}

impl<'de> Deserialize<'de> for Keys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct KeysVisitor;
        impl<'de> Visitor<'de> for KeysVisitor {
            type Value = Keys;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an operator, which is an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Keys, A::Error> {
                let (mut keys, mut seen) = (Keys::default(), BTreeSet::new());
                while let Some(key) = map.next_key::<String>()? {
                    let value: &RawValue = map.next_value()?;
                    let text = || serde_json::from_str(value.get()).ok();
                    match key.as_str() {
                        "op" => keys.op = text(),
                        "name" => keys.name = text(),
                        _ => {}
                    }
                    if !seen.insert(key.clone()) {
                        keys.twice = Some(key);
                    }
                }
                Ok(keys)
            }
        }
        deserializer.deserialize_map(KeysVisitor)
    }
}

fn operator(index: usize, text: &str, problems: &mut Vec<Problem>) -> Option<Op> {
    let keys: serde_json::Result<Keys> = serde_json::from_str(text);
    let name = keys.as_ref().ok().and_then(|k| k.name.clone()).unwrap_or_else(|| "?".into());
    let mut fault = |reason: String| {
        problems.push(Problem::Operator { index, name: name.clone(), reason });
        None
    };
    if text.len() > MAX_OP_TEXT {
        return fault(format!("its text has {} bytes, more than the {MAX_OP_TEXT} allowed", text.len()));
    }
    let keys = match keys {
        Ok(Keys { twice: Some(field), .. }) => return fault(format!("field `{field}` stands twice")),
        Ok(keys) => keys,
        Err(e) => return fault(plain(&e)),
    };
    let Some(kind) = keys.op else { return fault("field `op` is missing or no string".into()) };
    let mut fields = match serde_json::from_str::<serde_json::Map<_, _>>(text) {
        Ok(fields) => fields,
        Err(e) => return fault(plain(&e)),
    };
    fields.remove("op");
    match Op::parse(&kind, fields.into()) {
        Some(Ok(op)) => Some(op),
        Some(Err(e)) => fault(plain(&e)),
        None => {
            problems.push(Problem::UnknownOperator { index, name, op: kind });
            None
        }
    }
}

/// The error without its place: line and column of a piece of the document lead nowhere.
fn plain(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.split_once(" at line ").map_or(text.clone(), |(words, _)| words.into())
}
