//! The method `gather`: one ray a cell and frame into the scene's triangles, lit where it ends by
//! the lights (a shadow ray each) and by a cache of light in the world; averaged over frames,
//! blurred over neighbours, brought to full resolution.
//!
//! ```text
//! G-buffer ─► gi.cells ─► gi.rays ───────────► gi.settle ─► gi.blur ─► gi.smooth ─► gi.bring ─► E/π, gloss
//!                          │  ▲ who was met       ▲   mean of the frames before
//!                          ▼  │                   │
//!        gi.evict ─► table of entries ─► gi.renew ┘   one ray an entry, several rounds in a first frame
//! ```
//!
//! Of each 2×2 cells one in turn sends a second ray, into its surface's lobe: what lobes show goes
//! the same way beside the light ([`Outputs::specular`]). Lobes narrower than cells get rays of
//! their own, one a frame of each 2×2 pixels (`gi.mirror`).
//!
//! It asks what stands between, so it needs no constant for that. What it knows of a surface that a
//! ray meets is one colour a triangle; how finely it knows the light between surfaces is the size
//! of an entry's cell; the rest is noise, which frames and neighbours average away. `docs/internals/gather.md`
//! says what it cannot do.

mod bindings;
pub mod bring;
mod frame;
mod options;
mod params;
mod pass;
mod schedule;
mod store;
mod work;

pub use frame::Settled;
pub use options::{Options, OptionsError};
pub use params::Params;

use crate::gi::interface::technique::{Memory, Technique};
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::stage;
use crate::gi::stage::cells::{self, CellsPass};
use crate::gi::stage::inputs::InputGroup;
use crate::gpu::bind::{Binder, Bound};
use crate::gpu::timing::Recorder;
use bring::BringPass;
use params::ParamsRing;
use pass::Pass;
use schedule::Schedule;
use store::Store;

/// A ray begins this share of the view distance off its surface: half along the way to the eye,
/// half along the normal. At 1024 × 512 and 60° a three-hundredth of a cell's width, and 500 times
/// the rounding of the depth.
const LIFT: f32 = 3e-5;

/// It begins no nearer than so many steps of the depth's texels.
const LIFT_STEPS: f32 = 4.0;

/// Constants of the shaders as WGSL.
pub fn prelude() -> String {
    let flags: String = params::FLAGS.iter().map(|(name, bit)| format!("const GATHER_{name} = {bit}u;\n")).collect();
    let unit = format!("const UNIT = {}u;\nconst CANDIDATES = {}u;\n", work::UNIT, crate::lights::CANDIDATES);
    let lift = format!("const LIFT = f32({LIFT:?});\nconst LIFT_STEPS = f32({LIFT_STEPS:?});\n");
    [cells::prelude(), flags, unit, lift].concat()
}

/// Most bits of a lot that may name a query (`lot_bits` of `entries.wgsl`): ten are left to draw
/// by.
const LOT_BITS: u32 = 22;

/// Storage buffers that `gi.rays` and `gi.renew` bind: as many as every WebGPU device has.
const STORAGE_BUFFERS: u32 = 8;

/// Rays of a cell of which nothing is remembered: eight in pictures of up to two million pixels.
/// Larger ones have more cells of the same surfaces, and at 3840×2160 records of eight would not fit
/// into the 128 MiB that every WebGPU device binds.
pub(super) fn looks(size: [u32; 2]) -> u32 {
    if size.map(u64::from).iter().product::<u64>() <= 1 << 21 { 8 } else { 4 }
}

/// Bytes that a workgroup remembers of its rays: of 256 ways, thirteen vectors each (`WALKS`
/// and `PARTS` of `ways.wgsl`).
const WAYS: u64 = 256 * 13 * 16;

/// Bytes of what a cell's ray found.
const RECORD: u64 = 48;

/// Bytes of what a cell remembers.
pub const PAST: u64 = 80;

/// Bytes of what a network says of a cell; `Guidance` of `guided.wgsl`.
pub const GUIDANCE: u64 = 48;

/// The method at work.
pub struct GatherGi {
    device: wgpu::Device,
    options: Options,
    inputs: InputGroup,
    params: ParamsRing,
    scene: Binder,
    /// Group 1 of passes that send no rays: the parameters alone.
    frame_params: Binder,
    cells: CellsPass,
    /// Sends rays of the frame before once more, where something has changed.
    gradient: Pass,
    /// Finds cells of which nothing is remembered that still holds; binds what `settle` binds.
    recall: Pass,
    rays: Pass,
    /// Frees entries that no ray has met for long; binds what `renew` binds.
    evict: Pass,
    renew: Pass,
    /// Rays of smooth pixels.
    mirror: Pass,
    mean: Pass,
    blur: Pass,
    blur_wide: Pass,
    smooth: Pass,
    bring: BringPass,
    store: Store,
    workgroups: work::Groups,
    /// Size of pictures that the device is known to have room for.
    checked: [u32; 2],
    /// Bound where the host names no lights or no motion.
    no_lights: wgpu::Buffer,
    /// Bound where no network guides the filter.
    no_guidance: wgpu::Buffer,
    no_motion: wgpu::TextureView,
    /// Bound where the host names no specular reflectance: there is none.
    no_specular: wgpu::TextureView,
    /// Where what lobes reflect goes if the host does not ask for it: one texel.
    nowhere: wgpu::TextureView,
    /// What the next frame has to know of those before it.
    schedule: Schedule,
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
        // A lot's low bits name a query.
        let queries = cells::count(size) + store::squares(size) + 4 * u64::from(options.slots);
        if queries >= 1 << LOT_BITS {
            return Err(GiError::Device(format!(
                "is asked for {queries} rays a frame, but they are numbered up to {}",
                1 << LOT_BITS
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
        let (table, history, blur) = (bindings::Entries::TYPES, bindings::History::TYPES, bindings::Blur::TYPES);
        let workgroups = work::Groups::of(device);
        Self {
            cells: CellsPass::new(device, &inputs, size),
            evict: new(shared, ("gi.evict", "gi.renew", "evict"), table),
            gradient: new(shared, ("gi.gradient", "gi.gradient", "gradient"), bindings::Gradient::TYPES),
            rays: new(shared, ("gi.rays", "gi.rays", "rays"), bindings::CellRays::TYPES),
            renew: new(shared, ("gi.renew", "gi.renew", "renew"), table),
            mirror: new(shared, ("gi.mirror", "gi.mirror", "mirror"), bindings::Mirror::TYPES),
            recall: new(alone, ("gi.recall", "gi.recall", "recall"), history),
            mean: new(alone, ("gi.settle", "gi.settle", "settle"), history),
            blur: new(alone, ("gi.blur", "gi.blur", "blur"), blur),
            blur_wide: new(alone, ("gi.blur", "gi.blur", "blur_wide"), blur),
            smooth: new(alone, ("gi.smooth", "gi.smooth", "smooth_light"), bindings::Smooth::TYPES),
            bring: BringPass::new(device, &inputs),
            store: Store::new(device, size, options.slots, workgroups),
            workgroups,
            checked: size,
            no_lights: unused("gi.no_lights", size_of::<crate::lights::LightGpu>() as u64),
            no_guidance: unused("gi.no_guidance", GUIDANCE),
            no_motion: stage::absent(device, "gi.no_motion", wgpu::TextureFormat::Rg16Float),
            no_specular: stage::absent(device, "gi.no_specular", wgpu::TextureFormat::Rgba8Unorm),
            nowhere: stage::nowhere(device, "gi.nowhere"),
            device: device.clone(),
            options,
            inputs,
            params,
            scene,
            frame_params,
            schedule: Schedule::default(),
        }
    }

    /// Frames in the longest-lived means: 0 before the first, and 1 after it and after a cut.
    pub fn frames(&self) -> u32 {
        self.schedule.frames()
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        let rays = [&self.gradient, &self.recall, &self.evict, &self.rays, &self.renew, &self.mirror];
        let made = rays.into_iter().chain([&self.mean, &self.blur, &self.blur_wide, &self.smooth]).map(Pass::made);
        self.inputs.made() + self.scene.made() + self.frame_params.made() + self.bring.made() + made.sum::<u64>()
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
        let settled = self.settle(recorder, queue, inputs, false)?;
        self.filter(recorder, &settled, None, outputs);
        Ok(())
    }

    fn warm_up(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
    ) -> Result<bool, GiError> {
        let settled = self.settle(recorder, queue, inputs, false)?;
        // Where light has changed cells are told by their neighbours.
        self.blur(recorder, &settled, Bound::from(&self.no_guidance));
        Ok(true)
    }

    fn shows_lobes(&self) -> bool {
        true
    }

    fn memory(&self) -> Option<Memory<'_>> {
        let pasts = &self.store.pasts[(self.frames() & 1) as usize];
        let Store { cell_light, changes, .. } = &self.store;
        Some(Memory { pasts, pixels: self.cells.pixels(), light: cell_light, changes })
    }

    fn knows_scene(&self, rays: bool) -> bool {
        rays
    }

    fn settled(&self) -> Option<u32> {
        Some(self.frames())
    }

    fn cut(&mut self) {
        self.schedule.cut();
    }

    fn forget(&mut self) {
        self.inputs.forget();
        self.scene.forget();
        self.gradient.forget();
        self.recall.forget();
        self.mirror.forget();
        self.mean.forget();
        self.bring.forget();
    }

    fn allocations(&self) -> u64 {
        self.allocations()
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.cells.bytes() + self.store.bytes()
    }
}
