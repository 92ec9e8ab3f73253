//! Reader of weights files (`weights-format/README.md` is the specification): a safetensors file whose metadata key
//! `bouncelight` holds one JSON document with inputs, output, graph and provenance.
//!
//! Everything is checked before memory is taken for a tensor, and all faults are reported at once. No input makes it panic.

use super::document::{self, Document};
pub use super::document::{Feature, Output, Provenance, Table};
use super::graph::Graph;
use super::header;
pub use super::problem::{Problem, WeightsError};
use super::stored;
pub use super::stored::{Dtype, MAX_SCALE, SCALE_SUFFIX, WeightTensor};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// Version of the JSON document that the program writes.
pub const VERSION: u32 = 2;
/// Versions that it reads.
pub const KNOWN_VERSIONS: RangeInclusive<u64> = 1..=VERSION as u64;
/// Metadata key of the JSON document.
pub const KEY: &str = "bouncelight";
/// Files larger than this are refused; the largest network this is for takes a fifth of it.
pub const MAX_FILE: u64 = 1 << 30;
/// Most operators of a graph.
pub const MAX_OPS: usize = 1024;
/// Meanings of the output that exist. `plain` is for tests: numbers without a unit.
pub const MEANINGS: &[&str] = &["log_irradiance_over_exposure", "gain_and_rest_on_guess", "display_signed", "plain"];

/// One row of a feature table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FeatureRow {
    /// Name.
    pub name: &'static str,
    /// Channels.
    pub channels: u32,
    /// Encodings that there are; files of version 1 mean the first.
    pub encodings: &'static [&'static str],
}

/// A table of features that networks can be given.
#[derive(Debug, Clone, Copy)]
pub struct FeatureTable {
    /// Name in files.
    pub name: &'static str,
    /// Rows; empty where anything goes.
    pub features: &'static [FeatureRow],
    /// A network uses its features in the table's order.
    pub ordered: bool,
}

const fn row(name: &'static str, channels: u32, encodings: &'static [&'static str]) -> FeatureRow {
    FeatureRow { name, channels, encodings }
}

/// Table `screen`, version 1: one real pixel for each cell of the picture; `gi::features` says what the encodings are.
pub const SCREEN_V1: &[FeatureRow] = &[
    row("direct", 3, &["log1p_over_exposure"]),
    row("outgoing", 3, &["log1p_over_exposure"]),
    row("albedo", 3, &["linear"]),
    row("normal", 3, &["gravity_frame"]),
    row("position", 3, &["gravity_frame_squashed"]),
    row("depth", 1, &["log_over_mean"]),
    row("spread", 1, &["log_ratio"]),
    row("hit", 1, &["flag"]),
    row("sky", 3, &["log1p_over_exposure"]),
    row("guess", 3, &["log1p_over_exposure"]),
];

/// `v` = value of an 8-bit picture / 255. `signed`: 2v − 1. `signed_stretched`: 2(v − min)/(max − min) − 1 with the
/// picture's own smallest and largest value of all channels, −1 for a picture of one value. `unit`: v.
const PICTURE: &[&str] = &["signed", "signed_stretched", "unit"];

/// Table `images`, version 1: pictures as they are shown, pixel by pixel, in any order.
pub const IMAGES_V1: &[FeatureRow] =
    &[row("depth", 3, PICTURE), row("direct", 3, PICTURE), row("diffuse", 3, PICTURE), row("normal", 3, PICTURE)];

/// Every feature table.
pub const TABLES: &[FeatureTable] = &[
    FeatureTable { name: "screen", features: SCREEN_V1, ordered: true },
    FeatureTable { name: "images", features: IMAGES_V1, ordered: false },
    FeatureTable { name: "free", features: &[], ordered: false },
];

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
    pub provenance: Provenance,
    /// 64-bit FNV-1a of the file's bytes: identifies the file in a picture's metadata, protects against nothing.
    pub content_hash: u64,
    pub(super) tensors: BTreeMap<String, WeightTensor>,
}

impl Weights {
    /// Reads and checks a file.
    pub fn load(path: &Path) -> Result<Self, WeightsError> {
        Self::parse(path, &Self::read_bytes(path)?)
    }

    /// The bytes of a file that may be one of weights: an ordinary file of at most [`MAX_FILE`] bytes.
    pub fn read_bytes(path: &Path) -> Result<Vec<u8>, WeightsError> {
        let io = |source| WeightsError::Io { path: path.into(), source };
        let meta = std::fs::metadata(path).map_err(io)?;
        if !meta.is_file() {
            return Err(WeightsError::NotAFile { path: path.into() });
        }
        if meta.len() > MAX_FILE {
            return Err(WeightsError::TooLarge { path: path.into(), bytes: meta.len() });
        }
        std::fs::read(path).map_err(io)
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

    /// The same network with the weights of its convolutions to be stored as `dtype`; vectors become F32.
    pub fn stored_as(mut self, dtype: Dtype) -> Self {
        for tensor in self.tensors.values_mut() {
            tensor.stored = if tensor.shape.len() == 4 { dtype } else { Dtype::F32 };
        }
        self
    }

    /// The content hash as it is printed.
    pub fn hash_text(&self) -> String {
        format!("{:016x}", self.content_hash)
    }

    fn parse(path: &Path, bytes: &[u8]) -> Result<Self, WeightsError> {
        let mut problems = Vec::new();
        let header = header::parse(path, bytes, &mut problems)?;
        let document = document::parse(&header.metadata, &mut problems);
        if let Some((_, graph)) = &document {
            stored::check(&header, graph, &mut problems);
        }
        let provenance = document.as_ref().map(|(d, _)| d.provenance()).unwrap_or_else(|| Ok(Provenance::new()));
        let provenance = provenance.unwrap_or_else(|fault| {
            problems.push(Problem::Document(fault));
            Provenance::new()
        });
        let Some((document, graph)) = document.filter(|_| problems.is_empty()) else {
            return Err(WeightsError::Invalid { path: path.into(), problems });
        };
        let tensors = stored::widen(&header, &graph);
        let Document { name, licence, table, inputs, cell, output, .. } = document;
        let (path, content_hash) = (path.into(), fnv1a(bytes));
        Ok(Self { path, name, licence, table, inputs, cell, output, graph, provenance, content_hash, tensors })
    }
}

fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, b| (hash ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}
