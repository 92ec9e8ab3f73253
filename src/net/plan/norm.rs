//! What a norm needs to know of the picture that it scales: mean and variance of each group of
//! channels.

use super::fuse::Node;
use super::{Builder, Kind, Step, TILE};
use crate::net::graph::Shape;

impl Builder<'_> {
    /// The tensor with mean, scale and shift of each channel, and the steps that lead to it.
    pub(super) fn measure(&mut self, node: &Node, input: usize, groups: u32, eps: f32) -> usize {
        let name = self.graph.ops[node.op].name();
        let shape = self.plan.tensors[input].shape;
        let moments = self.moments(&format!("{name}.moments"), node, input);
        let three = Shape { channels: shape.vectors() * 12, height: 1, width: 1 };
        let scale = self.tensor(&format!("{name}.scale"), three, true);
        let step = self.step(&format!("{name}.scale"), Some(node.op), Kind::Merge { groups, eps }, moments, scale);
        self.push(Step { second: Some(input), ..step });
        scale
    }

    /// The tensor with the moments of tiles of `input`. A convolution measures what it makes in
    /// passing; of anything else a step of its own reads it again.
    fn moments(&mut self, name: &str, node: &Node, input: usize) -> usize {
        let shape = self.plan.tensors[input].shape;
        // Number, mean and sum of squared deviations of each tile and channel.
        let moments = |tiles| Shape { channels: shape.vectors() * 12, height: 1, width: tiles };
        let conv = |s: &Step| s.output == input && matches!(s.kind, Kind::Conv { .. } | Kind::Transposed { .. });
        let Some(maker) = self.plan.steps.iter().position(conv).filter(|_| self.measure) else {
            let tensor = self.tensor(name, moments(shape.pixels().div_ceil(TILE.into()) as u32), true);
            self.push(self.step(name, Some(node.op), Kind::Moments, input, tensor));
            return tensor;
        };
        if let Some(known) = self.plan.steps[maker].moments {
            return known;
        }
        let tensor = self.tensor(name, moments(most_tiles(self.plan.steps[maker].kind, shape)), true);
        self.plan.tensors[tensor].first = maker + 1;
        let bytes = self.plan.tensors[tensor].bytes();
        let maker = &mut self.plan.steps[maker];
        maker.moments = Some(tensor);
        maker.traffic += bytes;
        tensor
    }
}

/// Most workgroups that make a vector of channels of a convolution's picture, whichever kernel
/// runs: each measures its own. In each phase a workgroup of the plain kernel makes 16×4 pixels, of
/// the others at least 32 unless there are fewer.
fn most_tiles(kind: Kind, out: Shape) -> u32 {
    let spread = match kind {
        Kind::Transposed { stride, .. } => stride,
        Kind::Conv { stride: 1, nearest, .. } => nearest,
        _ => 1,
    };
    let [columns, rows] = [out.width, out.height].map(|edge| edge.div_ceil(spread));
    // At most 2^26 pixels.
    spread * spread * (columns * rows).div_ceil(32).max(columns.div_ceil(16) * rows.div_ceil(4))
}
