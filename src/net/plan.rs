//! From a graph to what the GPU does: the list of dispatches and each tensor's place in one arena.
//! Pure.
//!
//! Bias, activation, dropout, sums, batch norms, zero padding and enlarging by a whole factor run
//! inside the operator before or after them where its kernel has room (`fuse`). A concatenation is
//! one tensor whose makers each write a slice of its channels, if these are multiples of four.
//! Tensors whose lives do not meet share memory, and a step may overwrite what it reads for the
//! last time, if each thread reads just the element that it then writes (`place`).

mod fuse;
mod norm;
mod place;
mod types;

use super::graph::{Activation, AddAt, Graph, GraphError, INPUT, Shape};
use fuse::{Node, Work};
use place::Inside;
use std::collections::HashMap;
use thiserror::Error;
pub use types::{Kind, Options, Precision, Row, Step, TILE, Tensor};

/// Offsets of whole tensors in the arena are multiples of this: WebGPU's default alignment of
/// storage bindings.
pub const ALIGN: u64 = 256;
/// Largest arena on a device of WebGPU's default limits: one storage binding.
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

/// Dispatches and memory for one input size.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Input width.
    pub width: u32,
    /// Input height.
    pub height: u32,
    /// Width and height at which the graph runs, see [`Graph::inner_size`].
    pub inner: [u32; 2],
    /// How numbers lie.
    pub precision: Precision,
    /// Tensors that exist in memory; `input` is the first.
    pub tensors: Vec<Tensor>,
    /// Dispatches in order.
    pub steps: Vec<Step>,
    /// Index of the output tensor.
    pub output: usize,
    /// Bytes at the arena's beginning that are always zero: what a kernel reads outside the
    /// picture.
    pub zero_bytes: u64,
    /// Size of the arena.
    pub arena_bytes: u64,
}

impl Plan {
    /// Plans `graph` for an input of `width`×`height` with default [`Options`].
    pub fn new(graph: &Graph, width: u32, height: u32) -> Result<Self, PlanError> {
        Self::with(graph, width, height, &Options::default())
    }

    /// Plans `graph` for an input of `width`×`height`.
    pub fn with(graph: &Graph, width: u32, height: u32, options: &Options) -> Result<Self, PlanError> {
        let wrong = |source| PlanError::Graph { width, height, source };
        let inner = graph.inner_size(width, height).map_err(wrong)?;
        let shapes = graph.shapes(inner[0], inner[1]).map_err(wrong)?;
        let plan = Plan {
            width,
            height,
            inner,
            precision: options.precision,
            tensors: Vec::new(),
            steps: Vec::new(),
            output: 0,
            zero_bytes: 0,
            arena_bytes: 0,
        };
        let mut builder =
            Builder { graph, shapes: &shapes, plan, index: HashMap::new(), inside: Vec::new(), measure: options.fuse };
        builder.begin(options.packed_input);
        let nodes = fuse::nodes(graph, &shapes, options);
        for node in &nodes {
            builder.add(node, &nodes);
        }
        builder.end();
        if options.fuse {
            builder.slice(&nodes);
        }
        place::overwrite(&builder.plan, &mut builder.inside);
        let Builder { mut plan, inside, .. } = builder;
        place::place(&mut plan, &inside);
        if plan.arena_bytes > options.limit {
            return Err(PlanError::TooLarge { width, height, bytes: plan.arena_bytes, limit: options.limit });
        }
        Ok(plan)
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
        self.steps.iter().map(|s| Row::new(s, &self.tensors[s.output])).collect()
    }
}

struct Builder<'a> {
    graph: &'a Graph,
    shapes: &'a [Shape],
    plan: Plan,
    /// Tensors by name.
    index: HashMap<&'a str, usize>,
    inside: Vec<Option<Inside>>,
    /// Convolutions measure what they make for the norm that reads it.
    measure: bool,
}

impl<'a> Builder<'a> {
    fn tensor(&mut self, name: &str, shape: Shape, full: bool) -> usize {
        let time = self.plan.steps.len() + 1;
        let full = full || self.plan.precision == Precision::F32;
        let root = self.plan.tensors.len();
        let tensor =
            Tensor { name: name.into(), shape, full, offset: 0, pitch: 0, root, slice: 0, first: time, last: time };
        self.plan.tensors.push(tensor);
        self.inside.push(None);
        root
    }

    /// A step that only reads and writes; callers add the rest.
    fn step(&self, name: &str, op: Option<usize>, kind: Kind, input: usize, output: usize) -> Step {
        Step {
            name: name.into(),
            op,
            kind,
            input,
            second: None,
            skip: None,
            add_at: AddAt::default(),
            activation: Activation::None,
            dropout: None,
            fold: None,
            output,
            moments: None,
            flops: 0,
            traffic: 0,
            parameters: 0,
        }
    }

    fn push(&mut self, mut step: Step) {
        let bytes = if self.plan.precision == Precision::F16 { 2 } else { 4 };
        // Of the picture that was measured a merge wants the size alone.
        let merge = matches!(step.kind, Kind::Merge { .. });
        let read = step.reads().filter(|t| !merge || step.second != Some(*t));
        let moved = read.chain([step.output]).map(|t| self.plan.tensors[t].bytes());
        step.traffic = moved.sum::<u64>() + bytes * step.parameters;
        let time = self.plan.steps.len() + 1;
        for read in step.reads() {
            self.plan.tensors[read].last = time;
        }
        let first = &mut self.plan.tensors[step.output].first;
        *first = time.min(*first);
        self.plan.steps.push(step);
    }

    /// The input, and the picture fitted to the size and the precision at which the graph runs.
    fn begin(&mut self, packed: bool) {
        let Plan { width, height, inner, precision, .. } = self.plan;
        let shape = Shape { channels: self.graph.input_channels, width, height };
        let mut at = self.tensor(INPUT, shape, !packed);
        (self.plan.tensors[at].first, self.plan.tensors[at].last) = (0, 0);
        if inner != [width, height] || (precision == Precision::F16 && !packed) {
            let fitted = self.tensor("input.fitted", Shape { width: inner[0], height: inner[1], ..shape }, false);
            self.push(self.step("fit", None, WINDOW, at, fitted));
            at = fitted;
        }
        self.index.insert(INPUT, at);
    }

    /// The output, cropped and in f32.
    fn end(&mut self) {
        let Plan { width, height, inner, .. } = self.plan;
        // `check` has seen that an operator writes the output, and fusion keeps it.
        let mut at = self.index[self.graph.output.as_str()];
        if inner != [width, height] || !self.plan.tensors[at].full {
            let shape = self.plan.tensors[at].shape;
            let kept = Shape {
                width: Graph::cropped(shape.width, width, inner[0]),
                height: Graph::cropped(shape.height, height, inner[1]),
                ..shape
            };
            let output = self.tensor("output.fitted", kept, true);
            self.push(self.step("crop", None, WINDOW, at, output));
            at = output;
        }
        self.plan.output = at;
        self.plan.tensors[at].last = self.plan.steps.len() + 1;
    }

    fn add(&mut self, node: &Node, nodes: &[Node]) {
        let ops = &self.graph.ops;
        let name = ops[node.op].name();
        let last = node.merged.iter().copied().max().unwrap_or(node.op);
        let shape = self.shapes[last];
        let inputs: Vec<usize> = node.inputs.iter().map(|t| self.index[t.as_str()]).collect();
        let flops =
            node.merged.iter().map(|i| ops[*i].flops(self.shape_of(ops[*i].inputs()[0]), self.shapes[*i])).sum();
        let kind = match node.work {
            Work::Conv { kernel, stride, padding, nearest, groups } => {
                Kind::Conv { kernel, stride, padding, nearest, groups }
            }
            Work::Transposed { kernel, stride, padding } => Kind::Transposed { kernel, stride, padding },
            Work::Bilinear => Kind::Upsample,
            Work::Nearest => Kind::Nearest,
            Work::Pad(p) => Kind::Window { left: p.left, top: p.top, clamp: false, channel: 0 },
            Work::Copy => Kind::Copy,
            Work::Affine => Kind::Scale { fixed: true },
            Work::Concat => return self.concat(node, &inputs, shape),
            Work::Norm { .. } => Kind::Scale { fixed: false },
        };
        let measured = match node.work {
            Work::Norm { groups, eps } => Some(self.measure(node, inputs[0], groups, eps)),
            _ => None,
        };
        // What a batch norm of its own scales is rounded but once, after it, as if it had been
        // folded into the weights.
        let mut readers = nodes.iter().filter(|n| n.inputs.iter().chain(&n.skip).any(|t| *t == node.output));
        let unrounded = node.is_conv()
            && node.output != self.graph.output
            && readers.next().is_some_and(|n| n.work == Work::Affine && n.skip.is_none())
            && readers.next().is_none();
        // What is handed over in f32 as it is need not be copied into it.
        let handed = node.is_conv()
            && node.output == self.graph.output
            && self.plan.inner == [self.plan.width, self.plan.height]
            && !nodes.iter().any(|n| n.inputs.iter().chain(&n.skip).any(|t| *t == node.output));
        let output = self.output(last, shape, unrounded || handed);
        let step = self.step(name, Some(node.op), kind, inputs[0], output);
        self.push(Step {
            second: measured,
            skip: node.skip.as_ref().map(|t| self.index[t.as_str()]),
            add_at: node.add_at,
            activation: node.activation,
            dropout: node.dropout,
            fold: node.fold,
            flops,
            parameters: node.merged.iter().map(|i| ops[*i].parameters()).sum(),
            ..step
        });
    }

    fn shape_of(&self, tensor: &str) -> Shape {
        let made = self.graph.ops.iter().position(|op| op.output() == tensor).map(|i| self.shapes[i]);
        made.unwrap_or(Shape {
            channels: self.graph.input_channels,
            width: self.plan.inner[0],
            height: self.plan.inner[1],
        })
    }

    fn output(&mut self, op: usize, shape: Shape, full: bool) -> usize {
        let name = self.graph.ops[op].output();
        let output = self.tensor(name, shape, full);
        self.index.insert(name, output);
        output
    }

    /// One copy for each input. [`Builder::slice`] takes away those that their makers can write in
    /// place.
    fn concat(&mut self, node: &Node, inputs: &[usize], shape: Shape) {
        let output = self.output(node.op, shape, false);
        let name = self.graph.ops[node.op].name();
        let mut channel = 0;
        for input in inputs {
            let kind = Kind::Window { left: 0, top: 0, clamp: false, channel };
            self.push(self.step(name, Some(node.op), kind, *input, output));
            channel += self.plan.tensors[*input].shape.channels;
        }
    }

    /// Moves inputs of concatenations into them where that is possible, and takes away the copies.
    fn slice(&mut self, nodes: &[Node]) {
        let mut gone = vec![false; self.plan.steps.len()];
        for (i, step) in self.plan.steps.iter().enumerate() {
            let joins = step.op.is_some_and(|op| nodes.iter().any(|n| n.op == op && n.work == Work::Concat));
            let Kind::Window { channel, .. } = step.kind else { continue };
            let channels = self.plan.tensors[step.input].shape.channels;
            let end = channel + channels;
            let whole =
                channel % 4 == 0 && (end.is_multiple_of(4) || end == self.plan.tensors[step.output].shape.channels);
            // The caller reads and writes input and output densely.
            if joins && whole && step.input != 0 && step.input != self.plan.output && self.inside[step.input].is_none()
            {
                self.inside[step.input] = Some(Inside { tensor: step.output, slice: channel / 4 });
                gone[i] = true;
            }
        }
        // Times count steps, so they move together.
        let kept: Vec<usize> = std::iter::once(0)
            .chain(gone.iter().scan(0, |n, g| {
                *n += usize::from(!g);
                Some(*n)
            }))
            .collect();
        let end = gone.len() + 1;
        let new_end = kept[gone.len()] + 1;
        for tensor in &mut self.plan.tensors {
            for time in [&mut tensor.first, &mut tensor.last] {
                *time = if *time == end { new_end } else { kept[*time] };
            }
        }
        let mut gone = gone.into_iter();
        self.plan.steps.retain(|_| !gone.next().unwrap_or(false));
    }
}

/// A window from the left top corner that repeats the edges.
const WINDOW: Kind = Kind::Window { left: 0, top: 0, clamp: true, channel: 0 };
