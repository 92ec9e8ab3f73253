//! The operators a network is made of, with their fields as the weights file spells them. What
//! follows from the fields (tensors, counts) is in [`super::op_facts`], what the sizes are in
//! [`super::graph`].

pub use super::activation::Activation;
use serde::{Deserialize, Serialize};

/// Where a skip tensor joins relative to the activation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AddAt {
    /// activation(x + skip), as in a residual block.
    #[default]
    BeforeActivation,
    /// activation(x) + skip.
    AfterActivation,
}

/// Zeros around a picture. In the file one number for all four sides, or
/// `[left, top, right, bottom]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(from = "Sides", into = "Sides")]
pub struct Padding {
    /// Columns at the left.
    pub left: u32,
    /// Rows at the top.
    pub top: u32,
    /// Columns at the right.
    pub right: u32,
    /// Rows at the bottom.
    pub bottom: u32,
}

impl Padding {
    /// The same on all four sides.
    pub const fn all(n: u32) -> Self {
        Self { left: n, top: n, right: n, bottom: n }
    }

    /// Left, top, right, bottom.
    pub const fn sides(self) -> [u32; 4] {
        [self.left, self.top, self.right, self.bottom]
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "a number or [left, top, right, bottom]")]
enum Sides {
    All(u32),
    Each([u32; 4]),
}

impl From<Sides> for Padding {
    fn from(sides: Sides) -> Self {
        match sides {
            Sides::All(n) => Self::all(n),
            Sides::Each([left, top, right, bottom]) => Self { left, top, right, bottom },
        }
    }
}

impl From<Padding> for Sides {
    fn from(p: Padding) -> Self {
        if p == Padding::all(p.left) { Sides::All(p.left) } else { Sides::Each(p.sides()) }
    }
}

/// Defines operators: every struct has `name`, for labels and tensors, and `output`, the tensor
/// written.
macro_rules! operators {
    ($($(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $type:ty),* $(,)? })*) => { $(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// Operator's name (PyTorch's module name where it has trained numbers): label, and
            /// prefix of its tensors.
            pub name: String,
            $($(#[$field_doc])* pub $field: $type,)*
            /// Tensor written.
            pub output: String,
        }
    )* };
}

operators! {
    /// Cross-correlation with zero padding, then bias, then optional skip and activation. Tensors:
    /// `NAME.weight` [out, in / groups, kh, kw] and, unless `bias` is false, `NAME.bias` (out
    /// values).
    Conv2d {
        /// Tensor read.
        input: String,
        /// Channels read.
        in_channels: u32,
        /// Channels written.
        out_channels: u32,
        /// Kernel height and width.
        kernel: [u32; 2],
        /// Step in both directions.
        #[serde(default = "one")]
        stride: u32,
        /// Zeros around the picture.
        #[serde(default)]
        padding: Padding,
        /// Input and output channels are cut into this many groups that do not see each other.
        #[serde(default = "one")]
        groups: u32,
        /// There is a bias.
        #[serde(default = "yes")]
        bias: bool,
        /// Activation.
        #[serde(default)]
        activation: Activation,
        /// Skip tensor of the output's shape.
        #[serde(default)]
        add: Option<String>,
        /// Where the skip joins.
        #[serde(default)]
        add_at: AddAt,
    }

    /// Transposed convolution as PyTorch's `ConvTranspose2d`: edge (n − 1) · stride − 2 · padding +
    /// kernel + output_padding. Tensors: `NAME.weight` [in, out, kh, kw] and, unless `bias` is
    /// false, `NAME.bias` (out values).
    ConvTranspose2d {
        /// Tensor read.
        input: String,
        /// Channels read.
        in_channels: u32,
        /// Channels written.
        out_channels: u32,
        /// Kernel height and width.
        kernel: [u32; 2],
        /// Step of the output per input pixel, both directions.
        #[serde(default = "one")]
        stride: u32,
        /// Rows and columns cut off on all four sides.
        #[serde(default)]
        padding: u32,
        /// Rows and columns added at the bottom and at the right.
        #[serde(default)]
        output_padding: u32,
        /// There is a bias.
        #[serde(default = "yes")]
        bias: bool,
        /// Activation.
        #[serde(default)]
        activation: Activation,
    }

    /// Resampling: to another tensor's size (`size_as`), or by a whole factor (`scale`); exactly
    /// one of the two. `upsample_nearest` takes source pixel ⌊x · in / out⌋, `upsample_bilinear`
    /// has half-pixel centres and clamped edges (`align_corners=False`).
    Upsample {
        /// Tensor read.
        input: String,
        /// Tensor whose width and height the output takes.
        #[serde(default)]
        size_as: Option<String>,
        /// Whole factor by which the output is larger.
        #[serde(default)]
        scale: Option<u32>,
    }

    /// Zeros around a picture.
    Pad {
        /// Tensor read.
        input: String,
        /// How many.
        padding: Padding,
    }

    /// The channels of two or more tensors of one size, one after the other.
    Concat {
        /// Tensors read.
        inputs: Vec<String>,
    }

    /// Sum of two tensors of one shape, then an activation.
    Add {
        /// The two summands.
        inputs: [String; 2],
        /// Activation of the sum.
        #[serde(default)]
        activation: Activation,
    }

    /// Batch norm at inference: (x − running_mean) / √(running_var + eps) · weight + bias for each
    /// channel. Tensors: `NAME.running_mean`, `NAME.running_var` and, if `affine`, `NAME.weight`,
    /// `NAME.bias`.
    BatchNorm {
        /// Tensor read.
        input: String,
        /// Its channels.
        channels: u32,
        /// Added to the variance.
        #[serde(default = "epsilon")]
        eps: f32,
        /// There are weight and bias.
        #[serde(default = "yes")]
        affine: bool,
        /// Activation.
        #[serde(default)]
        activation: Activation,
    }

    /// As batch norm, with mean and (biased) variance of this picture's channel. Tensors, if
    /// `affine`: `NAME.weight`, `NAME.bias`.
    InstanceNorm {
        /// Tensor read.
        input: String,
        /// Its channels.
        channels: u32,
        /// Added to the variance.
        #[serde(default = "epsilon")]
        eps: f32,
        /// There are weight and bias; not by default, as in PyTorch.
        #[serde(default)]
        affine: bool,
        /// Activation.
        #[serde(default)]
        activation: Activation,
    }

    /// As instance norm, with mean and variance of all values of a group of channels.
    GroupNorm {
        /// Tensor read.
        input: String,
        /// Its channels.
        channels: u32,
        /// Groups, a divisor of the channels.
        groups: u32,
        /// Added to the variance.
        #[serde(default = "epsilon")]
        eps: f32,
        /// There are weight and bias.
        #[serde(default = "yes")]
        affine: bool,
        /// Activation.
        #[serde(default)]
        activation: Activation,
    }

    /// A function of each value.
    Activate {
        /// Tensor read.
        input: String,
        /// The function.
        activation: Activation,
    }

    /// Dropout. The identity unless the run is given a seed; then a value becomes 0 with
    /// probability `p` and is divided by 1 − p otherwise, as in PyTorch's training mode. See
    /// [`super::dropout`] for the random numbers.
    Dropout {
        /// Tensor read.
        input: String,
        /// Probability of 0.
        p: f32,
    }
}

fn one() -> u32 {
    1
}

fn yes() -> bool {
    true
}

/// PyTorch's default.
fn epsilon() -> f32 {
    1e-5
}

/// One operator.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "op", rename_all = "snake_case")]
pub enum Op {
    /// `conv2d`
    #[serde(rename = "conv2d")]
    Conv2d(Conv2d),
    /// `conv_transpose2d`
    #[serde(rename = "conv_transpose2d")]
    ConvTranspose2d(ConvTranspose2d),
    /// `upsample_nearest`
    UpsampleNearest(Upsample),
    /// `upsample_bilinear`
    UpsampleBilinear(Upsample),
    /// `pad`
    Pad(Pad),
    /// `concat`
    Concat(Concat),
    /// `add`
    Add(Add),
    /// `batch_norm`
    BatchNorm(BatchNorm),
    /// `instance_norm`
    InstanceNorm(InstanceNorm),
    /// `group_norm`
    GroupNorm(GroupNorm),
    /// `activation`
    Activation(Activate),
    /// `dropout`
    Dropout(Dropout),
}

/// Does the same with whatever operator it is.
macro_rules! each {
    ($op:expr, $o:ident => $body:expr) => {
        match $op {
            Op::Conv2d($o) => $body,
            Op::ConvTranspose2d($o) => $body,
            Op::UpsampleNearest($o) | Op::UpsampleBilinear($o) => $body,
            Op::Pad($o) => $body,
            Op::Concat($o) => $body,
            Op::Add($o) => $body,
            Op::BatchNorm($o) => $body,
            Op::InstanceNorm($o) => $body,
            Op::GroupNorm($o) => $body,
            Op::Activation($o) => $body,
            Op::Dropout($o) => $body,
        }
    };
}

impl Op {
    /// Operator's name.
    pub fn name(&self) -> &str {
        each!(self, o => &o.name)
    }

    /// Tensor written.
    pub fn output(&self) -> &str {
        each!(self, o => &o.output)
    }
}
