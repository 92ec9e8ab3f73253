//! What `gather` keeps from frame to frame, and between the passes of one.

use super::{HISTORY, RECORD, spp};
use crate::gi::stage::{cells, inputs::cells_of};

/// Squares of 2×2 cells, each of which sends one ray a frame into a lobe.
pub(super) fn squares(size: [u32; 2]) -> u64 {
    cells_of(size).map(|n| u64::from(n.div_ceil(2))).iter().product()
}

pub(super) struct Store {
    /// Of the cache, by slot: keys; proposals of both halves; vertices of proposals and origins of rays;
    /// last use; light of both halves. `entries.wgsl` documents them.
    pub keys: wgpu::Buffer,
    pub proposals: wgpu::Buffer,
    pub vertices: wgpu::Buffer,
    pub last_used: wgpu::Buffer,
    pub light: wgpu::Buffer,
    /// Rays of the frame, then of each cache update (`jobs.wgsl`).
    pub jobs: wgpu::Buffer,
    /// Of cells: records of rays; histories of the last and of this frame in turns; directional light.
    pub records: wgpu::Buffer,
    pub histories: [wgpu::Buffer; 2],
    pub cell_light: wgpu::Buffer,
    /// Directional light after the blur, before the à-trous step.
    pub light_blurred: wgpu::Buffer,
    /// Light of cells where the anti-lag test found a change.
    pub changes: wgpu::Buffer,
    /// Specular of cells after the blur; as lobes show it.
    pub specular_blurred: wgpu::Buffer,
    pub specular_filtered: wgpu::Buffer,
    /// Specular history of smooth pixels, four halves each (`specular_trace.wgsl`).
    pub pixel_specular: wgpu::Buffer,
}

/// Bytes of `pixel_specular` of pictures of `size` pixels.
fn pixel_specular(size: [u32; 2]) -> u64 {
    8 * size.map(|n| u64::from(n.max(1))).iter().product::<u64>()
}

/// Bytes of `vertices`.
fn vertices(size: [u32; 2], slots: u64) -> u64 {
    16 * (cells::count(size).max(1) + squares(size) + 4 * slots)
}

/// Records of rays of a picture.
fn records(size: [u32; 2]) -> u64 {
    u64::from(spp(size)) * cells::count(size).max(1) + squares(size)
}

/// Bytes of `jobs`: eight words, and eight bytes a job.
fn jobs(size: [u32; 2], slots: u64) -> u64 {
    32 + 8 * records(size).max(slots)
}

impl Store {
    pub fn new(device: &wgpu::Device, size: [u32; 2], slots: u32) -> Self {
        let cells = cells::count(size).max(1);
        let slots = u64::from(slots);
        let buffer = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        // The lowest proposal wins, so none is the largest number.
        let proposals = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.entry_proposals"),
            size: 8 * slots,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: true,
        });
        if let Ok(mut range) = proposals.get_mapped_range_mut(..) {
            range.slice(..).fill(0xff);
        }
        proposals.unmap();
        let history = || buffer("gi.histories", HISTORY * cells);
        Self {
            keys: buffer("gi.entry_keys", 4 * slots),
            proposals,
            vertices: buffer("gi.proposal_vertices", vertices(size, slots)),
            last_used: buffer("gi.entry_last_used", 4 * slots),
            light: buffer("gi.entry_light", 32 * slots),
            jobs: buffer("gi.jobs", jobs(size, slots)),
            records: buffer("gi.records", RECORD * records(size)),
            histories: [history(), history()],
            cell_light: buffer("gi.light", cells::light_bytes(size)),
            light_blurred: buffer("gi.light_blurred", cells::light_bytes(size)),
            changes: buffer("gi.changes", 16 * cells),
            specular_blurred: buffer("gi.specular_blurred", 16 * cells),
            specular_filtered: buffer("gi.specular_filtered", 16 * cells),
            pixel_specular: buffer("gi.pixel_specular", pixel_specular(size)),
        }
    }

    /// Bytes of the largest buffer, on whatever device.
    pub fn largest(size: [u32; 2], slots: u32) -> u64 {
        let (cells, slots) = (cells::count(size).max(1), u64::from(slots));
        let [light, histories, records] = [32 * slots, HISTORY * cells, RECORD * records(size)];
        [
            vertices(size, slots),
            jobs(size, slots),
            light,
            histories,
            records,
            cells::light_bytes(size),
            pixel_specular(size),
        ]
        .into_iter()
        .max()
        .unwrap_or(0)
    }

    pub fn bytes(&self) -> u64 {
        let Self {
            keys,
            proposals,
            vertices,
            last_used,
            light,
            jobs,
            records,
            histories: [a, b],
            cell_light,
            light_blurred,
            changes,
            specular_blurred,
            specular_filtered,
            pixel_specular,
        } = self;
        let table = [keys, proposals, vertices, last_used, light];
        let buffers = table.into_iter().chain([
            jobs,
            records,
            a,
            b,
            cell_light,
            light_blurred,
            changes,
            specular_blurred,
            specular_filtered,
            pixel_specular,
        ]);
        buffers.map(|b| b.size()).sum::<u64>()
    }
}
