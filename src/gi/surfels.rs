//! The cube around the camera as surfels: lit by the lights, exchanging light for a few rounds, with windows to the sky
//! between; and as discs for the gather.

use super::World;
use super::emitters::EmittersPass;
use super::rung::Cost;
use super::view_cache::ViewCache;
use crate::gpu::shaders;
use crate::gpu::timing::Recorder;
use crate::render::around;
use crate::render::tool::{self, LOAD, READ, READ_WRITE, STORE_HALF, UNIFORM};

/// Texels of the cube.
pub const SURFELS: u32 = 6 * around::SIDE * around::SIDE;
/// Bytes of a `Surfel` of `shaders/gi/surfel.wgsl`.
const SURFEL_BYTES: u64 = 80;
/// Bytes of a `Disc`.
const DISC_BYTES: u64 = 48;
/// Width and height of the picture of the surroundings: six faces side by side.
const PAINTED: [u32; 2] = [6 * around::SIDE, around::SIDE];

/// How many surfels a shader gathers, as WGSL.
pub fn prelude(surfels: u32) -> String {
    format!("const SURFELS = {surfels}u;\nconst SQUARES = {}u;\nconst SIDE = {}u;\n", surfels / 4, around::SIDE)
}

/// Lights the surfels and lets them light each other.
pub struct SurfelsPass {
    device: wgpu::Device,
    light_up: wgpu::ComputePipeline,
    first: wgpu::ComputePipeline,
    join: wgpu::ComputePipeline,
    finish: wgpu::ComputePipeline,
    exchange: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    first_layout: wgpu::BindGroupLayout,
    first_group: Option<wgpu::BindGroup>,
    groups: ViewCache<3>,
    join_group: wgpu::BindGroup,
    exchange_group: wgpu::BindGroup,
    surfels: wgpu::Buffer,
    sent: wgpu::Buffer,
    discs: wgpu::Buffer,
    surroundings: wgpu::TextureView,
    rounds: u32,
}

impl SurfelsPass {
    /// Compiles the shaders and makes buffers of 0.1 MB.
    pub fn new(device: &wgpu::Device, rounds: u32) -> Self {
        let types = [READ, READ, READ, READ, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, READ_WRITE, UNIFORM];
        let stage = wgpu::ShaderStages::COMPUTE;
        let layout = tool::layout(device, "gi.surfels", stage, &types);
        let first_types = [READ, READ, READ, UNIFORM, READ_WRITE, READ_WRITE];
        let first_layout = tool::layout(device, "gi.first", stage, &first_types);
        let join_layout = tool::layout(device, "gi.discs", stage, &[READ, READ, READ_WRITE, STORE_HALF]);
        let exchange_layout = tool::layout(device, "gi.exchange", stage, &[READ, READ, READ_WRITE]);
        let buffer = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        let surfels = buffer("gi.surfels", u64::from(SURFELS) * SURFEL_BYTES);
        let sent = buffer("gi.sent", u64::from(SURFELS) * 16);
        let discs = buffer("gi.discs", u64::from(SURFELS + SURFELS / 4) * DISC_BYTES);
        let surroundings = device
            .create_texture(&wgpu::TextureDescriptor {
                label: Some("gi.surroundings"),
                size: wgpu::Extent3d { width: PAINTED[0], height: PAINTED[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba16Float,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
            .create_view(&Default::default());
        let [a, b, c] = [&surfels, &sent, &discs].map(|b| b.as_entire_binding());
        let painted = wgpu::BindingResource::TextureView(&surroundings);
        let join_group = tool::group(device, "gi.discs", &join_layout, &[a, b, c, painted]);
        let resources = [&surfels, &discs, &sent].map(|b| b.as_entire_binding());
        let exchange_group = tool::group(device, "gi.exchange", &exchange_layout, &resources);
        Self {
            device: device.clone(),
            light_up: pipeline(device, "gi.surfels", "light_up", &layout),
            first: pipeline(device, "gi.first", "first_bounce", &first_layout),
            join: pipeline(device, "gi.discs", "join", &join_layout),
            finish: pipeline(device, "gi.discs", "finish", &join_layout),
            exchange: pipeline(device, "gi.exchange", "exchange", &exchange_layout),
            layout,
            first_layout,
            first_group: None,
            groups: ViewCache::new(),
            join_group,
            exchange_group,
            surfels,
            sent,
            discs,
            surroundings,
            rounds,
        }
    }

    /// Records passes `gi.surfels`, `gi.first` and `gi.exchange`. When `emitters` has new buffers, [`forget`](Self::forget) first.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        world: &World<'_>,
        lights: &wgpu::Buffer,
        emitters: &EmittersPass,
    ) {
        let view = wgpu::BindingResource::TextureView;
        let group = self.groups.get([world.around.depth, world.rsm.depth, world.environment], || {
            Ok::<_, std::convert::Infallible>(tool::group(
                &self.device,
                "gi.surfels",
                &self.layout,
                &[
                    world.around.views.as_entire_binding(),
                    world.rsm.views.as_entire_binding(),
                    lights.as_entire_binding(),
                    world.rsm_of_light.as_entire_binding(),
                    view(world.around.depth),
                    view(world.around.albedo),
                    view(world.around.normal),
                    view(world.around.emissive),
                    view(world.rsm.depth),
                    view(world.environment),
                    self.surfels.as_entire_binding(),
                    emitters.counts().as_entire_binding(),
                ],
            ))
        });
        let Ok(group) = group;
        recorder.compute("gi.surfels", |pass| {
            pass.set_pipeline(&self.light_up);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(SURFELS.div_ceil(64), 1, 1);
        });
        let first_group = self.first_group.get_or_insert_with(|| {
            let resources =
                [emitters.fine(), emitters.blocks(), emitters.coarse(), emitters.counts(), &self.surfels, &self.sent]
                    .map(|b| b.as_entire_binding());
            tool::group(&self.device, "gi.first", &self.first_layout, &resources)
        });
        recorder.compute("gi.first", |pass| {
            pass.set_pipeline(&self.first);
            pass.set_bind_group(0, &*first_group, &[]);
            pass.dispatch_workgroups(SURFELS, 1, 1);
        });
        recorder.compute("gi.exchange", |pass| {
            for round in 0..=self.rounds {
                pass.set_pipeline(if round < self.rounds { &self.join } else { &self.finish });
                pass.set_bind_group(0, &self.join_group, &[]);
                pass.dispatch_workgroups((SURFELS / 4).div_ceil(64), 1, 1);
                if round < self.rounds {
                    pass.set_pipeline(&self.exchange);
                    pass.set_bind_group(0, &self.exchange_group, &[]);
                    pass.dispatch_workgroups(SURFELS, 1, 1);
                }
            }
        });
    }

    /// What surfels and windows send: discs of four each, then every one.
    pub fn discs(&self) -> &wgpu::Buffer {
        &self.discs
    }

    /// What the surroundings send to the camera, for reflections: [`super::rung::Rung::surroundings`].
    pub fn surroundings(&self) -> &wgpu::TextureView {
        &self.surroundings
    }

    /// Lets go of texture views and of the buffers bound with them.
    pub fn forget(&mut self) {
        self.groups.clear();
        self.first_group = None;
    }

    /// Bind groups made so far, the fixed ones not counted.
    pub fn made(&self) -> u64 {
        self.groups.made()
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.surfels.size() + self.sent.size() + self.discs.size() + 8 * u64::from(PAINTED[0] * PAINTED[1])
    }

    /// What the passes cost with so many blocks of emitters.
    pub fn costs(&self, blocks: u32) -> [Cost; 3] {
        let blocks = f64::from(blocks);
        let (n, rounds) = (f64::from(SURFELS), f64::from(self.rounds));
        [
            Cost::new("gi.surfels", n * 400.0, n * 140.0),
            // As in gi.gather, 1.26 emitters a block.
            Cost::new("gi.first", n * blocks * (1.26 * 92.0 + 0.5 * 9.0), 34.5 * 80.0 * blocks + n * 100.0),
            // A surfel meets 0.51 discs a surfel, as cells do, shared by 64 invocations: 40 operations each, and 18 to ask
            // each square twice; joining a surfel takes 30. Buffers stay in cache.
            Cost::new(
                "gi.exchange",
                rounds * n * (64.0 * ((0.51 * n / 64.0).ceil() * 40.0 + (n / 256.0).ceil() * 18.0) + 30.0),
                rounds * n * 200.0,
            ),
        ]
    }
}

fn pipeline(device: &wgpu::Device, name: &str, entry: &str, layout: &wgpu::BindGroupLayout) -> wgpu::ComputePipeline {
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&pipeline_layout),
        module: &shaders::module_with(device, name, &prelude(SURFELS)),
        entry_point: Some(entry),
        compilation_options: Default::default(),
        cache: None,
    })
}
