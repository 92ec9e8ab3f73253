//! The network's topology: named operators in execution order, shape inference, parameter and FLOP
//! counts.
//!
//! Pure: no file, no GPU. A graph is in single-assignment form: every operator writes one tensor
//! with a name of its own and reads tensors that were written before it, or [`INPUT`].

use super::check;
pub use super::graph_error::GraphError;
pub use super::op::{
    Activate, Activation, Add, AddAt, BatchNorm, Concat, Conv2d, ConvTranspose2d, Dropout, GroupNorm, InstanceNorm, Op,
    Pad, Padding, Upsample,
};
pub use super::tensor::{MAX_CHANNELS, MAX_EDGE, MAX_JOINED, MAX_KERNEL, MAX_PAD, MAX_SCALE, MAX_STRIDE, Shape};
use std::collections::{HashMap, HashSet};

/// Name of the tensor that the network is given.
pub const INPUT: &str = "input";
/// Operators in execution order between an input of known channels and one output tensor.
#[derive(Debug, Clone, PartialEq)]
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
        check::range(&mut errors, INPUT, "channels", self.input_channels, 1, MAX_CHANNELS);
        // `None`: written, but by an operator whose own input is unknown, so nothing follows from
        // it.
        let mut known: HashMap<&str, Option<u32>> = HashMap::from([(INPUT, Some(self.input_channels))]);
        let mut names = HashSet::new();
        for op in &self.ops {
            let name = op.name();
            if !names.insert(name) {
                errors.push(GraphError::DuplicateOperator { op: name.into() });
            }
            let size_as = match op {
                Op::UpsampleNearest(o) | Op::UpsampleBilinear(o) => o.size_as.as_deref(),
                _ => None,
            };
            for tensor in op.inputs().into_iter().chain(size_as) {
                if !known.contains_key(tensor) {
                    errors.push(GraphError::UnknownTensor { op: name.into(), tensor: tensor.into() });
                }
            }
            check::fields(op, &mut errors);
            let out = check::channels(op, |tensor| known.get(tensor).copied().flatten(), &mut errors);
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
            let shape = super::shape::infer(op, |tensor| known[tensor])?;
            known.insert(op.output(), shape);
            shapes.push(shape);
        }
        Ok(shapes)
    }

    /// The size, at least `width`×`height`, at which the network runs for a picture of that size:
    /// the next multiples of the smallest power of two for which all its tensors fit together and
    /// the output loses no pixels at its edges (a U-Net with eight halvings and concatenated skips
    /// wants multiples of 256; one that resamples to its skips' sizes takes any). The picture's
    /// last row and column are repeated, and the output is cropped to [`Graph::cropped`].
    ///
    /// # Errors
    /// What is wrong with the size itself when no larger one will do.
    pub fn inner_size(&self, width: u32, height: u32) -> Result<[u32; 2], GraphError> {
        let first = match self.output_edges([width, height]) {
            Ok(out) if self.keeps_edges([width, height], out) => return Ok([width, height]),
            other => other,
        };
        let multiples = (1..=10).map(|bits| 1u32 << bits);
        let sizes = multiples.map(|m| [width, height].map(|edge| edge.saturating_add(m - 1) / m * m));
        let fit = |size: &[u32; 2]| self.output_edges(*size).is_ok_and(|out| self.keeps_edges(*size, out));
        let better = sizes.filter(|s| *s != [width, height]).find(fit);
        // Without a better size one that fits at all will do.
        better.map_or_else(|| first.map(|_| [width, height]), Ok)
    }

    fn output_edges(&self, [width, height]: [u32; 2]) -> Result<[u32; 2], GraphError> {
        let shapes = self.shapes(width, height)?;
        let made = self.ops.iter().zip(shapes).find(|(op, _)| op.output() == self.output);
        Ok(made.map_or([width, height], |(_, shape)| [shape.width, shape.height]))
    }

    /// Whether `out` is as large as it should be for `size`. That is a linear function of the size
    /// for a network of convolutions and resamplings, and two sizes that most strides divide show
    /// which.
    fn keeps_edges(&self, size: [u32; 2], out: [u32; 2]) -> bool {
        const PROBE: i64 = 3072;
        let probe = |edge: i64| self.output_edges([edge as u32; 2]).map(|out| out.map(i64::from));
        let (Ok(one), Ok(two)) = (probe(PROBE), probe(2 * PROBE)) else { return true };
        (0..2).all(|i| {
            let slope = two[i] - one[i];
            i64::from(out[i]) >= (slope * (i64::from(size[i]) - PROBE)).div_euclid(PROBE) + one[i]
        })
    }

    /// Edge of the output that is kept of `output` pixels when `edge` of `inner` pixels of the
    /// input were the picture.
    pub fn cropped(output: u32, edge: u32, inner: u32) -> u32 {
        (u64::from(output) * u64::from(edge)).div_ceil(u64::from(inner.max(1))) as u32
    }

    /// Trained numbers in all.
    pub fn parameters(&self) -> u64 {
        self.ops.iter().map(Op::parameters).sum()
    }

    /// Floating-point operations for an input of `width`×`height`, counted as [`Op::flops`] says.
    pub fn flops(&self, width: u32, height: u32) -> Result<u64, GraphError> {
        let shapes = self.shapes(width, height)?;
        let mut known = HashMap::from([(INPUT, Shape { channels: self.input_channels, height, width })]);
        known.extend(self.ops.iter().map(Op::output).zip(shapes.iter().copied()));
        Ok(self.ops.iter().zip(&shapes).map(|(op, shape)| op.flops(known[op.inputs()[0]], *shape)).sum())
    }
}
