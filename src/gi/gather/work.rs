//! Workgroups of the passes, 64 threads each.

use super::store;
use crate::gi::stage::cells;

/// Threads of a workgroup, in passes over a grid eight by eight.
const THREADS: u32 = 64;

/// Entries that send a ray in one update are seldom more than one slot in so many.
const SLOTS_AN_UPDATE: u32 = 4;

/// A thread for each place of a grid.
pub(super) fn of_grid(grid: [u32; 2]) -> [u32; 3] {
    [grid[0].div_ceil(8), grid[1].div_ceil(8), 1]
}

/// A grid of squares of 2×2 places.
pub(super) fn halved(grid: [u32; 2]) -> [u32; 2] {
    grid.map(|n| n.div_ceil(2))
}

/// A thread for each item of a list.
pub(super) fn of_list(items: u32) -> [u32; 3] {
    [items.div_ceil(THREADS), 1, 1]
}

/// Of `gi.trace`: a thread for each ray of a settled frame. Where there are more, in a first frame or
/// after a change, a thread traces several.
pub(super) fn for_cells(size: [u32; 2]) -> [u32; 3] {
    of_list((cells::count(size) + store::squares(size)) as u32)
}

/// Of `gi.cache_update`.
pub(super) fn for_entries(slots: u32) -> [u32; 3] {
    of_list(slots.div_ceil(SLOTS_AN_UPDATE))
}

#[cfg(test)]
mod tests {
    use super::super::{GatherGi, Options, RECORD, spp};
    use super::{for_cells, for_entries};
    use crate::gi::stage::inputs::cells_of;

    #[test]
    fn a_picture_of_4k_fits_every_device() {
        let (limits, size) = (wgpu::Limits::default(), [3840, 2160]);
        GatherGi::check(&limits, size, &Options::default()).expect("it fits");
        // Eight rays for each disoccluded cell would not.
        let cells: u64 = cells_of(size).map(u64::from).iter().product();
        assert!(8 * RECORD * cells > limits.max_storage_buffer_binding_size);
        assert_eq!((spp(size), spp([1920, 1080])), (4, 8));
    }

    #[test]
    fn the_largest_pictures_and_caches_are_few_enough_workgroups() {
        let most = wgpu::Limits::default().max_compute_workgroups_per_dimension;
        // More cells or slots cannot be numbered (`GatherGi::check`).
        assert!(for_cells([7200, 7200])[0] <= most && for_entries(1 << 20)[0] <= most);
        assert!((cells_of([7200, 7200]).iter().product::<u32>() * 5 / 4) < 1 << super::super::VERTEX_BITS);
        assert!(for_cells([8192, 8192])[0] > most, "negative control");
    }
}
