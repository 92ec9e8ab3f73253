//! The network's topology: named operators in execution order, shape inference, parameter and FLOP counts.
//!
//! Pure: no file, no GPU. A graph is in single-assignment form: every operator writes one tensor with a name of its
//! own and reads tensors that were written before it, or [`INPUT`].

pub use super::op::{Activation, Add, AddAt, Conv2d, Op, UpsampleBilinear};
use std::collections::{HashMap, HashSet};
use thiserror::Error;

/// Name of the tensor that the network is given.
pub const INPUT: &str = "input";
/// Most channels of any tensor.
pub const MAX_CHANNELS: u32 = 4096;
/// Largest kernel edge.
pub const MAX_KERNEL: u32 = 7;
/// Largest stride.
pub const MAX_STRIDE: u32 = 4;
/// Largest width or height of any tensor.
pub const MAX_EDGE: u32 = 16384;

/// Size of one tensor, batch of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shape {
    /// Channels.
    pub channels: u32,
    /// Rows.
    pub height: u32,
    /// Columns.
    pub width: u32,
}

impl Shape {
    /// Pixels.
    pub fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Bytes on the GPU: NHWC f32, channels padded to a multiple of four.
    pub fn padded_bytes(self) -> u64 {
        self.pixels() * u64::from(self.channels.div_ceil(4)) * 16
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}×{}×{}", self.channels, self.height, self.width)
    }
}

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
    /// Sizes of two summands differ.
    #[error("operator `{op}`: cannot add {b} to {a}")]
    Sizes {
        /// Operator.
        op: String,
        /// First summand.
        a: Shape,
        /// Second summand.
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
}

/// Operators in execution order between an input of known channels and one output tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Graph {
    /// Channels of [`INPUT`].
    pub input_channels: u32,
    /// Operators.
    pub ops: Vec<Op>,
    /// Name of the output tensor.
    pub output: String,
}

impl Graph {
    /// Everything wrong with the graph whatever the picture's size; empty when it is sound.
    pub fn check(&self) -> Vec<GraphError> {
        let mut errors = Vec::new();
        if self.ops.is_empty() {
            errors.push(GraphError::Empty);
        }
        range(&mut errors, INPUT, "channels", self.input_channels, 1, MAX_CHANNELS);
        // `None`: written, but by an operator whose own input is unknown, so nothing follows from it.
        let mut known: HashMap<&str, Option<u32>> = HashMap::from([(INPUT, Some(self.input_channels))]);
        let mut names = HashSet::new();
        for op in &self.ops {
            let name = op.name();
            if !names.insert(name) {
                errors.push(GraphError::DuplicateOperator { op: name.into() });
            }
            let mut channels_of = |tensor: &str| {
                known.get(tensor).copied().unwrap_or_else(|| {
                    errors.push(GraphError::UnknownTensor { op: name.into(), tensor: tensor.into() });
                    None
                })
            };
            // Tensor, its channels, the channels it should have.
            let mut pairs: Vec<(&str, Option<u32>, Option<u32>)> = Vec::new();
            let out = match op {
                Op::Conv2d(o) => {
                    pairs.push((&o.input, channels_of(&o.input), Some(o.in_channels)));
                    if let Some(add) = &o.add {
                        pairs.push((add, channels_of(add), Some(o.out_channels)));
                    }
                    range(&mut errors, name, "in_channels", o.in_channels, 1, MAX_CHANNELS);
                    range(&mut errors, name, "out_channels", o.out_channels, 1, MAX_CHANNELS);
                    range(&mut errors, name, "kernel height", o.kernel[0], 1, MAX_KERNEL);
                    range(&mut errors, name, "kernel width", o.kernel[1], 1, MAX_KERNEL);
                    range(&mut errors, name, "stride", o.stride, 1, MAX_STRIDE);
                    range(&mut errors, name, "padding", o.padding, 0, MAX_KERNEL - 1);
                    Some(o.out_channels)
                }
                Op::UpsampleBilinear(o) => {
                    channels_of(&o.size_as);
                    channels_of(&o.input)
                }
                Op::Add(o) => {
                    let first = channels_of(&o.inputs[0]);
                    pairs.push((&o.inputs[1], channels_of(&o.inputs[1]), first));
                    first
                }
            };
            for (tensor, found, wanted) in pairs {
                if let (Some(found), Some(wanted)) = (found, wanted)
                    && found != wanted
                {
                    errors.push(GraphError::Channels { op: name.into(), tensor: tensor.into(), found, wanted });
                }
            }
            if known.contains_key(op.output()) {
                errors.push(GraphError::DuplicateTensor { op: name.into(), tensor: op.output().into() });
            }
            known.insert(op.output(), out);
        }
        if !self.ops.iter().any(|op| op.output() == self.output) {
            errors.push(GraphError::NoOutput { tensor: self.output.clone() });
        }
        errors
    }

    /// Shape of each operator's output, in order, for an input of `width`×`height`.
    pub fn shapes(&self, width: u32, height: u32) -> Result<Vec<Shape>, GraphError> {
        if let Some(error) = self.check().into_iter().next() {
            return Err(error);
        }
        for (what, value) in [("width", width), ("height", height)] {
            if value == 0 || value > MAX_EDGE {
                return Err(GraphError::Range { op: INPUT.into(), what, value, min: 1, max: MAX_EDGE });
            }
        }
        let mut known = HashMap::from([(INPUT, Shape { channels: self.input_channels, height, width })]);
        let mut shapes = Vec::with_capacity(self.ops.len());
        for op in &self.ops {
            // `check` has seen every name, so the lookups hold.
            let shape = match op {
                Op::Conv2d(o) => {
                    let input = known[o.input.as_str()];
                    let shape = Shape {
                        channels: o.out_channels,
                        height: conv_edge(o, input.height, o.kernel[0])?,
                        width: conv_edge(o, input.width, o.kernel[1])?,
                    };
                    if let Some(add) = &o.add {
                        same(op, shape, known[add.as_str()])?;
                    }
                    shape
                }
                Op::UpsampleBilinear(o) => {
                    Shape { channels: known[o.input.as_str()].channels, ..known[o.size_as.as_str()] }
                }
                Op::Add(o) => {
                    let [a, b] = [known[o.inputs[0].as_str()], known[o.inputs[1].as_str()]];
                    same(op, a, b)?;
                    a
                }
            };
            known.insert(op.output(), shape);
            shapes.push(shape);
        }
        Ok(shapes)
    }

    /// Trained numbers in all.
    pub fn parameters(&self) -> u64 {
        self.ops.iter().map(Op::parameters).sum()
    }

    /// Floating-point operations for an input of `width`×`height`, counted as [`Op::flops`] says.
    pub fn flops(&self, width: u32, height: u32) -> Result<u64, GraphError> {
        Ok(self.ops.iter().zip(self.shapes(width, height)?).map(|(op, shape)| op.flops(shape)).sum())
    }
}

fn range(errors: &mut Vec<GraphError>, op: &str, what: &'static str, value: u32, min: u32, max: u32) {
    if !(min..=max).contains(&value) {
        errors.push(GraphError::Range { op: op.into(), what, value, min, max });
    }
}

fn conv_edge(o: &Conv2d, edge: u32, kernel: u32) -> Result<u32, GraphError> {
    let size = edge + 2 * o.padding;
    if size < kernel {
        return Err(GraphError::TooSmall { op: o.name.clone(), kernel, size });
    }
    let out = (size - kernel) / o.stride + 1;
    if out > MAX_EDGE {
        let (what, min, max) = ("output edge", 1, MAX_EDGE);
        return Err(GraphError::Range { op: o.name.clone(), what, value: out, min, max });
    }
    Ok(out)
}

fn same(op: &Op, a: Shape, b: Shape) -> Result<(), GraphError> {
    if a == b { Ok(()) } else { Err(GraphError::Sizes { op: op.name().into(), a, b }) }
}
