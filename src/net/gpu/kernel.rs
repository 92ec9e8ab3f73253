//! A kernel of a step: which shader with which numbers, what it binds and how many workgroups it
//! takes. Pure.

use super::kernel_config::{Facts, KernelConfig, MATRIX, MAX_UNIFORM, Tuned, Variant};
use super::layer::{Filter, Layer};
use crate::gpu::shaders::NetKernel;

/// Threads of a workgroup in x and y, as in the shaders.
pub(super) const GROUP: [u32; 2] = [16, 4];
/// Workgroups in a row of such a dispatch, half of WebGPU's default limit.
const ROW_OF_GROUPS: u32 = 1 << 15;

/// What a step binds besides the arena.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// Nothing.
    None,
    /// Matrices in a uniform buffer.
    Uniform,
    /// Matrices in a storage buffer.
    Storage,
    /// Matrices in a storage buffer, 16 bits.
    Half,
    /// Vectors for each four channels in a storage buffer: how many of them.
    Vectors(u32),
}

/// One dispatch of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Part {
    /// First block of output channels, counted through the phases.
    pub first_block: u32,
    /// How many, as the weights are stored.
    pub blocks: u32,
    /// Workgroups in z.
    pub depth: u32,
}

/// A second dispatch, which adds up what the first has made in parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sum {
    /// Shader.
    pub shader: NetKernel,
    /// Generated `const` lines.
    pub prelude: String,
    /// Workgroups.
    pub groups: [u32; 3],
    /// Bytes of the parts.
    pub bytes: u64,
}

/// Shapes in a kernel's uniform; see `shaders/net/common.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Numbers {
    pub(super) pad: [i32; 2],
    pub(super) base: [i32; 2],
    pub(super) blocks: u32,
    pub(super) parts: u32,
    pub(super) in_channels: u32,
    pub(super) in_vectors: u32,
    pub(super) in_pitch: u32,
    pub(super) out_channels: u32,
    pub(super) out_vectors: u32,
    pub(super) out_pitch: u32,
    pub(super) skip_pitch: u32,
    pub(super) group: u32,
    pub(super) tiles: u32,
    pub(super) group_inputs: u32,
}

/// How one step runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kernel {
    /// Shader.
    pub shader: NetKernel,
    /// Generated `const` lines.
    pub prelude: String,
    /// What else is bound.
    pub bound: Bound,
    /// For convolutions.
    pub filter: Option<Filter>,
    /// For convolutions.
    pub layer: Option<Layer>,
    /// For convolutions of an enlarged input whose taps are merged: the factor and the padding
    /// before.
    pub enlarged: Option<(u32, [i32; 2])>,
    /// For blocked convolutions.
    pub config: Option<KernelConfig>,
    /// Vectors of output channels of a block of weights.
    pub vectors: u32,
    /// Dispatches.
    pub parts: Vec<Part>,
    /// What follows them.
    pub sum: Option<Sum>,
    /// Workgroups in x and y.
    pub groups: [u32; 2],
    /// Shapes.
    pub numbers: Numbers,
    pub(super) blocks_per_part: u32,
}

impl Kernel {
    /// Workgroups of a dispatch.
    pub fn workgroups(&self, part: &Part) -> [u32; 3] {
        [self.groups[0], self.groups[1], part.depth]
    }

    /// Tiles of the moments that it writes or reads: of a convolution that measures what it makes
    /// one a workgroup and vector of channels.
    pub fn tiles(&self) -> u32 {
        self.numbers.tiles
    }

    /// Bytes of weights that one dispatch binds.
    pub fn bound_bytes(&self) -> u64 {
        let matrices = self.filter.map_or(0, |f| f.matrices(self.vectors)) * u64::from(self.blocks_per_part);
        match self.bound {
            Bound::None => 0,
            // As long whatever the layer has of them: an array's length is part of a shader's text,
            // and each text is compiled.
            Bound::Uniform => MAX_UNIFORM,
            Bound::Storage => matrices * MATRIX,
            Bound::Half => matrices * MATRIX / 2,
            // Whole rows.
            Bound::Vectors(n) => u64::from(n) * 16,
        }
    }
}

/// So many workgroups, in rows that the dimensions of a dispatch allow.
pub(super) fn in_rows(groups: u32) -> [u32; 2] {
    [groups.min(ROW_OF_GROUPS), groups.div_ceil(ROW_OF_GROUPS)]
}

/// On what the choice of a kernel depends besides its step.
pub struct Choice<'a> {
    /// What is asked for.
    pub variant: Variant,
    /// What has been measured.
    pub tuned: &'a Tuned,
    /// What the device can do.
    pub facts: Facts,
}

/// Lines before a shader's text: `const`s, and the optional feature that it needs.
#[derive(Default)]
pub(super) struct Prelude {
    pub feature: &'static str,
    numbers: Vec<(&'static str, u32)>,
}

impl Prelude {
    pub fn add(&mut self, name: &'static str, value: u32) {
        self.numbers.push((name, value));
    }

    pub fn text(&self) -> String {
        let lines = self.numbers.iter().map(|(name, value)| format!("const {name} = {value}u;\n"));
        std::iter::once(self.feature.to_string()).chain(lines).collect()
    }
}
