//! Which kernel runs a step. Pure. Convolutions are in [`super::conv`].

use super::super::graph::AddAt;
use super::super::plan::{Kind, Plan, Precision, Step};
use super::kernel::{Bound, Choice, GROUP, Kernel, Numbers, Part, Prelude, in_rows};
use super::layer::THREADS;
use crate::gpu::shaders::{NetFamily, NetKernel};

/// Rows that a thread of `scale.wgsl` makes.
const ROWS_OF_SCALE: u32 = 8;

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
            shader: NetKernel { half, ..NetKernel::new(NetFamily::Add) },
            prelude: String::new(),
            bound: Bound::None,
            filter: None,
            layer: None,
            enlarged: None,
            config: None,
            vectors: 0,
            parts: vec![Part { first_block: 0, blocks: 0, depth: out.vectors() }],
            sum: None,
            groups: [out.width.div_ceil(GROUP[0]), out.height.div_ceil(GROUP[1])],
            numbers,
            blocks_per_part: 0,
        };
        let family = match step.kind {
            Kind::Conv { .. } | Kind::Transposed { .. } => kernel.convolution(&mut prelude, step, plan, choice),
            Kind::Upsample => {
                let double = [input.shape.width * 2, input.shape.height * 2] == [out.width, out.height];
                prelude.add("DOUBLE", double.into());
                if double {
                    // Blocks of two by two begin one pixel before the picture.
                    let blocks = |edge: u32, group: u32| (edge / 2 + 1).div_ceil(group);
                    kernel.groups = [blocks(out.width, GROUP[0]), blocks(out.height, GROUP[1])];
                }
                NetFamily::Upsample
            }
            Kind::Nearest => NetFamily::Nearest,
            Kind::Copy => NetFamily::Add,
            Kind::Window { left, top, clamp, channel } => {
                kernel.numbers.pad = [left as i32, top as i32];
                prelude.add("CLAMP", clamp.into());
                prelude.add("IN_FULL", input.full.into());
                prelude.add("OUT_FULL", output.full.into());
                kernel.parts[0].depth = (channel % 4 + input.shape.channels).div_ceil(4);
                NetFamily::Window
            }
            Kind::Moments => {
                // At most 2^26 pixels and 1,024 vectors.
                kernel.numbers.tiles = out.width;
                kernel.groups = in_rows((out.width * input.shape.vectors()).div_ceil(THREADS));
                kernel.parts[0].depth = 1;
                NetFamily::Moments
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
                NetFamily::Merge
            }
            Kind::Scale { fixed: false } => NetFamily::Norm,
            Kind::Scale { fixed: true } => {
                kernel.bound = Bound::Vectors(3 * out.vectors());
                NetFamily::BatchNorm
            }
        };
        if matches!(step.kind, Kind::Scale { .. }) {
            prelude.add("IN_FULL", (half && input.full).into());
            kernel.groups[1] = out.height.div_ceil(GROUP[1] * ROWS_OF_SCALE);
        }
        kernel.shader.family = family;
        kernel.shader.measured = step.moments.is_some() && kernel.sum.is_none();
        kernel.prelude = prelude.text();
        kernel
    }
}
