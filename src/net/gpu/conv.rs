//! How a convolution runs: as taps, phases and blocks of output channels, in one of several
//! permutations. Pure.
//!
//! A transposed convolution of stride s, and a convolution of a picture enlarged s times, are s²
//! ordinary ones of the picture itself, each of which makes every s-th output pixel in both
//! directions: its phase. All phases go into one dispatch wherever their weights do.

use super::super::graph::Padding;
use super::super::plan::{Kind, Plan, Precision, Step};
use super::kernel::{Bound, Choice, GROUP, Kernel, Part, Prelude, Sum, in_rows};
use super::kernel_config::{KernelConfig, Source, Variant};
use super::layer::{Filter, Layer, Stage, THREADS};
use crate::gpu::shaders::{NetFamily, NetKernel};
use crate::net::graph::Shape;

/// Vectors side by side in a workgroup that adds up and measures, as in `sum_measured.wgsl`.
const SUM_COLUMNS: u32 = 8;
/// WebGPU's default limit of workgroups in one dimension.
const MAX_DEPTH: u32 = 65535;

/// Taps of one phase, and its padding: `pad` − ⌊(phase + `base`) / spread⌋.
struct Phases {
    filter: Filter,
    pad: [i32; 2],
    base: [i32; 2],
}

impl Kernel {
    /// Fills in what a convolution needs, and its shader but for the family, which it answers.
    pub(super) fn convolution(
        &mut self,
        prelude: &mut Prelude,
        step: &Step,
        plan: &Plan,
        choice: &Choice<'_>,
    ) -> NetFamily {
        let out = plan.tensors[step.output].shape;
        let Phases { filter, pad, base } = self.phases(step, plan, choice);
        let group = channels_of_a_group(step.kind, plan.tensors[step.input].shape, out);
        let size = [out.width, out.height];
        let layer = Layer { filter, out_vectors: out.vectors(), size, precision: plan.precision };
        let config = layer.config(choice.variant, choice.tuned, plan, choice.facts);
        let row = matches!(step.kind, Kind::Conv { kernel: [3, 3], stride: 1, nearest: 1, padding, .. } if padding == Padding::all(1));
        (self.filter, self.layer, self.config) = (Some(filter), Some(layer), config);
        let plain = KernelConfig::new(Source::Storage, out.vectors().min(2));
        let KernelConfig { weights, vectors, parts, half } = config.unwrap_or(plain);
        let staged = weights == Source::Staged;
        self.vectors = if staged { 1 } else { vectors };
        self.bound = match weights {
            Source::Uniform => Bound::Uniform,
            Source::Storage | Source::Staged if plan.precision == Precision::F16 => Bound::Half,
            Source::Storage | Source::Staged => Bound::Storage,
        };
        let blocks = out.vectors().div_ceil(self.vectors);
        let all = blocks * filter.spread * filter.spread;
        // As many blocks a dispatch as a binding of weights, and its workgroups in z, allow; staged
        // kernels need all at once.
        let bound = match self.bound {
            Bound::Uniform => layer.uniform_blocks(vectors),
            Bound::Storage | Bound::Half if !staged => layer.storage_blocks(self.vectors),
            _ => all,
        };
        let deep = if config.is_none() { vectors } else { parts };
        self.blocks_per_part = all.div_ceil(all.div_ceil(bound.min(MAX_DEPTH / deep)));
        let part = |first_block| {
            let blocks = self.blocks_per_part.min(all - first_block);
            Part { first_block, blocks, depth: blocks * parts }
        };
        self.parts = (0..all).step_by(self.blocks_per_part as usize).map(part).collect();
        (self.numbers.pad, self.numbers.base, self.numbers.blocks) = (pad, base, blocks);
        self.numbers.in_vectors = filter.in_vectors;
        [self.numbers.group_inputs, self.numbers.group] = group;
        self.numbers.parts = parts;
        if parts > 1 {
            let vectors = out.pixels() as u32 * out.vectors();
            let [mut x, mut y] = in_rows(vectors.div_ceil(THREADS));
            let mut text = prelude.text();
            let measured = step.moments.is_some();
            if measured {
                (x, y) = ((out.pixels() as u32).div_ceil(THREADS), out.vectors().div_ceil(SUM_COLUMNS));
                self.numbers.tiles = x;
                text += &format!("const THREADS = {THREADS}u;\nconst MADE = 1u;\n");
            }
            let shader = NetKernel { half: self.shader.half, measured, ..NetKernel::new(NetFamily::Sum) };
            let bytes = layer.partial_bytes(parts);
            self.sum = Some(Sum { shader, prelude: text, groups: [x, y, 1], bytes });
        }
        prelude.add("KERNEL_H", filter.taps[0]);
        prelude.add("KERNEL_W", filter.taps[1]);
        prelude.add("STRIDE", filter.stride);
        prelude.add("SPREAD", filter.spread);
        prelude.add("NEAREST", filter.nearest);
        prelude.add("VECTORS", vectors);
        self.shader.parts = parts > 1;
        let [columns, rows] = size.map(|edge| edge.div_ceil(filter.spread));
        // Each phase's workgroups in x and y measure what they make.
        let phases = filter.spread * filter.spread;
        let tiles =
            |kernel: &Self| if parts > 1 { kernel.numbers.tiles } else { phases * kernel.groups[0] * kernel.groups[1] };
        prelude.add("MADE", if config.is_none() { 1 } else { vectors });
        if config.is_none() {
            prelude.add("THREADS", THREADS);
            self.groups = [columns.div_ceil(GROUP[0]), rows.div_ceil(GROUP[1])];
            self.parts.iter_mut().for_each(|p| p.depth *= vectors);
            self.numbers.tiles = tiles(self);
            return NetFamily::ConvPlain;
        }
        if staged {
            let stage = Stage::of(&layer, vectors);
            prelude.add("COLUMNS", stage.columns);
            prelude.add("PIXELS", stage.pixels);
            prelude.add("THREADS", THREADS);
            self.groups = in_rows(stage.groups(&layer));
            self.numbers.tiles = tiles(self);
            // A workgroup makes several of the blocks as they are stored.
            self.numbers.blocks = out.vectors().div_ceil(stage.columns * vectors);
            self.parts[0].depth = self.numbers.blocks * filter.spread * filter.spread * parts;
            self.shader.arithmetic = half;
            prelude.feature = if half { "enable f16;\n" } else { "" };
            return NetFamily::ConvStaged;
        }
        let [wide, high] = [2, 4];
        // A processor needs no more threads than its vectors are wide, and smaller groups share
        // small pictures out better.
        let threads = if choice.facts.software { THREADS / 4 } else { THREADS };
        prelude.add("THREADS", threads);
        self.groups = in_rows((columns.div_ceil(wide) * rows.div_ceil(high)).div_ceil(threads));
        self.numbers.tiles = tiles(self);
        self.shader.wide = self.bound == Bound::Storage;
        if row { NetFamily::Conv3x3 } else { NetFamily::ConvAny }
    }

    /// The taps and phases of a step.
    fn phases(&mut self, step: &Step, plan: &Plan, choice: &Choice<'_>) -> Phases {
        let (input, out) = (plan.tensors[step.input].shape, plan.tensors[step.output].shape);
        match step.kind {
            Kind::Transposed { kernel, stride, padding } => {
                let taps = kernel.map(|k| k.div_ceil(stride));
                let [in_vectors, group_vectors] = [input, out].map(Shape::vectors);
                let filter = Filter { taps, stride: 1, spread: stride, nearest: 1, in_vectors, group_vectors };
                Phases { filter, pad: [taps[1] as i32 - 1, taps[0] as i32 - 1], base: [padding as i32; 2] }
            }
            Kind::Conv { kernel, stride, padding, nearest, groups } => {
                let grouped = choice.variant != Variant::Plain;
                let [in_vectors, group_vectors] =
                    if grouped { read_of(input, out, groups) } else { read_of(input, out, 1) };
                let pad = [padding.left as i32, padding.top as i32];
                if nearest > 1 && stride == 1 && choice.variant != Variant::Plain {
                    self.enlarged = Some((nearest, pad));
                    let taps = [merged(kernel[0], pad[1], nearest as i32), merged(kernel[1], pad[0], nearest as i32)];
                    let filter = Filter { taps, stride, spread: nearest, nearest: 1, in_vectors, group_vectors };
                    return Phases { filter, pad: [0, 0], base: pad.map(|n| -n) };
                }
                let filter = Filter { taps: kernel, stride, spread: 1, nearest, in_vectors, group_vectors };
                Phases { filter, pad, base: [0, 0] }
            }
            // Nothing else is a convolution.
            _ => {
                let [in_vectors, group_vectors] = [input, out].map(Shape::vectors);
                let filter = Filter { taps: [1, 1], stride: 1, spread: 1, nearest: 1, in_vectors, group_vectors };
                Phases { filter, pad: [0, 0], base: [0, 0] }
            }
        }
    }
}

/// Input and output channels of one of the groups that do not see each other.
fn channels_of_a_group(kind: Kind, input: Shape, out: Shape) -> [u32; 2] {
    let groups = if let Kind::Conv { groups, .. } = kind { groups.max(1) } else { 1 };
    [input, out].map(|s| (s.channels / groups).max(1))
}

/// Vectors that an output reads, and how many output vectors read the same. Groups of whole vectors
/// read their own. Where groups begin within vectors each output vector reads those that its groups
/// touch; if these are more than half of all, every one reads all.
fn read_of(input: Shape, out: Shape, groups: u32) -> [u32; 2] {
    let all = [input, out].map(Shape::vectors);
    let [inputs, outputs] = [input, out].map(|s| s.channels / groups);
    if inputs.is_multiple_of(4) && outputs.is_multiple_of(4) {
        return all.map(|n| n / groups);
    }
    let touched = |vector: u32| {
        let [first, last] = [vector * 4, (vector * 4 + 3).min(out.channels - 1)].map(|channel| channel / outputs);
        ((last + 1) * inputs).div_ceil(4) - first * inputs / 4
    };
    match (0..all[1]).map(touched).max() {
        Some(most) if 2 * most <= all[0] => [most, 1],
        _ => all,
    }
}

/// Along one edge of a kernel after enlarging `n` times: the taps that meet the same pixel are
/// added up, so 4×4 after ×2 has 25 taps in four phases instead of 64. How many the largest phase
/// has.
fn merged(edge: u32, pad: i32, n: i32) -> u32 {
    let of = |phase: i32| (phase + edge as i32 - 1 - pad).div_euclid(n) - (phase - pad).div_euclid(n) + 1;
    (0..n).map(of).max().unwrap_or(1) as u32
}
