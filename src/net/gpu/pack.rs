//! Trained numbers as the kernels read them. Pure.
//!
//! Convolutions: output channels in blocks of one to four vectors. A block is one matrix with the
//! bias, a column a vector, then for each input vector, tap row, tap column and output vector of
//! the block one 4×4 matrix, which takes four input channels to four output channels. (For staged
//! kernels input vectors come within taps.) All blocks of one phase come before those of the next.
//! Channels that only pad, and inputs outside an output's group, are zero. A transposed convolution
//! of stride s is s² ordinary ones, each of which makes every s-th pixel (its phase) in both
//! directions.

use super::kernel::{Bound, Kernel, Part};
use super::kernel_config::Source;
use super::layer::Filter;
use crate::net::format::Weights;
use crate::net::graph::Op;
use crate::net::plan::{Kind, Step};

/// The bytes of each dispatch's weights; empty for a step without.
pub(super) fn pack(weights: &Weights, step: &Step, kernel: &Kernel) -> Vec<Vec<u8>> {
    let Some(op) = step.op.map(|i| &weights.graph.ops[i]) else { return Vec::new() };
    if let Some(filter) = kernel.filter {
        let layer = Layer::new(weights, op, step.fold.map(|i| &weights.graph.ops[i]), filter, kernel);
        return kernel.parts.iter().map(|part| layer.part(part, kernel)).collect();
    }
    let vectors = match step.kind {
        Kind::Merge { .. } => affine(weights, op).to_vec(),
        Kind::Scale { fixed: true } => fixed(weights, op),
        _ => return Vec::new(),
    };
    let padded = vectors.into_iter().flat_map(|mut channels| {
        channels.resize(channels.len().next_multiple_of(4), 0.0);
        channels
    });
    vec![padded.flat_map(f32::to_le_bytes).collect()]
}

/// Weight and bias of each channel of a norm; 1 and 0 where it has none.
fn affine(weights: &Weights, op: &Op) -> [Vec<f32>; 2] {
    let channels = match op {
        Op::BatchNorm(o) => o.channels,
        Op::InstanceNorm(o) => o.channels,
        Op::GroupNorm(o) => o.channels,
        _ => 0,
    };
    [("weight", 1.0), ("bias", 0.0)].map(|(leaf, default)| {
        let found = weights.values(op.name(), leaf);
        if found.is_empty() { vec![default; channels as usize] } else { found.to_vec() }
    })
}

/// Mean, scale and shift of each channel of a batch norm.
fn fixed(weights: &Weights, op: &Op) -> Vec<Vec<f32>> {
    let [weight, bias] = affine(weights, op);
    let eps = if let Op::BatchNorm(o) = op { f64::from(o.eps) } else { 0.0 };
    let variance = weights.values(op.name(), "running_var");
    let scale = weight.iter().zip(variance).map(|(w, v)| (f64::from(*w) / (f64::from(*v) + eps).sqrt()) as f32);
    vec![weights.values(op.name(), "running_mean").to_vec(), scale.collect(), bias]
}

/// A convolution's numbers, a folded batch norm multiplied in.
struct Layer<'a> {
    weight: &'a [f32],
    /// Of each output channel.
    bias: Vec<f32>,
    /// Of each output channel.
    scale: Vec<f32>,
    in_channels: usize,
    /// Input and output channels of a group.
    group: [usize; 2],
    kernel: [usize; 2],
    /// Padding of a transposed convolution.
    transposed: Option<u32>,
    filter: Filter,
    /// Padding and base of a phase, as in `shaders/net/place.wgsl`.
    pad: [i32; 2],
    base: [i32; 2],
    enlarged: Option<(u32, [i32; 2])>,
}

impl<'a> Layer<'a> {
    fn new(weights: &'a Weights, op: &Op, fold: Option<&Op>, filter: Filter, kernel_choice: &Kernel) -> Self {
        let (in_channels, out_channels, kernel, groups, transposed) = match op {
            Op::Conv2d(o) => (o.in_channels, o.out_channels, o.kernel, o.groups, None),
            Op::ConvTranspose2d(o) => (o.in_channels, o.out_channels, o.kernel, 1, Some(o.padding)),
            _ => (0, 0, [0, 0], 1, None),
        };
        let mut bias = weights.values(op.name(), "bias").to_vec();
        bias.resize(out_channels as usize, 0.0);
        let mut scale = vec![1.0; bias.len()];
        if let Some(norm) = fold {
            let norm = fixed(weights, norm);
            for (o, b) in bias.iter_mut().enumerate() {
                scale[o] = norm[1][o];
                *b = (f64::from(*b - norm[0][o]) * f64::from(norm[1][o]) + f64::from(norm[2][o])) as f32;
            }
        }
        Self {
            weight: weights.values(op.name(), "weight"),
            bias,
            scale,
            in_channels: in_channels as usize,
            group: [in_channels, out_channels].map(|n| (n / groups) as usize),
            kernel: kernel.map(|k| k as usize),
            transposed,
            filter,
            pad: kernel_choice.numbers.pad,
            base: kernel_choice.numbers.base,
            enlarged: kernel_choice.enlarged,
        }
    }

    /// The weight that takes input channel `i` under tap (ky, kx) of a phase's kernel to output
    /// channel `o`.
    fn at(&self, phase: [u32; 2], o: usize, i: usize, ky: usize, kx: usize) -> f32 {
        let [kh, kw] = self.kernel;
        if o >= self.bias.len() || i >= self.in_channels {
            return 0.0;
        }
        let Some(padding) = self.transposed else {
            let [inputs, outputs] = self.group;
            if i / inputs != o / outputs {
                return 0.0;
            }
            let first = (o * inputs + i % inputs) * kh * kw;
            let Some((factor, pad)) = self.enlarged else {
                return self.scale[o] * self.weight[first + ky * kw + kx];
            };
            // All taps that meet the same pixel of the picture before it was enlarged.
            let of_phase = [0, 1].map(|axis| {
                self.pad[axis] - (phase[axis] as i32 + self.base[axis]).div_euclid(self.filter.spread as i32)
            });
            let real = |axis: usize, edge: usize, k: usize| {
                let meets = move |real: &usize| {
                    let place = phase[axis] as i32 + *real as i32 - pad[axis];
                    place.div_euclid(factor as i32) + of_phase[axis] == k as i32
                };
                (0..edge).filter(meets)
            };
            let rows = real(1, kh, ky).flat_map(|y| real(0, kw, kx).map(move |x| y * kw + x));
            let sum: f64 = rows.map(|tap| f64::from(self.weight[first + tap])).sum();
            return (f64::from(self.scale[o]) * sum) as f32;
        };
        // Output pixel stride·j + phase hears input pixel j − pad + k through the real tap
        // (phase + padding) mod stride + stride · (taps − 1 − k).
        let real = |phase: u32, taps: u32, k: usize| {
            let stride = self.filter.spread;
            ((phase + padding) % stride) as usize + stride as usize * (taps as usize - 1 - k)
        };
        let (ky, kx) = (real(phase[1], self.filter.taps[0], ky), real(phase[0], self.filter.taps[1], kx));
        if ky >= kh || kx >= kw {
            return 0.0;
        }
        self.scale[o] * self.weight[((i * self.bias.len() + o) * kh + ky) * kw + kx]
    }

    fn part(&self, part: &Part, kernel: &Kernel) -> Vec<u8> {
        let half = kernel.bound == Bound::Half;
        let vectors = kernel.vectors as usize;
        let mut bytes = Vec::with_capacity(kernel.bound_bytes() as usize);
        let mut put = |value: f32| {
            if half {
                bytes.extend(half::f16::from_f32(value.clamp(-65504.0, 65504.0)).to_le_bytes());
            } else {
                bytes.extend(value.to_le_bytes());
            }
        };
        // Blocks of a phase as they are stored, which may be more than a workgroup's.
        let blocks = self.bias.len().div_ceil(4).div_ceil(vectors);
        let staged = kernel.config.is_some_and(|p| p.weights == Source::Staged);
        for block in part.first_block as usize..(part.first_block + part.blocks) as usize {
            let (phase, spread) = ((block / blocks) as u32, self.filter.spread);
            let phase = [phase % spread, phase / spread];
            let first = block % blocks * 4 * vectors;
            let bias = |i: usize| if i < 4 * vectors { self.bias.get(first + i).copied().unwrap_or(0.0) } else { 0.0 };
            (0..16).for_each(|i| put(bias(i)));
            // The first channel that the block reads, as in make.wgsl.
            let own = first / self.group[1].max(1) * self.group[0] / 4;
            let begin = 4 * own.min(self.in_channels.div_ceil(4) - self.filter.in_vectors as usize);
            // One tap of one input vector. Column-major: column k takes input channel k to the four
            // outputs.
            let mut matrices = |c: usize, tap: usize| {
                let (ky, kx) = (tap / self.filter.taps[1] as usize, tap % self.filter.taps[1] as usize);
                for k in 0..16 * vectors {
                    put(self.at(phase, first + k / 16 * 4 + k % 4, begin + c * 4 + k % 16 / 4, ky, kx));
                }
            };
            let (inputs, taps) = (self.filter.in_vectors as usize, self.filter.taps.iter().product::<u32>() as usize);
            for i in 0..inputs * taps {
                if staged { matrices(i % inputs, i / inputs) } else { matrices(i / taps, i % taps) }
            }
        }
        bytes.resize(kernel.bound_bytes() as usize, 0);
        bytes
    }
}
