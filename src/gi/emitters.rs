//! Emitters from reflective shadow maps: texels of a light's map, grouped by four and by sixty-four.

use super::World;
use super::rung::Cost;
use super::view_cache::ViewCache;
use crate::gpu::timing::Recorder;
use crate::render::tool::{self, LOAD, READ, READ_WRITE, UNIFORM};

/// Bytes of an `Emitter` of `shaders/lib/emitter.wgsl`.
pub const EMITTER_BYTES: u64 = 80;
/// Fine emitters of a block.
pub const FINE: u64 = 16;

/// `Counts` of `shaders/lib/emitter.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Counts {
    /// Blocks of all reflective shadow maps.
    pub blocks: u32,
    /// Lights.
    pub lights: u32,
    /// Unused.
    pub pad: [u32; 2],
    /// Middle of the box that the scene's small objects fill, metres.
    pub clutter_middle: [f32; 3],
    /// Half of [`crate::scene::upload::Clutter::extinction`], 1/m.
    pub half_extinction: f32,
    /// One over the box's half size, 1/m.
    pub clutter_scale: [f32; 3],
    /// Unused.
    pub pad1: f32,
}

impl Counts {
    fn new(world: &World<'_>) -> Self {
        let c = world.clutter;
        Self {
            blocks: world.rsm_blocks,
            lights: world.light_count,
            clutter_middle: std::array::from_fn(|k| 0.5 * (c.low[k] + c.high[k])),
            half_extinction: 0.5 * c.extinction,
            clutter_scale: std::array::from_fn(|k| 2.0 / (c.high[k] - c.low[k]).max(1e-6)),
            ..Self::default()
        }
    }
}

/// Makes emitters of what lights see.
pub struct EmittersPass {
    device: wgpu::Device,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    groups: ViewCache<1>,
    counts: Counts,
    uniform: wgpu::Buffer,
    fine: wgpu::Buffer,
    blocks: wgpu::Buffer,
}

impl EmittersPass {
    /// Compiles the shader; the buffers grow with the first scene.
    pub fn new(device: &wgpu::Device) -> Self {
        let types = [READ, READ, LOAD, LOAD, LOAD, LOAD, READ_WRITE, READ_WRITE, UNIFORM];
        let layout = tool::layout(device, "gi.emitters", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = tool::compute(device, "gi.emitters", "collect", &[&layout]);
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.counts"),
            size: size_of::<Counts>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let [fine, blocks] = buffers(device, 1);
        let device = device.clone();
        Self { device, pipeline, layout, groups: ViewCache::new(), counts: Counts::default(), uniform, fine, blocks }
    }

    /// Makes room for the emitters of `world`. True when buffers are new, so that whoever bound them binds them again.
    pub fn fit(&mut self, queue: &wgpu::Queue, world: &World<'_>) -> bool {
        let counts = Counts::new(world);
        if counts == self.counts {
            return false;
        }
        self.counts = counts;
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&counts));
        let needed = u64::from(counts.blocks.max(1));
        if self.blocks.size() == 2 * needed * EMITTER_BYTES {
            return false;
        }
        [self.fine, self.blocks] = buffers(&self.device, needed);
        self.groups.clear();
        true
    }

    /// Records pass `gi.emitters`.
    pub fn record(&mut self, recorder: &mut Recorder<'_>, world: &World<'_>) {
        if world.rsm_blocks == 0 {
            return;
        }
        let rsm = &world.rsm;
        let view = wgpu::BindingResource::TextureView;
        let group = self.groups.get([rsm.depth], || {
            Ok::<_, std::convert::Infallible>(tool::group(
                &self.device,
                "gi.emitters",
                &self.layout,
                &[
                    rsm.views.as_entire_binding(),
                    world.lights.as_entire_binding(),
                    view(rsm.depth),
                    view(rsm.albedo),
                    view(rsm.normal),
                    view(rsm.emissive),
                    self.fine.as_entire_binding(),
                    self.blocks.as_entire_binding(),
                    self.uniform.as_entire_binding(),
                ],
            ))
        });
        let Ok(group) = group;
        recorder.compute("gi.emitters", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(world.rsm_most_blocks, world.rsm_views, 1);
        });
    }

    /// Fine emitters, sixteen a block.
    pub fn fine(&self) -> &wgpu::Buffer {
        &self.fine
    }

    /// Two a block.
    pub fn blocks(&self) -> &wgpu::Buffer {
        &self.blocks
    }

    /// [`Counts`], a uniform buffer.
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.uniform
    }

    /// Lets go of texture views.
    pub fn forget(&mut self) {
        self.groups.clear();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.groups.made()
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.fine.size() + self.blocks.size() + self.uniform.size()
    }

    /// Blocks of the scene that was drawn last.
    pub fn block_count(&self) -> u32 {
        self.counts.blocks
    }

    /// What the pass costs: a texel reads 16 bytes and takes about 170 operations; a block is 18 emitters.
    pub fn cost(&self) -> Cost {
        let blocks = f64::from(self.counts.blocks);
        Cost::new("gi.emitters", blocks * 64.0 * 170.0, blocks * (64.0 * 16.0 + 18.0 * EMITTER_BYTES as f64))
    }
}

fn buffers(device: &wgpu::Device, blocks: u64) -> [wgpu::Buffer; 2] {
    [("gi.emitters.fine", blocks * FINE), ("gi.emitters.blocks", 2 * blocks)].map(|(label, count)| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: count * EMITTER_BYTES,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    })
}
