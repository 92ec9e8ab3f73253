//! Emitters from reflective shadow maps: texels of a light's map, grouped by four and by sixty-four.

use super::World;
use super::rung::Cost;
use super::view_cache::ViewCache;
use crate::gpu::timing::Recorder;
use crate::render::tool::{self, LOAD, READ, READ_WRITE, UNIFORM};

/// Bytes of an `Emitter` of `shaders/lib/emitter.wgsl`.
pub const EMITTER_BYTES: u64 = 80;
/// Fine emitters of a block: up to two for each four texels.
pub const FINE: u64 = 32;

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
    /// Lowest corner of the scene, metres.
    pub low: [f32; 3],
    /// Unused.
    pub pad2: f32,
    /// Highest corner.
    pub high: [f32; 3],
    /// Unused.
    pub pad3: f32,
}

impl Counts {
    fn new(world: &World<'_>, lights: u32) -> Self {
        let c = world.clutter;
        Self {
            blocks: if lights > 0 { world.rsm_blocks } else { 0 },
            lights,
            clutter_middle: std::array::from_fn(|k| 0.5 * (c.low[k] + c.high[k])),
            half_extinction: 0.5 * c.extinction,
            clutter_scale: std::array::from_fn(|k| 2.0 / (c.high[k] - c.low[k]).max(1e-6)),
            low: world.bounds[0],
            high: world.bounds[1],
            ..Self::default()
        }
    }
}

/// Makes emitters of what lights see.
pub struct EmittersPass {
    device: wgpu::Device,
    pipeline: wgpu::ComputePipeline,
    merge: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    groups: ViewCache<1>,
    counts: Counts,
    uniform: wgpu::Buffer,
    fine: wgpu::Buffer,
    blocks: wgpu::Buffer,
    coarse: wgpu::Buffer,
}

impl EmittersPass {
    /// Compiles the shader; the buffers grow with the first scene.
    pub fn new(device: &wgpu::Device) -> Self {
        let types = [READ, READ, LOAD, LOAD, LOAD, LOAD, READ_WRITE, READ_WRITE, UNIFORM, READ_WRITE];
        let layout = tool::layout(device, "gi.emitters", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = tool::compute(device, "gi.emitters", "collect", &[&layout]);
        let merge = tool::compute(device, "gi.emitters", "merge", &[&layout]);
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.counts"),
            size: size_of::<Counts>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let [fine, blocks, coarse] = buffers(device, 4);
        let device = device.clone();
        let (groups, counts) = (ViewCache::new(), Counts::default());
        Self { device, pipeline, merge, layout, groups, counts, uniform, fine, blocks, coarse }
    }

    /// Makes room for the emitters of `world` under so many `lights`. True when buffers are new, so that whoever bound them binds them again.
    pub fn fit(&mut self, queue: &wgpu::Queue, world: &World<'_>, lights: u32) -> bool {
        let counts = Counts::new(world, lights);
        if counts == self.counts {
            return false;
        }
        self.counts = counts;
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&counts));
        let needed = u64::from(counts.blocks.max(4));
        if self.blocks.size() == 2 * needed * EMITTER_BYTES {
            return false;
        }
        [self.fine, self.blocks, self.coarse] = buffers(&self.device, needed);
        self.groups.clear();
        true
    }

    /// Records pass `gi.emitters`; `lights` are those of [`fit`](Self::fit).
    pub fn record(&mut self, recorder: &mut Recorder<'_>, world: &World<'_>, lights: &wgpu::Buffer) {
        if self.counts.blocks == 0 {
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
                    lights.as_entire_binding(),
                    view(rsm.depth),
                    view(rsm.albedo),
                    view(rsm.normal),
                    view(rsm.emissive),
                    self.fine.as_entire_binding(),
                    self.blocks.as_entire_binding(),
                    self.uniform.as_entire_binding(),
                    self.coarse.as_entire_binding(),
                ],
            ))
        });
        let Ok(group) = group;
        recorder.compute("gi.emitters", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(world.rsm_most_blocks, world.rsm_views, 1);
            pass.set_pipeline(&self.merge);
            pass.dispatch_workgroups((self.counts.blocks / 2).div_ceil(64), 1, 1);
        });
    }

    /// Fine emitters, [`FINE`] a block.
    pub fn fine(&self) -> &wgpu::Buffer {
        &self.fine
    }

    /// Two a block.
    pub fn blocks(&self) -> &wgpu::Buffer {
        &self.blocks
    }

    /// Two for each square of four blocks.
    pub fn coarse(&self) -> &wgpu::Buffer {
        &self.coarse
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
        self.fine.size() + self.blocks.size() + self.coarse.size() + self.uniform.size()
    }

    /// Blocks of the scene that was drawn last.
    pub fn block_count(&self) -> u32 {
        self.counts.blocks
    }

    /// What the pass costs: a texel reads 16 bytes and takes about 230 operations; a block is 34 emitters and half
    /// of a coarse one.
    pub fn cost(&self) -> Cost {
        let blocks = f64::from(self.counts.blocks);
        Cost::new("gi.emitters", blocks * 64.0 * 230.0, blocks * (64.0 * 16.0 + 34.5 * EMITTER_BYTES as f64))
    }
}

fn buffers(device: &wgpu::Device, blocks: u64) -> [wgpu::Buffer; 3] {
    let counts =
        [("gi.emitters.fine", blocks * FINE), ("gi.emitters.blocks", 2 * blocks), ("gi.emitters.coarse", blocks / 2)];
    counts.map(|(label, count)| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: count * EMITTER_BYTES,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    })
}
