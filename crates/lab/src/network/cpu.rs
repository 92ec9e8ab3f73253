//! The slow, obvious CPU reference: every operator as plain loops over CHW f32. The test oracle for
//! the kernels; it runs the graph as it stands in the file, so that it also judges the planner's
//! fusion and sharing of memory.

mod conv;
mod plain;

use bouncelight::net::format::Weights;
use bouncelight::net::graph::{AddAt, Graph, GraphError, INPUT, Op, Shape};
use bouncelight::net::{dropout, op::Activation};
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

/// Runs the network on `input` (shape: the network's channels, any size), without dropout.
pub fn run(weights: &Weights, input: &Tensor) -> Result<Tensor, RunError> {
    run_with(weights, input, None)
}

/// As [`run`], with dropout when there is a seed. The picture is padded and the output cropped as
/// [`Graph::inner_size`] says.
pub fn run_with(weights: &Weights, input: &Tensor, seed: Option<u32>) -> Result<Tensor, RunError> {
    let graph = &weights.graph;
    let shape = input.shape;
    let values = input.data.len();
    if shape.channels != graph.input_channels || values as u64 != shape.pixels() * u64::from(shape.channels) {
        return Err(RunError::Input { wanted: graph.input_channels, found: shape, values });
    }
    let [width, height] = graph.inner_size(shape.width, shape.height)?;
    let shapes = graph.shapes(width, height)?;
    let inner = plain::window(input, Shape { width, height, ..shape });
    let mut tensors: HashMap<&str, Tensor> = HashMap::from([(INPUT, inner)]);
    for (i, (op, shape)) in graph.ops.iter().zip(shapes).enumerate() {
        let result = apply(weights, op, &tensors, shape, seed.map(|seed| dropout::stream(seed, i)));
        tensors.insert(op.output(), result);
    }
    let out = tensors.remove(graph.output.as_str()).expect("shapes() has checked that an operator writes the output");
    let kept = Shape {
        width: Graph::cropped(out.shape.width, shape.width, width),
        height: Graph::cropped(out.shape.height, shape.height, height),
        ..out.shape
    };
    Ok(plain::window(&out, kept))
}

/// One operator; `stream` is for dropout alone.
fn apply(weights: &Weights, op: &Op, tensors: &HashMap<&str, Tensor>, shape: Shape, stream: Option<u32>) -> Tensor {
    let read = |name: &String| &tensors[name.as_str()];
    match op {
        Op::Conv2d(o) => {
            let mut out = conv::conv2d(weights, o, read(&o.input), shape);
            let skip = o.add.as_ref().map(|s| (read(s), o.add_at));
            if let Some((skip, AddAt::BeforeActivation)) = skip {
                add(&mut out, skip);
            }
            activate(&mut out, o.activation);
            if let Some((skip, AddAt::AfterActivation)) = skip {
                add(&mut out, skip);
            }
            out
        }
        Op::ConvTranspose2d(o) => activated(conv::transposed(weights, o, read(&o.input), shape), o.activation),
        Op::UpsampleBilinear(o) => plain::bilinear(read(&o.input), shape),
        Op::UpsampleNearest(o) => plain::nearest(read(&o.input), shape),
        Op::Pad(o) => plain::pad(read(&o.input), o.padding, shape),
        Op::Concat(o) => Tensor { shape, data: o.inputs.iter().flat_map(|t| read(t).data.iter().copied()).collect() },
        Op::Add(o) => {
            let mut out = read(&o.inputs[0]).clone();
            add(&mut out, read(&o.inputs[1]));
            activated(out, o.activation)
        }
        Op::BatchNorm(o) => {
            let [mean, variance] = ["running_mean", "running_var"].map(|leaf| weights.values(&o.name, leaf));
            let moments = |c: usize| (f64::from(mean[c]), f64::from(variance[c]));
            activated(plain::normalised(weights, &o.name, read(&o.input), o.eps, moments), o.activation)
        }
        Op::InstanceNorm(o) => {
            activated(plain::group_norm(weights, &o.name, read(&o.input), o.channels, o.eps), o.activation)
        }
        Op::GroupNorm(o) => {
            activated(plain::group_norm(weights, &o.name, read(&o.input), o.groups, o.eps), o.activation)
        }
        Op::Activation(o) => activated(read(&o.input).clone(), o.activation),
        Op::Dropout(o) => match stream {
            Some(stream) => plain::dropout(read(&o.input), stream, o.p),
            None => read(&o.input).clone(),
        },
    }
}

fn add(to: &mut Tensor, from: &Tensor) {
    to.data.iter_mut().zip(&from.data).for_each(|(a, b)| *a += b);
}

fn activate(tensor: &mut Tensor, activation: Activation) {
    tensor.data.iter_mut().for_each(|v| *v = activation.apply(*v));
}

fn activated(mut tensor: Tensor, activation: Activation) -> Tensor {
    activate(&mut tensor, activation);
    tensor
}
