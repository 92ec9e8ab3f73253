//! Which kernel runs a step, its prelude, how its weights are packed, and how many workgroups it takes. Pure.
//!
//! Packed weights: output channels in blocks of eight. A block is one matrix with the bias in its first two columns, then for
//! each tap column kx, input vector c, tap row ky, and half h of the block one 4×4 matrix, which takes four input channels to
//! four output channels. Channels that only pad are zero.

use super::super::graph::{Activation, AddAt};
use super::super::plan::{Kind, Plan, Step};

/// Bytes of one matrix.
const MATRIX: u64 = 64;
/// WebGPU's default limit of one uniform binding.
const MAX_UNIFORM: u64 = 64 << 10;
/// Threads of a workgroup in x and y, as in the shaders.
const GROUP: [u32; 2] = [16, 4];

/// Which family of convolution kernels to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Variant {
    /// Register-blocked, weights in uniform buffers where they fit.
    #[default]
    Blocked,
    /// Register-blocked, weights always in storage buffers.
    BlockedStorage,
    /// One pixel and four channels a thread; the yardstick.
    Plain,
}

/// How one step runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kernel {
    /// Name in `gpu::shaders::NET`.
    pub shader: &'static str,
    /// Generated `const` lines.
    pub prelude: String,
    /// Weights are bound as a uniform buffer.
    pub uniform: bool,
    /// Blocks of eight output channels of the whole layer; 0 without weights.
    pub blocks: u32,
    /// Blocks that one dispatch takes.
    pub blocks_per_dispatch: u32,
    /// Workgroups in x and y, and in z for each block (convolutions) or in all.
    pub groups: [u32; 3],
    /// Matrices of one block.
    matrices: u64,
}

impl Kernel {
    /// Chooses for `step`.
    pub fn choose(plan: &Plan, step: &Step, variant: Variant) -> Self {
        let out = plan.tensors[step.output].shape;
        let in_vectors = plan.tensors[step.input].shape.channels.div_ceil(4);
        let out_vectors = out.channels.div_ceil(4);
        let add = match (step.skip, step.add_at) {
            (None, _) => 0,
            (Some(_), AddAt::BeforeActivation) => 1,
            (Some(_), AddAt::AfterActivation) => 2,
        };
        let activation = u32::from(step.activation == Activation::Relu);
        let mut consts = vec![("ACTIVATION", activation), ("ADD", add), ("OUT_VECTORS", out_vectors)];
        let mut kernel = Kernel {
            shader: if step.kind == Kind::Upsample { "net.upsample" } else { "net.add" },
            prelude: String::new(),
            uniform: false,
            blocks: 0,
            blocks_per_dispatch: 0,
            groups: [out.width.div_ceil(GROUP[0]), out.height.div_ceil(GROUP[1]), out_vectors],
            matrices: 0,
        };
        if let Kind::Conv { kernel: [h, w], stride, padding } = step.kind {
            let shape = [("KERNEL_H", h), ("KERNEL_W", w), ("STRIDE", stride), ("PADDING", padding)];
            consts.extend(shape);
            consts.push(("IN_VECTORS", in_vectors));
            kernel.matrices = 1 + u64::from(w) * u64::from(h) * u64::from(in_vectors) * 2;
            kernel.blocks = out.channels.div_ceil(8);
            let fit = (MAX_UNIFORM / (kernel.matrices * MATRIX)) as u32;
            kernel.uniform = variant == Variant::Blocked && fit > 0;
            let dispatches = if kernel.uniform { kernel.blocks.div_ceil(fit) } else { 1 };
            kernel.blocks_per_dispatch = kernel.blocks.div_ceil(dispatches);
            let row = ([h, w], stride, padding) == ([3, 3], 1, 1);
            kernel.shader = match (variant, row, kernel.uniform) {
                (Variant::Plain, ..) => "net.conv_plain",
                (_, true, true) => "net.conv3x3",
                (_, true, false) => "net.conv3x3_wide",
                (_, false, true) => "net.conv_block",
                (_, false, false) => "net.conv_block_wide",
            };
            if kernel.uniform {
                consts.push(("MATRICES", (kernel.matrices * u64::from(kernel.blocks_per_dispatch)) as u32));
            }
            kernel.groups = match variant {
                Variant::Plain => [kernel.groups[0], kernel.groups[1], 2],
                _ => [kernel.groups[0], out.height.div_ceil(GROUP[1] * 8), 1],
            };
        }
        kernel.prelude = consts.iter().map(|(name, value)| format!("const {name} = {value}u;\n")).collect();
        kernel
    }

    /// First block of each dispatch with the number of its blocks; one entry (0, 0) for a step without weights.
    pub fn dispatches(&self) -> Vec<(u32, u32)> {
        if self.blocks == 0 {
            return vec![(0, 0)];
        }
        let step = self.blocks_per_dispatch;
        (0..self.blocks).step_by(step as usize).map(|first| (first, step.min(self.blocks - first))).collect()
    }

    /// Workgroups of a dispatch of `blocks` blocks.
    pub fn workgroups(&self, blocks: u32) -> [u32; 3] {
        [self.groups[0], self.groups[1], self.groups[2] * blocks.max(1)]
    }

    /// Bytes of the weights that one dispatch binds.
    pub fn bound_bytes(&self) -> u64 {
        self.matrices * MATRIX * u64::from(self.blocks_per_dispatch)
    }

    /// Packs a layer: `weight` [O, I, kh, kw] and `bias` (O values) to the matrices of each dispatch, one vector a dispatch.
    pub fn pack(&self, weight: &[f32], bias: &[f32], in_channels: usize, [kh, kw]: [usize; 2]) -> Vec<Vec<f32>> {
        let in_vectors = in_channels.div_ceil(4);
        let at = |o: usize, i: usize, ky: usize, kx: usize| {
            let inside = o < bias.len() && i < in_channels;
            if inside { weight[((o * in_channels + i) * kh + ky) * kw + kx] } else { 0.0 }
        };
        let block = |b: usize| {
            let mut m: Vec<f32> =
                (0..16).map(|i| if i < 8 { bias.get(b * 8 + i).copied().unwrap_or(0.0) } else { 0.0 }).collect();
            for kx in 0..kw {
                for c in 0..in_vectors {
                    for ky in 0..kh {
                        for half in 0..2 {
                            // Column-major: column k takes input channel k to the four outputs.
                            m.extend((0..16).map(|k| at(b * 8 + half * 4 + k % 4, c * 4 + k / 4, ky, kx)));
                        }
                    }
                }
            }
            m
        };
        let pack = |(first, count): (u32, u32)| {
            let mut packed: Vec<f32> = (first..first + count).flat_map(|b| block(b as usize)).collect();
            packed.resize(self.bound_bytes() as usize / 4, 0.0);
            packed
        };
        self.dispatches().into_iter().map(pack).collect()
    }
}

/// One prelude of each kind with the shader it belongs to, so that a test can validate every permutation without a GPU.
pub fn example_preludes() -> Vec<(&'static str, String)> {
    let mut examples = Vec::new();
    let shaders = crate::gpu::shaders::NET.iter().map(|s| s.name);
    for shader in shaders {
        for (activation, add) in [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2)] {
            for (edge, stride) in [(3, 1), (3, 2), (1, 1), (5, 3)] {
                let mut prelude =
                    format!("const ACTIVATION = {activation}u;\nconst ADD = {add}u;\nconst OUT_VECTORS = 4u;\n");
                if shader.contains("conv") {
                    prelude.push_str(&format!(
                        "const KERNEL_H = {edge}u;\nconst KERNEL_W = {edge}u;\nconst STRIDE = {stride}u;\n"
                    ));
                    prelude.push_str(&format!("const PADDING = {}u;\nconst IN_VECTORS = 6u;\n", edge / 2));
                    prelude.push_str("const MATRICES = 218u;\n");
                }
                if !examples.contains(&(shader, prelude.clone()))
                    && (edge == 3 && stride == 1 || !shader.contains("conv3x3"))
                {
                    examples.push((shader, prelude));
                }
            }
        }
    }
    examples
}
