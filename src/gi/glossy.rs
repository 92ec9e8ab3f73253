//! Specular light of sky and bounces, from the diffuse light that a method found: the split sum with that light as
//! the surroundings. Exact where the surroundings are even; what a mirror shows is not in it.

use super::rung::Cost;
use crate::gpu::timing::Recorder;
use crate::render::{Targets, tool};

/// Fills `indirect_specular` of the targets.
pub struct GlossyPass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

impl GlossyPass {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        use tool::{LOAD, STORE_HALF, UNIFORM};
        let types = [UNIFORM, LOAD, LOAD, LOAD, LOAD, STORE_HALF];
        let layout = tool::layout(device, "gi.glossy", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = tool::compute(device, "gi.glossy", "glossy", &[&layout]);
        Self { pipeline, layout }
    }

    /// Binds the targets; rebuilt on resize.
    pub fn picture(&self, device: &wgpu::Device, frame: &wgpu::Buffer, targets: &Targets) -> wgpu::BindGroup {
        let t = targets;
        let views = [&t.depth, &t.normal, &t.specular, &t.indirect, &t.indirect_specular].map(tool::view);
        let resources: Vec<_> = [frame.as_entire_binding()].into_iter().chain(views).collect();
        tool::group(device, "gi.glossy", &self.layout, &resources)
    }

    /// Records the pass for targets of `size` pixels.
    pub fn record(&self, recorder: &mut Recorder<'_>, picture: &wgpu::BindGroup, size: [u32; 2]) {
        recorder.compute("gi.glossy", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, picture, &[]);
            tool::dispatch(pass, size);
        });
    }

    /// What the pass costs for a picture of `size` pixels.
    pub fn cost(size: [u32; 2]) -> Cost {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        Cost::new("gi.glossy", pixels * 120.0, pixels * 28.0)
    }
}
