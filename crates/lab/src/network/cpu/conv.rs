//! Convolutions: one weight at a time, added to a whole row.

use super::Tensor;
use bouncelight::net::format::Weights;
use bouncelight::net::graph::Shape;
use bouncelight::net::op::{Conv2d, ConvTranspose2d};

/// Fills each channel with its bias.
fn with_bias(weights: &Weights, name: &str, shape: Shape) -> Tensor {
    let mut out = Tensor::zeros(shape);
    let bias = weights.values(name, "bias");
    for (plane, bias) in out.data.chunks_exact_mut(shape.pixels() as usize).zip(bias) {
        plane.fill(*bias);
    }
    out
}

/// Convolution and bias.
pub(super) fn conv2d(weights: &Weights, o: &Conv2d, input: &Tensor, shape: Shape) -> Tensor {
    let weight = weights.values(&o.name, "weight");
    let [kernel_h, kernel_w] = o.kernel.map(|k| k as usize);
    let (in_w, in_h) = (input.shape.width as usize, input.shape.height as usize);
    let (out_w, out_h) = (shape.width as usize, shape.height as usize);
    let (stride, left, top) = (o.stride as usize, o.padding.left as usize, o.padding.top as usize);
    let depth = (o.in_channels / o.groups) as usize;
    let mut out = with_bias(weights, &o.name, shape);
    for (oc, plane) in out.data.chunks_exact_mut(out_w * out_h).enumerate() {
        let group = oc / (o.out_channels / o.groups) as usize;
        for ic in 0..depth {
            let source = input.plane(group * depth + ic);
            for ky in 0..kernel_h {
                for kx in 0..kernel_w {
                    let w = weight[((oc * depth + ic) * kernel_h + ky) * kernel_w + kx];
                    // Columns whose tap lies inside: 0 <= x·stride + kx − left < in_w.
                    let first = left.saturating_sub(kx).div_ceil(stride);
                    let end = (in_w + left).saturating_sub(kx).div_ceil(stride).min(out_w);
                    for (y, row) in plane.chunks_exact_mut(out_w).enumerate() {
                        let tap = y * stride + ky;
                        if tap < top || tap - top >= in_h || first >= end {
                            continue;
                        }
                        let from = (tap - top) * in_w + first * stride + kx - left;
                        let taps = source[from..].iter().step_by(stride);
                        row[first..end].iter_mut().zip(taps).for_each(|(sum, v)| *sum += w * v);
                    }
                }
            }
        }
    }
    out
}

/// Transposed convolution and bias: every input value is sent to the output pixels of its kernel.
pub(super) fn transposed(weights: &Weights, o: &ConvTranspose2d, input: &Tensor, shape: Shape) -> Tensor {
    let weight = weights.values(&o.name, "weight");
    let [kernel_h, kernel_w] = o.kernel.map(|k| k as usize);
    let (in_w, in_h) = (input.shape.width as usize, input.shape.height as usize);
    let (out_w, out_h) = (shape.width as usize, shape.height as usize);
    let (stride, padding, out_channels) = (o.stride as usize, o.padding as usize, o.out_channels as usize);
    let mut out = with_bias(weights, &o.name, shape);
    for (oc, plane) in out.data.chunks_exact_mut(out_w * out_h).enumerate() {
        for ic in 0..o.in_channels as usize {
            let source = input.plane(ic);
            for ky in 0..kernel_h {
                for kx in 0..kernel_w {
                    let w = weight[((ic * out_channels + oc) * kernel_h + ky) * kernel_w + kx];
                    for y in 0..in_h {
                        let Some(to_y) = (y * stride + ky).checked_sub(padding).filter(|y| *y < out_h) else {
                            continue;
                        };
                        // Columns whose target lies inside: 0 <= x·stride + kx − padding < out_w.
                        let first = padding.saturating_sub(kx).div_ceil(stride);
                        let end = (out_w + padding).saturating_sub(kx).div_ceil(stride).min(in_w);
                        if first >= end {
                            continue;
                        }
                        let to = to_y * out_w + first * stride + kx - padding;
                        let targets = plane[to..].iter_mut().step_by(stride);
                        targets.zip(&source[y * in_w..][first..end]).for_each(|(sum, v)| *sum += w * v);
                    }
                }
            }
        }
    }
    out
}
