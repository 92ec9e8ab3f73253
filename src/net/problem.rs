//! What can be wrong with a weights file, in sentences that name file, tensor or operator.

use super::graph::GraphError;
use super::spec::{KEY, MAX_FILE, MAX_SCALE};
use std::path::PathBuf;
use thiserror::Error;

/// Why a weights file cannot be used.
#[derive(Debug, Error)]
pub enum WeightsError {
    /// The file cannot be read.
    #[error("cannot read weights file {}: {source}", path.display())]
    Io {
        /// File.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// The path is a folder, a pipe or a device.
    #[error("weights file {} is not a file; name a .safetensors file", path.display())]
    NotAFile {
        /// Path.
        path: PathBuf,
    },
    /// The file is larger than [`MAX_FILE`].
    #[error("weights file {} has {bytes} bytes, more than the {MAX_FILE} allowed", path.display())]
    TooLarge {
        /// File.
        path: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// The container is something else.
    #[error("{} is not a safetensors file: {reason}", path.display())]
    NotSafetensors {
        /// File.
        path: PathBuf,
        /// What gives it away.
        reason: String,
    },
    /// The file ends too early.
    #[error("{} is truncated: {needed} bytes are needed, it has {found}; fetch it again", path.display())]
    Truncated {
        /// File.
        path: PathBuf,
        /// Bytes that its header promises.
        needed: u64,
        /// Bytes there are.
        found: u64,
    },
    /// A sound container with wrong contents.
    #[error("{} is not a usable weights file:{}", path.display(), list(problems))]
    Invalid {
        /// File.
        path: PathBuf,
        /// Every fault found.
        problems: Vec<Problem>,
    },
}

/// Faults as lines, the first forty of them.
pub fn list(problems: &[Problem]) -> String {
    const SHOWN: usize = 40;
    let mut text: String = problems.iter().take(SHOWN).map(|p| format!("\n  {p}")).collect();
    if problems.len() > SHOWN {
        text.push_str(&format!("\n  … and {} more", problems.len() - SHOWN));
    }
    text
}

/// One fault of a weights file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Problem {
    /// The metadata has no document, or one that is not as specified.
    #[error("metadata `{KEY}`: {0}")]
    Document(String),
    /// A version that this program does not know.
    #[error("{what} has version {found}; this program reads up to version {known}, so a newer one is needed")]
    Version {
        /// What carries the version.
        what: String,
        /// Version found.
        found: u64,
        /// Version known.
        known: u32,
    },
    /// An operator that this program does not know.
    #[error("graph[{index}] `{name}`: operator `{op}` is unknown; a newer program may run it")]
    UnknownOperator {
        /// Position in the graph.
        index: usize,
        /// The operator's name, or `?`.
        name: String,
        /// Its kind.
        op: String,
    },
    /// An operator's fields are wrong.
    #[error("graph[{index}] `{name}`: {reason}")]
    Operator {
        /// Position in the graph.
        index: usize,
        /// The operator's name, or `?`.
        name: String,
        /// What is wrong.
        reason: String,
    },
    /// The graph does not fit together.
    #[error("graph: {0}")]
    Graph(#[from] GraphError),
    /// An input feature that the table does not have, or has otherwise.
    #[error("input feature `{feature}`: {reason}")]
    Feature {
        /// Feature.
        feature: String,
        /// What is wrong.
        reason: String,
    },
    /// A tensor that the graph needs is not there.
    #[error("tensor `{tensor}` is missing")]
    Missing {
        /// Tensor.
        tensor: String,
    },
    /// A tensor that the graph does not use.
    #[error("tensor `{tensor}` is used by no operator")]
    Unexpected {
        /// Tensor.
        tensor: String,
    },
    /// Two tensors of one name.
    #[error("`{tensor}` occurs twice")]
    Duplicate {
        /// Tensor.
        tensor: String,
    },
    /// A tensor of another shape.
    #[error("tensor `{tensor}` has shape {found:?}, the graph needs {wanted:?}")]
    Shape {
        /// Tensor.
        tensor: String,
        /// Shape found.
        found: Vec<u64>,
        /// Shape needed.
        wanted: Vec<u64>,
    },
    /// A number type that is not read.
    #[error("tensor `{tensor}` holds {dtype}; F32 and F16 are read, and I8 for the weights of convolutions")]
    Dtype {
        /// Tensor.
        tensor: String,
        /// Its type.
        dtype: String,
    },
    /// A state dict's tensor of another kind of number.
    #[error("tensor `{tensor}` holds {dtype}; F32, F16, BF16 and F64 are converted")]
    FloatDtype {
        /// Tensor.
        tensor: String,
        /// Its type.
        dtype: String,
    },
    /// Values that halves cannot hold.
    #[error(
        "tensor `{tensor}` holds {count} values beyond the ±65504 of F16, the first at index {index}; store it as f32"
    )]
    Overflow {
        /// Tensor.
        tensor: String,
        /// How many.
        count: usize,
        /// First flat index.
        index: usize,
    },
    /// Scales that are no singles.
    #[error("tensor `{tensor}` holds {dtype}; scales are F32")]
    ScaleDtype {
        /// Tensor.
        tensor: String,
        /// Its type.
        dtype: String,
    },
    /// A scale that bytes cannot be multiplied with.
    #[error("tensor `{tensor}`: the scale at index {index} is not a number above 0 and up to {MAX_SCALE:e}")]
    Scale {
        /// Tensor.
        tensor: String,
        /// First index.
        index: usize,
    },
    /// Values below zero where they make no sense.
    #[error("tensor `{tensor}` holds {count} values below 0, the first at index {index}; a variance has none")]
    Negative {
        /// Tensor.
        tensor: String,
        /// How many.
        count: usize,
        /// First flat index.
        index: usize,
    },
    /// A tensor's place in the file is wrong.
    #[error("tensor `{tensor}` {what}")]
    Size {
        /// Tensor.
        tensor: String,
        /// What is wrong.
        what: String,
    },
    /// Bytes that belong to no tensor.
    #[error("{bytes} bytes at the end belong to no tensor")]
    Trailing {
        /// How many.
        bytes: u64,
    },
    /// NaN or infinity.
    #[error("tensor `{tensor}` holds {count} values that are not finite, the first at index {index}")]
    NotFinite {
        /// Tensor.
        tensor: String,
        /// How many.
        count: usize,
        /// First flat index.
        index: usize,
    },
}

impl Problem {
    /// The kind of fault in one word; the Python package has the same ones.
    pub fn code(&self) -> &'static str {
        match self {
            Problem::Document(_) => "document",
            Problem::Version { .. } => "version",
            Problem::UnknownOperator { .. } => "unknown-operator",
            Problem::Operator { .. } => "operator",
            Problem::Graph(_) => "graph",
            Problem::Feature { .. } => "feature",
            Problem::Missing { .. } => "missing",
            Problem::Unexpected { .. } => "unexpected",
            Problem::Duplicate { .. } => "duplicate",
            Problem::Shape { .. } => "shape",
            Problem::Dtype { .. } | Problem::ScaleDtype { .. } | Problem::FloatDtype { .. } => "dtype",
            Problem::Overflow { .. } => "overflow",
            Problem::Scale { .. } => "scale",
            Problem::Negative { .. } => "negative",
            Problem::Size { .. } => "size",
            Problem::Trailing { .. } => "trailing",
            Problem::NotFinite { .. } => "not-finite",
        }
    }

    /// Tensor, operator or feature that it is about; empty where it is about the whole file.
    pub fn subject(&self) -> &str {
        match self {
            Problem::Document(_) | Problem::Trailing { .. } => "",
            Problem::Version { what, .. } => what,
            Problem::UnknownOperator { name, .. } | Problem::Operator { name, .. } => name,
            Problem::Graph(error) => error.op(),
            Problem::Feature { feature, .. } => feature,
            Problem::Missing { tensor }
            | Problem::Unexpected { tensor }
            | Problem::Duplicate { tensor }
            | Problem::Shape { tensor, .. }
            | Problem::Dtype { tensor, .. }
            | Problem::ScaleDtype { tensor, .. }
            | Problem::FloatDtype { tensor, .. }
            | Problem::Overflow { tensor, .. }
            | Problem::Scale { tensor, .. }
            | Problem::Negative { tensor, .. }
            | Problem::Size { tensor, .. }
            | Problem::NotFinite { tensor, .. } => tensor,
        }
    }
}

impl WeightsError {
    /// Every fault as code and subject. A file that cannot be read as a container has one, without
    /// a subject.
    pub fn faults(&self) -> Vec<(&'static str, String)> {
        let one = |code| vec![(code, String::new())];
        match self {
            WeightsError::Io { .. } => one("io"),
            WeightsError::NotAFile { .. } => one("not-a-file"),
            WeightsError::TooLarge { .. } => one("too-large"),
            WeightsError::NotSafetensors { .. } => one("not-safetensors"),
            WeightsError::Truncated { .. } => one("truncated"),
            WeightsError::Invalid { problems, .. } => {
                problems.iter().map(|p| (p.code(), p.subject().to_string())).collect()
            }
        }
    }
}
