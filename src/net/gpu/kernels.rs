//! Which kernel runs a step, its prelude, and how many workgroups it takes. Pure.

use super::super::graph::{AddAt, Padding};
use super::super::plan::{Kind, Plan, Precision, Step};
use super::permutation::{Facts, Layer as ConvLayer, MATRIX, Permutation, ROW, Source, Tuned, Variant, mirrors};
use crate::net::graph::Shape;

/// Threads of a workgroup in x and y, as in the shaders.
const GROUP: [u32; 2] = [16, 4];
/// Threads of a workgroup of a blocked convolution, each with a tile of 2×4 pixels.
const TILES: u32 = 64;
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

/// The convolution kernel's view of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Filter {
    /// Taps, height and width; of one phase, for a transposed convolution.
    pub taps: [u32; 2],
    /// Distance of input pixels.
    pub stride: u32,
    /// Distance of output pixels: the stride of a transposed convolution.
    pub spread: u32,
    /// Factor by which the input is enlarged.
    pub nearest: u32,
    /// Four-channel vectors read for each output.
    pub in_vectors: u32,
    /// Four-channel vectors written that read the same: those of a group of channels, or all.
    pub group_vectors: u32,
}

impl Filter {
    /// Matrices of one block of `vectors` vectors of output channels.
    pub fn matrices(self, vectors: u32) -> u64 {
        1 + u64::from(self.taps[0]) * u64::from(self.taps[1]) * u64::from(self.in_vectors) * u64::from(vectors)
    }
}

/// One dispatch of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Column and row of the first output pixel, for a transposed convolution.
    pub phase: [u32; 2],
    /// Padding at the left and the top.
    pub pad: [i32; 2],
    /// First block of output channels.
    pub first_block: u32,
    /// How many.
    pub blocks: u32,
}

/// First output pixel of a phase, and its padding.
type Phase = ([u32; 2], [i32; 2]);

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
    /// For convolutions.
    pub layer: Option<ConvLayer>,
    /// For convolutions of an enlarged input whose taps are merged: the factor and the padding before.
    pub enlarged: Option<(u32, [i32; 2])>,
    /// Weights of 3×3 taps come transformed for Winograd's F(2, 3) along rows: 3×4 matrices.
    pub pairs: bool,
    /// For blocked convolutions.
    pub permutation: Option<Permutation>,
    /// It reads its input and its skip from the mirror.
    pub mirror: bool,
    /// Vectors of output channels of a block of weights.
    pub vectors: u32,
    /// Dispatches.
    pub parts: Vec<Part>,
    /// Workgroups in x and y, and in z for each block (convolutions) or in all.
    pub groups: [u32; 3],
    blocks_per_part: u32,
}

impl Kernel {
    /// Chooses for `step`.
    pub fn choose(plan: &Plan, step: &Step, choice: &Choice<'_>) -> Self {
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
            layer: None,
            enlarged: None,
            pairs: false,
            permutation: None,
            mirror: false,
            vectors: 0,
            parts: vec![Part { phase: [0, 0], pad: [0, 0], first_block: 0, blocks: 0 }],
            groups: [out.width.div_ceil(GROUP[0]), out.height.div_ceil(GROUP[1]), out.vectors()],
            blocks_per_part: 0,
        };
        let shader: String = match step.kind {
            Kind::Conv { kernel: [h, w], stride, padding, nearest, groups } => {
                // Groups of whole vectors read their own; others run as one, with zeros for what they do not see.
                let whole = [input.shape.channels, out.channels].iter().all(|n| n.is_multiple_of(4 * groups));
                let groups = if whole && choice.variant != Variant::Plain { groups } else { 1 };
                let [in_vectors, group_vectors] = [input.shape, out].map(|s| s.vectors() / groups);
                let pad = [padding.left as i32, padding.top as i32];
                if nearest > 1 && stride == 1 && choice.variant != Variant::Plain {
                    let (taps, phases) = merged([h, w], pad, nearest as i32);
                    let filter = Filter { taps, stride, spread: nearest, nearest: 1, in_vectors, group_vectors };
                    kernel.enlarged = Some((nearest, pad));
                    kernel.convolution(&mut prelude, filter, &phases, out, false, plan, choice)
                } else {
                    let filter = Filter { taps: [h, w], stride, spread: 1, nearest, in_vectors, group_vectors };
                    let row = ([h, w], stride, padding) == ([3, 3], 1, Padding::all(1));
                    kernel.convolution(&mut prelude, filter, &[([0, 0], pad)], out, row, plan, choice)
                }
            }
            Kind::Transposed { kernel: edges, stride, padding } => {
                let taps = edges.map(|k| k.div_ceil(stride));
                let [in_vectors, group_vectors] = [input.shape, out].map(Shape::vectors);
                let filter = Filter { taps, stride: 1, spread: stride, nearest: 1, in_vectors, group_vectors };
                let pad = |phase: u32, taps: u32| taps as i32 - 1 - ((phase + padding) / stride) as i32;
                let phases: Vec<_> = (0..stride * stride)
                    .map(|i| [i % stride, i / stride])
                    .map(|[x, y]| ([x, y], [pad(x, taps[1]), pad(y, taps[0])]))
                    .collect();
                kernel.convolution(&mut prelude, filter, &phases, out, false, plan, choice)
            }
            Kind::Upsample => {
                let double = [input.shape.width * 2, input.shape.height * 2] == [out.width, out.height];
                prelude.add("DOUBLE", double.into());
                if double {
                    // Blocks of two by two begin one pixel before the picture.
                    let blocks = |edge: u32, group: u32| (edge / 2 + 1).div_ceil(group);
                    kernel.groups = [blocks(out.width, GROUP[0]), blocks(out.height, GROUP[1]), out.vectors()];
                }
                "upsample".into()
            }
            Kind::Nearest => "nearest".into(),
            Kind::Copy => "add".into(),
            Kind::Window { left, top, clamp, channel } => {
                kernel.parts[0].pad = [left as i32, top as i32];
                let lane = channel % 4;
                prelude.add("IN_CHANNELS", input.shape.channels);
                prelude.add("CLAMP", clamp.into());
                prelude.add("LANE", lane);
                prelude.add("IN_FULL", input.full.into());
                prelude.add("OUT_FULL", output.full.into());
                kernel.groups[2] = (lane + input.shape.channels).div_ceil(4);
                "window".into()
            }
            Kind::Moments => {
                // At most 2^26 pixels and 1,024 vectors.
                let groups = (output.shape.width * input.shape.vectors()).div_ceil(TILES);
                kernel.groups = [groups.min(ROW_OF_GROUPS), groups.div_ceil(ROW_OF_GROUPS), 1];
                "moments".into()
            }
            Kind::Merge { groups, .. } => {
                // The moments' picture says how many channels there are.
                let picture = step.second.map_or(input.shape, |s| plan.tensors[s].shape);
                prelude.set("IN_VECTORS", picture.vectors());
                prelude.add("CHANNELS", picture.channels);
                prelude.add("PER_GROUP", picture.channels / groups.max(1));
                kernel.groups = [groups, 1, 1];
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
            kernel.groups[1] = out.height.div_ceil(GROUP[1] * ROWS_OF_SCALE);
        }
        let light = matches!(step.kind, Kind::Upsample | Kind::Copy | Kind::Moments | Kind::Scale { .. });
        // What is in 32 bits whatever the plan's precision has no mirror.
        let same = step.reads().all(|t| !half || !plan.tensors[t].full || Some(t) == step.second);
        let mirror = if light && same && choice.mirrors(plan) { "_mirror" } else { "" };
        kernel.mirror |= !mirror.is_empty();
        kernel.shader = format!("net.{shader}{mirror}{}", if half { "_half" } else { "" });
        kernel.prelude = prelude.text();
        kernel
    }

    /// Fills in what a convolution needs and names its shader. `phases`: first output pixel and padding of each; `row`: 3×3,
    /// stride 1, padding 1.
    #[allow(clippy::too_many_arguments, reason = "one caller, and every one is needed")]
    fn convolution(
        &mut self,
        prelude: &mut Prelude,
        filter: Filter,
        phases: &[Phase],
        out: Shape,
        row: bool,
        plan: &Plan,
        choice: &Choice<'_>,
    ) -> String {
        let half = plan.precision == Precision::F16;
        let size = [out.width, out.height];
        let layer = ConvLayer { filter, out_vectors: out.vectors(), size, precision: plan.precision };
        let permutation = layer.permutation(choice.variant, choice.tuned, plan, choice.facts);
        self.pairs = row && permutation.is_some_and(|p| p.weights == Source::Lanes);
        let filter = if self.pairs { Filter { taps: [3, 4], ..filter } } else { filter };
        (self.filter, self.layer, self.permutation) = (Some(filter), Some(layer), permutation);
        let Permutation { weights, mirror, vectors } = permutation.unwrap_or(Permutation {
            weights: Source::Storage,
            mirror: false,
            vectors: out.vectors().min(2),
        });
        (self.mirror, self.vectors) = (mirror, vectors);
        self.bound = match weights {
            Source::Lanes => Bound::Texture,
            Source::Uniform => Bound::Uniform,
            Source::Storage if half => Bound::Half,
            Source::Storage => Bound::Storage,
        };
        let uniform = self.bound == Bound::Uniform;
        let blocks = out.vectors().div_ceil(vectors);
        let dispatches = if uniform { blocks.div_ceil(layer.uniform_blocks(vectors)) } else { 1 };
        self.blocks_per_part = blocks.div_ceil(dispatches);
        let part = |(phase, pad): Phase| {
            let each = self.blocks_per_part;
            (0..blocks).step_by(each as usize).map(move |first_block| {
                let blocks = each.min(blocks - first_block);
                Part { phase, pad, first_block, blocks }
            })
        };
        self.parts = phases.iter().copied().flat_map(part).collect();
        prelude.set("IN_VECTORS", filter.in_vectors);
        prelude.add("GROUP_VECTORS", filter.group_vectors);
        prelude.add("KERNEL_H", filter.taps[0]);
        prelude.add("KERNEL_W", filter.taps[1]);
        prelude.add("STRIDE", filter.stride);
        prelude.add("SPREAD", filter.spread);
        prelude.add("NEAREST", filter.nearest);
        prelude.add("VECTORS", vectors);
        if uniform {
            prelude.add("MATRICES", (filter.matrices(vectors) * u64::from(self.blocks_per_part)) as u32);
        }
        let [columns, rows] = size.map(|edge| edge.div_ceil(filter.spread));
        if permutation.is_none() {
            self.groups = [columns.div_ceil(GROUP[0]), rows.div_ceil(GROUP[1]), vectors];
            return "conv_plain".into();
        }
        // At most 2^26 pixels, so the tiles fit.
        let groups = (columns.div_ceil(2) * rows.div_ceil(4)).div_ceil(TILES);
        self.groups = [groups.min(ROW_OF_GROUPS), groups.div_ceil(ROW_OF_GROUPS), 1];
        let family = if row { "conv3x3" } else { "conv_any" };
        let input = if mirror && self.bound != Bound::Texture { "_mirror" } else { "" };
        let weights = match self.bound {
            Bound::Texture => "_lanes",
            Bound::Storage => "_wide",
            _ => "",
        };
        format!("{family}{input}{weights}")
    }

    /// Workgroups of a dispatch of `blocks` blocks.
    pub fn workgroups(&self, blocks: u32) -> [u32; 3] {
        [self.groups[0], self.groups[1], self.groups[2] * blocks.max(1)]
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
            Bound::Uniform | Bound::Storage => matrices * MATRIX,
            Bound::Half => matrices * MATRIX / 2,
            // Whole rows.
            Bound::Texture => (matrices * 4).next_multiple_of(ROW) * self.texel(),
            Bound::Vectors(n) => u64::from(n) * 16,
        }
    }
}

/// A convolution of a picture enlarged `n` times is n² convolutions of the picture itself, one for each phase of the output, with
/// the taps that meet the same pixel added up: 4×4 after ×2 has 25 taps in four phases instead of 64. Taps of the largest phase,
/// and each phase with its padding.
fn merged([h, w]: [u32; 2], pad: [i32; 2], n: i32) -> ([u32; 2], Vec<Phase>) {
    let least = |phase: i32, pad: i32| (phase - pad).div_euclid(n);
    let taps = |edge: u32, pad: i32| {
        let of = |phase: i32| (phase + edge as i32 - 1 - pad).div_euclid(n) - least(phase, pad) + 1;
        (0..n).map(of).max().unwrap_or(1) as u32
    };
    let phases = (0..n * n).map(|i| [i % n, i / n]);
    let phases = phases.map(|[x, y]| ([x as u32, y as u32], [-least(x, pad[0]), -least(y, pad[1])])).collect();
    ([taps(h, pad[1]), taps(w, pad[0])], phases)
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
