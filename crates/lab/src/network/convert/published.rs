//! The two published generators as graphs. Operators carry the module names of the published code.
//!
//! - `pix2pix`: "Global Illumination using Pix2Pix GAN"
//!   (github.com/Jaredrhd/Global-Illumination-using-Pix2Pix-GAN, `Network.py`).
//! - `deep-illumination`: Thomas and Forbes 2018 (github.com/CreativeCodingLab/DeepIllumination,
//!   `model.py`). Differs in four ways: convolutions have biases, skips pass a second ReLU after
//!   they are joined, dropout is in the first three up steps only, and the last layer is
//!   transposed. Its layers of equal width share one batch norm; here each has its own copy.

use super::{Arch, Norm};
use bouncelight::net::graph::{
    Activate, Activation, AddAt, BatchNorm, Concat, Conv2d, ConvTranspose2d, Dropout, Graph, GroupNorm, INPUT,
    InstanceNorm, Op, Pad, Padding, Upsample,
};

/// Channels of four RGB pictures.
pub const INPUTS: u32 = 12;
/// Channels of the picture that comes out.
pub const OUTPUTS: u32 = 3;
const LEAKY: Activation = Activation::LeakyRelu(0.2);
const EPS: f32 = 1e-5;

/// Channels after down step `step` (1 to 8) in multiples of the base width.
pub fn multiple(step: u32) -> u32 {
    1 << (step - 1).min(3)
}

/// Channels after up step `step` (1 to 7) in multiples of the base width.
pub fn up_multiple(step: u32) -> u32 {
    multiple(8 - step)
}

/// A generator of base width `width`. `affine` matters for instance norm only.
pub fn graph(arch: Arch, norm: Norm, width: u32, affine: bool) -> Graph {
    let mut b = Builder { ops: Vec::new(), norm, affine };
    match arch {
        Arch::Pix2pix => b.pix2pix(width),
        Arch::DeepIllumination => b.deep_illumination(width),
    }
    Graph { input_channels: INPUTS, ops: b.ops, output: "y".into() }
}

struct Builder {
    ops: Vec<Op>,
    norm: Norm,
    affine: bool,
}

impl Builder {
    fn pix2pix(&mut self, width: u32) {
        let (mut from, mut channels) = (INPUT.to_string(), INPUTS);
        for i in 1..=8 {
            let (module, out) = (format!("down{i}.model"), width.saturating_mul(multiple(i)));
            let dropped = i >= 4;
            let last = format!("d{i}");
            let normed = if dropped { format!("{module}.normed") } else { last.clone() };
            if i == 1 || i == 8 {
                self.ops.push(conv(&format!("{module}.0"), &from, &normed, [channels, out], 2, false, LEAKY));
            } else {
                let raw = format!("{module}.conv");
                self.ops.push(conv(&format!("{module}.0"), &from, &raw, [channels, out], 2, false, Activation::None));
                self.norm(&format!("{module}.1"), &raw, &normed, out, LEAKY);
            }
            if dropped {
                self.dropout(&format!("{module}.{}", if i == 8 { 2 } else { 3 }), &normed, &last);
            }
            (from, channels) = (last, out);
        }
        for i in 1..=7 {
            let (module, out) = (format!("up{i}.model"), width.saturating_mul(up_multiple(i)));
            let [raw, normed, own] = ["conv", "normed", "dropped"].map(|t| format!("{module}.{t}"));
            self.transposed(&format!("{module}.0"), &from, &raw, [channels, out], false, Activation::None);
            self.norm(&format!("{module}.1"), &raw, &normed, out, Activation::Relu);
            let own = if i <= 4 {
                self.dropout(&format!("{module}.3"), &normed, &own);
                own
            } else {
                normed
            };
            let joined = format!("u{i}");
            self.concat(&format!("up{i}.cat"), [own, format!("d{}", 8 - i)], &joined);
            (from, channels) = (joined, out.saturating_mul(2));
        }
        let [up, pad] = ["final.up", "final.pad"].map(String::from);
        let (name, output) = ("final.0".into(), up.clone());
        self.ops.push(Op::UpsampleNearest(Upsample { name, input: from, size_as: None, scale: Some(2), output }));
        let padding = Padding { left: 1, top: 1, right: 0, bottom: 0 };
        self.ops.push(Op::Pad(Pad { name: "final.1".into(), input: up, padding, output: pad.clone() }));
        self.ops.push(conv("final.2", &pad, "y", [channels, OUTPUTS], 1, true, Activation::Tanh));
    }

    fn deep_illumination(&mut self, width: u32) {
        let (mut from, mut channels) = (INPUT.to_string(), INPUTS);
        for i in 1..=8 {
            let (name, out) = (format!("conv{i}"), width.saturating_mul(multiple(i)));
            // The published code's leaky ReLU works in place, so skips carry its result; ReLU after
            // it is ReLU alone.
            let last = format!("encoder{i}");
            match i {
                1 => self.ops.push(conv(&name, &from, &last, [channels, out], 2, true, LEAKY)),
                8 => self.ops.push(conv(&name, &from, &last, [channels, out], 2, true, Activation::Relu)),
                _ => {
                    let raw = format!("{name}.conv");
                    self.ops.push(conv(&name, &from, &raw, [channels, out], 2, true, Activation::None));
                    self.norm(&format!("{name}.batch_norm"), &raw, &last, out, LEAKY);
                }
            }
            (from, channels) = (last, out);
        }
        for i in 1..=7 {
            let (name, out) = (format!("deconv{i}"), width.saturating_mul(up_multiple(i)));
            let [raw, normed, own, joined] = ["conv", "normed", "dropped", "joined"].map(|t| format!("{name}.{t}"));
            self.transposed(&name, &from, &raw, [channels, out], true, Activation::None);
            self.norm(&format!("{name}.batch_norm"), &raw, &normed, out, Activation::None);
            let own = if i <= 3 {
                self.dropout(&format!("{name}.dropout"), &normed, &own);
                own
            } else {
                normed
            };
            self.concat(&format!("{name}.cat"), [own, format!("encoder{}", 8 - i)], &joined);
            let output = format!("decoder{i}");
            let (activation, name) = (Activation::Relu, format!("{name}.relu"));
            self.ops.push(Op::Activation(Activate { name, input: joined, activation, output: output.clone() }));
            (from, channels) = (output, out.saturating_mul(2));
        }
        self.transposed("deconv8", &from, "y", [channels, OUTPUTS], true, Activation::Tanh);
    }

    fn transposed(&mut self, name: &str, from: &str, to: &str, channels: [u32; 2], bias: bool, activation: Activation) {
        self.ops.push(Op::ConvTranspose2d(ConvTranspose2d {
            name: name.into(),
            input: from.into(),
            in_channels: channels[0],
            out_channels: channels[1],
            kernel: [4, 4],
            stride: 2,
            padding: 1,
            output_padding: 0,
            bias,
            activation,
            output: to.into(),
        }));
    }

    fn norm(&mut self, name: &str, from: &str, to: &str, channels: u32, activation: Activation) {
        let (name, input, output, eps) = (name.into(), from.into(), to.into(), EPS);
        self.ops.push(match self.norm {
            Norm::Group => {
                Op::GroupNorm(GroupNorm { name, input, channels, groups: 2, eps, affine: true, activation, output })
            }
            Norm::Instance => {
                let affine = self.affine;
                Op::InstanceNorm(InstanceNorm { name, input, channels, eps, affine, activation, output })
            }
            Norm::Batch => Op::BatchNorm(BatchNorm { name, input, channels, eps, affine: true, activation, output }),
        });
    }

    fn dropout(&mut self, name: &str, from: &str, to: &str) {
        self.ops.push(Op::Dropout(Dropout { name: name.into(), input: from.into(), p: 0.5, output: to.into() }));
    }

    fn concat(&mut self, name: &str, inputs: [String; 2], to: &str) {
        self.ops.push(Op::Concat(Concat { name: name.into(), inputs: inputs.into(), output: to.into() }));
    }
}

fn conv(
    name: &str,
    input: &str,
    output: &str,
    [in_channels, out_channels]: [u32; 2],
    stride: u32,
    bias: bool,
    activation: Activation,
) -> Op {
    Op::Conv2d(Conv2d {
        name: name.into(),
        input: input.into(),
        in_channels,
        out_channels,
        kernel: [4, 4],
        stride,
        padding: Padding::all(1),
        groups: 1,
        bias,
        activation,
        add: None,
        add_at: AddAt::default(),
        output: output.into(),
    })
}
