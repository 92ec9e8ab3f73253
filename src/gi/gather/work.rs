//! How the rays of a pass are shared out among workgroups (`jobs.wgsl`).

use super::looks;
use crate::gi::stage::inputs::cells_of;

/// Jobs that a workgroup has at once: `JOBS` of `jobs.wgsl`. Of cells or squares they are 32×32
/// beside each other.
const JOBS: u32 = BLOCK * BLOCK;
const BLOCK: u32 = 32;

/// Workgroups of a pass at most; those that have more to do go on with it one after the other. Of
/// each of a GTX 1050's five multiprocessors six fill the memory.
const GROUPS: u32 = 256;

fn blocks(grid: [u32; 2]) -> u32 {
    grid[0].div_ceil(BLOCK).saturating_mul(grid[1].div_ceil(BLOCK))
}

/// Workgroups of `gi.rays`: a layer of blocks for rays of cells, one for rays into lobes, the
/// others for further rays of fresh cells.
pub fn of_cells(size: [u32; 2]) -> u32 {
    blocks(cells_of(size)).saturating_mul(1 + looks(size)).clamp(1, GROUPS)
}

/// Workgroups of `gi.gradient`, for squares of 2×2 cells.
pub fn of_squares(size: [u32; 2]) -> u32 {
    blocks(cells_of(size).map(|n| n.div_ceil(2))).clamp(1, GROUPS)
}

/// Workgroups of `gi.mirror`, for squares of 2×2 pixels.
pub fn of_pixels(size: [u32; 2]) -> u32 {
    blocks(size.map(|n| n.div_ceil(2))).clamp(1, GROUPS)
}

/// Slots that a workgroup of `gi.renew` looks after: `SPAN` of `renew.wgsl`. The table of 65,536
/// has 32 workgroups then, about as many as fill the memory of a GTX 1050.
const SPAN: u32 = 2 * JOBS;

/// Workgroups of `gi.renew`.
pub fn of_slots(slots: u32) -> u32 {
    slots.div_ceil(SPAN).clamp(1, GROUPS)
}

#[cfg(test)]
mod tests {
    use super::super::{GatherGi, Options, RECORD, WAYS, looks};
    use super::{BLOCK, JOBS, SPAN, cells_of};

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
        assert_eq!(constant(jobs, "JOBS"), u64::from(JOBS));
        let renew = include_str!("../../../shaders/gi/gather/renew.wgsl");
        assert!(renew.contains(&format!("const SPAN = {}u * JOBS;", SPAN / JOBS)));
        assert_eq!(16 * constant(queue, "WALKS") * constant(look, "PARTS"), WAYS);
        let blocks = format!("return (grid + {}u) / {BLOCK}u;", BLOCK - 1);
        assert!(jobs.contains(&blocks), "{blocks}");
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
