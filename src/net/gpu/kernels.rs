//! Which kernel runs a step, its prelude, and how many workgroups it takes. Pure.

use super::super::graph::{AddAt, Padding};
use super::super::plan::{Kind, Plan, Precision, Step};
use crate::net::graph::Shape;

/// Bytes of one matrix of weights in 32 bits.
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

/// The convolution kernel's view of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Filter {
    /// Taps, height and width; of one phase, for a transposed convolution.
    pub taps: [u32; 2],
    /// Distance of input pixels.
    pub stride: u32,
    /// Distance of output pixels: the stride of a transposed convolution.
    pub spread: u32,
    /// Factor by which the input is enlarged.
    pub nearest: u32,
    /// Four-channel vectors read.
    pub in_vectors: u32,
}

impl Filter {
    /// Matrices of one block of eight output channels.
    pub fn matrices(self) -> u64 {
        1 + u64::from(self.taps[0]) * u64::from(self.taps[1]) * u64::from(self.in_vectors) * 2
    }
}

/// One dispatch of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Column and row of the first output pixel, for a transposed convolution.
    pub phase: [u32; 2],
    /// Padding at the left and the top.
    pub pad: [i32; 2],
    /// First block of eight output channels.
    pub first_block: u32,
    /// How many.
    pub blocks: u32,
}

/// How one step runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Kernel {
    /// Name in `gpu::shaders::NET`.
    pub shader: String,
    /// Generated `const` lines.
    pub prelude: String,
    /// What else is bound.
    pub bound: Bound,
    /// For convolutions.
    pub filter: Option<Filter>,
    /// Dispatches.
    pub parts: Vec<Part>,
    /// Workgroups in x and y, and in z for each block (convolutions) or in all.
    pub groups: [u32; 3],
    blocks_per_part: u32,
}

impl Kernel {
    /// Chooses for `step`.
    pub fn choose(plan: &Plan, step: &Step, variant: Variant) -> Self {
        let half = plan.precision == Precision::F16;
        let (input, output) = (&plan.tensors[step.input], &plan.tensors[step.output]);
        let out = output.shape;
        let mut prelude = Prelude::default();
        prelude.add("OUT_CHANNELS", out.channels);
        prelude.add("OUT_VECTORS", out.vectors());
        prelude.add("OUT_PITCH", output.pitch);
        prelude.add("IN_VECTORS", input.shape.vectors());
        prelude.add("IN_PITCH", input.pitch);
        if !matches!(step.kind, Kind::Window { .. } | Kind::Moments | Kind::Merge { .. }) {
            let add = match (step.skip, step.add_at) {
                (None, _) => 0,
                (Some(_), AddAt::BeforeActivation) => 1,
                (Some(_), AddAt::AfterActivation) => 2,
            };
            prelude.add("ACTIVATION", step.activation.code());
            prelude.add("ADD", add);
            prelude.add("DROPOUT", step.dropout.is_some().into());
            prelude.add("SKIP_PITCH", step.skip.map_or(0, |s| plan.tensors[s].pitch));
        }
        let mut kernel = Kernel {
            shader: String::new(),
            prelude: String::new(),
            bound: Bound::None,
            filter: None,
            parts: vec![Part { phase: [0, 0], pad: [0, 0], first_block: 0, blocks: 0 }],
            groups: [out.width.div_ceil(GROUP[0]), out.height.div_ceil(GROUP[1]), out.vectors()],
            blocks_per_part: 0,
        };
        let shader = match step.kind {
            Kind::Conv { kernel: [h, w], stride, padding, nearest } => {
                let pad = [padding.left as i32, padding.top as i32];
                let filter = Filter { taps: [h, w], stride, spread: 1, nearest, in_vectors: input.shape.vectors() };
                let row = ([h, w], stride, padding) == ([3, 3], 1, Padding::all(1));
                let family = Family { variant, half, row };
                kernel.convolution(&mut prelude, filter, &[([0, 0], pad)], out, family)
            }
            Kind::Transposed { kernel: edges, stride, padding } => {
                let taps = edges.map(|k| k.div_ceil(stride));
                let filter = Filter { taps, stride: 1, spread: stride, nearest: 1, in_vectors: input.shape.vectors() };
                let pad = |phase: u32, taps: u32| taps as i32 - 1 - ((phase + padding) / stride) as i32;
                let phases: Vec<_> = (0..stride * stride)
                    .map(|i| [i % stride, i / stride])
                    .map(|[x, y]| ([x, y], [pad(x, taps[1]), pad(y, taps[0])]))
                    .collect();
                kernel.convolution(&mut prelude, filter, &phases, out, Family { variant, half, row: false })
            }
            Kind::Upsample => "net.upsample",
            Kind::Nearest => "net.nearest",
            Kind::Copy => "net.add",
            Kind::Window { left, top, clamp, channel } => {
                kernel.parts[0].pad = [left as i32, top as i32];
                let lane = channel % 4;
                prelude.add("IN_CHANNELS", input.shape.channels);
                prelude.add("CLAMP", clamp.into());
                prelude.add("LANE", lane);
                prelude.add("IN_FULL", input.full.into());
                prelude.add("OUT_FULL", output.full.into());
                kernel.groups[2] = (lane + input.shape.channels).div_ceil(4);
                "net.window"
            }
            Kind::Moments => {
                let tiles = output.shape.width;
                kernel.groups = [input.shape.vectors().div_ceil(GROUP[0]), tiles.div_ceil(GROUP[1]), 1];
                "net.moments"
            }
            Kind::Merge { groups, .. } => {
                // The moments' picture says how many channels there are.
                let picture = step.second.map_or(input.shape, |s| plan.tensors[s].shape);
                prelude.set("IN_VECTORS", picture.vectors());
                prelude.add("CHANNELS", picture.channels);
                prelude.add("PER_GROUP", picture.channels / groups.max(1));
                kernel.groups = [groups, 1, 1];
                kernel.bound = Bound::Vectors(2 * picture.vectors());
                "net.merge"
            }
            Kind::Scale { fixed: false } => "net.norm",
            Kind::Scale { fixed: true } => {
                kernel.bound = Bound::Vectors(3 * out.vectors());
                "net.batch_norm"
            }
            Kind::Shuffle(factor) | Kind::Unshuffle(factor) => {
                prelude.add("FACTOR", factor);
                prelude.add("DOWN", matches!(step.kind, Kind::Unshuffle(_)).into());
                "net.shuffle"
            }
        };
        kernel.shader = if half && !shader.ends_with("_half") { format!("{shader}_half") } else { shader.into() };
        kernel.prelude = prelude.text();
        kernel
    }

    /// Fills in what a convolution needs and names its shader. `phases`: first output pixel and padding of each.
    fn convolution(
        &mut self,
        prelude: &mut Prelude,
        filter: Filter,
        phases: &[([u32; 2], [i32; 2])],
        out: Shape,
        Family { variant, half, row }: Family,
    ) -> &'static str {
        prelude.add("KERNEL_H", filter.taps[0]);
        prelude.add("KERNEL_W", filter.taps[1]);
        prelude.add("STRIDE", filter.stride);
        prelude.add("SPREAD", filter.spread);
        prelude.add("NEAREST", filter.nearest);
        self.filter = Some(filter);
        let blocks = out.channels.div_ceil(8);
        let fit = (MAX_UNIFORM / (filter.matrices() * MATRIX)) as u32;
        self.bound = match variant {
            _ if half => Bound::Half,
            Variant::Blocked if fit > 0 => Bound::Uniform,
            _ => Bound::Storage,
        };
        let uniform = self.bound == Bound::Uniform;
        let dispatches = if uniform { blocks.div_ceil(fit) } else { 1 };
        self.blocks_per_part = blocks.div_ceil(dispatches);
        let part = |(phase, pad): ([u32; 2], [i32; 2])| {
            let each = self.blocks_per_part;
            (0..blocks).step_by(each as usize).map(move |first_block| {
                let blocks = each.min(blocks - first_block);
                Part { phase, pad, first_block, blocks }
            })
        };
        self.parts = phases.iter().copied().flat_map(part).collect();
        if uniform {
            prelude.add("MATRICES", (filter.matrices() * u64::from(self.blocks_per_part)) as u32);
        }
        let [columns, rows] = [out.width, out.height].map(|edge| edge.div_ceil(filter.spread));
        let [rows_each, z] = if variant == Variant::Plain { [1, 2] } else { [8, 1] };
        self.groups = [columns.div_ceil(GROUP[0]), rows.div_ceil(GROUP[1] * rows_each), z];
        match (variant, row, self.bound) {
            (Variant::Plain, ..) => "net.conv_plain",
            (_, true, Bound::Uniform) => "net.conv3x3",
            (_, true, Bound::Half) => "net.conv3x3_half",
            (_, true, _) => "net.conv3x3_wide",
            (_, false, Bound::Uniform) => "net.conv_block",
            (_, false, Bound::Half) => "net.conv_block_half",
            (_, false, _) => "net.conv_block_wide",
        }
    }

    /// Workgroups of a dispatch of `blocks` blocks.
    pub fn workgroups(&self, blocks: u32) -> [u32; 3] {
        [self.groups[0], self.groups[1], self.groups[2] * blocks.max(1)]
    }

    /// Bytes of weights that one dispatch binds.
    pub fn bound_bytes(&self) -> u64 {
        let matrices = self.filter.map_or(0, Filter::matrices) * u64::from(self.blocks_per_part);
        match self.bound {
            Bound::None => 0,
            Bound::Uniform | Bound::Storage => matrices * MATRIX,
            Bound::Half => matrices * MATRIX / 2,
            Bound::Vectors(n) => u64::from(n) * 16,
        }
    }
}

/// Which convolution kernel is wanted.
struct Family {
    variant: Variant,
    half: bool,
    /// 3×3, stride 1, padding 1.
    row: bool,
}

/// Lines of `const`.
#[derive(Default)]
struct Prelude(Vec<(&'static str, u32)>);

impl Prelude {
    fn add(&mut self, name: &'static str, value: u32) {
        self.0.push((name, value));
    }

    fn set(&mut self, name: &'static str, value: u32) {
        self.0.retain(|(n, _)| *n != name);
        self.add(name, value);
    }

    fn text(&self) -> String {
        self.0.iter().map(|(name, value)| format!("const {name} = {value}u;\n")).collect()
    }
}
