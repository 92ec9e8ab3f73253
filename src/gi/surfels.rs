//! The cube around the camera as surfels: lit by the lights, exchanging light for a few rounds, with the sky between.

use super::World;
use super::rung::Cost;
use super::view_cache::ViewCache;
use crate::gpu::shaders;
use crate::gpu::timing::Recorder;
use crate::render::around;
use crate::render::tool::{self, LOAD, READ, READ_WRITE, UNIFORM};

/// Texels of the cube.
pub const SURFELS: u32 = 6 * around::SIDE * around::SIDE;
/// Rows of the buffers: the gather reads whole tiles of 64, and what no pass writes stays 0, which is no surfel.
const ROWS: u64 = SURFELS.next_multiple_of(64) as u64;
/// Bytes of a `Surfel` of `shaders/gi/surfel.wgsl`.
const SURFEL_BYTES: u64 = 80;
/// Bytes of `Sky`.
const SKY_BYTES: u64 = 64;

/// How many surfels a shader gathers, as WGSL.
pub fn prelude(surfels: u32) -> String {
    format!("const SURFELS = {surfels}u;\nconst SIDE = {}u;\n", around::SIDE)
}

/// Lights the surfels and lets them light each other.
pub struct SurfelsPass {
    device: wgpu::Device,
    light_up: wgpu::ComputePipeline,
    sky: wgpu::ComputePipeline,
    exchange: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    groups: ViewCache<3>,
    sky_group: wgpu::BindGroup,
    /// From the first buffer of sent light to the second, and back.
    exchange_groups: [wgpu::BindGroup; 2],
    surfels: wgpu::Buffer,
    sent: [wgpu::Buffer; 2],
    sky_buffer: wgpu::Buffer,
    rounds: u32,
}

impl SurfelsPass {
    /// Compiles the shaders and makes buffers of 0.1 MB. `rounds` of exchange are rounded up to an even number.
    pub fn new(device: &wgpu::Device, rounds: u32) -> Self {
        let types = [READ, READ, READ, READ, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, READ_WRITE, READ_WRITE, UNIFORM];
        let stage = wgpu::ShaderStages::COMPUTE;
        let layout = tool::layout(device, "gi.surfels", stage, &types);
        let sky_layout = tool::layout(device, "gi.sky", stage, &[READ, READ_WRITE]);
        let exchange_layout = tool::layout(device, "gi.exchange", stage, &[READ, READ, READ, READ_WRITE]);
        let buffer = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            })
        };
        let surfels = buffer("gi.surfels", ROWS * SURFEL_BYTES);
        let sent = ["gi.sent.0", "gi.sent.1"].map(|label| buffer(label, ROWS * 16));
        let sky_buffer = buffer("gi.sky", SKY_BYTES);
        let resources = [surfels.as_entire_binding(), sky_buffer.as_entire_binding()];
        let sky_group = tool::group(device, "gi.sky", &sky_layout, &resources);
        let exchange_groups = [(0, 1), (1, 0)].map(|(from, to): (usize, usize)| {
            let resources = [
                surfels.as_entire_binding(),
                sky_buffer.as_entire_binding(),
                sent[from].as_entire_binding(),
                sent[to].as_entire_binding(),
            ];
            tool::group(device, "gi.exchange", &exchange_layout, &resources)
        });
        Self {
            device: device.clone(),
            light_up: pipeline(device, "gi.surfels", "light_up", &layout),
            sky: pipeline(device, "gi.sky", "add_up", &sky_layout),
            exchange: pipeline(device, "gi.exchange", "exchange", &exchange_layout),
            layout,
            groups: ViewCache::new(),
            sky_group,
            exchange_groups,
            surfels,
            sent,
            sky_buffer,
            rounds: rounds.next_multiple_of(2),
        }
    }

    /// Records passes `gi.surfels`, `gi.sky` and `gi.exchange`. `counts` is [`super::emitters::EmittersPass::counts`].
    pub fn record(&mut self, recorder: &mut Recorder<'_>, world: &World<'_>, counts: &wgpu::Buffer) {
        let view = wgpu::BindingResource::TextureView;
        let group = self.groups.get([world.around.depth, world.rsm.depth, world.environment], || {
            Ok::<_, std::convert::Infallible>(tool::group(
                &self.device,
                "gi.surfels",
                &self.layout,
                &[
                    world.around.views.as_entire_binding(),
                    world.rsm.views.as_entire_binding(),
                    world.lights.as_entire_binding(),
                    world.rsm_of_light.as_entire_binding(),
                    view(world.around.depth),
                    view(world.around.albedo),
                    view(world.around.normal),
                    view(world.around.emissive),
                    view(world.rsm.depth),
                    view(world.environment),
                    self.surfels.as_entire_binding(),
                    self.sent[0].as_entire_binding(),
                    counts.as_entire_binding(),
                ],
            ))
        });
        let Ok(group) = group;
        recorder.compute("gi.surfels", |pass| {
            pass.set_pipeline(&self.light_up);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(SURFELS.div_ceil(64), 1, 1);
            pass.set_pipeline(&self.sky);
            pass.set_bind_group(0, &self.sky_group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        });
        recorder.compute("gi.exchange", |pass| {
            pass.set_pipeline(&self.exchange);
            for round in 0..self.rounds {
                pass.set_bind_group(0, &self.exchange_groups[round as usize % 2], &[]);
                pass.dispatch_workgroups(SURFELS, 1, 1);
            }
        });
    }

    /// The surfels.
    pub fn surfels(&self) -> &wgpu::Buffer {
        &self.surfels
    }

    /// Radiance that each sends, `vec4f`.
    pub fn sent(&self) -> &wgpu::Buffer {
        &self.sent[0]
    }

    /// What the camera sees of the sky.
    pub fn sky(&self) -> &wgpu::Buffer {
        &self.sky_buffer
    }

    /// Lets go of texture views and of the buffers bound with them.
    pub fn forget(&mut self) {
        self.groups.clear();
    }

    /// Bind groups made so far, the fixed ones not counted.
    pub fn made(&self) -> u64 {
        self.groups.made()
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.surfels.size() + 2 * self.sent[0].size() + self.sky_buffer.size()
    }

    /// What the passes cost.
    pub fn costs(&self) -> [Cost; 2] {
        let n = f64::from(SURFELS);
        [
            Cost::new("gi.surfels", n * 400.0, n * 140.0),
            // A pair: 39 for what arrives, 9 for the sums; buffers stay in cache.
            Cost::new("gi.exchange", f64::from(self.rounds) * n * n * 48.0, f64::from(self.rounds) * n * 112.0),
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
