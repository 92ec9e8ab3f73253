//! The methods `rsm` and `cache`: light that lights and surfels beyond the screen send to cells.
//!
//! `rsm` is one bounce of the analytic lights: what their reflective shadow maps show, as emitters, and nothing else; no
//! sky, no second bounce, no emissive surfaces. `cache` adds the camera-centred cube: its surfels, lit by the lights
//! and by each other, send on what comes after the first bounce and what they emit, and between them is the sky.
//! `docs/gi.md` says what neither can do.

use super::cells::{CellSide, CellsPass};
use super::contact::ContactPass;
use super::emitters::EmittersPass;
use super::exposure::{pipeline, storage_entry};
use super::inputs::InputGroup;
use super::rung::{Cost, Rung};
use super::surfels::{self, SURFELS, SurfelsPass};
use super::upsample::UpsamplePass;
use super::{GiError, Inputs};
use crate::gpu::shaders;
use crate::gpu::timing::Recorder;
use crate::scene::upload::LightGpu;

/// How the world beyond the screen is gathered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// With the cube around the camera (`cache`); without it only the reflective shadow maps (`rsm`).
    pub around: bool,
    /// Rounds of light exchange between surfels.
    pub rounds: u32,
    /// Resolution of the gather.
    pub side: CellSide,
}

impl Options {
    /// The method `rsm`.
    pub const RSM: Self = Self { around: false, rounds: 0, side: CellSide::Eight };
    /// The method `cache`.
    pub const CACHE: Self = Self { around: true, rounds: 2, side: CellSide::Eight };
}

/// Constants of the gather as WGSL.
pub fn prelude(options: Options) -> String {
    options.side.prelude() + &surfels::prelude(if options.around { SURFELS } else { 0 })
}

/// Either method.
pub struct WorldGi {
    device: wgpu::Device,
    options: Options,
    inputs: InputGroup,
    emitters: EmittersPass,
    surfels: SurfelsPass,
    cells: CellsPass,
    contact: ContactPass,
    upsample: UpsamplePass,
    gather: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    /// Bound where the host names no lights.
    no_lights: wgpu::Buffer,
    /// Light of the cells and the group that writes it.
    light: Option<(wgpu::Buffer, wgpu::BindGroup)>,
    made: u64,
}

impl WorldGi {
    /// Makes pipelines, and buffers for pictures of `size` pixels.
    pub fn new(device: &wgpu::Device, size: [u32; 2], options: Options) -> Self {
        let inputs = InputGroup::new(device);
        let mut entries: Vec<_> = (0..6).map(|i| storage_entry(i, i != 1)).collect();
        entries.push(wgpu::BindGroupLayoutEntry { binding: 6, ty: crate::render::tool::UNIFORM, ..entries[0] });
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("gi.gather"), entries: &entries });
        let module = shaders::module_with(device, "gi.gather", &prelude(options));
        Self {
            gather: pipeline(device, "gi.gather", &module, "gather", &inputs, &layout),
            emitters: EmittersPass::new(device),
            surfels: SurfelsPass::new(device, options.rounds),
            cells: CellsPass::new(device, &inputs, options.side, size),
            no_lights: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("gi.no_lights"),
                size: size_of::<LightGpu>() as u64,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
            contact: ContactPass::new(device, &inputs),
            upsample: UpsamplePass::new(device, &inputs, options.side),
            device: device.clone(),
            inputs,
            layout,
            options,
            light: None,
            made: 0,
        }
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        self.made
            + self.inputs.made()
            + self.emitters.made()
            + self.surfels.made()
            + self.contact.made()
            + self.upsample.made()
    }

    fn light(&self, size: [u32; 2]) -> (wgpu::Buffer, wgpu::BindGroup) {
        let light = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.light"),
            size: self.options.side.light_bytes(size),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let resources = [
            self.cells.pixels(),
            &light,
            self.emitters.fine(),
            self.emitters.blocks(),
            self.emitters.coarse(),
            self.surfels.discs(),
            self.emitters.counts(),
        ]
        .map(|b| b.as_entire_binding());
        let group = crate::render::tool::group(&self.device, "gi.gather", &self.layout, &resources);
        (light, group)
    }
}

impl Rung for WorldGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        super::ambient::check_output(output, inputs.size)?;
        let world = inputs.world.as_ref().ok_or(GiError::World)?;
        let bound = self.inputs.bind(queue, inputs)?;
        let lights = inputs.lights.map_or(&self.no_lights, |l| l.buffer);
        let fresh = self.emitters.fit(queue, world, inputs.lights.map_or(0, |l| l.count));
        if fresh {
            self.surfels.forget();
        }
        if self.contact.fit(inputs.size, world.spheres) {
            self.upsample.forget();
        }
        if self.cells.fit(inputs.size) || fresh || self.light.is_none() {
            self.upsample.forget();
            self.light = Some(self.light(inputs.size));
            self.made += 1;
        }
        let (light, group) = self.light.as_ref().expect("made above");
        self.emitters.record(recorder, world, lights);
        if self.options.around {
            self.surfels.record(recorder, world, lights, &self.emitters);
        }
        self.cells.record(recorder, &bound);
        let [w, h] = self.options.side.grid(inputs.size);
        recorder.compute("gi.gather", |pass| {
            bound.set(pass);
            pass.set_bind_group(1, group, &[]);
            pass.set_pipeline(&self.gather);
            pass.dispatch_workgroups(w.div_ceil(8), h.div_ceil(8), 1);
        });
        self.contact.record(recorder, &bound);
        self.upsample.record(recorder, &bound, &self.cells, light, Some(self.contact.found()), output)
    }

    fn surroundings(&self) -> Option<&wgpu::TextureView> {
        self.options.around.then(|| self.surfels.surroundings())
    }

    fn forget(&mut self) {
        self.inputs.forget();
        self.emitters.forget();
        self.surfels.forget();
        self.contact.forget();
        self.upsample.forget();
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes()
            + self.emitters.bytes()
            + self.surfels.bytes()
            + self.cells.bytes()
            + self.contact.bytes()
            + self.light.as_ref().map_or(0, |(light, _)| light.size())
    }

    fn costs(&self, size: [u32; 2]) -> Vec<Cost> {
        let cells = self.options.side.count(size) as f64;
        // Pairs: in six training rooms the cell of each 8 × 4 that has most of them (those that a GPU runs together wait
        // for it) meets 1.26 emitters a block, coarse, whole or opened, and 0.51 discs a
        // surfel. An emitter takes 92 operations (21 for direction and distance, 32 for what arrives, 8 for what small
        // objects take, 13 for the lobe, 18 for the sums), a disc 55, a surfel of an opened square (0.35 of all) 56; selects
        // count as one. Each group that is opened costs 9 more for the question.
        let blocks = f64::from(self.emitters.block_count());
        let surfels = if self.options.around { f64::from(SURFELS) } else { 0.0 };
        let flops = blocks * (1.26 * 92.0 + 0.5 * 9.0) + surfels * (0.51 * 55.0 + 0.35 + 0.09 * 9.0);
        let mut costs = vec![self.emitters.cost()];
        if self.options.around {
            costs.extend(self.surfels.costs(self.emitters.block_count()));
        }
        costs.push(CellsPass::cost(self.options.side, size));
        let bytes = cells * (4.0 + 8.0 + 48.0) + 34.5 * 80.0 * blocks + surfels * 60.0;
        costs.push(Cost::new("gi.gather", cells * flops, bytes));
        costs.push(ContactPass::cost(size, self.contact.sphere_count()));
        costs.push(UpsamplePass::cost(self.options.side, size, self.contact.sphere_count()));
        costs
    }
}
