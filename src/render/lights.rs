//! Lists of the lights that can reach what each tile of 16×16 pixels shows (compute): 8 bytes a
//! tile for each 32 lights.

use super::pipelines;
use super::shadow::ShadowMaps;
use super::targets::Targets;
use crate::gpu::timing::Recorder;
use crate::gpu_scene::SceneGpu;

/// Side of a tile, pixels; `TILE` in `shaders/lib/light_list.wgsl`.
const TILE: u32 = 16;

/// Finds which lights can reach which tiles.
pub struct LightsPass {
    pipeline: wgpu::ComputePipeline,
    picture_layout: wgpu::BindGroupLayout,
    list_layout: wgpu::BindGroupLayout,
}

/// The lists of a picture's tiles for the lights of a scene.
pub struct LightLists {
    /// Words of one list, 32 lights each; 0 where there are too few lights for lists.
    pub words: u32,
    /// Two lists a tile.
    pub buffer: wgpu::Buffer,
    size: [u32; 2],
    group: wgpu::BindGroup,
}

impl LightLists {
    /// Whether they are for pictures of `size` pixels.
    pub fn fit(&self, size: [u32; 2]) -> bool {
        self.size == size
    }
}

impl LightsPass {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        use pipelines::*;
        let stage = wgpu::ShaderStages::COMPUTE;
        let picture_layout = layout(device, "render.lights", stage, &[UNIFORM, LOAD, LOAD]);
        let list_layout = layout(device, "render.lights", stage, &[READ, READ, READ_WRITE]);
        let pipeline = compute(device, "render.lights", "tiles", &[&picture_layout, &list_layout]);
        Self { pipeline, picture_layout, list_layout }
    }

    /// Binds the G-buffer.
    pub fn picture(&self, device: &wgpu::Device, frame: &wgpu::Buffer, targets: &Targets) -> wgpu::BindGroup {
        let resources = [frame.as_entire_binding(), pipelines::view(&targets.depth), pipelines::view(&targets.normal)];
        pipelines::group(device, "render.lights", &self.picture_layout, &resources)
    }

    /// Lists for pictures of `size` pixels, if the scene has `from` lights or more.
    pub fn lists(
        &self,
        device: &wgpu::Device,
        scene: &SceneGpu,
        maps: &ShadowMaps,
        size: [u32; 2],
        from: u32,
    ) -> LightLists {
        let lights = scene.lights.len() as u32;
        let words = if lights >= from { lights.div_ceil(32) } else { 0 };
        let tiles = u64::from(size[0].div_ceil(TILE)) * u64::from(size[1].div_ceil(TILE));
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("render.lights"),
            size: (8 * tiles * u64::from(words)).max(16),
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let resources = [&scene.light_buffer, &maps.light_buffer, &buffer].map(|b| b.as_entire_binding());
        let group = pipelines::group(device, "render.lights", &self.list_layout, &resources);
        LightLists { words, buffer, size, group }
    }

    /// Fills the lists, if there are any.
    pub fn record(&self, recorder: &mut Recorder<'_>, picture: &wgpu::BindGroup, lists: &LightLists) {
        if lists.words == 0 {
            return;
        }
        recorder.compute("lights", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, picture, &[]);
            pass.set_bind_group(1, &lists.group, &[]);
            pass.dispatch_workgroups(lists.size[0].div_ceil(TILE), lists.size[1].div_ceil(TILE), 1);
        });
    }
}
