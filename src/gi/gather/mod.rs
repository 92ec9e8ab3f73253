//! The method `gather`. It traces one ray per 4×4-pixel cell and frame into the scene's triangles,
//! lights the hits by a shadow ray and a world-space radiance cache, accumulates over frames, blurs
//! over neighbours and upsamples to full resolution.
//!
//! ```text
//! G-buffer ─► gi.downsample ─► gi.gradient ─► gi.reproject ─► gi.trace ─► gi.accumulate ─► gi.blur ─► gi.atrous
//!                                                               │  ▲         ▲ history          │
//!                                              proposals, hits  ▼  │         │                  ▼
//!         gi.cache_evict ─► entries ─► gi.cache_select ─► gi.cache_update   └─ …          gi.upsample ─► E/π, specular
//! ```
//!
//! One cell of each 2×2 also sends a specular ray ([`Outputs::specular`]). Pixels whose reflection
//! changes within a cell have rays of their own, one a frame for each 2×2 pixels
//! (`gi.specular_trace`).
//!
//! A ray is a thread's: `gi.reproject` and `gi.cache_select` note in a list which rays are due.
//!
//! Limits: a ray knows one colour of a triangle or a piece of one, indirect light is as fine as an entry's cell, and
//! the rest is noise. See `docs/internals/gather.md`.

mod bindings;
mod budget;
mod frame;
mod options;
mod params;
mod pass;
mod schedule;
mod store;
pub mod upsample;
mod work;

pub use frame::Accumulated;
pub use options::{Options, OptionsError};
pub use params::Params;
pub use schedule::{FRAMES_TO_REST, REST_PERIOD};

use crate::gi::interface::technique::{Memory, Technique};
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::stage;
use crate::gi::stage::cells::{self, DownsamplePass};
use crate::gi::stage::inputs::InputGroup;
use crate::gpu::bind::{Binder, Bound};
use crate::gpu::timing::Recorder;
use crate::layouts::{Row, row};
use params::ParamsRing;
use pass::Pass;
use schedule::Schedule;
use store::Store;
use upsample::UpsamplePass;

/// Ray origin offset, as a fraction of the view distance, split between the view direction and the
/// normal. Prevents self-intersection. At 1024×512 and 60° a three-hundredth of a cell, and 500
/// times the rounding of the depth.
const RAY_BIAS: f32 = 3e-5;

/// Least offset, in steps of the depth texture.
const RAY_BIAS_STEPS: f32 = 4.0;

/// Constants of the shaders as WGSL.
pub fn prelude() -> String {
    let flags: String = params::FLAGS.iter().map(|(name, bit)| format!("const GATHER_{name} = {bit}u;\n")).collect();
    let candidates = format!("const CANDIDATES = {}u;\n", crate::lights::CANDIDATES);
    let bias = format!("const RAY_BIAS = f32({RAY_BIAS:?});\nconst RAY_BIAS_STEPS = f32({RAY_BIAS_STEPS:?});\n");
    [cells::prelude(), flags, candidates, bias].concat()
}

/// Shaders of the method, each with an example of its prelude.
pub(super) fn preludes() -> Vec<(&'static str, String)> {
    let alike = [
        "gi.trace",
        "gi.cache_select",
        "gi.cache_update",
        "gi.gradient",
        "gi.specular_trace",
        "gi.reproject",
        "gi.accumulate",
        "gi.blur",
        "gi.atrous",
    ];
    let mut all: Vec<_> = alike.map(|shader| (shader, prelude())).into();
    all.push(("gi.upsample", upsample::prelude()));
    all
}

/// Structs that its shaders share with Rust.
pub(super) fn layouts() -> Vec<Row> {
    vec![row!("Gather", Params =>
        eye, frame, light_count, emitter_count, inverse_power, mask, entry_scale, cache_iteration, cell_frames,
        entry_frames, flags, cells, rays, frames_since_change, last_iteration, spp, shift, ray_budget,
        entry_lifetime, pad,
    )]
}

/// Most bits of a proposal that may index a vertex (`proposal_bits` of `entries.wgsl`): ten are
/// left for the random number.
const VERTEX_BITS: u32 = 22;

/// Storage buffers that `gi.trace` and `gi.cache_update` bind: as many as every WebGPU device has.
const STORAGE_BUFFERS: u32 = 8;

/// Rays of a disoccluded cell: eight in pictures of up to two million pixels, else four, since
/// records of eight would not fit into the 128 MiB that every WebGPU device binds.
pub(super) fn spp(size: [u32; 2]) -> u32 {
    if size.map(u64::from).iter().product::<u64>() <= 1 << 21 { 8 } else { 4 }
}

/// Bytes of a ray's record.
const RECORD: u64 = 48;

/// Bytes of a cell's history.
pub const HISTORY: u64 = 80;

/// Bytes of a cell's guidance; `Guidance` of `guidance.wgsl`.
pub const GUIDANCE: u64 = 48;

/// Where the number of rays that cells have sent lies in `jobs`, bytes: `LAST_RAYS` of `jobs.wgsl`.
pub const RAYS_SENT: u64 = 16;

/// The method at work.
pub struct GatherGi {
    device: wgpu::Device,
    options: Options,
    inputs: InputGroup,
    params: ParamsRing,
    scene: Binder,
    /// Group 1 of passes that send no rays: the parameters alone.
    frame_params: Binder,
    cells: DownsamplePass,
    /// Traces rays of the last frame again, where lights or objects changed.
    gradient: Pass,
    /// Marks cells without a valid history; has the bindings of `accumulate`.
    reproject: Pass,
    rays: Pass,
    /// Frees entries that no ray has met for long; has the bindings of `cache_select`.
    cache_evict: Pass,
    /// Notes entries that send a ray.
    cache_select: Pass,
    cache_update: Pass,
    /// Specular rays of smooth pixels.
    specular_trace: Pass,
    accumulate: Pass,
    blur: Pass,
    blur_wide: Pass,
    atrous: Pass,
    upsample: UpsamplePass,
    store: Store,
    /// Size of pictures that the device is known to have room for.
    checked: [u32; 2],
    /// Placeholders, bound when the host provides no lights, no motion or no specular reflectance,
    /// or when no network guides the filter.
    no_lights: wgpu::Buffer,
    no_guidance: wgpu::Buffer,
    no_motion: wgpu::TextureView,
    no_specular: wgpu::TextureView,
    /// Specular output where the host asks for none: one texel.
    unused_specular: wgpu::TextureView,
    /// What the next frame has to know of the earlier ones.
    schedule: Schedule,
    /// The last frame was filtered, not only accumulated.
    filtered: bool,
}

impl GatherGi {
    /// Whether a device with `limits` can have the method for pictures of `size` pixels.
    ///
    /// # Errors
    /// [`GiError::Device`], which says what is too small.
    pub fn check(limits: &wgpu::Limits, size: [u32; 2], options: &Options) -> Result<(), GiError> {
        let has = limits.max_storage_buffers_per_shader_stage;
        if has < STORAGE_BUFFERS {
            return Err(GiError::Device(format!(
                "binds {has} storage buffers to a shader stage, but rays need {STORAGE_BUFFERS}"
            )));
        }
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let bytes = Store::largest(size, options.slots);
        if bytes > limit {
            let [w, h] = size;
            return Err(GiError::Device(format!(
                "binds {limit} bytes at once, but a picture of {w}x{h} pixels by rays needs {bytes}"
            )));
        }
        // The low bits of a proposal index its vertex.
        let vertices = cells::count(size) + store::squares(size) + 4 * u64::from(options.slots);
        if vertices >= 1 << VERTEX_BITS {
            return Err(GiError::Device(format!(
                "would need {vertices} proposal vertices for this picture and cache, but they are numbered up to {}",
                1 << VERTEX_BITS
            )));
        }
        Ok(())
    }

    /// Makes pipelines, and buffers for pictures of `size` pixels.
    pub fn new(device: &wgpu::Device, size: [u32; 2], options: Options) -> Self {
        let inputs = InputGroup::geometry(device);
        let params = ParamsRing::new(device);
        let scene = Binder::new(device, "gi.gather", bindings::Scene::TYPES);
        let frame_params = Binder::new(device, "gi.gather", bindings::Alone::TYPES);
        let (shared, alone) = ((&inputs, &scene), (&inputs, &frame_params));
        let new = |groups, names, types: &[wgpu::BindingType]| Pass::new(device, groups, names, types);
        let unused = |label, size| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let (select, history, blur) = (bindings::CacheSelect::TYPES, bindings::Temporal::TYPES, bindings::Blur::TYPES);
        Self {
            cells: DownsamplePass::new(device, &inputs, size),
            cache_evict: new(alone, ("gi.cache_evict", "gi.cache_select", "cache_evict"), select),
            cache_select: new(alone, ("gi.cache_select", "gi.cache_select", "cache_select"), select),
            gradient: new(shared, ("gi.gradient", "gi.gradient", "gradient"), bindings::Gradient::TYPES),
            rays: new(shared, ("gi.trace", "gi.trace", "trace_cells"), bindings::Trace::TYPES),
            cache_update: new(
                shared,
                ("gi.cache_update", "gi.cache_update", "cache_update"),
                bindings::CacheUpdate::TYPES,
            ),
            specular_trace: new(
                shared,
                ("gi.specular_trace", "gi.specular_trace", "specular_trace"),
                bindings::SpecularTrace::TYPES,
            ),
            reproject: new(alone, ("gi.reproject", "gi.reproject", "reproject"), history),
            accumulate: new(alone, ("gi.accumulate", "gi.accumulate", "accumulate"), history),
            blur: new(alone, ("gi.blur", "gi.blur", "blur"), blur),
            blur_wide: new(alone, ("gi.blur", "gi.blur", "blur_wide"), blur),
            atrous: new(alone, ("gi.atrous", "gi.atrous", "atrous"), bindings::Atrous::TYPES),
            upsample: UpsamplePass::new(device, &inputs),
            store: Store::new(device, size, options.slots),
            checked: size,
            no_lights: unused("gi.no_lights", size_of::<crate::lights::LightGpu>() as u64),
            no_guidance: unused("gi.no_guidance", GUIDANCE),
            no_motion: stage::dummy_view(device, "gi.no_motion", wgpu::TextureFormat::Rg16Float),
            no_specular: stage::dummy_view(device, "gi.no_specular", wgpu::TextureFormat::Rgba8Unorm),
            unused_specular: stage::dummy_storage(device, "gi.unused_specular"),
            device: device.clone(),
            options,
            inputs,
            params,
            scene,
            frame_params,
            schedule: Schedule::default(),
            filtered: false,
        }
    }

    /// Frames in the longest-lived means: 0 before the first, and 1 after it and after a cut.
    pub fn frames(&self) -> u32 {
        self.schedule.frames()
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        let rays =
            [&self.gradient, &self.reproject, &self.cache_evict, &self.cache_select, &self.rays, &self.cache_update];
        let made = rays
            .into_iter()
            .chain([&self.specular_trace])
            .chain([&self.accumulate, &self.blur, &self.blur_wide, &self.atrous])
            .map(Pass::made);
        self.inputs.made() + self.scene.made() + self.frame_params.made() + self.upsample.made() + made.sum::<u64>()
    }
}

impl Technique for GatherGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        stage::inputs::check_outputs(outputs, inputs.size)?;
        let accumulated = self.accumulate(recorder, queue, inputs, false)?;
        self.filter(recorder, &accumulated, None, outputs);
        Ok(())
    }

    fn warm_up(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
    ) -> Result<bool, GiError> {
        let accumulated = self.accumulate(recorder, queue, inputs, false)?;
        // The next frame reads the anti-lag test.
        self.blur(recorder, &accumulated, Bound::from(&self.no_guidance));
        Ok(true)
    }

    fn writes_specular(&self) -> bool {
        true
    }

    fn memory(&self) -> Option<Memory<'_>> {
        let histories = &self.store.histories[(self.frames() & 1) as usize];
        let Store { cell_light, changes, jobs, .. } = &self.store;
        Some(Memory { histories, pixels: self.cells.pixels(), light: cell_light, changes, jobs })
    }

    fn set_rays(&mut self, rays: f32) {
        self.options.rays = rays;
    }

    fn uses_rays(&self, rays: bool) -> bool {
        rays
    }

    fn settled(&self) -> Option<u32> {
        Some(self.frames())
    }

    fn reset_history(&mut self) {
        self.schedule.reset_history();
    }

    fn release_bindings(&mut self) {
        self.inputs.release_bindings();
        self.scene.release_bindings();
        self.gradient.release_bindings();
        self.reproject.release_bindings();
        self.specular_trace.release_bindings();
        self.accumulate.release_bindings();
        self.upsample.release_bindings();
    }

    fn allocations(&self) -> u64 {
        self.allocations()
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.cells.bytes() + self.store.bytes()
    }
}
