//! The method `gather`: one ray a cell and frame into the scene's triangles, lit where it ends by the lights (a shadow ray each)
//! and by a cache of light in the world; averaged over frames, blurred over neighbours, brought to full resolution.
//!
//! ```text
//! G-buffer ─► gi.cells ─► gi.rays ───────────► gi.settle ─► gi.blur ─► gi.smooth ─► gi.bring ─► E/π, gloss
//!                          │  ▲ who was met       ▲   mean of the frames before
//!                          ▼  │                   │
//!        gi.evict ─► table of entries ─► gi.renew ┘   one ray an entry, several rounds in a first frame
//! ```
//!
//! Of each 2×2 cells one in turn sends a second ray, into its surface's lobe: what lobes show goes the same way beside the light
//! ([`Rung::gloss`]).
//!
//! It asks what stands between, so it needs no constant for that. What it knows of a surface that a ray meets is one colour a
//! triangle; how finely it knows the light between surfaces is the size of an entry's cell; the rest is noise, which frames and
//! neighbours average away. `docs/gi.md` says what it cannot do.

pub mod bring;
mod cost;
mod options;
mod params;
mod store;

pub use options::{Options, OptionsError};
pub use params::Params;

use super::cells::{self, CellsPass};
use super::inputs::{BoundInputs, InputGroup};
use super::rung::{Cost, Rung};
use super::{GiError, Inputs, Rays};
use crate::gpu::bind::{self, Binder, Bound};
use crate::gpu::{shaders, timing::Recorder};
use crate::render::tool::{LOAD, READ, READ_WRITE};
use bring::{BringPass, Brought};
use params::ParamsRing;
use store::Store;

/// A ray begins this share of the view distance off its surface: half along the way to the eye, half along the normal. At
/// 1024 × 512 and 60° a three-hundredth of a cell's width, and 500 times the rounding of the depth.
const LIFT: f32 = 3e-5;

/// Frames after a change of the lights for which entries get two rays each and remember no more than [`HURRIED`]: nothing is left of the
/// old light then, and they settle anew.
const HURRY: u32 = 8;
const HURRIED: f32 = 2.5;

/// After the first frame entries get so many rays each for so many frames: light between surfaces has come round by then.
const YOUNG: u32 = 8;
const ROUNDS_YOUNG: u32 = 4;

/// Constants of the shaders as WGSL.
pub fn prelude() -> String {
    format!("{}const LIFT = f32({LIFT:?});\n", cells::prelude())
}

/// Most bits of a lot that may name a query (`lot_bits` of `entries.wgsl`): ten are left to draw by.
const LOT_BITS: u32 = 22;

/// Storage buffers that `gi.rays` and `gi.renew` bind: as many as every WebGPU device has.
const STORAGE_BUFFERS: u32 = 8;

/// Bytes of what a cell's ray found.
const RECORD: u64 = 48;

/// Bytes of what a cell remembers.
const PAST: u64 = 80;

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
    rays: Pass,
    /// Frees entries that no ray has met for long; binds what `renew` binds.
    evict: wgpu::ComputePipeline,
    renew: Pass,
    settle: Pass,
    blur: Pass,
    smooth: Pass,
    bring: BringPass,
    store: Store,
    /// Size of pictures that the device is known to have room for.
    checked: [u32; 2],
    /// Bound where the host names no lights or no motion.
    no_lights: wgpu::Buffer,
    no_motion: wgpu::TextureView,
    /// Bound where the host names no specular reflectance: there is none.
    no_specular: wgpu::TextureView,
    /// Frames since the last cut, rounds since the beginning.
    frame: u32,
    round: u32,
    /// The lights' state in the last frame, and frames for which entries forget quickly because it was another before.
    lights_epoch: u64,
    hurry: u32,
    scene_id: u64,
}

/// A pipeline with group 2 of its own.
struct Pass {
    pipeline: wgpu::ComputePipeline,
    binder: Binder,
}

impl Pass {
    fn new(
        device: &wgpu::Device,
        (inputs, scene): (&InputGroup, &Binder),
        (name, entry): (&'static str, &str),
        types: &[wgpu::BindingType],
    ) -> Self {
        let binder = Binder::new(device, name, types);
        let pipeline = Self::pipeline(device, (inputs, scene), (name, entry), &binder);
        Self { pipeline, binder }
    }

    fn pipeline(
        device: &wgpu::Device,
        (inputs, scene): (&InputGroup, &Binder),
        (name, entry): (&'static str, &str),
        own: &Binder,
    ) -> wgpu::ComputePipeline {
        let module = shaders::module_with(device, name, &prelude());
        let layouts = [inputs.layout(), scene.layout(), own.layout()];
        bind::pipeline(device, name, &module, entry, &layouts)
    }
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
        let inputs = InputGroup::new(device);
        let params = ParamsRing::new(device);
        let texels = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let scene = Binder::new(device, "gi.gather", &[ParamsRing::TYPE, texels, READ, READ, READ, LOAD, texels]);
        let frame_params = Binder::new(device, "gi.gather", &[ParamsRing::TYPE]);
        let (shared, alone) = ((&inputs, &scene), (&inputs, &frame_params));
        let new = |groups, name, entry, types: &[wgpu::BindingType]| Pass::new(device, groups, (name, entry), types);
        let rw = READ_WRITE;
        let renew = new(shared, "gi.renew", "renew", &[rw, rw, rw, rw, rw]);
        let nothing = |label, format| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        Self {
            cells: CellsPass::new(device, &inputs, size),
            rays: new(shared, "gi.rays", "rays", &[rw, rw, rw, READ, rw, LOAD]),
            evict: Pass::pipeline(device, shared, ("gi.renew", "evict"), &renew.binder),
            renew,
            settle: new(alone, "gi.settle", "settle", &[READ, READ, READ, READ, rw, READ, LOAD, LOAD]),
            blur: new(alone, "gi.blur", "blur", &[READ, rw, rw, rw]),
            smooth: new(alone, "gi.smooth", "smooth_light", &[READ, READ, rw]),
            bring: BringPass::new(device, &inputs),
            store: Store::new(device, size, options.slots),
            checked: size,
            no_lights: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("gi.no_lights"),
                size: size_of::<crate::scene::upload::LightGpu>() as u64,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
            no_motion: nothing("gi.no_motion", wgpu::TextureFormat::Rg16Float),
            no_specular: nothing("gi.no_specular", wgpu::TextureFormat::Rgba8Unorm),
            device: device.clone(),
            options,
            inputs,
            params,
            scene,
            frame_params,
            frame: 0,
            round: 0,
            lights_epoch: 0,
            hurry: 0,
            scene_id: 0,
        }
    }

    /// Frames in the longest-lived means: 0 before the first, and 1 after it and after a cut.
    pub fn frames(&self) -> u32 {
        self.frame
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        let passes = [&self.rays, &self.renew, &self.settle, &self.blur, &self.smooth].map(|p| p.binder.made());
        self.inputs.made()
            + self.scene.made()
            + self.frame_params.made()
            + self.bring.made()
            + passes.iter().sum::<u64>()
    }

    fn params(&self, inputs: &Inputs<'_>, rays: &Rays<'_>) -> Result<Params, GiError> {
        let counts = rays.scene.counts();
        let flags = [
            (inputs.lights.is_some_and(|l| l.stand_in), params::STANDS_IN),
            (self.frame == 0, params::CUT),
            (!self.options.blur, params::NO_BLUR),
            (self.options.even, params::EVEN),
            (self.hurry > 0, params::LIGHTS_CHANGED),
            (!self.options.caustics, params::NO_CAUSTICS),
            (inputs.specular.is_none(), params::NO_GLOSS),
        ];
        Ok(Params {
            eye: super::inputs::Params::new(inputs.size, &inputs.camera, inputs.environment)?.eye_position(),
            frame: self.frame,
            light_count: inputs.lights.map_or(0, |l| l.count),
            emitter_count: counts.emitters as u32,
            inverse_power: rays.scene.inverse_power(),
            mask: self.options.slots - 1,
            entry_scale: self.options.entry_scale,
            round: self.round,
            cell_frames: self.options.cell_frames,
            entry_frames: if self.hurry > 0 {
                self.options.entry_frames.min(HURRIED)
            } else {
                self.options.entry_frames
            },
            flags: flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum(),
            cells: cells::count(inputs.size) as u32,
            rays: (cells::count(inputs.size) + store::squares(inputs.size)) as u32,
            pad: 0,
        })
    }

    fn run(recorder: &mut Recorder<'_>, label: &str, pass: &wgpu::ComputePipeline, groups: Groups<'_>, size: [u32; 3]) {
        recorder.compute(label, |p| {
            groups.inputs.set(p);
            p.set_bind_group(1, groups.scene, &[groups.offset]);
            p.set_bind_group(2, groups.own, &[]);
            p.set_pipeline(pass);
            p.dispatch_workgroups(size[0], size[1], size[2]);
        });
    }
}

/// What a pass is bound to.
struct Groups<'a> {
    inputs: &'a BoundInputs,
    scene: &'a wgpu::BindGroup,
    offset: u32,
    own: &'a wgpu::BindGroup,
}

impl Rung for GatherGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        super::ambient::check_output(output, inputs.size)?;
        let rays = inputs.rays.as_ref().ok_or(GiError::Rays)?;
        if inputs.size != self.checked {
            Self::check(&self.device.limits(), inputs.size, &self.options)?;
            self.checked = inputs.size;
        }
        let bound = self.inputs.bind(queue, inputs)?;
        // Another scene's light is nobody's past.
        let another = rays.scene.id() != self.scene_id;
        self.scene_id = rays.scene.id();
        if self.cells.fit(inputs.size) || another {
            self.store = Store::new(&self.device, inputs.size, self.options.slots);
            // The same scene gets the same rays, whatever was drawn before.
            self.round = 0;
            self.bring.forget();
            self.frame = 0;
        }
        let lights = inputs.lights.map_or(&self.no_lights, |l| l.buffer);
        let scene = self.scene.group([
            self.params.bound(),
            rays.scene.accel().view().into(),
            rays.scene.surfaces().into(),
            rays.scene.emitters().into(),
            lights.into(),
            rays.environment.into(),
            rays.scene.normals().into(),
        ]);
        let store = &self.store;
        let table = || [&store.keys, &store.lots, &store.queries].map(Bound::from);
        let [keys, lots, queries] = table();
        let specular = Bound::from(inputs.specular.unwrap_or(&self.no_specular));
        let pixels = Bound::from(self.cells.pixels());
        let records = Bound::from(&store.records);
        let rays_group = self.rays.binder.group([keys, lots, queries, pixels, records, specular.clone()]);
        let [keys, lots, queries] = table();
        let renew_group = self.renew.binder.group([keys, lots, queries, (&store.asked).into(), (&store.light).into()]);
        let [before, after] = [self.frame & 1, 1 - (self.frame & 1)].map(|i| &store.pasts[i as usize]);
        let settle_group = self.settle.binder.group([
            self.cells.pixels().into(),
            (&store.records).into(),
            (&store.light).into(),
            before.into(),
            after.into(),
            (&store.changes).into(),
            inputs.motion.unwrap_or(&self.no_motion).into(),
            specular,
        ]);
        let [changes, glosses] = [&store.changes, &store.glosses].map(Bound::from);
        let blur_group = self.blur.binder.group([after.into(), (&store.blurred).into(), changes, glosses]);
        let smooth_group =
            self.smooth.binder.group([after.into(), (&store.blurred).into(), (&store.cell_light).into()]);

        let epoch = inputs.lights.map_or(0, |l| l.epoch);
        if epoch != self.lights_epoch && self.frame > 0 && !self.options.even {
            self.hurry = HURRY;
        }
        self.lights_epoch = epoch;
        let mut params = self.params(inputs, rays)?;
        let [w, h] = cells::grid(inputs.size).map(|n| n.div_ceil(8));
        let mut offset = self.params.write(queue, &params);
        let frame_params = self.frame_params.group([self.params.bound()]);
        let groups = |offset, own| Groups { inputs: &bound, scene: &scene, offset, own };
        let alone = |offset, own| Groups { scene: &frame_params, ..groups(offset, own) };

        self.cells.record(recorder, &bound);
        let slots = self.options.slots.div_ceil(64);
        Self::run(recorder, "gi.evict", &self.evict, groups(offset, &renew_group), [slots, 1, 1]);
        // The second layer of workgroups sends rays into lobes.
        let layers = 1 + u32::from(inputs.specular.is_some());
        Self::run(recorder, "gi.rays", &self.rays.pipeline, groups(offset, &rays_group), [w, h, layers]);
        let rounds = match (self.frame, self.hurry) {
            (0, _) => self.options.first_rounds.max(1),
            (1..=YOUNG, _) => ROUNDS_YOUNG,
            (_, 0) => 1,
            _ => 2,
        };
        for round in 0..rounds {
            if round > 0 {
                params.round += 1;
                offset = self.params.write(queue, &params);
            }
            Self::run(recorder, "gi.renew", &self.renew.pipeline, groups(offset, &renew_group), [slots, 1, 1]);
        }
        Self::run(recorder, "gi.settle", &self.settle.pipeline, alone(offset, &settle_group), [w, h, 1]);
        Self::run(recorder, "gi.blur", &self.blur.pipeline, alone(offset, &blur_group), [w, h, 1]);
        Self::run(recorder, "gi.smooth", &self.smooth.pipeline, alone(offset, &smooth_group), [w, h, 1]);
        self.round = params.round + 1;
        self.frame += 1;
        self.hurry = self.hurry.saturating_sub(1);
        let brought = Brought { light: &store.cell_light, glosses: &store.glosses, output, gloss: &store.gloss };
        self.bring.record(recorder, &bound, &self.cells, brought);
        Ok(())
    }

    fn gloss(&self) -> Option<&wgpu::TextureView> {
        Some(&self.store.gloss)
    }

    fn knows_scene(&self, rays: bool) -> bool {
        rays
    }

    fn settled(&self) -> Option<u32> {
        Some(self.frame)
    }

    fn cut(&mut self) {
        self.frame = 0;
    }

    fn forget(&mut self) {
        self.inputs.forget();
        self.scene.forget();
        self.settle.binder.forget();
        self.bring.forget();
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.cells.bytes() + self.store.bytes()
    }

    fn costs(&self, size: [u32; 2]) -> Vec<Cost> {
        cost::costs(size, self.options.slots)
    }
}
