//! How the rays of a pass are shared out among workgroups (`jobs.wgsl`).

use super::looks;
use crate::gi::stage::inputs::cells_of;
use crate::gpu::tape;

/// Places of a unit: `UNIT` of `jobs.wgsl`. Of cells or squares they are 32×32 beside each other.
const UNIT: u32 = BLOCK * BLOCK;
const BLOCK: u32 = 32;

/// Units of a workgroup's share at most, since sixteen bits name a job.
const SHARE: u32 = 65_536 / UNIT;

/// How many workgroups a device does well with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Groups {
    /// Of a pass at most.
    most: u32,
}

impl Groups {
    /// Of each of a GTX 1050's five multiprocessors six fill the memory.
    pub const GPU: Self = Self { most: 256 };

    /// Of a driver that draws on the CPU two a processor: vectors of threads go through a whole
    /// shader once, whether one of them has something to do or not. What is written down of
    /// dispatches, to be counted or exported, is as GPUs have it.
    pub fn of(device: &wgpu::Device) -> Self {
        if device.adapter_info().device_type != wgpu::DeviceType::Cpu || tape::runs() {
            return Self::GPU;
        }
        let processors = std::thread::available_parallelism().map_or(1, |n| n.get() as u32);
        Self { most: processors.saturating_mul(2).min(Self::GPU.most) }
    }

    fn for_units(self, units: u32) -> u32 {
        units.clamp(1, self.most).max(units.div_ceil(SHARE))
    }

    /// Workgroups of `gi.rays`: layers of blocks for rays of cells, for rays into lobes, and for
    /// each further ray of fresh cells.
    pub fn for_cells(self, size: [u32; 2]) -> u32 {
        self.for_units(blocks(cells_of(size)).saturating_mul(1 + looks(size)))
    }

    /// Workgroups of `gi.gradient`, for squares of 2×2 cells.
    pub fn for_squares(self, size: [u32; 2]) -> u32 {
        self.for_units(blocks(cells_of(size).map(|n| n.div_ceil(2))))
    }

    /// Workgroups of `gi.mirror`, for squares of 2×2 pixels.
    pub fn for_pixels(self, size: [u32; 2]) -> u32 {
        self.for_units(blocks(size.map(|n| n.div_ceil(2))))
    }

    /// Workgroups of `gi.renew`, two units each, since few slots of a table are in use, and of those
    /// few send a ray. The table of 65,536 has 32 workgroups then, about as many as fill the memory
    /// of a GTX 1050.
    pub fn for_slots(self, slots: u32) -> u32 {
        self.for_units(slots.div_ceil(UNIT)).min(slots.div_ceil(2 * UNIT))
    }
}

fn blocks(grid: [u32; 2]) -> u32 {
    grid[0].div_ceil(BLOCK).saturating_mul(grid[1].div_ceil(BLOCK))
}

#[cfg(test)]
mod tests {
    use super::super::{GatherGi, Options, RECORD, WAYS, looks};
    use super::{BLOCK, Groups, SHARE, UNIT, cells_of};

    /// A constant of a shader.
    fn constant(source: &str, name: &str) -> u64 {
        let start = format!("const {name} = ");
        let line = source.lines().find_map(|l| l.strip_prefix(&start)).expect("the shader has it");
        line.trim_end_matches(';').trim_end_matches('u').parse().expect("a whole number")
    }

    #[test]
    fn buffers_and_groups_are_what_shaders_fill() {
        let look = include_str!("../../../shaders/gi/gather/look.wgsl");
        let jobs = include_str!("../../../shaders/gi/gather/jobs.wgsl");
        let queue = include_str!("../../../shaders/gi/gather/queue.wgsl");
        assert_eq!(constant(jobs, "UNIT"), u64::from(UNIT));
        assert_eq!(16 * constant(queue, "WALKS") * constant(look, "PARTS"), WAYS);
        let blocks = format!("return (grid + {}u) / {BLOCK}u;", BLOCK - 1);
        assert!(jobs.contains(&blocks), "{blocks}");
    }

    #[test]
    fn every_workgroup_has_a_share_that_sixteen_bits_name() {
        for most in [1, 4, 256] {
            let groups = Groups { most };
            for units in [1, 2, 9, 63, 288, 2040, 16_384] {
                let of = |group: u32, all: u32| group * units / all;
                let all = groups.for_units(units);
                assert!(all <= units, "{most}, {units}");
                for group in 0..all {
                    let share = of(group + 1, all) - of(group, all);
                    assert!((1..=SHARE).contains(&share), "{most}, {units}: {share}");
                }
            }
            assert!([64_u32, 1024, 1 << 16, 1 << 20].iter().all(|&slots| {
                let units = slots.div_ceil(UNIT);
                (units.div_ceil(SHARE)..=units).contains(&groups.for_slots(slots))
            }));
        }
        // Negative control: one workgroup could not name all of a large picture's places.
        assert!(16_384 > SHARE && Groups { most: 1 }.for_units(16_384) > 1);
    }

    #[test]
    fn a_picture_of_4k_fits_every_device() {
        let (limits, size) = (wgpu::Limits::default(), [3840, 2160]);
        GatherGi::check(&limits, size, &Options::default()).expect("it fits");
        // Eight rays for each cell that nothing is remembered of would not.
        let cells: u64 = cells_of(size).map(u64::from).iter().product();
        assert!(8 * RECORD * cells > limits.max_storage_buffer_binding_size);
        assert_eq!((looks(size), looks([1920, 1080])), (4, 8));
    }
}
