//! From a graph to what the GPU does: the list of dispatches and each tensor's place in one arena. Pure.
//!
//! Sums are fused into the operator that makes one of their summands, as bias and activation are, so a skip costs one
//! read and no dispatch. Tensors whose lifetimes do not meet share memory; a fused sum overwrites its skip in place when
//! nobody reads the skip afterwards, which is safe because each thread reads just the element that it then writes.

use super::graph::{Activation, AddAt, Graph, GraphError, INPUT, Op, Shape};
use std::collections::HashMap;
use thiserror::Error;

/// Offsets in the arena are multiples of this: WebGPU's default alignment of storage bindings.
pub const ALIGN: u64 = 256;
/// Largest arena: WebGPU's default limit of one storage binding.
pub const MAX_ARENA: u64 = 128 << 20;

/// Why there is no plan.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PlanError {
    /// The graph does not fit together, or not at this size.
    #[error("network at {width}×{height}: {source}")]
    Graph {
        /// Input width.
        width: u32,
        /// Input height.
        height: u32,
        /// What is wrong.
        source: GraphError,
    },
    /// The tensors take more memory than one binding may.
    #[error(
        "network at {width}×{height} needs {bytes} bytes for its tensors, more than the {limit} of one binding; make the picture smaller"
    )]
    TooLarge {
        /// Input width.
        width: u32,
        /// Input height.
        height: u32,
        /// Bytes needed.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
}

/// A tensor's place and life. Step `i` happens at time `i + 1`; the input exists from time 0, the output to the end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tensor {
    /// Name in the graph.
    pub name: String,
    /// Shape; in memory NHWC f32 with channels padded to a multiple of four.
    pub shape: Shape,
    /// Byte offset in the arena.
    pub offset: u64,
    /// Time of writing.
    pub first: usize,
    /// Time of the last reading.
    pub last: usize,
}

/// What a step computes before its epilogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Convolution with bias.
    Conv {
        /// Kernel height and width.
        kernel: [u32; 2],
        /// Stride.
        stride: u32,
        /// Padding.
        padding: u32,
    },
    /// Bilinear resampling.
    Upsample,
    /// The input itself: a sum that could not be fused.
    Copy,
}

/// One dispatch: `kind`, then the skip and the activation in the order of `add_at`.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Name of the operator that does the work; the label is `net.NAME`.
    pub name: String,
    /// Its position in the graph.
    pub op: usize,
    /// What is computed.
    pub kind: Kind,
    /// Index of the tensor read.
    pub input: usize,
    /// Index of the tensor added.
    pub skip: Option<usize>,
    /// Where it joins.
    pub add_at: AddAt,
    /// Activation.
    pub activation: Activation,
    /// Index of the tensor written.
    pub output: usize,
    /// Floating-point operations, fused sums included.
    pub flops: u64,
    /// Bytes moved at least once: input, skip, weights and output.
    pub traffic: u64,
    /// Trained numbers.
    pub parameters: u64,
}

/// One line of `weights info`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Operator's name.
    pub name: String,
    /// `conv 3×3 /2`, `upsample + skip` …
    pub kind: String,
    /// Shape of the result.
    pub shape: Shape,
    /// Trained numbers.
    pub parameters: u64,
    /// Floating-point operations.
    pub flops: u64,
    /// Bytes moved.
    pub traffic: u64,
    /// Bytes of the result.
    pub bytes: u64,
    /// Its byte offset in the arena.
    pub offset: u64,
}

/// Dispatches and memory for one input size.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Input width.
    pub width: u32,
    /// Input height.
    pub height: u32,
    /// Tensors that exist in memory; `input` is the first.
    pub tensors: Vec<Tensor>,
    /// Dispatches in order.
    pub steps: Vec<Step>,
    /// Index of the output tensor.
    pub output: usize,
    /// Bytes at the arena's beginning that are always zero: what a kernel reads outside the picture.
    pub zero_bytes: u64,
    /// Size of the arena.
    pub arena_bytes: u64,
}

impl Plan {
    /// Plans `graph` for an input of `width`×`height`.
    pub fn new(graph: &Graph, width: u32, height: u32) -> Result<Self, PlanError> {
        let shapes = graph.shapes(width, height).map_err(|source| PlanError::Graph { width, height, source })?;
        let fused = fusions(graph);
        let input = Shape { channels: graph.input_channels, width, height };
        let mut plan = Plan {
            width,
            height,
            tensors: vec![Tensor { name: INPUT.into(), shape: input, offset: 0, first: 0, last: 0 }],
            steps: Vec::new(),
            output: 0,
            zero_bytes: 0,
            arena_bytes: 0,
        };
        let mut index: HashMap<&str, usize> = HashMap::from([(INPUT, 0)]);
        for (i, op) in graph.ops.iter().enumerate() {
            if fused.iter().flatten().any(|f| f.producer == i) {
                continue;
            }
            let output = plan.tensors.len();
            let step = step(graph, &shapes, &index, i, fused[i].as_ref(), output);
            let time = plan.steps.len() + 1;
            for read in std::iter::once(step.input).chain(step.skip) {
                plan.tensors[read].last = time;
            }
            plan.tensors.push(Tensor {
                name: op.output().into(),
                shape: shapes[i],
                offset: 0,
                first: time,
                last: time,
            });
            index.insert(op.output(), output);
            plan.steps.push(Step { traffic: traffic(&plan.tensors, &step), ..step });
        }
        // The planner's invariant: `check` has seen that an operator writes the output, and `fusions` keeps it.
        plan.output = index[graph.output.as_str()];
        let end = plan.steps.len() + 1;
        plan.tensors[plan.output].last = end;
        plan.place();
        if plan.arena_bytes > MAX_ARENA {
            return Err(PlanError::TooLarge { width, height, bytes: plan.arena_bytes, limit: MAX_ARENA });
        }
        Ok(plan)
    }

    /// Greedy by size: the largest tensor first, each at the lowest offset that is free during its life.
    fn place(&mut self) {
        let widest = self.tensors.iter().map(|t| t.shape.channels.div_ceil(4)).max().unwrap_or(1);
        self.zero_bytes = (u64::from(widest) * 16).next_multiple_of(ALIGN);
        // A group is a chain of tensors that overwrite each other in place.
        let mut group: Vec<usize> = (0..self.tensors.len()).collect();
        for (i, step) in self.steps.iter().enumerate() {
            if let Some(skip) = step.skip
                && skip != step.input
                && self.tensors[skip].last == i + 1
                && skip != self.output
            {
                group[step.output] = group[skip];
            }
        }
        let mut lives: HashMap<usize, (u64, usize, usize)> = HashMap::new();
        for (t, g) in self.tensors.iter().zip(&group) {
            let life = lives.entry(*g).or_insert((t.shape.padded_bytes().next_multiple_of(ALIGN), t.first, t.last));
            life.1 = life.1.min(t.first);
            life.2 = life.2.max(t.last);
        }
        let mut order: Vec<(usize, (u64, usize, usize))> = lives.into_iter().collect();
        order.sort_by_key(|(g, (bytes, ..))| (std::cmp::Reverse(*bytes), *g));
        let mut placed: Vec<(u64, u64, usize, usize, usize)> = Vec::new();
        for (g, (bytes, first, last)) in order {
            let mut busy: Vec<_> = placed.iter().filter(|p| p.2 <= last && first <= p.3).map(|p| (p.0, p.1)).collect();
            busy.sort_unstable();
            let mut offset = self.zero_bytes;
            for (from, to) in busy {
                if offset + bytes <= from {
                    break;
                }
                offset = offset.max(to);
            }
            placed.push((offset, offset + bytes, first, last, g));
        }
        self.arena_bytes = placed.iter().map(|p| p.1).max().unwrap_or(self.zero_bytes);
        for (from, _, _, _, g) in placed {
            for (tensor, _) in self.tensors.iter_mut().zip(&group).filter(|(_, other)| **other == g) {
                tensor.offset = from;
            }
        }
    }

    /// Floating-point operations of all steps.
    pub fn flops(&self) -> u64 {
        self.steps.iter().map(|s| s.flops).sum()
    }

    /// Bytes moved by all steps.
    pub fn traffic(&self) -> u64 {
        self.steps.iter().map(|s| s.traffic).sum()
    }

    /// One row a step, for `weights info`.
    pub fn rows(&self) -> Vec<Row> {
        let row = |s: &Step| {
            let tensor = &self.tensors[s.output];
            let mut kind = match s.kind {
                Kind::Conv { kernel: [h, w], stride: 1, .. } => format!("conv {h}×{w}"),
                Kind::Conv { kernel: [h, w], stride, .. } => format!("conv {h}×{w} /{stride}"),
                Kind::Upsample => "upsample".into(),
                Kind::Copy => "add".into(),
            };
            if s.skip.is_some() && s.kind != Kind::Copy {
                kind.push_str(" + skip");
            }
            if s.activation == Activation::Relu {
                kind.push_str(", relu");
            }
            let (shape, offset) = (tensor.shape, tensor.offset);
            let Step { name, parameters, flops, traffic, .. } = s.clone();
            Row { name, kind, shape, parameters, flops, traffic, bytes: shape.padded_bytes(), offset }
        };
        self.steps.iter().map(row).collect()
    }
}

/// A sum that runs in the epilogue of the operator that makes one of its summands.
struct Fusion {
    producer: usize,
    skip: String,
    add_at: AddAt,
    activation: Activation,
}

/// For each operator that is a fusible sum, how. A summand can be produced in place of the sum when nothing else reads it.
fn fusions(graph: &Graph) -> Vec<Option<Fusion>> {
    let mut readers: HashMap<&str, usize> = HashMap::new();
    for tensor in graph.ops.iter().flat_map(Op::inputs).chain([graph.output.as_str()]) {
        *readers.entry(tensor).or_default() += 1;
    }
    let mut taken = vec![false; graph.ops.len()];
    let mut fuse = |op: &Op| {
        let Op::Add(sum) = op else { return None };
        [(0, 1), (1, 0)].into_iter().find_map(|(own, other)| {
            let name = sum.inputs[own].as_str();
            let producer = graph.ops.iter().position(|p| p.output() == name)?;
            let inner = match &graph.ops[producer] {
                Op::Conv2d(o) if o.add.is_none() => o.activation,
                Op::UpsampleBilinear(_) => Activation::None,
                _ => return None,
            };
            let (add_at, activation) = match (inner, sum.activation) {
                (Activation::None, outer) => (AddAt::BeforeActivation, outer),
                (inner, Activation::None) => (AddAt::AfterActivation, inner),
                _ => return None,
            };
            if readers[name] != 1 || std::mem::replace(&mut taken[producer], true) {
                return None;
            }
            Some(Fusion { producer, skip: sum.inputs[other].clone(), add_at, activation })
        })
    };
    graph.ops.iter().map(&mut fuse).collect()
}

fn step(
    graph: &Graph,
    shapes: &[Shape],
    index: &HashMap<&str, usize>,
    i: usize,
    fusion: Option<&Fusion>,
    output: usize,
) -> Step {
    let op = fusion.map_or(i, |f| f.producer);
    let work = &graph.ops[op];
    let (kind, input, skip, add_at, activation) = match work {
        Op::Conv2d(o) => {
            let kind = Kind::Conv { kernel: o.kernel, stride: o.stride, padding: o.padding.left };
            (kind, &o.input, o.add.as_ref(), o.add_at, o.activation)
        }
        Op::UpsampleBilinear(o) => (Kind::Upsample, &o.input, None, AddAt::default(), Activation::None),
        Op::Add(o) => (Kind::Copy, &o.inputs[0], Some(&o.inputs[1]), AddAt::BeforeActivation, o.activation),
        _ => unimplemented!(),
    };
    let (skip, add_at, activation) =
        fusion.map_or((skip, add_at, activation), |f| (Some(&f.skip), f.add_at, f.activation));
    let sum = if fusion.is_some() { graph.ops[i].flops(shapes[i], shapes[i]) } else { 0 };
    Step {
        name: work.name().into(),
        op,
        kind,
        input: index[input.as_str()],
        skip: skip.map(|s| index[s.as_str()]),
        add_at,
        activation,
        output,
        flops: work.flops(shapes[op], shapes[op]) + sum,
        traffic: 0,
        parameters: work.parameters(),
    }
}

fn traffic(tensors: &[Tensor], step: &Step) -> u64 {
    let reads = std::iter::once(step.input).chain(step.skip).chain([step.output]);
    reads.map(|t| tensors[t].shape.padded_bytes()).sum::<u64>() + 4 * step.parameters
}
