//! What can be wrong with a graph.

use super::tensor::Shape;
use thiserror::Error;

/// What is wrong with a graph. `op` is the operator's name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum GraphError {
    /// No operator at all.
    #[error("the graph has no operator")]
    Empty,
    /// Two operators share a name.
    #[error("operator `{op}` occurs twice")]
    DuplicateOperator {
        /// Operator.
        op: String,
    },
    /// Two operators write one tensor, or one writes `input`.
    #[error("operator `{op}` writes tensor `{tensor}`, which exists already")]
    DuplicateTensor {
        /// Operator.
        op: String,
        /// Tensor.
        tensor: String,
    },
    /// A tensor is read that nothing before has written.
    #[error("operator `{op}` reads tensor `{tensor}`, which no operator before it writes")]
    UnknownTensor {
        /// Operator.
        op: String,
        /// Tensor.
        tensor: String,
    },
    /// The graph's output is written by no operator.
    #[error("the output tensor `{tensor}` is written by no operator")]
    NoOutput {
        /// Tensor.
        tensor: String,
    },
    /// Channels differ from what the operator declares or needs.
    #[error("operator `{op}`: tensor `{tensor}` has {found} channels, {wanted} are needed")]
    Channels {
        /// Operator.
        op: String,
        /// Tensor.
        tensor: String,
        /// Channels it has.
        found: u32,
        /// Channels needed.
        wanted: u32,
    },
    /// Sizes of two tensors that are added or concatenated differ.
    #[error("operator `{op}`: {a} and {b} do not fit together")]
    Sizes {
        /// Operator.
        op: String,
        /// First tensor.
        a: Shape,
        /// Second tensor.
        b: Shape,
    },
    /// A number is outside what the operators support.
    #[error("operator `{op}`: {what} is {value}, allowed are {min} to {max}")]
    Range {
        /// Operator, or `input`.
        op: String,
        /// Field.
        what: &'static str,
        /// Value found.
        value: u32,
        /// Smallest allowed.
        min: u32,
        /// Largest allowed.
        max: u32,
    },
    /// The kernel is larger than the padded picture.
    #[error("operator `{op}`: a {kernel} kernel does not fit the padded input of {size} pixels")]
    TooSmall {
        /// Operator.
        op: String,
        /// Kernel edge.
        kernel: u32,
        /// Padded edge.
        size: u32,
    },
    /// A fraction is outside what the operators support.
    #[error("operator `{op}`: {what} is {value}, allowed is {allowed}")]
    Number {
        /// Operator.
        op: String,
        /// Field.
        what: &'static str,
        /// Value found.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Something cannot be divided evenly.
    #[error("operator `{op}`: {what} {value} is not a multiple of {by}")]
    Divide {
        /// Operator.
        op: String,
        /// What cannot be divided.
        what: &'static str,
        /// Its value.
        value: u32,
        /// The divisor.
        by: u32,
    },
    /// A resampling has both or none of `size_as` and `scale`.
    #[error("operator `{op}`: give either `size_as` or `scale`")]
    SizeOrScale {
        /// Operator.
        op: String,
    },
}

impl GraphError {
    /// The operator that it is about; `input` for the input's own size, the output's tensor where
    /// nothing writes it.
    pub fn op(&self) -> &str {
        match self {
            GraphError::Empty => "",
            GraphError::NoOutput { tensor } => tensor,
            GraphError::DuplicateOperator { op }
            | GraphError::DuplicateTensor { op, .. }
            | GraphError::UnknownTensor { op, .. }
            | GraphError::Channels { op, .. }
            | GraphError::Sizes { op, .. }
            | GraphError::Range { op, .. }
            | GraphError::TooSmall { op, .. }
            | GraphError::Number { op, .. }
            | GraphError::Divide { op, .. }
            | GraphError::SizeOrScale { op } => op,
        }
    }
}
