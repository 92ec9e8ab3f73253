//! Reader of weights files (`weights-format/README.md` is the specification): a safetensors file
//! whose metadata key `bouncelight` holds one JSON document with inputs, output, graph and
//! provenance.
//!
//! Everything is checked before memory is taken for a tensor, and all faults are reported at once.
//! No input makes it panic.
//!
//! ```
//! use bouncelight::net::format::Weights;
//! let error = Weights::from_bytes(b"not a weights file").expect_err("is refused");
//! assert!(error.to_string().contains("safetensors"));
//! ```

use super::document::{self, Document};
pub use super::document::{Feature, Output, Provenance, Table};
use super::graph::Graph;
use super::header;
pub use super::problem::{Problem, WeightsError};
pub use super::spec::*;
use super::stored;
pub use super::stored::{Dtype, WeightTensor};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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
    /// Channels and meaning of the output.
    pub output: Output,
    /// Topology.
    pub graph: Graph,
    /// How the weights were trained; free-form.
    pub provenance: Provenance,
    /// 64-bit FNV-1a of the file's bytes: identifies the file in a picture's metadata, protects
    /// against nothing.
    pub content_hash: u64,
    #[doc(hidden)]
    pub tensors: BTreeMap<String, WeightTensor>,
}

impl Weights {
    /// Reads and checks a file.
    pub fn load(path: &Path) -> Result<Self, WeightsError> {
        Self::parse(path, &Self::read_bytes(path)?)
    }

    /// The bytes of a file that may be one of weights: an ordinary file of at most [`MAX_FILE`]
    /// bytes.
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

    /// Values of tensor `NAME.LEAF`; empty where the graph has none, as the bias of a convolution
    /// without.
    pub fn values(&self, name: &str, leaf: &str) -> &[f32] {
        self.tensors.get(&format!("{name}.{leaf}")).map_or(&[], |t| &t.data)
    }

    /// Every tensor by its PyTorch name.
    pub fn tensors(&self) -> &BTreeMap<String, WeightTensor> {
        &self.tensors
    }

    /// The same network with the weights of its convolutions to be stored as `dtype`; vectors
    /// become F32.
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
