//! Which kernel runs a step, its numbers, and how many workgroups it takes. Pure. Convolutions are in [`super::conv`].

use super::super::graph::AddAt;
use super::super::plan::{Kind, Plan, Precision, Step};
use super::conv::Filter;
use super::permutation::{Facts, Layer as ConvLayer, MATRIX, Permutation, ROW, Tuned, Variant, mirrors};

/// Threads of a workgroup in x and y, as in the shaders.
pub(super) const GROUP: [u32; 2] = [16, 4];
/// Threads of a workgroup that counts what it makes in one row.
pub(super) const THREADS: u32 = 64;
/// Rows that a thread of `scale.wgsl` makes.
const ROWS_OF_SCALE: u32 = 8;
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
    /// Matrices in a texture, a column a texel.
    Texture,
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
    /// Name, one of `gpu::shaders::net_names`.
    pub shader: String,
    /// Generated `const` lines.
    pub prelude: String,
    /// Workgroups.
    pub groups: [u32; 3],
    /// Bytes of the parts.
    pub bytes: u64,
}

/// What a kernel is told in its uniform about shapes; see `shaders/net/common.wgsl`.
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
    /// Name, one of `gpu::shaders::net_names`.
    pub shader: String,
    /// Generated `const` lines.
    pub prelude: String,
    /// What else is bound.
    pub bound: Bound,
    /// For convolutions.
    pub filter: Option<Filter>,
    /// For convolutions.
    pub layer: Option<ConvLayer>,
    /// For convolutions of an enlarged input whose taps are merged: the factor and the padding before.
    pub enlarged: Option<(u32, [i32; 2])>,
    /// Weights of 3×3 taps come transformed for Winograd's F(n, 3) along rows, 3×(n + 2) matrices: n, or 0 where they do not.
    pub winograd: u32,
    /// For blocked convolutions.
    pub permutation: Option<Permutation>,
    /// It reads its input and its skip from the mirror.
    pub mirror: bool,
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
    /// Chooses for `step`.
    pub fn choose(plan: &Plan, step: &Step, choice: &Choice<'_>) -> Self {
        let half = plan.precision == Precision::F16;
        let (input, output) = (&plan.tensors[step.input], &plan.tensors[step.output]);
        let out = output.shape;
        let mut prelude = Prelude::default();
        if !matches!(step.kind, Kind::Window { .. } | Kind::Moments | Kind::Merge { .. }) {
            let add = match (step.skip, step.add_at) {
                (None, _) => 0,
                (Some(_), AddAt::BeforeActivation) => 1,
                (Some(_), AddAt::AfterActivation) => 2,
            };
            prelude.add("ACTIVATION", step.activation.code());
            prelude.add("ADD", add);
            prelude.add("DROPOUT", step.dropout.is_some().into());
            prelude.add("OUT_FULL", (half && output.full).into());
        }
        let numbers = Numbers {
            pad: [0, 0],
            base: [0, 0],
            blocks: 1,
            parts: 1,
            in_channels: input.shape.channels,
            in_vectors: input.shape.vectors(),
            in_pitch: input.pitch,
            out_channels: out.channels,
            out_vectors: out.vectors(),
            out_pitch: output.pitch,
            skip_pitch: step.skip.map_or(0, |s| plan.tensors[s].pitch),
            group: 1,
            tiles: 0,
            group_inputs: 0,
        };
        let mut kernel = Kernel {
            shader: String::new(),
            prelude: String::new(),
            bound: Bound::None,
            filter: None,
            layer: None,
            enlarged: None,
            winograd: 0,
            permutation: None,
            mirror: false,
            vectors: 0,
            parts: vec![Part { first_block: 0, blocks: 0, depth: out.vectors() }],
            sum: None,
            groups: [out.width.div_ceil(GROUP[0]), out.height.div_ceil(GROUP[1])],
            numbers,
            blocks_per_part: 0,
        };
        let shader: String = match step.kind {
            Kind::Conv { .. } | Kind::Transposed { .. } => kernel.convolution(&mut prelude, step, plan, choice),
            Kind::Upsample => {
                let double = [input.shape.width * 2, input.shape.height * 2] == [out.width, out.height];
                prelude.add("DOUBLE", double.into());
                if double {
                    // Blocks of two by two begin one pixel before the picture.
                    let blocks = |edge: u32, group: u32| (edge / 2 + 1).div_ceil(group);
                    kernel.groups = [blocks(out.width, GROUP[0]), blocks(out.height, GROUP[1])];
                }
                "upsample".into()
            }
            Kind::Nearest => "nearest".into(),
            Kind::Copy => "add".into(),
            Kind::Window { left, top, clamp, channel } => {
                kernel.numbers.pad = [left as i32, top as i32];
                prelude.add("CLAMP", clamp.into());
                prelude.add("IN_FULL", input.full.into());
                prelude.add("OUT_FULL", output.full.into());
                kernel.parts[0].depth = (channel % 4 + input.shape.channels).div_ceil(4);
                "window".into()
            }
            Kind::Moments => {
                // At most 2^26 pixels and 1,024 vectors.
                kernel.numbers.tiles = out.width;
                kernel.groups = in_rows((out.width * input.shape.vectors()).div_ceil(THREADS));
                kernel.parts[0].depth = 1;
                "moments".into()
            }
            Kind::Merge { groups, .. } => {
                // The moments' picture says how many channels there are.
                let picture = step.second.map_or(input.shape, |s| plan.tensors[s].shape);
                kernel.numbers.in_vectors = picture.vectors();
                kernel.numbers.out_channels = picture.channels;
                kernel.numbers.group = picture.channels / groups.max(1);
                let maker = plan.steps.iter().find(|s| s.moments.unwrap_or(s.output) == step.input);
                kernel.numbers.tiles = maker.map_or(0, |maker| Self::choose(plan, maker, choice).numbers.tiles);
                kernel.groups = [groups, 1];
                kernel.parts[0].depth = 1;
                kernel.bound = Bound::Vectors(2 * picture.vectors());
                "merge".into()
            }
            Kind::Scale { fixed: false } => "norm".into(),
            Kind::Scale { fixed: true } => {
                kernel.bound = Bound::Vectors(3 * out.vectors());
                "batch_norm".into()
            }
            Kind::Shuffle(factor) | Kind::Unshuffle(factor) => {
                prelude.add("FACTOR", factor);
                prelude.add("DOWN", matches!(step.kind, Kind::Unshuffle(_)).into());
                "shuffle".into()
            }
        };
        if matches!(step.kind, Kind::Scale { .. }) {
            prelude.add("IN_FULL", (half && input.full).into());
            kernel.groups[1] = out.height.div_ceil(GROUP[1] * ROWS_OF_SCALE);
        }
        let light = matches!(step.kind, Kind::Upsample | Kind::Copy | Kind::Moments | Kind::Scale { .. });
        // What is in 32 bits whatever the plan's precision has no mirror.
        let same = step.reads().all(|t| !half || !plan.tensors[t].full || Some(t) == step.second);
        let mirror = if light && same && choice.mirrors(plan) { "_mirror" } else { "" };
        kernel.mirror |= !mirror.is_empty();
        let reads_mirror = ["_lanes", "_mirror"].iter().any(|end| format!("{shader}{mirror}").ends_with(end));
        let kind = match (half, reads_mirror && choice.facts.words && step.kind != Kind::Moments) {
            (true, _) => "_half",
            (false, true) => "_words",
            (false, false) => "",
        };
        let measured = if step.moments.is_some() && kernel.sum.is_none() { "_measured" } else { "" };
        kernel.shader = format!("net.{shader}{mirror}{kind}{measured}");
        kernel.prelude = prelude.text();
        kernel
    }

    /// Workgroups of a dispatch.
    pub fn workgroups(&self, part: &Part) -> [u32; 3] {
        [self.groups[0], self.groups[1], part.depth]
    }

    /// Tiles of the moments that it writes or reads: of a convolution that measures what it makes one a workgroup and vector of channels.
    pub fn tiles(&self) -> u32 {
        self.numbers.tiles
    }

    /// Bytes of a texel of weights.
    pub fn texel(&self) -> u64 {
        if self.layer.is_some_and(|l| l.precision == Precision::F16) { 8 } else { 16 }
    }

    /// Bytes of weights that one dispatch binds.
    pub fn bound_bytes(&self) -> u64 {
        let matrices = self.filter.map_or(0, |f| f.matrices(self.vectors)) * u64::from(self.blocks_per_part);
        match self.bound {
            Bound::None => 0,
            Bound::Uniform => matrices.next_power_of_two() * MATRIX,
            Bound::Storage => matrices * MATRIX,
            Bound::Half => matrices * MATRIX / 2,
            // Whole rows.
            Bound::Texture => (matrices * 4).next_multiple_of(ROW) * self.texel(),
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

impl Choice<'_> {
    /// Kernels that are no convolutions read from the mirror: on processors, unless one kind of kernel is asked for.
    fn mirrors(&self, plan: &Plan) -> bool {
        let wanted = match self.variant {
            Variant::Auto => self.facts.software,
            Variant::Fixed(permutation) => permutation.mirror,
            Variant::Plain => false,
        };
        wanted && mirrors(plan)
    }
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
