//! The shape that an operator gives, once every tensor that it reads has one.

use super::graph_error::GraphError;
use super::op::{Op, Upsample};
use super::tensor::{MAX_EDGE, Shape};

/// Shape of `op`'s output; `of` knows the shapes of its inputs. The graph has passed
/// [`super::graph::Graph::check`].
pub(super) fn infer(op: &Op, of: impl Fn(&str) -> Shape) -> Result<Shape, GraphError> {
    let name = op.name();
    let shape = match op {
        Op::Conv2d(o) => {
            let input = of(&o.input);
            let [left, top, right, bottom] = o.padding.sides();
            let shape = Shape {
                channels: o.out_channels,
                height: conv_edge(name, input.height + top + bottom, o.kernel[0], o.stride)?,
                width: conv_edge(name, input.width + left + right, o.kernel[1], o.stride)?,
            };
            if let Some(add) = &o.add {
                same(name, shape, of(add))?;
            }
            shape
        }
        Op::ConvTranspose2d(o) => {
            let input = of(&o.input);
            let edge = |n: u32, kernel: u32| {
                let size = (n - 1) * o.stride + kernel + o.output_padding;
                let too_small = GraphError::TooSmall { op: name.into(), kernel: 2 * o.padding + 1, size };
                size.checked_sub(2 * o.padding).filter(|n| *n > 0).ok_or(too_small)
            };
            Shape {
                channels: o.out_channels,
                height: edge(input.height, o.kernel[0])?,
                width: edge(input.width, o.kernel[1])?,
            }
        }
        Op::UpsampleNearest(o) | Op::UpsampleBilinear(o) => upsampled(o, of),
        Op::Pad(o) => {
            let input = of(&o.input);
            let [left, top, right, bottom] = o.padding.sides();
            Shape { height: input.height + top + bottom, width: input.width + left + right, ..input }
        }
        Op::Concat(o) => {
            let first = of(&o.inputs[0]);
            let mut channels = 0;
            for tensor in &o.inputs {
                let other = of(tensor);
                same(name, Shape { channels: 0, ..first }, Shape { channels: 0, ..other })
                    .map_err(|_| GraphError::Sizes { op: name.into(), a: first, b: other })?;
                channels += other.channels;
            }
            Shape { channels, ..first }
        }
        Op::Add(o) => {
            let [a, b] = [of(&o.inputs[0]), of(&o.inputs[1])];
            same(name, a, b)?;
            a
        }
        Op::BatchNorm(o) => of(&o.input),
        Op::InstanceNorm(o) => of(&o.input),
        Op::GroupNorm(o) => of(&o.input),
        Op::Activation(o) => of(&o.input),
        Op::Dropout(o) => of(&o.input),
    };
    let edge = shape.width.max(shape.height);
    if edge > MAX_EDGE {
        let (what, min, max) = ("output edge", 1, MAX_EDGE);
        return Err(GraphError::Range { op: name.into(), what, value: edge, min, max });
    }
    Ok(shape)
}

fn conv_edge(op: &str, size: u32, kernel: u32, stride: u32) -> Result<u32, GraphError> {
    if size < kernel {
        return Err(GraphError::TooSmall { op: op.into(), kernel, size });
    }
    Ok((size - kernel) / stride + 1)
}

fn upsampled(o: &Upsample, of: impl Fn(&str) -> Shape) -> Shape {
    let input = of(&o.input);
    match &o.size_as {
        Some(tensor) => Shape { channels: input.channels, ..of(tensor) },
        None => {
            let scale = o.scale.unwrap_or(1);
            Shape { height: input.height * scale, width: input.width * scale, ..input }
        }
    }
}

fn same(op: &str, a: Shape, b: Shape) -> Result<(), GraphError> {
    if a == b { Ok(()) } else { Err(GraphError::Sizes { op: op.into(), a, b }) }
}
