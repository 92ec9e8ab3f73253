//! The slow, obvious twin: every operator as plain loops over CHW f32. The test oracle for the kernels; it runs the
//! graph as it stands in the file, so that it also judges the planner's fusion and sharing of memory.

use super::format::Weights;
use super::graph::{AddAt, GraphError, INPUT, Op, Shape};
use super::op::Conv2d;
use std::collections::HashMap;
use thiserror::Error;

/// Values of one picture: channel by channel, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// Channels, height, width.
    pub shape: Shape,
    /// `channels · height · width` values.
    pub data: Vec<f32>,
}

/// Why a network did not run.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum RunError {
    /// The graph does not fit the input's size.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// The input has other channels than the network, or a length that is not its shape's.
    #[error("the network takes {wanted} channels; the input is {found} with {values} values")]
    Input {
        /// Channels of the network.
        wanted: u32,
        /// Shape given.
        found: Shape,
        /// Values given.
        values: usize,
    },
}

impl Tensor {
    /// All zero.
    pub fn zeros(shape: Shape) -> Self {
        Self { shape, data: vec![0.0; shape.channels as usize * shape.pixels() as usize] }
    }

    /// From NHWC with channels padded to a multiple of four, as it lies on the GPU.
    pub fn from_padded(shape: Shape, padded: &[f32]) -> Self {
        let (pixels, stride) = (shape.pixels() as usize, shape.channels.next_multiple_of(4) as usize);
        let value = |c: usize, p: usize| padded[p * stride + c];
        let channels = 0..shape.channels as usize;
        Self { shape, data: channels.flat_map(|c| (0..pixels).map(move |p| value(c, p))).collect() }
    }

    /// To NHWC with channels padded to a multiple of four with zeros.
    pub fn to_padded(&self) -> Vec<f32> {
        let (pixels, stride) = (self.shape.pixels() as usize, self.shape.channels.next_multiple_of(4) as usize);
        let mut padded = vec![0.0; pixels * stride];
        for (c, plane) in self.data.chunks_exact(pixels.max(1)).enumerate() {
            for (p, value) in plane.iter().enumerate() {
                padded[p * stride + c] = *value;
            }
        }
        padded
    }

    fn plane(&self, channel: usize) -> &[f32] {
        let pixels = self.shape.pixels() as usize;
        &self.data[channel * pixels..(channel + 1) * pixels]
    }
}

/// Runs the network on `input` (shape: the network's channels, any size).
pub fn run(weights: &Weights, input: &Tensor) -> Result<Tensor, RunError> {
    let graph = &weights.graph;
    let shape = input.shape;
    let values = input.data.len();
    if shape.channels != graph.input_channels || values as u64 != shape.pixels() * u64::from(shape.channels) {
        return Err(RunError::Input { wanted: graph.input_channels, found: shape, values });
    }
    let shapes = graph.shapes(shape.width, shape.height)?;
    let mut tensors: HashMap<&str, Tensor> = HashMap::from([(INPUT, input.clone())]);
    for (op, shape) in graph.ops.iter().zip(shapes) {
        let result = match op {
            Op::Conv2d(o) => {
                let mut out = conv2d(weights, o, &tensors[o.input.as_str()], shape);
                let skip = o.add.as_ref().map(|s| (&tensors[s.as_str()], o.add_at));
                if let Some((skip, AddAt::BeforeActivation)) = skip {
                    add(&mut out, skip);
                }
                out.data.iter_mut().for_each(|v| *v = o.activation.apply(*v));
                if let Some((skip, AddAt::AfterActivation)) = skip {
                    add(&mut out, skip);
                }
                out
            }
            Op::UpsampleBilinear(o) => upsample(&tensors[o.input.as_str()], shape),
            Op::Add(o) => {
                let mut out = tensors[o.inputs[0].as_str()].clone();
                add(&mut out, &tensors[o.inputs[1].as_str()]);
                out.data.iter_mut().for_each(|v| *v = o.activation.apply(*v));
                out
            }
            _ => unimplemented!(),
        };
        tensors.insert(op.output(), result);
    }
    Ok(tensors.remove(graph.output.as_str()).expect("shapes() has checked that an operator writes the output"))
}

fn add(to: &mut Tensor, from: &Tensor) {
    to.data.iter_mut().zip(&from.data).for_each(|(a, b)| *a += b);
}

/// Convolution and bias: one weight at a time, added to a whole row.
fn conv2d(weights: &Weights, o: &Conv2d, input: &Tensor, shape: Shape) -> Tensor {
    let (weight, bias) = (weights.values(&o.name, "weight"), weights.values(&o.name, "bias"));
    let [kernel_h, kernel_w] = o.kernel.map(|k| k as usize);
    let (in_w, in_h) = (input.shape.width as usize, input.shape.height as usize);
    let (out_w, out_h) = (shape.width as usize, shape.height as usize);
    let (stride, padding, in_channels) = (o.stride as usize, o.padding.left as usize, o.in_channels as usize);
    let mut out = Tensor::zeros(shape);
    for (oc, plane) in out.data.chunks_exact_mut(out_w * out_h).enumerate() {
        plane.fill(bias[oc]);
        for ic in 0..in_channels {
            let source = input.plane(ic);
            for ky in 0..kernel_h {
                for kx in 0..kernel_w {
                    let w = weight[((oc * in_channels + ic) * kernel_h + ky) * kernel_w + kx];
                    // Columns whose tap lies inside: 0 <= x·stride + kx − padding < in_w.
                    let first = padding.saturating_sub(kx).div_ceil(stride);
                    let end = (in_w + padding).saturating_sub(kx).div_ceil(stride).min(out_w);
                    for (y, row) in plane.chunks_exact_mut(out_w).enumerate() {
                        let tap = y * stride + ky;
                        if tap < padding || tap - padding >= in_h || first >= end {
                            continue;
                        }
                        let from = (tap - padding) * in_w + first * stride + kx - padding;
                        let taps = source[from..].iter().step_by(stride);
                        row[first..end].iter_mut().zip(taps).for_each(|(sum, v)| *sum += w * v);
                    }
                }
            }
        }
    }
    out
}

/// Bilinear resampling, half-pixel centres, edges clamped: PyTorch's `align_corners=False`.
fn upsample(input: &Tensor, shape: Shape) -> Tensor {
    let mut out = Tensor::zeros(shape);
    let (in_w, width, height) = (input.shape.width as usize, shape.width as usize, shape.height as usize);
    for (c, plane) in out.data.chunks_exact_mut(width * height).enumerate() {
        let source = input.plane(c);
        for y in 0..height {
            let (y0, y1, fy) = taps(y, height, input.shape.height as usize);
            for x in 0..width {
                let (x0, x1, fx) = taps(x, width, in_w);
                let top = source[y0 * in_w + x0] * (1.0 - fx) + source[y0 * in_w + x1] * fx;
                let bottom = source[y1 * in_w + x0] * (1.0 - fx) + source[y1 * in_w + x1] * fx;
                plane[y * width + x] = top * (1.0 - fy) + bottom * fy;
            }
        }
    }
    out
}

/// The two source positions of `at` and the weight of the second.
fn taps(at: usize, size: usize, source: usize) -> (usize, usize, f32) {
    let place = ((at as f32 + 0.5) * (source as f32 / size as f32) - 0.5).max(0.0);
    let low = (place as usize).min(source - 1);
    (low, (low + 1).min(source - 1), place - low as f32)
}
