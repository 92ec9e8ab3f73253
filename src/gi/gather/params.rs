//! What changes from round to round, in a ring of uniform slots: a host may record several views
//! into one submission.

use crate::gpu::bind::Bound;
use bytemuck::{Pod, Zeroable};

/// Some lights stand for surfaces that glow.
pub(super) const STANDS_IN: u32 = 1;
/// The frame has nothing to do with the one before.
pub(super) const CUT: u32 = 2;
/// Cells are shown as they are.
pub(super) const NO_BLUR: u32 = 4;
/// All frames of a mean count the same.
pub(super) const EVEN: u32 = 8;
/// The lights are not what they were a few frames ago.
pub(super) const LIGHTS_CHANGED: u32 = 16;
/// Surfaces that rays meet show no gloss.
pub(super) const NO_CAUSTICS: u32 = 32;
/// The host does not say what surfaces mirror.
pub(super) const NO_GLOSS: u32 = 64;

/// Light or objects are not what they were a short while ago.
pub(super) const CHANGING: u32 = 128;

/// A network says which cells are averaged.
pub(super) const GUIDED: u32 = 256;

/// Lights or objects have changed since the frame before.
pub(super) const CHANGED: u32 = 512;
/// Every entry sends a ray in each round, whoever met it.
pub(super) const ALL_ENTRIES: u32 = 1024;
/// The device runs the threads of a workgroup one after the other.
pub(super) const IN_TURN: u32 = 2048;

/// `Gather` of `shaders/gi/gather/types.wgsl`, which documents the fields.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "documented in the shader")]
pub struct Params {
    pub eye: [f32; 3],
    pub frame: u32,
    pub light_count: u32,
    pub emitter_count: u32,
    pub inverse_power: f32,
    pub mask: u32,
    pub entry_scale: f32,
    pub round: u32,
    pub cell_frames: f32,
    pub entry_frames: f32,
    pub flags: u32,
    pub cells: u32,
    pub rays: u32,
    pub since: u32,
    pub last_round: u32,
    pub looks: u32,
    pub shift: [u32; 2],
}

/// Uniform offsets are multiples of this under WebGPU's default limits.
const STRIDE: u64 = 256;
/// Rounds between two submissions that keep their own parameters: as many views as `InputGroup`
/// allows, with a few first frames among them.
const SLOTS: u32 = 512;

pub(super) struct ParamsRing {
    buffer: wgpu::Buffer,
    next: u32,
}

impl ParamsRing {
    pub const TYPE: wgpu::BindingType = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: wgpu::BufferSize::new(size_of::<Params>() as u64),
    };

    pub fn new(device: &wgpu::Device) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.gather"),
            size: STRIDE * u64::from(SLOTS),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Self { buffer, next: 0 }
    }

    pub fn bound(&self) -> Bound {
        Bound::Slot(self.buffer.clone(), size_of::<Params>() as u64)
    }

    /// Writes into the next slot; its offset.
    pub fn write(&mut self, queue: &wgpu::Queue, params: &Params) -> u32 {
        let offset = STRIDE * u64::from(self.next);
        self.next = (self.next + 1) % SLOTS;
        queue.write_buffer(&self.buffer, offset, bytemuck::bytes_of(params));
        offset as u32
    }
}
