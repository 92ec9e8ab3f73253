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
//! ([`Technique::gloss`]).
//!
//! It asks what stands between, so it needs no constant for that. What it knows of a surface that a ray meets is one colour a
//! triangle; how finely it knows the light between surfaces is the size of an entry's cell; the rest is noise, which frames and
//! neighbours average away. `docs/gi.md` says what it cannot do.

pub mod bring;
mod cost;
mod options;
mod params;
mod pass;
mod store;

pub use options::{Options, OptionsError};
pub use params::Params;

use crate::gi::interface::technique::{Cost, Technique};
use crate::gi::interface::{GiError, Inputs, Rays};
use crate::gi::stage;
use crate::gi::stage::cells::{self, CellsPass};
use crate::gi::stage::inputs::{InputGroup, cells_of};
use crate::gpu::bind::{Binder, Bound};
use crate::gpu::binding::{LOAD, READ, READ_WRITE};
use crate::gpu::timing::Recorder;
use bring::{BringPass, Brought};
use params::ParamsRing;
use pass::{Groups, Pass};
use store::Store;

/// A ray begins this share of the view distance off its surface: half along the way to the eye, half along the normal. At
/// 1024 × 512 and 60° a three-hundredth of a cell's width, and 500 times the rounding of the depth.
const LIFT: f32 = 3e-5;

/// It begins no nearer than so many steps of the depth's texels.
const LIFT_STEPS: f32 = 4.0;

/// Frames after a change of the lights for which cells let go of what they remember at less evidence.
const HURRY: u32 = 8;

/// Frames after the first, after a change of the lights, or after an object has moved, for which entries get two rays each and remember
/// no more than [`HURRIED`]. Light between surfaces of albedo ρ goes with exp(−t (1 − ρ) 2 / HURRIED) then, by frames: of white ones' (0.8) 2 % are
/// left after so many. With one ray a frame and a memory of eight it would take 160.
const STIR: u32 = 24;
const HURRIED: f32 = 2.5;

/// After the first frame entries get so many rays each for so many frames: light between surfaces has come round by then.
const YOUNG: u32 = 8;
const ROUNDS_YOUNG: u32 = 4;

/// Constants of the shaders as WGSL.
pub fn prelude() -> String {
    format!("{}const LIFT = f32({LIFT:?});\nconst LIFT_STEPS = f32({LIFT_STEPS:?});\n", cells::prelude())
}

/// Most bits of a lot that may name a query (`lot_bits` of `entries.wgsl`): ten are left to draw by.
const LOT_BITS: u32 = 22;

/// Storage buffers that `gi.rays` and `gi.renew` bind: as many as every WebGPU device has.
const STORAGE_BUFFERS: u32 = 8;

/// Rays of a cell of which nothing is remembered; `LOOKS` of `types.wgsl`.
const LOOKS: u64 = 4;

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
    /// Finds cells of which nothing is remembered; binds what `settle` binds.
    recall: Pass,
    rays: Pass,
    /// Frees entries that no ray has met for long; binds what `renew` binds.
    evict: Pass,
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
    /// The lights' state in the last frame, and frames for which cells forget at less evidence because it was another before.
    lights_epoch: u64,
    hurry: u32,
    /// Where objects were in the last frame, and frames for which entries forget quickly because lights or objects changed before.
    moves: u64,
    stir: u32,
    /// Frames for which light may be expected to change for the same reasons.
    changing: u32,
    scene_id: u64,
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
        let texels = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let scene = Binder::new(device, "gi.gather", &[ParamsRing::TYPE, texels, READ, READ, READ, LOAD, texels]);
        let frame_params = Binder::new(device, "gi.gather", &[ParamsRing::TYPE]);
        let (shared, alone) = ((&inputs, &scene), (&inputs, &frame_params));
        let new = |groups, names, types: &[wgpu::BindingType]| Pass::new(device, groups, names, types);
        let rw = READ_WRITE;
        let table = [rw, rw, rw, rw, rw];
        let history = [rw, READ, READ, READ, rw, READ, LOAD, LOAD];
        Self {
            cells: CellsPass::new(device, &inputs, size),
            evict: new(shared, ("gi.evict", "gi.renew", "evict"), &table),
            rays: new(shared, ("gi.rays", "gi.rays", "rays"), &[rw, rw, rw, READ, rw, LOAD]),
            renew: new(shared, ("gi.renew", "gi.renew", "renew"), &table),
            recall: new(alone, ("gi.recall", "gi.settle", "recall"), &history),
            settle: new(alone, ("gi.settle", "gi.settle", "settle"), &history),
            blur: new(alone, ("gi.blur", "gi.blur", "blur"), &[READ, rw, rw, rw]),
            smooth: new(alone, ("gi.smooth", "gi.smooth", "smooth_light"), &[READ, READ, rw]),
            bring: BringPass::new(device, &inputs),
            store: Store::new(device, size, options.slots),
            checked: size,
            no_lights: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("gi.no_lights"),
                size: size_of::<crate::scene::upload::LightGpu>() as u64,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
            no_motion: stage::absent(device, "gi.no_motion", wgpu::TextureFormat::Rg16Float),
            no_specular: stage::absent(device, "gi.no_specular", wgpu::TextureFormat::Rgba8Unorm),
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
            moves: 0,
            stir: 0,
            changing: 0,
            scene_id: 0,
        }
    }

    /// Frames in the longest-lived means: 0 before the first, and 1 after it and after a cut.
    pub fn frames(&self) -> u32 {
        self.frame
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        let passes = [&self.recall, &self.evict, &self.rays, &self.renew, &self.settle, &self.blur, &self.smooth];
        let made = passes.map(Pass::made);
        self.inputs.made() + self.scene.made() + self.frame_params.made() + self.bring.made() + made.iter().sum::<u64>()
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
            (self.changing > 0, params::CHANGING),
        ];
        Ok(Params {
            eye: stage::inputs::Params::of(inputs, None)?.eye_position(),
            frame: self.frame,
            light_count: inputs.lights.map_or(0, |l| l.count),
            emitter_count: counts.emitters as u32,
            inverse_power: rays.scene.inverse_power(),
            mask: self.options.slots - 1,
            entry_scale: self.options.entry_scale,
            round: self.round,
            cell_frames: self.options.cell_frames,
            entry_frames: if self.stir > 0 {
                self.options.entry_frames.min(HURRIED)
            } else {
                self.options.entry_frames
            },
            flags: flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum(),
            cells: cells::count(inputs.size) as u32,
            rays: (cells::count(inputs.size) + store::squares(inputs.size)) as u32,
            since: STIR - self.changing,
        })
    }
}

impl Technique for GatherGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        stage::inputs::check_output(output, inputs.size)?;
        let rays = inputs.rays.as_ref().ok_or(GiError::Rays)?;
        if inputs.size != self.checked {
            Self::check(&self.device.limits(), inputs.size, &self.options)?;
            self.checked = inputs.size;
        }
        let bound = self.inputs.bind(queue, inputs)?;
        if inputs.reset {
            self.frame = 0;
        }
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
        let [keys, lots, queries, asked, entry_light] =
            [&store.keys, &store.lots, &store.queries, &store.asked, &store.light].map(Bound::from);
        let specular = Bound::from(inputs.specular.unwrap_or(&self.no_specular));
        let [pixels, records] = [self.cells.pixels(), &store.records].map(Bound::from);
        let [before, after] = [self.frame & 1, 1 - (self.frame & 1)].map(|i| Bound::from(&store.pasts[i as usize]));
        let [changes, blurred, light] = [&store.changes, &store.blurred, &store.cell_light].map(Bound::from);
        let table = || [&keys, &lots, &queries, &asked, &entry_light].map(Clone::clone);

        let (epoch, moves) = (inputs.lights.map_or(0, |l| l.epoch), rays.scene.moves());
        if self.frame > 0 && !self.options.even {
            if epoch != self.lights_epoch {
                self.hurry = HURRY;
            }
            if epoch != self.lights_epoch || moves != self.moves {
                (self.stir, self.changing) = (STIR, STIR);
            }
            // Entries have to come to know each other.
            if self.frame == 1 {
                self.stir = STIR;
            }
        }
        (self.lights_epoch, self.moves) = (epoch, moves);
        let mut params = self.params(inputs, rays)?;
        let [w, h] = cells_of(inputs.size).map(|n| n.div_ceil(8));
        let mut offset = self.params.write(queue, &params);
        let frame_params = self.frame_params.group([self.params.bound()]);
        let groups = |offset| Groups { inputs: &bound, scene: &scene, offset };
        let alone = |offset| Groups { scene: &frame_params, ..groups(offset) };

        self.cells.record(recorder, &bound);
        let motion = Bound::from(inputs.motion.unwrap_or(&self.no_motion));
        let own = [&pixels, &records, &entry_light, &before, &after, &changes, &motion, &specular];
        let history = || own.map(Clone::clone);
        self.recall.record(recorder, alone(offset), history(), [w, h, 1]);
        let slots = [self.options.slots.div_ceil(64), 1, 1];
        self.evict.record(recorder, groups(offset), table(), slots);
        // The second layer of workgroups sends rays into lobes, those above further ones of fresh cells.
        let layers = 1 + LOOKS as u32;
        let own = [&keys, &lots, &queries, &pixels, &records, &specular].map(Clone::clone);
        self.rays.record(recorder, groups(offset), own, [w, h, layers]);
        let rounds = match (self.frame, self.stir) {
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
            self.renew.record(recorder, groups(offset), table(), slots);
        }
        self.settle.record(recorder, alone(offset), history(), [w, h, 1]);
        let own = [&after, &blurred, &changes, &Bound::from(&store.glosses)].map(Clone::clone);
        self.blur.record(recorder, alone(offset), own, [w, h, 1]);
        self.smooth.record(recorder, alone(offset), [after, blurred, light], [w, h, 1]);
        self.round = params.round + 1;
        self.frame += 1;
        self.hurry = self.hurry.saturating_sub(1);
        self.stir = self.stir.saturating_sub(1);
        self.changing = self.changing.saturating_sub(1);
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
        self.recall.forget();
        self.settle.forget();
        self.bring.forget();
    }

    fn allocations(&self) -> u64 {
        self.allocations()
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.cells.bytes() + self.store.bytes()
    }

    fn costs(&self, size: [u32; 2]) -> Vec<Cost> {
        cost::costs(size, &self.options)
    }
}
