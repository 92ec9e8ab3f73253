//! Everything that is not a convolution.

use super::Tensor;
use bouncelight::net::dropout as random;
use bouncelight::net::format::Weights;
use bouncelight::net::graph::{Padding, Shape};

/// Output values from channel, row and column.
fn from_fn(shape: Shape, mut value: impl FnMut(usize, usize, usize) -> f32) -> Tensor {
    let mut out = Tensor::zeros(shape);
    let (width, height) = (shape.width as usize, shape.height as usize);
    for (i, v) in out.data.iter_mut().enumerate() {
        *v = value(i / (width * height), i / width % height, i % width);
    }
    out
}

/// `shape.width`×`shape.height` pixels from the left top corner; beyond the edges the last column
/// and row are repeated.
pub(super) fn window(input: &Tensor, shape: Shape) -> Tensor {
    if input.shape == shape {
        return input.clone();
    }
    let (in_w, in_h) = (input.shape.width as usize, input.shape.height as usize);
    from_fn(shape, |c, y, x| input.plane(c)[y.min(in_h - 1) * in_w + x.min(in_w - 1)])
}

/// Zeros around.
pub(super) fn pad(input: &Tensor, padding: Padding, shape: Shape) -> Tensor {
    let (in_w, in_h) = (input.shape.width as usize, input.shape.height as usize);
    from_fn(shape, |c, y, x| {
        let x = x.checked_sub(padding.left as usize).filter(|x| *x < in_w);
        let y = y.checked_sub(padding.top as usize).filter(|y| *y < in_h);
        x.zip(y).map_or(0.0, |(x, y)| input.plane(c)[y * in_w + x])
    })
}

/// Source pixel ⌊x · in / out⌋.
pub(super) fn nearest(input: &Tensor, shape: Shape) -> Tensor {
    let (in_w, in_h) = (input.shape.width as usize, input.shape.height as usize);
    let (width, height) = (shape.width as usize, shape.height as usize);
    from_fn(shape, |c, y, x| input.plane(c)[y * in_h / height * in_w + x * in_w / width])
}

/// Bilinear resampling, half-pixel centres, edges clamped: PyTorch's `align_corners=False`.
pub(super) fn bilinear(input: &Tensor, shape: Shape) -> Tensor {
    let (in_w, width, height) = (input.shape.width as usize, shape.width as usize, shape.height as usize);
    from_fn(shape, |c, y, x| {
        let source = input.plane(c);
        let (y0, y1, fy) = taps(y, height, input.shape.height as usize);
        let (x0, x1, fx) = taps(x, width, in_w);
        let top = source[y0 * in_w + x0] * (1.0 - fx) + source[y0 * in_w + x1] * fx;
        let bottom = source[y1 * in_w + x0] * (1.0 - fx) + source[y1 * in_w + x1] * fx;
        top * (1.0 - fy) + bottom * fy
    })
}

/// The two source positions of `at` and the weight of the second.
fn taps(at: usize, size: usize, source: usize) -> (usize, usize, f32) {
    let place = ((at as f32 + 0.5) * (source as f32 / size as f32) - 0.5).max(0.0);
    let low = (place as usize).min(source - 1);
    (low, (low + 1).min(source - 1), place - low as f32)
}

/// (x − mean) / √(variance + eps) · weight + bias, with mean and variance of each channel.
pub(super) fn normalised(
    weights: &Weights,
    name: &str,
    input: &Tensor,
    eps: f32,
    moments: impl Fn(usize) -> (f64, f64),
) -> Tensor {
    let (weight, bias) = (weights.values(name, "weight"), weights.values(name, "bias"));
    let mut out = input.clone();
    for (c, plane) in out.data.chunks_exact_mut(input.shape.pixels() as usize).enumerate() {
        let (mean, variance) = moments(c);
        let scale = f64::from(weight.get(c).copied().unwrap_or(1.0)) / (variance + f64::from(eps)).sqrt();
        let shift = f64::from(bias.get(c).copied().unwrap_or(0.0));
        plane.iter_mut().for_each(|v| *v = ((f64::from(*v) - mean) * scale + shift) as f32);
    }
    out
}

/// Norm over `groups` groups of channels of this picture; in f64, in two passes.
pub(super) fn group_norm(weights: &Weights, name: &str, input: &Tensor, groups: u32, eps: f32) -> Tensor {
    let each = input.data.len() / groups as usize;
    let channels = (input.shape.channels / groups) as usize;
    let moments: Vec<(f64, f64)> = input
        .data
        .chunks_exact(each)
        .map(|values| {
            let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / each as f64;
            let variance = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / each as f64;
            (mean, variance)
        })
        .collect();
    normalised(weights, name, input, eps, |c| moments[c / channels])
}

/// Values dropped as [`random`] says.
pub(super) fn dropout(input: &Tensor, stream: u32, p: f32) -> Tensor {
    let (threshold, scale) = (random::threshold(p), 1.0 / (1.0 - p));
    let (channels, width) = (input.shape.channels as usize, input.shape.width as usize);
    from_fn(input.shape, |c, y, x| {
        let kept = random::keeps(stream, threshold, ((y * width + x) * channels + c) as u32);
        if kept { input.plane(c)[y * width + x] * scale } else { 0.0 }
    })
}
