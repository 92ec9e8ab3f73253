//! Direct light of the analytic lights (compute): diffuse as E/π, specular as radiance.

use super::lights::LightLists;
use super::pipelines;
use super::shadow::ShadowMaps;
use super::targets::Targets;
use crate::gpu::timing::Recorder;
use crate::gpu_scene::SceneGpu;

/// Lambert and GGX under every light, with soft shadows.
pub struct DirectPass {
    pipeline: wgpu::ComputePipeline,
    picture_layout: wgpu::BindGroupLayout,
    light_layout: wgpu::BindGroupLayout,
    compare: wgpu::Sampler,
}

/// Bind groups: of the picture (rebuilt on resize) and of the lights (rebuilt with the scene).
pub struct DirectInputs<'a> {
    /// From [`DirectPass::picture`].
    pub picture: &'a wgpu::BindGroup,
    /// From [`DirectPass::lights`].
    pub lights: &'a wgpu::BindGroup,
    /// Picture size, pixels.
    pub size: [u32; 2],
}

impl DirectPass {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        use pipelines::*;
        let stage = wgpu::ShaderStages::COMPUTE;
        let comparison = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison);
        let picture_layout =
            layout(device, "render.direct", stage, &[UNIFORM, LOAD, LOAD, LOAD, STORE_HALF, STORE_HALF]);
        let light_layout = layout(
            device,
            "render.lights",
            stage | wgpu::ShaderStages::FRAGMENT,
            &[READ, READ, READ, COMPARE_ARRAY, COMPARE_ARRAY, comparison, LOAD_ARRAY, LOAD_ARRAY, READ],
        );
        let pipeline =
            compute_with(device, "render.direct", "direct", &[Some(&picture_layout), None, Some(&light_layout)]);
        let compare = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("render.direct"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            // Lit where the point's depth is at least the map's: reversed Z, nearer is larger.
            compare: Some(wgpu::CompareFunction::GreaterEqual),
            ..Default::default()
        });
        Self { pipeline, picture_layout, light_layout, compare }
    }

    /// Binds the G-buffer.
    pub fn picture(&self, device: &wgpu::Device, frame: &wgpu::Buffer, targets: &Targets) -> wgpu::BindGroup {
        pipelines::group(
            device,
            "render.direct",
            &self.picture_layout,
            &[
                frame.as_entire_binding(),
                pipelines::view(&targets.depth),
                pipelines::view(&targets.normal),
                pipelines::view(&targets.specular),
                pipelines::view(&targets.direct_diffuse),
                pipelines::view(&targets.direct_specular),
            ],
        )
    }

    /// What lights and shadow maps are bound by: group 2 of `shaders/lib/direct_light.wgsl`.
    pub fn light_layout(&self) -> &wgpu::BindGroupLayout {
        &self.light_layout
    }

    /// Binds lights, shadow maps and lists of lights.
    pub fn lights(
        &self,
        device: &wgpu::Device,
        scene: &SceneGpu,
        maps: &ShadowMaps,
        lists: &LightLists,
    ) -> wgpu::BindGroup {
        pipelines::group(
            device,
            "render.direct",
            &self.light_layout,
            &[
                scene.light_buffer.as_entire_binding(),
                maps.light_buffer.as_entire_binding(),
                maps.view_buffer.as_entire_binding(),
                wgpu::BindingResource::TextureView(&maps.sun_view),
                wgpu::BindingResource::TextureView(&maps.local_view),
                wgpu::BindingResource::Sampler(&self.compare),
                wgpu::BindingResource::TextureView(&maps.sun_view),
                wgpu::BindingResource::TextureView(&maps.local_view),
                lists.buffer.as_entire_binding(),
            ],
        )
    }

    /// Fills `direct_diffuse` and `direct_specular`.
    pub fn record(&self, recorder: &mut Recorder<'_>, inputs: DirectInputs<'_>) {
        recorder.compute("direct", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, inputs.picture, &[]);
            pass.set_bind_group(2, inputs.lights, &[]);
            pipelines::dispatch(pass, inputs.size);
        });
    }
}
