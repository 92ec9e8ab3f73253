//! What `gather` keeps from frame to frame, and between the passes of one.

use super::{PAST, RECORD, WAYS, looks, work};
use crate::gi::stage::{cells, inputs::cells_of};

/// Squares of 2×2 cells, each of which sends one ray a frame into a lobe.
pub(super) fn squares(size: [u32; 2]) -> u64 {
    cells_of(size).map(|n| u64::from(n.div_ceil(2))).iter().product()
}

pub(super) struct Store {
    /// Of the table of entries, by slot: key; lots of both halves; queries of cells and of both
    /// halves' entries, where both halves' rays begin, and what workgroups remember of their rays;
    /// when it was asked for; light of both halves.
    pub keys: wgpu::Buffer,
    pub lots: wgpu::Buffer,
    pub queries: wgpu::Buffer,
    pub asked: wgpu::Buffer,
    pub light: wgpu::Buffer,
    /// Of cells: what rays found; what is remembered, before and after this frame in turns; the
    /// light that is shown.
    pub records: wgpu::Buffer,
    pub pasts: [wgpu::Buffer; 2],
    pub cell_light: wgpu::Buffer,
    /// The same as blurred over neighbours, before what lies further away is asked.
    pub blurred: wgpu::Buffer,
    /// Of cells: what light has changed to.
    pub changes: wgpu::Buffer,
    /// What rays into lobes of cells found, over neighbours; what lobes show.
    pub glosses: wgpu::Buffer,
    pub gleams: wgpu::Buffer,
    /// What rays of smooth pixels have found, four halves a pixel: `mirrored` of `mirror.wgsl`.
    pub mirrored: wgpu::Buffer,
}

/// Bytes of `mirrored` of pictures of `size` pixels.
fn mirrored(size: [u32; 2]) -> u64 {
    8 * size.map(|n| u64::from(n.max(1))).iter().product::<u64>()
}

/// Bytes of `queries`.
fn queries(size: [u32; 2], slots: u64, groups: work::Groups) -> u64 {
    let rays = cells::count(size).max(1) + squares(size);
    let groups = groups.for_pixels(size).max(groups.for_cells(size)).max(groups.for_slots(slots as u32));
    16 * (rays + 4 * slots) + u64::from(groups) * WAYS
}

impl Store {
    pub fn new(device: &wgpu::Device, size: [u32; 2], slots: u32, groups: work::Groups) -> Self {
        let cells = cells::count(size).max(1);
        let rays = cells + squares(size);
        let records = rays + u64::from(looks(size) - 1) * cells;
        let slots = u64::from(slots);
        let buffer = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        // The least number wins a lot, so none is the greatest.
        let lots = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.entry_lots"),
            size: 8 * slots,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: true,
        });
        if let Ok(mut range) = lots.get_mapped_range_mut(..) {
            range.slice(..).fill(0xff);
        }
        lots.unmap();
        let past = || buffer("gi.pasts", PAST * cells);
        Self {
            keys: buffer("gi.entry_keys", 4 * slots),
            lots,
            queries: buffer("gi.entry_queries", queries(size, slots, groups)),
            asked: buffer("gi.entry_asked", 4 * slots),
            light: buffer("gi.entry_light", 32 * slots),
            records: buffer("gi.records", RECORD * records),
            pasts: [past(), past()],
            cell_light: buffer("gi.light", cells::light_bytes(size)),
            blurred: buffer("gi.blurred", cells::light_bytes(size)),
            changes: buffer("gi.changes", 16 * cells),
            glosses: buffer("gi.glosses", 16 * cells),
            gleams: buffer("gi.gleams", 16 * cells),
            mirrored: buffer("gi.mirrored", mirrored(size)),
        }
    }

    /// Bytes of the largest buffer, on whatever device.
    pub fn largest(size: [u32; 2], slots: u32) -> u64 {
        let (cells, slots) = (cells::count(size).max(1), u64::from(slots));
        let rays = cells + squares(size);
        let records = rays + u64::from(looks(size) - 1) * cells;
        let [light, pasts, records] = [32 * slots, PAST * cells, RECORD * records];
        let queries = queries(size, slots, work::Groups::CPU).max(queries(size, slots, work::Groups::GPU));
        [queries, light, pasts, records, cells::light_bytes(size), mirrored(size)].into_iter().max().unwrap_or(0)
    }

    pub fn bytes(&self) -> u64 {
        let Self {
            keys,
            lots,
            queries,
            asked,
            light,
            records,
            pasts: [a, b],
            cell_light,
            blurred,
            changes,
            glosses,
            gleams,
            mirrored,
        } = self;
        let table = [keys, lots, queries, asked, light];
        let buffers = table.into_iter().chain([records, a, b, cell_light, blurred, changes, glosses, gleams, mirrored]);
        buffers.map(|b| b.size()).sum::<u64>()
    }
}
