//! How the rays of a pass are shared out among workgroups (`jobs.wgsl`).

use super::spp;
use crate::gi::stage::inputs::cells_of;
use crate::gpu::tape;

/// Places of a unit. Of cells or squares they are 32×32 beside each other.
pub(super) const UNIT: u32 = BLOCK * BLOCK;
const BLOCK: u32 = 32;

/// How many workgroups a device does well with, and how it runs them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Groups {
    /// Of a pass at most, with `least` units each if there are as many, and `share` at most.
    most: u32,
    least: u32,
    share: u32,
    /// Threads of a workgroup run one after the other.
    serial: bool,
}

impl Groups {
    /// A GTX 1050 runs 60 at a time; each holds 53 kB of memory. Sixteen bits name a job.
    pub const GPU: Self = Self { most: 512, least: 2, share: 65_536 / UNIT, serial: false };

    /// For a processor alone: each vector of threads goes through a whole shader once, whether one
    /// of them has something to do or not. But Mesa's driver ends all loops of a thread after
    /// 65,535 rounds in all, without a word: of a city's first frame, eight rays a cell, shares of
    /// 60 units come to that.
    pub const CPU: Self = Self { most: 2, least: 1, share: 4, serial: true };

    /// For a driver that draws on the CPU two a processor; but what is written down of dispatches,
    /// to be counted or exported, is as GPUs have it, and what is exported is for them.
    pub fn of(device: &wgpu::Device) -> Self {
        if device.adapter_info().device_type != wgpu::DeviceType::Cpu {
            return Self::GPU;
        }
        if tape::runs() {
            return Self { serial: tape::counts(), ..Self::GPU };
        }
        let processors = std::thread::available_parallelism().map_or(1, |n| n.get() as u32);
        Self { most: processors.saturating_mul(Self::CPU.most).min(Self::GPU.most), ..Self::CPU }
    }

    /// True on drivers that execute a workgroup's threads serially (software rasterisers).
    pub fn are_serial(self) -> bool {
        self.serial
    }

    fn for_units(self, units: u32) -> u32 {
        units.div_ceil(self.least).clamp(1, self.most).max(units.div_ceil(self.share))
    }

    /// Workgroups of `gi.trace`: layers of blocks for first rays of cells, specular rays, and further rays.
    pub fn for_cells(self, size: [u32; 2]) -> u32 {
        self.for_units(blocks(cells_of(size)).saturating_mul(1 + spp(size)))
    }

    /// Workgroups of `gi.gradient`, for squares of 2×2 cells.
    pub fn for_squares(self, size: [u32; 2]) -> u32 {
        self.for_units(blocks(cells_of(size).map(|n| n.div_ceil(2))))
    }

    /// Workgroups of `gi.specular_trace`, for squares of 2×2 pixels.
    pub fn for_pixels(self, size: [u32; 2]) -> u32 {
        self.for_units(blocks(size.map(|n| n.div_ceil(2))))
    }

    /// Workgroups of `gi.cache_update`.
    pub fn for_slots(self, slots: u32) -> u32 {
        self.for_units(slots.div_ceil(UNIT))
    }
}

fn blocks(grid: [u32; 2]) -> u32 {
    grid[0].div_ceil(BLOCK).saturating_mul(grid[1].div_ceil(BLOCK))
}

#[cfg(test)]
mod tests {
    use super::super::{GatherGi, Options, PATHS, RECORD, spp};
    use super::{BLOCK, Groups, UNIT, cells_of};

    /// A constant of a shader.
    fn constant(source: &str, name: &str) -> u64 {
        let start = format!("const {name} = ");
        let line = source.lines().find_map(|l| l.strip_prefix(&start)).expect("the shader has it");
        line.trim_end_matches(';').trim_end_matches('u').parse().expect("a whole number")
    }

    #[test]
    fn buffers_and_groups_are_what_shaders_fill() {
        let paths = include_str!("../../../shaders/gi/gather/path_state.wgsl");
        let jobs = include_str!("../../../shaders/gi/gather/jobs.wgsl");
        assert_eq!(16 * constant(paths, "PATHS_PER_GROUP") * constant(paths, "PATH_FIELDS"), PATHS);
        assert_eq!(Groups::GPU.share * UNIT, 1 << 16, "sixteen bits name a job");
        let blocks = format!("return (grid + {}u) / {BLOCK}u;", BLOCK - 1);
        assert!(jobs.contains(&blocks), "{blocks}");
    }

    #[test]
    fn every_workgroup_has_a_share_that_sixteen_bits_name() {
        for groups in [Groups::CPU, Groups { most: 4, ..Groups::CPU }, Groups::GPU] {
            for units in [1, 2, 9, 63, 288, 2040, 16_384] {
                let of = |group: u32, all: u32| group * units / all;
                let all = groups.for_units(units);
                assert!(all <= units, "{groups:?}, {units}");
                for group in 0..all {
                    let share = of(group + 1, all) - of(group, all);
                    assert!((1..=groups.share).contains(&share), "{groups:?}, {units}: {share}");
                }
            }
            assert!([64_u32, 1024, 1 << 16, 1 << 20].iter().all(|&slots| {
                let units = slots.div_ceil(UNIT);
                (units.div_ceil(groups.share)..=units).contains(&groups.for_slots(slots))
            }));
        }
        // Negative control: one workgroup could not name all of a large picture's places.
        assert!(16_384 > Groups::GPU.share && Groups { most: 1, ..Groups::GPU }.for_units(16_384) > 1);
    }

    #[test]
    fn a_picture_of_4k_fits_every_device() {
        let (limits, size) = (wgpu::Limits::default(), [3840, 2160]);
        GatherGi::check(&limits, size, &Options::default()).expect("it fits");
        // Eight rays for each disoccluded cell would not.
        let cells: u64 = cells_of(size).map(u64::from).iter().product();
        assert!(8 * RECORD * cells > limits.max_storage_buffer_binding_size);
        assert_eq!((spp(size), spp([1920, 1080])), (4, 8));
    }
}
