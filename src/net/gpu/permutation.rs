//! The ways in which a convolution can run, which of them a device can do, and which is taken when nobody has measured. Pure.

use super::super::plan::{Plan, Precision};
use super::kernels::Filter;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Elements in a row of a texture that holds the arena or weights.
pub const ROW: u64 = 2048;
/// Most rows: WebGPU's default limit of a texture's edge.
const MAX_ROWS: u64 = 8192;
/// WebGPU's default limit of one uniform binding.
const MAX_UNIFORM: u64 = 64 << 10;
/// Bytes of one matrix of weights in 32 bits.
pub const MATRIX: u64 = 64;

/// Where a convolution's weights lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// In a uniform buffer; 32 bits only.
    Uniform,
    /// In a storage buffer.
    Storage,
    /// In a texture, shared out among the threads of a subgroup: an optional feature. Reads the input from the mirror too.
    Lanes,
}

/// One way to run a convolution. All give the same result up to rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Permutation {
    /// Where its weights lie.
    pub weights: Source,
    /// It reads its input from a copy of the arena in a texture.
    pub mirror: bool,
    /// Vectors of output channels a thread, 1 to 4.
    pub vectors: u32,
}

impl std::fmt::Display for Permutation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let weights = match self.weights {
            Source::Uniform => "uniform",
            Source::Storage => "storage",
            Source::Lanes => "lanes",
        };
        let mirror = if self.mirror && self.weights != Source::Lanes { " mirror" } else { "" };
        write!(f, "{weights}{mirror} 8×{}", 4 * self.vectors)
    }
}

/// Which convolution kernels to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Variant {
    /// What a tuner has found, else what is known of devices of this kind.
    #[default]
    Auto,
    /// This one for every convolution that it can do, the nearest for the others.
    Fixed(Permutation),
    /// One pixel and four channels a thread; the yardstick.
    Plain,
}

/// What the choice of kernels depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facts {
    /// Threads can exchange values within subgroups of at least eight.
    pub lanes: bool,
    /// The adapter runs on the processor.
    pub software: bool,
}

impl Facts {
    /// Of a device.
    pub fn of(device: &wgpu::Device) -> Self {
        let info = device.adapter_info();
        Self {
            lanes: device.features().contains(wgpu::Features::SUBGROUP) && info.subgroup_min_size >= 8,
            software: info.device_type == wgpu::DeviceType::Cpu,
        }
    }
}

/// Everything that the speed of one convolution depends on, and the key under which a tuner remembers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Layer {
    /// The kernel's view of it.
    pub filter: Filter,
    /// Four-channel vectors written.
    pub out_vectors: u32,
    /// Width and height of the output.
    pub size: [u32; 2],
    /// Storage.
    pub precision: Precision,
}

impl std::fmt::Display for Layer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Filter { taps: [h, w], stride, spread, nearest, in_vectors, group_vectors } = self.filter;
        let [width, height] = self.size;
        let bits = if self.precision == Precision::F16 { 16 } else { 32 };
        write!(f, "{h}x{w} stride {stride} spread {spread} nearest {nearest} {in_vectors}>{} ", self.out_vectors)?;
        write!(f, "{width}x{height} f{bits}")?;
        if group_vectors < self.out_vectors { write!(f, " groups of {group_vectors}") } else { Ok(()) }
    }
}

/// The permutations that a tuner has found to be the fastest, by [`Layer`] as text.
pub type Tuned = HashMap<String, Permutation>;

impl Layer {
    /// Every permutation worth timing here, the guess first. On processors buffers are several times slower than textures, so
    /// what reads them is left out.
    pub fn candidates(&self, plan: &Plan, facts: Facts) -> Vec<Permutation> {
        let mut vectors: Vec<u32> = (1..=self.out_vectors.min(4)).collect();
        vectors.sort_by_key(|v| self.rounds(*v));
        vectors.truncate(2);
        let mut found = vec![self.guess(plan, facts)];
        for vectors in vectors {
            for weights in [Source::Lanes, Source::Uniform, Source::Storage] {
                for mirror in [true, false].into_iter().filter(|mirror| *mirror || !facts.software) {
                    let wanted = Permutation { weights, mirror, vectors };
                    if self.fitted(wanted, plan, facts) == wanted && !found.contains(&wanted) {
                        found.push(wanted);
                    }
                }
            }
        }
        found
    }

    /// What is known without timing. On processors loads are dear, and textures and shared weights the cheapest of them. Of
    /// GPUs nothing is known yet: 8×8 a thread, uniform weights.
    pub fn guess(&self, plan: &Plan, facts: Facts) -> Permutation {
        let wanted = if facts.software {
            let best = (1..=self.out_vectors.min(4)).rev().min_by_key(|v| self.rounds(*v)).unwrap_or(1);
            Permutation { weights: Source::Lanes, mirror: true, vectors: best }
        } else {
            Permutation { weights: Source::Uniform, mirror: false, vectors: self.out_vectors.min(2) }
        };
        self.fitted(wanted, plan, facts)
    }

    /// Cost of all blocks of `vectors` output vectors: of each the loads, which weigh about as much as one vector, and the rest.
    fn rounds(&self, vectors: u32) -> u32 {
        self.out_vectors.div_ceil(vectors) * (1 + vectors)
    }

    /// The nearest to `wanted` that this layer, plan and device allow.
    pub fn fitted(&self, wanted: Permutation, plan: &Plan, facts: Facts) -> Permutation {
        let mut vectors = wanted.vectors.clamp(1, self.out_vectors.clamp(1, 4));
        // A block of output channels stays within a group.
        while self.filter.group_vectors < self.out_vectors && !self.filter.group_vectors.is_multiple_of(vectors) {
            vectors -= 1;
        }
        let mirror = mirrors(plan);
        let matrices = self.filter.matrices(vectors);
        // Weights of 3×3 taps take a third more when they are transformed.
        let texels = (matrices * u64::from(self.out_vectors.div_ceil(vectors)) * 4).div_ceil(3) * 4;
        let weights = match wanted.weights {
            Source::Lanes if facts.lanes && mirror && texels.div_ceil(ROW) <= MAX_ROWS => Source::Lanes,
            Source::Storage => Source::Storage,
            _ if plan.precision == Precision::F16 || matrices * MATRIX > MAX_UNIFORM => Source::Storage,
            _ => Source::Uniform,
        };
        Permutation { weights, mirror: weights == Source::Lanes || (mirror && wanted.mirror), vectors }
    }

    /// How many blocks of output channels fit into one uniform binding.
    pub(super) fn uniform_blocks(&self, vectors: u32) -> u32 {
        ((MAX_UNIFORM / (self.filter.matrices(vectors) * MATRIX)) as u32).max(1)
    }

    /// What runs: as `variant` says, with what has been measured. `None` for the plain kernel.
    pub(super) fn permutation(
        &self,
        variant: Variant,
        tuned: &Tuned,
        plan: &Plan,
        facts: Facts,
    ) -> Option<Permutation> {
        match variant {
            Variant::Plain => None,
            Variant::Fixed(wanted) => Some(self.fitted(wanted, plan, facts)),
            Variant::Auto => Some(match tuned.get(&self.to_string()) {
                Some(found) => self.fitted(*found, plan, facts),
                None => self.guess(plan, facts),
            }),
        }
    }
}

/// The plan's arena fits into a mirror.
pub(super) fn mirrors(plan: &Plan) -> bool {
    let element = if plan.precision == Precision::F16 { 8 } else { 16 };
    plan.arena_bytes.div_ceil(element * ROW) <= MAX_ROWS
}
