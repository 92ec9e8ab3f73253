//! The ways in which a convolution can run, which of them a device can do, and which is taken when
//! nobody has measured. Pure.

use super::super::plan::{Plan, Precision};
use super::layer::{Layer, Stage, THREADS};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// WebGPU's default limit of one uniform binding, bytes; what kernels with uniform weights bind.
pub const MAX_UNIFORM: u64 = 64 << 10;
/// Workgroups that keep a large GPU busy: some for each of its processors.
const CROWD: u32 = 256;
/// Threads of a small one, some 5 multiprocessors with room for 1,000 to 2,000 each: with fewer,
/// each had better end soon.
const ROOM: u32 = 8192;
/// With fewer than this much of it empties, and parts of sums, written and read, pay.
const FEW: u32 = 3072;
/// Most parts of a sum.
pub const MAX_PARTS: u32 = 64;
/// Most bytes of a sum's parts.
const MAX_PARTIAL: u64 = 16 << 20;
/// WebGPU's default limit of one storage binding.
const MAX_STORAGE: u64 = 128 << 20;
/// Most blocks of a staged kernel: with all its parts they stay below WebGPU's default limit of
/// workgroups in one dimension.
const MAX_STAGED: u32 = 65535 / MAX_PARTS * 2;
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
    /// In a storage buffer, and with the input staged in the memory of a workgroup.
    Staged,
}

/// One way to run a convolution. All give the same result up to rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KernelConfig {
    /// Where its weights lie.
    pub weights: Source,
    /// Vectors of output channels a thread, 1 to 4, staged at most 2.
    pub vectors: u32,
    /// Parts into which the sum over input channels is cut, so that small pictures have work for
    /// more workgroups; staged only.
    #[serde(default = "one")]
    pub parts: u32,
    /// Products are taken in 16 bits, of four input channels each, and added up in 32: an optional
    /// feature, staged and with 16-bit storage only. Sums of four products beyond 65504 become
    /// infinite.
    #[serde(default)]
    pub half: bool,
}

fn one() -> u32 {
    1
}

impl KernelConfig {
    /// In one part, in 32 bits.
    pub const fn new(weights: Source, vectors: u32) -> Self {
        Self { weights, vectors, parts: 1, half: false }
    }
}

impl std::fmt::Display for KernelConfig {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let weights = match self.weights {
            Source::Uniform => "uniform",
            Source::Storage => "storage",
            Source::Staged => "staged",
        };
        write!(f, "{weights} 8×{}", 4 * self.vectors)?;
        if self.parts > 1 {
            write!(f, " /{}", self.parts)?;
        }
        if self.half { write!(f, " f16") } else { Ok(()) }
    }
}

/// Which convolution kernels to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Variant {
    /// What a tuner has found, else what is known of devices of this kind.
    #[default]
    Auto,
    /// This one for every convolution that it can do, the nearest for the others.
    Fixed(KernelConfig),
    /// One pixel and four channels a thread; the yardstick.
    Plain,
}

/// What the choice of kernels depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facts {
    /// The adapter runs on the processor.
    pub software: bool,
    /// Shaders can calculate in 16 bits.
    pub half: bool,
}

impl Facts {
    /// Of a device.
    pub fn of(device: &wgpu::Device) -> Self {
        Self {
            software: device.adapter_info().device_type == wgpu::DeviceType::Cpu,
            half: device.features().contains(wgpu::Features::SHADER_F16),
        }
    }
}

/// The permutations that a tuner has found to be the fastest, by [`Layer`] as text.
pub type Tuned = HashMap<String, KernelConfig>;

impl Layer {
    /// Every permutation worth timing here, the guess first. On processors a workgroup's memory is
    /// no faster than any other, 16-bit arithmetic is converted, and a few workgroups are enough:
    /// all that is left out there.
    pub fn candidates(&self, plan: &Plan, facts: Facts) -> Vec<KernelConfig> {
        let mut vectors: Vec<u32> = (1..=self.out_vectors.min(4)).collect();
        vectors.sort_by_key(|v| self.rounds(*v));
        vectors.truncate(2);
        let mut wanted = Vec::new();
        for vectors in vectors {
            wanted.extend([Source::Uniform, Source::Storage].map(|weights| KernelConfig::new(weights, vectors)));
        }
        if !facts.software {
            for half in [false, true] {
                wanted
                    .extend([1, 2].map(|vectors| KernelConfig { half, ..KernelConfig::new(Source::Staged, vectors) }));
            }
        }
        let cut = wanted.clone().into_iter().filter(|_| !facts.software);
        let parts = cut.flat_map(|p| self.parts(p).map(move |parts| KernelConfig { parts, ..p }));
        let mut found = vec![self.guess(plan, facts)];
        for wanted in wanted.iter().copied().chain(parts) {
            if self.fitted(wanted, plan, facts) == wanted && !found.contains(&wanted) {
                found.push(wanted);
            }
        }
        found
    }

    /// Into how many parts to cut the sum besides one: those that bring at least a quarter of
    /// [`CROWD`] workgroups, up to the first that brings all.
    fn parts(&self, config: KernelConfig) -> impl Iterator<Item = u32> + use<> {
        let groups = self.groups(config).max(1);
        let all = (CROWD / groups).next_power_of_two();
        [all / 4, all].into_iter().filter(|parts| *parts > 1)
    }

    /// Workgroups of a permutation in one part.
    fn groups(&self, p: KernelConfig) -> u32 {
        let phases = self.filter.spread * self.filter.spread;
        if p.weights == Source::Staged {
            let stage = Stage::of(self, p.vectors);
            return stage.groups(self) * self.out_vectors.div_ceil(stage.columns * p.vectors) * phases;
        }
        self.filter.pixels(self.size).div_ceil(8 * THREADS) * self.out_vectors.div_ceil(p.vectors) * phases
    }

    /// Bytes of the sums' parts.
    pub(super) fn partial_bytes(&self, parts: u32) -> u64 {
        let [width, height] = self.size.map(u64::from);
        width * height * u64::from(self.out_vectors) * u64::from(parts) * 16
    }

    /// What is taken without timing: uniform weights, 8×8 a thread. Where a GPU would wait for each
    /// thread's long sum, fewer channels a thread, and parts of sums.
    pub fn guess(&self, plan: &Plan, facts: Facts) -> KernelConfig {
        let fitted = |wanted| self.fitted(wanted, plan, facts);
        let tiles = self.filter.pixels(self.size).div_ceil(8) * self.filter.spread * self.filter.spread;
        let threads = |config: KernelConfig| tiles * self.out_vectors.div_ceil(config.vectors);
        let [one, two] = [1, 2].map(|n| fitted(KernelConfig::new(Source::Uniform, self.out_vectors.min(n))));
        if facts.software || threads(two) >= ROOM {
            return two;
        }
        let parts = FEW.div_ceil(threads(one)).next_power_of_two();
        if parts > 1 { fitted(KernelConfig { parts, ..KernelConfig::new(Source::Staged, 1) }) } else { one }
    }

    /// Cost of all blocks of `vectors` output vectors: of each the loads, which weigh about as much
    /// as one vector, and the rest.
    fn rounds(&self, vectors: u32) -> u32 {
        self.out_vectors.div_ceil(vectors) * (1 + vectors)
    }

    /// The nearest to `wanted` that this layer, plan and device allow.
    pub fn fitted(&self, wanted: KernelConfig, plan: &Plan, facts: Facts) -> KernelConfig {
        let mut vectors = wanted.vectors.clamp(1, self.out_vectors.clamp(1, 4));
        // A block of output channels stays within a group.
        while self.filter.group_vectors < self.out_vectors && !self.filter.group_vectors.is_multiple_of(vectors) {
            vectors -= 1;
        }
        let grouped = self.filter.group_vectors < self.out_vectors;
        let matrices = self.filter.matrices(vectors);
        let weights = match wanted.weights {
            Source::Staged if !grouped && self.stored_blocks() <= self.storage_blocks(1).min(MAX_STAGED) => {
                Source::Staged
            }
            Source::Storage | Source::Staged => Source::Storage,
            _ if plan.precision == Precision::F16 || matrices * MATRIX > MAX_UNIFORM => Source::Storage,
            _ => Source::Uniform,
        };
        let staged = weights == Source::Staged;
        let most = ((MAX_PARTIAL / self.partial_bytes(1).max(1)) as u32)
            .clamp(1, MAX_PARTS)
            .min(self.filter.in_vectors.max(1));
        KernelConfig {
            weights,
            vectors: if staged { vectors.min(2) } else { vectors },
            parts: if staged { wanted.parts.clamp(1, most) } else { 1 },
            half: staged && wanted.half && facts.half && plan.precision == Precision::F16,
        }
    }

    /// How many blocks of output channels fit into one uniform binding.
    pub(super) fn uniform_blocks(&self, vectors: u32) -> u32 {
        ((MAX_UNIFORM / (self.filter.matrices(vectors) * MATRIX)) as u32).max(1)
    }

    /// How many fit into one storage binding.
    pub(super) fn storage_blocks(&self, vectors: u32) -> u32 {
        ((MAX_STORAGE / (self.filter.matrices(vectors) * MATRIX)) as u32).max(1)
    }

    /// Blocks of one vector of output channels, of all phases.
    fn stored_blocks(&self) -> u32 {
        self.out_vectors * self.filter.spread * self.filter.spread
    }

    /// What runs: as `variant` says, with what has been measured. `None` for the plain kernel.
    pub(super) fn config(&self, variant: Variant, tuned: &Tuned, plan: &Plan, facts: Facts) -> Option<KernelConfig> {
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
