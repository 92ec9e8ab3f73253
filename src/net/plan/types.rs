//! What a plan consists of.

use crate::net::graph::{Activation, AddAt, Padding, Shape};

/// How numbers lie on the GPU. Arithmetic is f32 in both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Precision {
    /// 32 bits.
    #[default]
    F32,
    /// Weights and the tensors between the operators in 16 bits; output, the norms' statistics and,
    /// unless it is packed, the input in 32.
    F16,
}

/// How to plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Storage.
    pub precision: Precision,
    /// The caller writes the input in that precision, too.
    pub packed_input: bool,
    /// Dropout is on.
    pub dropout: bool,
    /// Operators are fused and concatenations are slices of one tensor. Off for tests that compare.
    pub fuse: bool,
    /// Largest arena in bytes: the device's limit of one storage binding.
    pub limit: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            precision: Precision::default(),
            packed_input: false,
            dropout: false,
            fuse: true,
            limit: super::MAX_ARENA,
        }
    }
}

/// A tensor's place and life. Step `i` happens at time `i + 1`; the input exists from time 0, the
/// output to the end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tensor {
    /// Name in the graph, or `OPERATOR.moments` and the like for what steps need between them.
    pub name: String,
    /// Shape; in memory NHWC with channels padded to a multiple of four.
    pub shape: Shape,
    /// f32 whatever the plan's precision.
    pub full: bool,
    /// Byte offset of its first value in the arena.
    pub offset: u64,
    /// Distance of pixels in vectors: more than its own when the tensor is a slice of a
    /// concatenation.
    pub pitch: u32,
    /// Index of the tensor whose memory it shares, or its own.
    pub root: usize,
    /// Vector of the root's pixels where it begins.
    pub slice: u32,
    /// Time of writing.
    pub first: usize,
    /// Time of the last reading.
    pub last: usize,
}

impl Tensor {
    /// Bytes of four channels of a pixel.
    pub fn vector_bytes(&self) -> u64 {
        if self.full { 16 } else { 8 }
    }

    /// Bytes of its values, padding channels included.
    pub fn bytes(&self) -> u64 {
        self.shape.pixels() * u64::from(self.shape.vectors()) * self.vector_bytes()
    }
}

/// What a step computes before its epilogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Convolution with bias.
    Conv {
        /// Kernel height and width.
        kernel: [u32; 2],
        /// Stride.
        stride: u32,
        /// Zeros around.
        padding: Padding,
        /// Factor by which the input is enlarged first (nearest), 1 for none.
        nearest: u32,
        /// Groups of channels that do not see each other.
        groups: u32,
    },
    /// Transposed convolution with bias.
    Transposed {
        /// Kernel height and width.
        kernel: [u32; 2],
        /// Stride.
        stride: u32,
        /// Rows and columns cut off on all sides.
        padding: u32,
    },
    /// Bilinear resampling.
    Upsample,
    /// Nearest resampling.
    Nearest,
    /// A copy with offsets; no epilogue. Output pixel (x, y) is input pixel (x − left, y − top);
    /// beyond the edges zero, or the nearest pixel if `clamp`. Channels go to `channel` and after,
    /// what lies before stays.
    Window {
        /// Columns to the right.
        left: u32,
        /// Rows down.
        top: u32,
        /// Repeats the edge.
        clamp: bool,
        /// First output channel.
        channel: u32,
    },
    /// The input itself.
    Copy,
    /// Number, mean and sum of squared deviations of each channel's values in tiles of [`TILE`]
    /// pixels; no epilogue.
    Moments,
    /// From those to scale and shift of each channel; no epilogue.
    Merge {
        /// Groups of channels with common statistics.
        groups: u32,
        /// Added to the variance.
        eps: f32,
    },
    /// Scale and shift of each channel, from the step before or, for a batch norm, from the
    /// weights.
    Scale {
        /// From the weights.
        fixed: bool,
    },
}

/// Pixels of a tile of [`Kind::Moments`].
pub const TILE: u32 = 256;

/// One dispatch: `kind`, then the skip and the activation in the order of `add_at`, then dropout.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Name of the operator that does the work; the label is `net.NAME`.
    pub name: String,
    /// Its position in the graph; `None` for fitting the picture to the network.
    pub op: Option<usize>,
    /// What is computed.
    pub kind: Kind,
    /// Index of the tensor read.
    pub input: usize,
    /// Index of the tensor with scale and shift, or with the moments' picture.
    pub second: Option<usize>,
    /// Index of the tensor added.
    pub skip: Option<usize>,
    /// Where it joins.
    pub add_at: AddAt,
    /// Activation.
    pub activation: Activation,
    /// Position of the dropout operator in the graph and its probability.
    pub dropout: Option<(usize, f32)>,
    /// Position of the batch norm that is folded into the weights.
    pub fold: Option<usize>,
    /// Index of the tensor written.
    pub output: usize,
    /// Index of the tensor into which a convolution writes the moments of its output: for as many
    /// tiles as it takes workgroups, which depends on the kernel; the tensor has room for the most.
    pub moments: Option<usize>,
    /// Floating-point operations, those of fused operators included.
    pub flops: u64,
    /// Bytes moved at least once: input, skip, weights and output.
    pub traffic: u64,
    /// Trained numbers.
    pub parameters: u64,
}

impl Step {
    /// Indices of all tensors read.
    pub fn reads(&self) -> impl Iterator<Item = usize> {
        [Some(self.input), self.second, self.skip].into_iter().flatten()
    }
}

/// One line of `weights info`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Operator's name.
    pub name: String,
    /// `conv 3×3 /2`, `upsample + skip` …
    pub kind: String,
    /// Shape of the result.
    pub shape: Shape,
    /// Trained numbers.
    pub parameters: u64,
    /// Floating-point operations.
    pub flops: u64,
    /// Bytes moved.
    pub traffic: u64,
    /// Bytes of the result.
    pub bytes: u64,
    /// Its byte offset in the arena.
    pub offset: u64,
}

impl Row {
    /// The line for a step that writes `tensor`.
    pub(super) fn new(step: &Step, tensor: &Tensor) -> Self {
        let mut kind = match step.kind {
            Kind::Conv { kernel: [h, w], stride, nearest, .. } => {
                let before = if nearest > 1 { format!("nearest ×{nearest}, ") } else { String::new() };
                let after = if stride > 1 { format!(" /{stride}") } else { String::new() };
                format!("{before}conv {h}×{w}{after}")
            }
            Kind::Transposed { kernel: [h, w], stride, .. } => format!("transposed {h}×{w} ×{stride}"),
            Kind::Upsample => "upsample".into(),
            Kind::Nearest => "nearest".into(),
            Kind::Window { .. } => "copy".into(),
            Kind::Copy if step.skip.is_some() => "add".into(),
            Kind::Copy => "pass".into(),
            Kind::Moments => "moments".into(),
            Kind::Merge { .. } => "statistics".into(),
            Kind::Scale { .. } => "norm".into(),
        };
        if step.fold.is_some() {
            kind.push_str(" + norm");
        }
        if step.skip.is_some() && step.kind != Kind::Copy {
            kind.push_str(" + skip");
        }
        if step.activation != Activation::None {
            kind.push_str(&format!(", {}", step.activation.name()));
        }
        if step.dropout.is_some() {
            kind.push_str(", dropout");
        }
        if step.moments.is_some() {
            kind.push_str(" + moments");
        }
        let (shape, offset, bytes) = (tensor.shape, tensor.offset, tensor.bytes());
        let Step { name, parameters, flops, traffic, .. } = step.clone();
        Row { name, kind, shape, parameters, flops, traffic, bytes, offset }
    }
}
