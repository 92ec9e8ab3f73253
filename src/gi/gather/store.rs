//! What `gather` keeps from frame to frame, and between the passes of one.

use super::{PAST, RECORD};
use crate::gi::cells::CellSide;

pub(super) struct Store {
    /// Of the table of entries, by slot: key; lots of both halves; queries of cells and of both halves' entries, and where both
    /// halves' rays begin; when it was asked for; light of both halves.
    pub keys: wgpu::Buffer,
    pub lots: wgpu::Buffer,
    pub queries: wgpu::Buffer,
    pub asked: wgpu::Buffer,
    pub light: wgpu::Buffer,
    /// Of cells: what rays found; what is remembered, before and after this frame in turns; the light that is shown.
    pub records: wgpu::Buffer,
    pub pasts: [wgpu::Buffer; 2],
    pub cell_light: wgpu::Buffer,
    /// Of cells: what light has changed to.
    pub changes: wgpu::Buffer,
}

impl Store {
    pub fn new(device: &wgpu::Device, size: [u32; 2], slots: u32) -> Self {
        let cells = CellSide::Four.count(size).max(1);
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
            usage: wgpu::BufferUsages::STORAGE,
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
            queries: buffer("gi.entry_queries", 16 * (cells + 4 * slots)),
            asked: buffer("gi.entry_asked", 4 * slots),
            light: buffer("gi.entry_light", 32 * slots),
            records: buffer("gi.records", RECORD * cells),
            pasts: [past(), past()],
            cell_light: buffer("gi.light", CellSide::Four.light_bytes(size)),
            changes: buffer("gi.changes", 16 * cells),
        }
    }

    /// Bytes of the largest buffer.
    pub fn largest(size: [u32; 2], slots: u32) -> u64 {
        let (cells, slots) = (CellSide::Four.count(size).max(1), u64::from(slots));
        [16 * (cells + 4 * slots), 32 * slots, PAST * cells, RECORD * cells, CellSide::Four.light_bytes(size)]
            .into_iter()
            .max()
            .unwrap_or(0)
    }

    pub fn bytes(&self) -> u64 {
        let Self { keys, lots, queries, asked, light, records, pasts: [a, b], cell_light, changes } = self;
        [keys, lots, queries, asked, light, records, a, b, cell_light, changes].iter().map(|b| b.size()).sum()
    }
}
