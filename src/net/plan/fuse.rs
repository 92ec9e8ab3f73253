//! Which operators share a dispatch. Every operator becomes a [`Node`]; then nodes are merged where
//! one kernel can do the work of two. A merged node stands where the later of the two stood, so
//! that all it reads exists.

use super::super::graph::{Activation, AddAt, Graph, Op, Padding, Shape};
use super::Options;

/// What a node's kernel does before its epilogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Work {
    Conv {
        kernel: [u32; 2],
        stride: u32,
        padding: Padding,
        nearest: u32,
        groups: u32,
    },
    Transposed {
        kernel: [u32; 2],
        stride: u32,
        padding: u32,
    },
    Bilinear,
    Nearest,
    Pad(Padding),
    Concat,
    /// The input itself.
    Copy,
    /// Batch norm that stands alone.
    Affine,
    /// Norm over `groups` groups of channels of this picture.
    Norm {
        groups: u32,
        eps: f32,
    },
}

/// One or more operators that run together: work, then skip and activation as `add_at` says, then
/// dropout.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node {
    /// Position in the graph of the operator that does the work.
    pub op: usize,
    /// Positions of all operators that this node runs.
    pub merged: Vec<usize>,
    pub work: Work,
    pub inputs: Vec<String>,
    pub skip: Option<String>,
    pub add_at: AddAt,
    pub activation: Activation,
    /// Position and probability.
    pub dropout: Option<(usize, f32)>,
    /// Position of the batch norm that is folded into the weights.
    pub fold: Option<usize>,
    pub output: String,
}

/// The nodes of `graph`, merged if `options.fuse`. `shapes` are those of the operators' outputs.
pub(super) fn nodes(graph: &Graph, shapes: &[Shape], options: &Options) -> Vec<Node> {
    let mut nodes: Vec<Node> = graph.ops.iter().enumerate().map(|(i, op)| node(i, op, options)).collect();
    if options.fuse {
        let mut net = Net { nodes: &mut nodes, output: &graph.output };
        net.skip_identities();
        net.absorb_padding();
        net.absorb_nearest(graph, shapes);
        let mut at = 0;
        while at < net.nodes.len() {
            at += usize::from(!net.merge(at));
        }
    }
    nodes
}

fn node(i: usize, op: &Op, options: &Options) -> Node {
    let mut node = Node {
        op: i,
        merged: vec![i],
        work: Work::Copy,
        inputs: op.inputs().into_iter().map(String::from).collect(),
        skip: None,
        add_at: AddAt::default(),
        activation: Activation::None,
        dropout: None,
        fold: None,
        output: op.output().into(),
    };
    (node.work, node.activation) = match op {
        Op::Conv2d(o) => {
            node.inputs.truncate(1);
            (node.skip, node.add_at) = (o.add.clone(), o.add_at);
            let work =
                Work::Conv { kernel: o.kernel, stride: o.stride, padding: o.padding, nearest: 1, groups: o.groups };
            (work, o.activation)
        }
        Op::ConvTranspose2d(o) => {
            (Work::Transposed { kernel: o.kernel, stride: o.stride, padding: o.padding }, o.activation)
        }
        Op::UpsampleBilinear(_) => (Work::Bilinear, Activation::None),
        Op::UpsampleNearest(_) => (Work::Nearest, Activation::None),
        Op::Pad(o) => (Work::Pad(o.padding), Activation::None),
        Op::Concat(_) => (Work::Concat, Activation::None),
        Op::Add(o) => {
            node.skip = node.inputs.pop();
            (Work::Copy, o.activation)
        }
        Op::BatchNorm(o) => (Work::Affine, o.activation),
        Op::InstanceNorm(o) => (Work::Norm { groups: o.channels, eps: o.eps }, o.activation),
        Op::GroupNorm(o) => (Work::Norm { groups: o.groups, eps: o.eps }, o.activation),
        Op::Activation(o) => (Work::Copy, o.activation),
        Op::Dropout(o) => {
            node.dropout = options.dropout.then_some((i, o.p));
            (Work::Copy, Activation::None)
        }
    };
    node
}

impl Node {
    fn reads<'a>(&'a self, tensor: &'a str) -> impl Iterator<Item = &'a String> {
        self.inputs.iter().chain(&self.skip).filter(move |t| *t == tensor)
    }

    /// Nothing follows the work.
    fn bare(&self) -> bool {
        self.skip.is_none() && self.activation == Activation::None && self.dropout.is_none() && self.fold.is_none()
    }

    pub(super) fn is_conv(&self) -> bool {
        matches!(self.work, Work::Conv { .. } | Work::Transposed { .. })
    }
}

struct Net<'a> {
    nodes: &'a mut Vec<Node>,
    output: &'a str,
}

impl Net<'_> {
    fn readers(&self, tensor: &str) -> usize {
        self.nodes.iter().flat_map(|n| n.reads(tensor)).count() + usize::from(tensor == self.output)
    }

    /// Dropout that is off, and functions that do nothing, unless one makes the output.
    fn skip_identities(&mut self) {
        while let Some(at) = self.nodes.iter().position(|n| n.work == Work::Copy && n.bare() && n.output != self.output)
        {
            let gone = self.nodes.remove(at);
            self.redirect(&gone.output, &gone.inputs[0]);
        }
    }

    fn redirect(&mut self, from: &str, to: &str) {
        for tensor in self.nodes.iter_mut().flat_map(|n| n.inputs.iter_mut().chain(&mut n.skip)) {
            if tensor == from {
                *tensor = to.into();
            }
        }
    }

    /// Removes node `at`, whose result only convolutions read, after `change` has been done to
    /// their work.
    fn push_into_convolutions(&mut self, at: usize, change: impl Fn(&mut Work) -> bool) -> bool {
        let gone = self.nodes[at].clone();
        if !gone.bare() || gone.output == self.output {
            return false;
        }
        let readers = || self.nodes.iter().filter(|n| n.reads(&gone.output).next().is_some());
        let all = readers().all(|n| {
            n.inputs == [gone.output.clone()] && n.skip.as_ref() != Some(&gone.output) && change(&mut n.work.clone())
        });
        if !all || readers().count() == 0 {
            return false;
        }
        for node in self.nodes.iter_mut().filter(|n| n.inputs[0] == gone.output) {
            change(&mut node.work);
            node.merged.extend(&gone.merged);
        }
        self.redirect(&gone.output, &gone.inputs[0]);
        self.nodes.remove(at);
        true
    }

    /// Zeros around a picture are what a convolution reads there anyway.
    fn absorb_padding(&mut self) {
        let mut at = 0;
        while at < self.nodes.len() {
            let Work::Pad(pad) = self.nodes[at].work else {
                at += 1;
                continue;
            };
            let gone = self.push_into_convolutions(at, |work| match work {
                Work::Conv { padding: p, .. } => {
                    let [left, top, right, bottom] = pad.sides();
                    *p = Padding {
                        left: p.left + left,
                        top: p.top + top,
                        right: p.right + right,
                        bottom: p.bottom + bottom,
                    };
                    true
                }
                _ => false,
            });
            at += usize::from(!gone);
        }
    }

    /// Enlarging by a whole factor is another address for a convolution.
    fn absorb_nearest(&mut self, graph: &Graph, shapes: &[Shape]) {
        let mut at = 0;
        while at < self.nodes.len() {
            let node = &self.nodes[at];
            let factor = (node.work == Work::Nearest).then(|| whole_factor(graph, shapes, node)).flatten();
            let gone = factor.is_some_and(|factor| {
                self.push_into_convolutions(at, |work| match work {
                    Work::Conv { nearest, .. } if *nearest == 1 => {
                        *nearest = factor;
                        true
                    }
                    _ => false,
                })
            });
            at += usize::from(!gone);
        }
    }

    /// Merges node `at` with the one that makes its input (or one of its summands), if one epilogue
    /// can do for both.
    fn merge(&mut self, at: usize) -> bool {
        let node = self.nodes[at].clone();
        let sides: &[(usize, usize)] = if node.skip.is_some() { &[(0, 1), (1, 0)] } else { &[(0, 0)] };
        if !matches!(node.work, Work::Copy | Work::Affine) || (node.work == Work::Affine && node.skip.is_some()) {
            return false;
        }
        let read: Vec<&String> = node.inputs.iter().chain(&node.skip).collect();
        for (own, other) in sides {
            let Some(p) = self.nodes[..at].iter().position(|p| p.output == *read[*own]) else { continue };
            if self.readers(read[*own]) != 1 || matches!(self.nodes[p].work, Work::Pad(_) | Work::Concat) {
                continue;
            }
            let mut merged = self.nodes[p].clone();
            if self.nodes[p].dropout.is_some() || !join(&mut merged, &node, node.skip.is_some().then(|| read[*other])) {
                continue;
            }
            merged.merged.extend(&node.merged);
            merged.output = node.output.clone();
            self.nodes[at] = merged;
            self.nodes.remove(p);
            return true;
        }
        false
    }
}

/// Puts what `node` does after what `first` does; false if the epilogue has no room for it.
fn join(first: &mut Node, node: &Node, summand: Option<&String>) -> bool {
    if node.work == Work::Affine {
        if !first.bare() || !first.is_conv() {
            return false;
        }
        first.fold = Some(node.op);
        first.activation = node.activation;
    } else if let Some(summand) = summand {
        if first.skip.is_some() {
            return false;
        }
        (first.add_at, first.activation) = match (first.activation, node.activation) {
            (Activation::None, outer) => (AddAt::BeforeActivation, outer),
            (inner, Activation::None) => (AddAt::AfterActivation, inner),
            _ => return false,
        };
        first.skip = Some(summand.clone());
    } else if node.activation != Activation::None {
        if first.activation != Activation::None {
            return false;
        }
        // Without an activation the skip may as well join before it.
        (first.add_at, first.activation) = (AddAt::BeforeActivation, node.activation);
    }
    first.dropout = node.dropout;
    true
}

/// By which factor a nearest resampling enlarges, if it does so by a whole one in both directions.
fn whole_factor(graph: &Graph, shapes: &[Shape], node: &Node) -> Option<u32> {
    let Op::UpsampleNearest(o) = &graph.ops[node.op] else { return None };
    if let Some(scale) = o.scale {
        return Some(scale);
    }
    let source = graph.ops.iter().position(|op| op.output() == o.input).map(|i| shapes[i])?;
    let out = shapes[node.op];
    let factor = out.width / source.width;
    (factor > 0 && [source.width * factor, source.height * factor] == [out.width, out.height]).then_some(factor)
}
