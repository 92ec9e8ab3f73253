//! What learning dispatches, in order, and where its numbers lie. Pure: no GPU.

use super::LearnError;
use crate::net::format::Weights;
use crate::net::graph::{Activation, Conv2d, INPUT, Op, Shape};
use std::collections::HashMap;
use std::ops::Range;

/// `Job` of `shaders/net/learn/job.wgsl`, which documents its fields.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[allow(missing_docs, reason = "documented in shaders/net/learn/job.wgsl")]
pub struct Job {
    pub in_size: [u32; 2],
    pub out_size: [u32; 2],
    pub kernel: [u32; 2],
    pub corner: [u32; 2],
    pub in_channels: u32,
    pub out_channels: u32,
    pub stride: u32,
    pub input: u32,
    pub other: u32,
    pub output: u32,
    pub weight: u32,
    pub bias: u32,
    pub total: u32,
    pub slope: f32,
    pub share: f32,
    pub rate: f32,
    pub unbias: [f32; 2],
    pub keep: f32,
    pub(super) padding: u32,
}

/// No bias; `NONE` in the shader.
const NONE: u32 = u32::MAX;

/// An entry of a shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Kernel {
    ConvForward,
    ConvToInput,
    ConvToWeights,
    Activation,
    ResizeForward,
    ResizeToInput,
    AddForward,
    AddToInput,
    LossMeasure,
    LossSpread,
    AdamNorm,
    AdamStep,
}

impl Kernel {
    pub const ALL: [Self; 12] = [
        Self::ConvForward,
        Self::ConvToInput,
        Self::ConvToWeights,
        Self::Activation,
        Self::ResizeForward,
        Self::ResizeToInput,
        Self::AddForward,
        Self::AddToInput,
        Self::LossMeasure,
        Self::LossSpread,
        Self::AdamNorm,
        Self::AdamStep,
    ];

    /// Shader and entry.
    pub fn entry(self) -> (&'static str, &'static str) {
        match self {
            Self::ConvForward => ("learn.conv", "forward"),
            Self::ConvToInput => ("learn.conv", "to_input"),
            Self::ConvToWeights => ("learn.conv", "to_weights"),
            Self::Activation => ("learn.conv", "activation"),
            Self::ResizeForward => ("learn.resize", "forward"),
            Self::ResizeToInput => ("learn.resize", "to_input"),
            Self::AddForward => ("learn.add", "forward"),
            Self::AddToInput => ("learn.add", "to_input"),
            Self::LossMeasure => ("learn.loss", "measure"),
            Self::LossSpread => ("learn.loss", "spread"),
            Self::AdamNorm => ("learn.adam", "norm"),
            Self::AdamStep => ("learn.adam", "step"),
        }
    }
}

/// A dispatch: a thread for each of `elements`; one workgroup where these are 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Call {
    pub kernel: Kernel,
    pub job: Job,
    pub elements: u64,
}

/// A tensor's first value and its shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub first: u32,
    pub shape: Shape,
}

impl Place {
    pub fn values(self) -> u64 {
        self.shape.pixels() * u64::from(self.shape.channels)
    }

    fn size(self) -> [u32; 2] {
        [self.shape.width, self.shape.height]
    }
}

/// The network's dispatches for pictures of one size.
#[derive(Debug)]
pub(super) struct Tape {
    /// From the input to the output; every tensor is kept.
    pub forward: Vec<Call>,
    /// From the output's slopes to the gradients.
    pub backward: Vec<Call>,
    /// Values of all tensors together.
    pub values: u64,
    /// What is learnt, by name; places in the sections of `numbers`.
    pub learnt: Vec<(String, Range<usize>)>,
    pub input: Place,
    pub output: Place,
}

impl Tape {
    /// # Errors
    /// An operator without a way back, or a size at which the network would have to be padded.
    pub fn new(weights: &Weights, [width, height]: [u32; 2]) -> Result<Self, LearnError> {
        let graph = &weights.graph;
        let shapes = graph.shapes(width, height)?;
        if graph.inner_size(width, height)? != [width, height] {
            return Err(LearnError::Size { cells: [width, height], reason: "the network runs at padded sizes".into() });
        }
        let mut learnt = Vec::new();
        for (name, tensor) in weights.tensors() {
            let first = learnt.last().map_or(0, |(_, r): &(String, Range<usize>)| r.end);
            learnt.push((name.clone(), first..first + tensor.data.len()));
        }
        let mut values = 0;
        let mut place = |shape: Shape| {
            let place = Place { first: values as u32, shape };
            values += place.values();
            place
        };
        let input = place(Shape { channels: graph.input_channels, height, width });
        let mut places = HashMap::from([(INPUT, input)]);
        let (mut forward, mut backward) = (Vec::new(), Vec::new());
        for (op, shape) in graph.ops.iter().zip(shapes) {
            let output = place(shape);
            let from = places[op.inputs()[0]];
            let job = Job {
                in_size: from.size(),
                out_size: output.size(),
                in_channels: from.shape.channels,
                out_channels: shape.channels,
                input: from.first,
                output: output.first,
                total: learnt.last().map_or(0, |(_, r)| r.end) as u32,
                slope: slope(op)?,
                ..Job::default()
            };
            let (there, back) = calls(op, job, &places, &learnt)?;
            let call = |(kernel, job): (Kernel, Job)| Call { kernel, job, elements: elements(kernel, &job) };
            forward.push(call(there));
            backward.push(back.into_iter().map(call).collect::<Vec<_>>());
            places.insert(op.output(), output);
        }
        if values > u64::from(u32::MAX) {
            return Err(LearnError::Size { cells: [width, height], reason: format!("{values} values are too many") });
        }
        let output = places[graph.output.as_str()];
        Ok(Self { forward, backward: backward.into_iter().rev().flatten().collect(), values, learnt, input, output })
    }

    /// Numbers that are learnt.
    pub fn total(&self) -> usize {
        self.learnt.last().map_or(0, |(_, range)| range.end)
    }
}

/// What an activation multiplies values below 0 with.
fn slope(op: &Op) -> Result<f32, LearnError> {
    let activation = match op {
        Op::Conv2d(o) => o.activation,
        Op::Add(o) => o.activation,
        _ => Activation::None,
    };
    match activation {
        Activation::None | Activation::Relu => Ok(activation.slope()),
        // Others would turn the sign, by which the way back tells what was below 0.
        Activation::LeakyRelu(slope) if slope >= 0.0 => Ok(slope),
        other => Err(unknown(op, format!("its activation `{}`", other.name()))),
    }
}

fn unknown(op: &Op, what: String) -> LearnError {
    LearnError::Operator { name: op.name().into(), what }
}

type Way = (Kernel, Job);

/// The way there, and the ways back in their order.
fn calls(
    op: &Op,
    job: Job,
    places: &HashMap<&str, Place>,
    learnt: &[(String, Range<usize>)],
) -> Result<(Way, Vec<Way>), LearnError> {
    let bent = (job.slope != 1.0).then_some((Kernel::Activation, job));
    let (there, back) = match op {
        Op::Conv2d(o) => {
            let job = convolution(op, o, job, learnt)?;
            // Nobody asks for the slopes of the network's input.
            let to_input = (o.input != INPUT).then_some((Kernel::ConvToInput, job));
            let back = [Some((Kernel::ConvToWeights, job)), to_input].into_iter().flatten().collect();
            ((Kernel::ConvForward, job), back)
        }
        Op::UpsampleBilinear(_) => ((Kernel::ResizeForward, job), vec![(Kernel::ResizeToInput, job)]),
        Op::Add(o) => {
            let job = Job { other: places[o.inputs[1].as_str()].first, ..job };
            ((Kernel::AddForward, job), vec![(Kernel::AddToInput, job)])
        }
        _ => return Err(unknown(op, format!("operator `{}`", op.kind()))),
    };
    Ok((there, bent.into_iter().chain(back).collect()))
}

fn convolution(op: &Op, o: &Conv2d, job: Job, learnt: &[(String, Range<usize>)]) -> Result<Job, LearnError> {
    if o.groups != 1 {
        return Err(unknown(op, format!("its {} groups", o.groups)));
    }
    if o.add.is_some() {
        return Err(unknown(op, "its skip tensor (`add`)".into()));
    }
    let first = |leaf: &str| {
        let name = format!("{}.{leaf}", o.name);
        learnt.iter().find(|(n, _)| *n == name).map_or(NONE, |(_, range)| range.start as u32)
    };
    let [height, width] = o.kernel;
    Ok(Job {
        kernel: [width, height],
        corner: [o.padding.left, o.padding.top],
        stride: o.stride,
        weight: first("weight"),
        bias: first("bias"),
        ..job
    })
}

fn elements(kernel: Kernel, job: &Job) -> u64 {
    let values = |channels: u32, [w, h]: [u32; 2]| u64::from(channels) * u64::from(w) * u64::from(h);
    match kernel {
        Kernel::ConvToInput | Kernel::ResizeToInput => values(job.in_channels, job.in_size),
        Kernel::ConvToWeights => u64::from(job.out_channels) * (values(job.in_channels, job.kernel) + 1),
        Kernel::LossSpread => values(3, job.out_size),
        Kernel::AdamStep => u64::from(job.total),
        Kernel::LossMeasure | Kernel::AdamNorm => 1,
        _ => values(job.out_channels, job.out_size),
    }
}

/// The loss of what the output means: see `shaders/net/learn/loss.wgsl`.
pub(super) fn loss_calls(output: Place, total: usize, pictures: usize) -> [Call; 2] {
    let job = Job {
        out_size: output.size(),
        out_channels: output.shape.channels,
        output: output.first,
        total: total as u32,
        share: 1.0 / pictures as f32,
        ..Job::default()
    };
    [Kernel::LossMeasure, Kernel::LossSpread].map(|kernel| Call { kernel, job, elements: elements(kernel, &job) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_network_has_a_way_back_from_every_operator() {
        let weights = Weights::corrector().unwrap();
        let tape = Tape::new(&weights, [33, 17]).unwrap();
        let kinds = |kernel: Kernel| tape.backward.iter().filter(|c| c.kernel == kernel).count();
        let convolutions = weights.graph.ops.iter().filter(|op| matches!(op, Op::Conv2d(_))).count();
        assert_eq!(tape.forward.len(), weights.graph.ops.len());
        assert_eq!((kinds(Kernel::ConvToWeights), kinds(Kernel::ConvToInput)), (convolutions, convolutions - 1));
        assert_eq!(tape.total() as u64, weights.graph.parameters());
        // No two tensors share a place: the way back reads all of them.
        let mut outputs: Vec<_> = tape.forward.iter().map(|c| (u64::from(c.job.output), c.elements)).collect();
        outputs.insert(0, (0, tape.input.values()));
        assert!(outputs.windows(2).all(|p| p[0].0 + p[0].1 == p[1].0) && outputs.last().unwrap().0 < tape.values);
    }

    #[test]
    fn what_cannot_be_learnt_is_named() {
        let with = |edit: &dyn Fn(&mut Vec<Op>)| {
            let mut weights = Weights::corrector().unwrap();
            edit(&mut weights.graph.ops);
            Tape::new(&weights, [16, 16]).unwrap_err().to_string()
        };
        let tanh = with(&|ops| {
            if let Op::Conv2d(o) = &mut ops[0] {
                o.activation = Activation::Tanh;
            }
        });
        assert!(tanh.contains("enc0.a") && tanh.contains("tanh"), "{tanh}");
        let nearest = with(&|ops| {
            let at = ops.iter().position(|op| matches!(op, Op::UpsampleBilinear(_))).unwrap();
            if let Op::UpsampleBilinear(o) = ops[at].clone() {
                ops[at] = Op::UpsampleNearest(o);
            }
        });
        assert!(nearest.contains("up3.upsample") && nearest.contains("upsample_nearest"), "{nearest}");
    }
}
