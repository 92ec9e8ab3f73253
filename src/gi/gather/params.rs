//! Parameters of each cache update, in a ring of uniform slots: a host may record several views into
//! one submission.

use crate::gpu::bind::Bound;
use bytemuck::{Pod, Zeroable};

/// Bits of [`Params::flags`], which shaders know as `GATHER_` and the name.
macro_rules! flags {
    ($($(#[$doc:meta])* $name:ident = $bit:expr),+ $(,)?) => {
        $($(#[$doc])* pub(super) const $name: u32 = $bit;)+

        /// All of them, for the shaders' prelude.
        pub(super) const FLAGS: &[(&str, u32)] = &[$((stringify!($name), $name)),+];
    };
}

flags! {
    /// Some lights stand in for emissive surfaces: shadow rays to these would count twice.
    EMISSIVE_PROXIES = 1,
    /// First frame: no history holds.
    RESET = 1 << 1,
    /// No spatial filter.
    NO_BLUR = 1 << 2,
    /// All frames of a mean count alike.
    PROGRESSIVE = 1 << 3,
    /// Lights changed within the last few frames.
    LIGHTS_CHANGED = 1 << 4,
    /// Surfaces that rays hit have no specular lobe.
    NO_CAUSTICS = 1 << 5,
    /// The host names no specular reflectance: no specular rays.
    NO_SPECULAR = 1 << 6,
    /// Lights or objects changed a short while ago.
    CHANGING = 1 << 7,
    /// A network guides the filters.
    GUIDED = 1 << 8,
    /// Lights or objects changed since the last frame.
    CHANGED = 1 << 9,
    /// All entries send a ray in each update.
    ALL_ENTRIES = 1 << 10,
    /// Nothing has changed for long: a fourth of the rays suffices.
    REST = 1 << 11,
}

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
    pub cache_iteration: u32,
    pub cell_frames: f32,
    pub entry_frames: f32,
    pub flags: u32,
    pub cells: u32,
    pub rays: u32,
    pub frames_since_change: u32,
    pub last_iteration: u32,
    pub spp: u32,
    pub shift: [u32; 2],
    pub ray_budget: u32,
    pub entry_lifetime: u32,
    pub pad: [u32; 2],
}

/// Uniform offsets are multiples of this under WebGPU's default limits.
const STRIDE: u64 = 256;
/// Slots of the ring, one a cache update: as many views as `InputGroup` allows between two
/// submissions, with a few first frames among them.
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
