//! The operators a network is made of, as the weights file spells them, with their parameter and FLOP counts.

use super::graph::Shape;

/// Function applied to each value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// x
    #[default]
    None,
    /// max(x, 0)
    Relu,
}

impl Activation {
    /// The function itself.
    pub fn apply(self, x: f32) -> f32 {
        match self {
            Activation::None => x,
            Activation::Relu => x.max(0.0),
        }
    }
}

/// Where a skip tensor joins relative to the activation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AddAt {
    /// activation(x + skip), as in a residual block.
    #[default]
    BeforeActivation,
    /// activation(x) + skip.
    AfterActivation,
}

/// Cross-correlation with zero padding, then bias, then optional skip and activation.
#[derive(Debug, Clone, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conv2d {
    /// Module name; its tensors are `NAME.weight` [O, I, kh, kw] and `NAME.bias` (O values).
    pub name: String,
    /// Tensor read.
    pub input: String,
    /// Tensor written.
    pub output: String,
    /// Channels read.
    pub in_channels: u32,
    /// Channels written.
    pub out_channels: u32,
    /// Kernel height and width.
    pub kernel: [u32; 2],
    /// Step in both directions.
    #[serde(default = "one")]
    pub stride: u32,
    /// Zeros around the picture on all four sides.
    #[serde(default)]
    pub padding: u32,
    /// Activation.
    #[serde(default)]
    pub activation: Activation,
    /// Skip tensor of the output's shape.
    #[serde(default)]
    pub add: Option<String>,
    /// Where the skip joins.
    #[serde(default)]
    pub add_at: AddAt,
}

fn one() -> u32 {
    1
}

/// Bilinear resampling to another tensor's size (`align_corners=False`, edges clamped).
#[derive(Debug, Clone, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UpsampleBilinear {
    /// Operator's name, for labels.
    pub name: String,
    /// Tensor read.
    pub input: String,
    /// Tensor whose width and height the output takes.
    pub size_as: String,
    /// Tensor written.
    pub output: String,
}

/// Sum of two tensors of one shape, then an activation.
#[derive(Debug, Clone, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Add {
    /// Operator's name, for labels.
    pub name: String,
    /// The two summands.
    pub inputs: [String; 2],
    /// Tensor written.
    pub output: String,
    /// Activation of the sum.
    #[serde(default)]
    pub activation: Activation,
}

/// One operator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Op {
    /// `conv2d`
    Conv2d(Conv2d),
    /// `upsample_bilinear`
    UpsampleBilinear(UpsampleBilinear),
    /// `add`
    Add(Add),
}

impl Op {
    /// Operator's name.
    pub fn name(&self) -> &str {
        match self {
            Op::Conv2d(o) => &o.name,
            Op::UpsampleBilinear(o) => &o.name,
            Op::Add(o) => &o.name,
        }
    }

    /// The operator's kind, as the file spells it.
    pub fn kind(&self) -> &'static str {
        match self {
            Op::Conv2d(_) => "conv2d",
            Op::UpsampleBilinear(_) => "upsample_bilinear",
            Op::Add(_) => "add",
        }
    }

    /// Tensor written.
    pub fn output(&self) -> &str {
        match self {
            Op::Conv2d(o) => &o.output,
            Op::UpsampleBilinear(o) => &o.output,
            Op::Add(o) => &o.output,
        }
    }

    /// Tensors whose values are read.
    pub fn inputs(&self) -> Vec<&str> {
        match self {
            Op::Conv2d(o) => std::iter::once(&o.input).chain(&o.add).map(String::as_str).collect(),
            Op::UpsampleBilinear(o) => vec![&o.input],
            Op::Add(o) => vec![&o.inputs[0], &o.inputs[1]],
        }
    }

    /// Trained numbers: weights and biases.
    pub fn parameters(&self) -> u64 {
        match self {
            Op::Conv2d(o) => {
                let taps = u64::from(o.kernel[0]) * u64::from(o.kernel[1]);
                u64::from(o.out_channels) * (u64::from(o.in_channels) * taps + 1)
            }
            _ => 0,
        }
    }

    /// Floating-point operations for an output of `shape`: two a multiply-add of a convolution (bias and activation
    /// not counted), eight a value of a bilinear resampling, one a value of a sum.
    pub fn flops(&self, shape: Shape) -> u64 {
        let values = shape.pixels() * u64::from(shape.channels);
        match self {
            Op::Conv2d(o) => {
                let taps = u64::from(o.kernel[0]) * u64::from(o.kernel[1]) * u64::from(o.in_channels);
                2 * taps * values + if o.add.is_some() { values } else { 0 }
            }
            Op::UpsampleBilinear(_) => 8 * values,
            Op::Add(_) => values,
        }
    }
}
