//! What follows from an operator's fields: how it is spelt and parsed, what it reads, its trained
//! tensors, its counts.

use super::graph::Shape;
use super::op::{Activation, Op};

/// Every operator, as the file spells it.
pub const KINDS: [&str; 12] = [
    "conv2d",
    "conv_transpose2d",
    "upsample_nearest",
    "upsample_bilinear",
    "pad",
    "concat",
    "add",
    "batch_norm",
    "instance_norm",
    "group_norm",
    "activation",
    "dropout",
];

impl Op {
    /// The operator `kind` from its fields (without `op`); `None` for a kind that is not in
    /// [`KINDS`].
    pub fn parse(kind: &str, fields: serde_json::Value) -> Option<serde_json::Result<Op>> {
        use serde_json::from_value as read;
        Some(match kind {
            "conv2d" => read(fields).map(Op::Conv2d),
            "conv_transpose2d" => read(fields).map(Op::ConvTranspose2d),
            "upsample_nearest" => read(fields).map(Op::UpsampleNearest),
            "upsample_bilinear" => read(fields).map(Op::UpsampleBilinear),
            "pad" => read(fields).map(Op::Pad),
            "concat" => read(fields).map(Op::Concat),
            "add" => read(fields).map(Op::Add),
            "batch_norm" => read(fields).map(Op::BatchNorm),
            "instance_norm" => read(fields).map(Op::InstanceNorm),
            "group_norm" => read(fields).map(Op::GroupNorm),
            "activation" => read(fields).map(Op::Activation),
            "dropout" => read(fields).map(Op::Dropout),
            _ => return None,
        })
    }

    /// The operator's kind, as the file spells it.
    pub fn kind(&self) -> &'static str {
        match self {
            Op::Conv2d(_) => "conv2d",
            Op::ConvTranspose2d(_) => "conv_transpose2d",
            Op::UpsampleNearest(_) => "upsample_nearest",
            Op::UpsampleBilinear(_) => "upsample_bilinear",
            Op::Pad(_) => "pad",
            Op::Concat(_) => "concat",
            Op::Add(_) => "add",
            Op::BatchNorm(_) => "batch_norm",
            Op::InstanceNorm(_) => "instance_norm",
            Op::GroupNorm(_) => "group_norm",
            Op::Activation(_) => "activation",
            Op::Dropout(_) => "dropout",
        }
    }

    /// Tensors whose values are read. (`size_as` is not among them: only its size matters.)
    pub fn inputs(&self) -> Vec<&str> {
        match self {
            Op::Conv2d(o) => std::iter::once(&o.input).chain(&o.add).map(String::as_str).collect(),
            Op::ConvTranspose2d(o) => vec![&o.input],
            Op::UpsampleNearest(o) | Op::UpsampleBilinear(o) => vec![&o.input],
            Op::Pad(o) => vec![&o.input],
            Op::Concat(o) => o.inputs.iter().map(String::as_str).collect(),
            Op::Add(o) => vec![&o.inputs[0], &o.inputs[1]],
            Op::BatchNorm(o) => vec![&o.input],
            Op::InstanceNorm(o) => vec![&o.input],
            Op::GroupNorm(o) => vec![&o.input],
            Op::Activation(o) => vec![&o.input],
            Op::Dropout(o) => vec![&o.input],
        }
    }

    /// Trained tensors: name and shape of each, as PyTorch has them. [`super::graph::Graph::check`]
    /// bounds the numbers, so ask it first; the operator's own group counts are not judged here.
    pub fn tensors(&self) -> Vec<(String, Vec<u64>)> {
        let named = |leaf: &str| format!("{}.{leaf}", self.name());
        let pair = |weight: Vec<u64>, bias: Option<u32>| {
            let bias = bias.map(|n| (named("bias"), vec![u64::from(n)]));
            std::iter::once((named("weight"), weight)).chain(bias).collect()
        };
        let affine = |channels: u32, affine: bool| -> Vec<(String, Vec<u64>)> {
            if affine { pair(vec![channels.into()], Some(channels)) } else { Vec::new() }
        };
        match self {
            Op::Conv2d(o) => {
                let shape = [o.out_channels, o.in_channels / o.groups.max(1), o.kernel[0], o.kernel[1]];
                pair(shape.map(u64::from).to_vec(), o.bias.then_some(o.out_channels))
            }
            Op::ConvTranspose2d(o) => {
                let shape = [o.in_channels, o.out_channels, o.kernel[0], o.kernel[1]];
                pair(shape.map(u64::from).to_vec(), o.bias.then_some(o.out_channels))
            }
            Op::BatchNorm(o) => {
                let mut all = affine(o.channels, o.affine);
                all.extend(["running_mean", "running_var"].map(|leaf| (named(leaf), vec![o.channels.into()])));
                all
            }
            Op::InstanceNorm(o) => affine(o.channels, o.affine),
            Op::GroupNorm(o) => affine(o.channels, o.affine),
            _ => Vec::new(),
        }
    }

    /// Trained numbers. Running means and variances of batch norm are not among them, as in
    /// PyTorch.
    pub fn parameters(&self) -> u64 {
        let trained = self.tensors().into_iter().filter(|(name, _)| !name.contains(".running_"));
        trained.map(|(_, shape)| shape.iter().product::<u64>()).sum()
    }

    /// Floating-point operations from `input` to `output`: two a multiply-add of a convolution
    /// (bias and activation not counted; of a transposed one, taps that are cut off count), eight a
    /// value of a bilinear resampling, two a value of a batch norm, eight of a norm that measures
    /// the picture, one a value of a sum or a function.
    pub fn flops(&self, input: Shape, output: Shape) -> u64 {
        let values = |s: Shape| s.pixels() * u64::from(s.channels);
        let taps = |kernel: [u32; 2]| u64::from(kernel[0]) * u64::from(kernel[1]);
        match self {
            Op::Conv2d(o) => {
                let depth = u64::from(o.in_channels / o.groups.max(1));
                2 * taps(o.kernel) * depth * values(output) + if o.add.is_some() { values(output) } else { 0 }
            }
            Op::ConvTranspose2d(o) => 2 * taps(o.kernel) * u64::from(o.out_channels) * values(input),
            Op::UpsampleBilinear(_) => 8 * values(output),
            Op::Add(_) => values(output),
            Op::Activation(o) => {
                if o.activation == Activation::None {
                    0
                } else {
                    values(output)
                }
            }
            Op::BatchNorm(_) => 2 * values(output),
            Op::InstanceNorm(_) | Op::GroupNorm(_) => 8 * values(output),
            Op::UpsampleNearest(_) | Op::Pad(_) | Op::Concat(_) | Op::Dropout(_) => 0,
        }
    }
}
