//! One operator judged by itself, whatever the picture's size: its numbers, and the channels of
//! what it reads.

use super::graph_error::GraphError;
use super::op::{Activation, Op};
use super::tensor::{MAX_CHANNELS, MAX_JOINED, MAX_KERNEL, MAX_PAD, MAX_SCALE, MAX_STRIDE};

/// Reports a whole number outside `min..=max`.
pub(super) fn range(errors: &mut Vec<GraphError>, op: &str, what: &'static str, value: u32, min: u32, max: u32) {
    if !(min..=max).contains(&value) {
        errors.push(GraphError::Range { op: op.into(), what, value, min, max });
    }
}

/// Reports every number of `op` that is outside what the operators support.
pub(super) fn fields(op: &Op, errors: &mut Vec<GraphError>) {
    let name = op.name();
    match op {
        Op::Conv2d(o) => {
            convolution(errors, name, [o.in_channels, o.out_channels], o.kernel, o.stride);
            for side in o.padding.sides() {
                range(errors, name, "padding", side, 0, MAX_KERNEL - 1);
            }
            range(errors, name, "groups", o.groups, 1, MAX_CHANNELS);
            divide(errors, name, "in_channels", o.in_channels, o.groups);
            divide(errors, name, "out_channels", o.out_channels, o.groups);
            activation(errors, name, o.activation);
        }
        Op::ConvTranspose2d(o) => {
            convolution(errors, name, [o.in_channels, o.out_channels], o.kernel, o.stride);
            range(errors, name, "padding", o.padding, 0, MAX_KERNEL - 1);
            range(errors, name, "output_padding", o.output_padding, 0, o.stride.max(1) - 1);
            activation(errors, name, o.activation);
        }
        Op::UpsampleNearest(o) | Op::UpsampleBilinear(o) => {
            if o.size_as.is_some() == o.scale.is_some() {
                errors.push(GraphError::SizeOrScale { op: name.into() });
            }
            range(errors, name, "scale", o.scale.unwrap_or(1), 1, MAX_SCALE);
        }
        Op::Pad(o) => {
            for side in o.padding.sides() {
                range(errors, name, "padding", side, 0, MAX_PAD);
            }
        }
        Op::Concat(o) => {
            let count = u32::try_from(o.inputs.len()).unwrap_or(u32::MAX);
            range(errors, name, "number of inputs", count, 1, MAX_JOINED);
        }
        Op::Add(o) => activation(errors, name, o.activation),
        Op::BatchNorm(o) => {
            range(errors, name, "channels", o.channels, 1, MAX_CHANNELS);
            epsilon(errors, name, o.eps);
            activation(errors, name, o.activation);
        }
        Op::InstanceNorm(o) => {
            range(errors, name, "channels", o.channels, 1, MAX_CHANNELS);
            epsilon(errors, name, o.eps);
            activation(errors, name, o.activation);
        }
        Op::GroupNorm(o) => {
            range(errors, name, "channels", o.channels, 1, MAX_CHANNELS);
            range(errors, name, "groups", o.groups, 1, MAX_CHANNELS);
            divide(errors, name, "channels", o.channels, o.groups);
            epsilon(errors, name, o.eps);
            activation(errors, name, o.activation);
        }
        Op::Activation(o) => activation(errors, name, o.activation),
        Op::Dropout(o) => number(errors, name, "p", o.p, (0.0..1.0).contains(&o.p), "0 or more, less than 1"),
    }
}

/// Channels of what `op` writes, if they follow from what is known; reports inputs with other
/// channels than declared.
pub(super) fn channels(op: &Op, of: impl Fn(&str) -> Option<u32>, errors: &mut Vec<GraphError>) -> Option<u32> {
    let name = op.name();
    let mut want = |tensor: &str, wanted: Option<u32>| {
        if let (Some(found), Some(wanted)) = (of(tensor), wanted)
            && found != wanted
        {
            errors.push(GraphError::Channels { op: name.into(), tensor: tensor.into(), found, wanted });
        }
    };
    let out = match op {
        Op::Conv2d(o) => {
            want(&o.input, Some(o.in_channels));
            if let Some(add) = &o.add {
                want(add, Some(o.out_channels));
            }
            Some(o.out_channels)
        }
        Op::ConvTranspose2d(o) => {
            want(&o.input, Some(o.in_channels));
            Some(o.out_channels)
        }
        Op::UpsampleNearest(o) | Op::UpsampleBilinear(o) => of(&o.input),
        Op::Pad(o) => of(&o.input),
        Op::Concat(o) => o.inputs.iter().try_fold(0u32, |sum, t| Some(sum.saturating_add(of(t)?))),
        Op::Add(o) => {
            want(&o.inputs[1], of(&o.inputs[0]));
            of(&o.inputs[0])
        }
        Op::BatchNorm(o) => {
            want(&o.input, Some(o.channels));
            Some(o.channels)
        }
        Op::InstanceNorm(o) => {
            want(&o.input, Some(o.channels));
            Some(o.channels)
        }
        Op::GroupNorm(o) => {
            want(&o.input, Some(o.channels));
            Some(o.channels)
        }
        Op::Activation(o) => of(&o.input),
        Op::Dropout(o) => of(&o.input),
    };
    // The others' are judged as fields or are an input's.
    if let (Op::Concat(_), Some(n)) = (op, out) {
        range(errors, name, "channels", n, 1, MAX_CHANNELS);
    }
    out
}

fn convolution(errors: &mut Vec<GraphError>, op: &str, channels: [u32; 2], kernel: [u32; 2], stride: u32) {
    range(errors, op, "in_channels", channels[0], 1, MAX_CHANNELS);
    range(errors, op, "out_channels", channels[1], 1, MAX_CHANNELS);
    range(errors, op, "kernel height", kernel[0], 1, MAX_KERNEL);
    range(errors, op, "kernel width", kernel[1], 1, MAX_KERNEL);
    range(errors, op, "stride", stride, 1, MAX_STRIDE);
}

fn divide(errors: &mut Vec<GraphError>, op: &str, what: &'static str, value: u32, by: u32) {
    if by != 0 && !value.is_multiple_of(by) {
        errors.push(GraphError::Divide { op: op.into(), what, value, by });
    }
}

fn number(errors: &mut Vec<GraphError>, op: &str, what: &'static str, value: f32, sound: bool, allowed: &'static str) {
    if !sound {
        errors.push(GraphError::Number { op: op.into(), what, value: value.to_string(), allowed });
    }
}

fn epsilon(errors: &mut Vec<GraphError>, op: &str, eps: f32) {
    number(errors, op, "eps", eps, eps > 0.0 && eps <= 1.0, "more than 0, at most 1");
}

fn activation(errors: &mut Vec<GraphError>, op: &str, activation: Activation) {
    if let Activation::LeakyRelu(slope) = activation {
        number(errors, op, "slope", slope, slope.abs() <= 1000.0, "−1000 to 1000");
    }
}
