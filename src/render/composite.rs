//! Puts light and surface together into `hdr` (compute).

use super::pipelines;
use super::targets::{Target, Targets};
use crate::gpu::timing::Recorder;

/// Background of a picture, where there is no surface. The surroundings light the scene in any case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum Backdrop {
    /// The surroundings.
    #[default]
    Shown,
    /// The surroundings, out of focus.
    Blurred,
    /// A dark grey.
    Hidden,
    /// Nothing: alpha is the share of the picture that surfaces cover.
    Transparent,
}

impl Backdrop {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Shown, Self::Blurred, Self::Hidden, Self::Transparent];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        ["shown", "blurred", "hidden", "transparent"][self as usize]
    }
}

impl std::str::FromStr for Backdrop {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|b| b.name() == name);
        found.ok_or_else(|| format!("`{name}` is none of: shown, blurred, hidden, transparent"))
    }
}

/// hdr = albedo · (direct + indirect) + direct and indirect specular + emissive; background =
/// environment.
pub struct CompositePass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    sky_layout: wgpu::BindGroupLayout,
}

impl CompositePass {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        use pipelines::*;
        let types = [UNIFORM, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, STORE_HALF];
        let layout = layout(device, "render.composite", wgpu::ShaderStages::COMPUTE, &types);
        let sky_layout = pipelines::layout(device, "render.composite", wgpu::ShaderStages::COMPUTE, &[LOAD]);
        let pipeline = compute(device, "render.composite", "composite", &[&layout, &sky_layout]);
        Self { pipeline, layout, sky_layout }
    }

    /// Binds the targets and where the picture goes (`Rgba16Float`); rebuilt on resize.
    pub fn picture(
        &self,
        device: &wgpu::Device,
        frame: &wgpu::Buffer,
        targets: &Targets,
        output: &Target,
    ) -> wgpu::BindGroup {
        let t = targets;
        pipelines::group(
            device,
            "render.composite",
            &self.layout,
            &[
                frame.as_entire_binding(),
                pipelines::view(&t.depth),
                pipelines::view(&t.albedo),
                pipelines::view(&t.emissive),
                pipelines::view(&t.direct_diffuse),
                pipelines::view(&t.direct_specular),
                pipelines::view(&t.indirect),
                pipelines::view(&t.indirect_specular),
                pipelines::view(output),
            ],
        )
    }

    /// Binds the environment; rebuilt when the scene changes.
    pub fn sky(&self, device: &wgpu::Device, environment: &wgpu::TextureView) -> wgpu::BindGroup {
        let resources = [wgpu::BindingResource::TextureView(environment)];
        pipelines::group(device, "render.composite", &self.sky_layout, &resources)
    }

    /// Fills the output.
    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        picture: &wgpu::BindGroup,
        sky: &wgpu::BindGroup,
        size: [u32; 2],
    ) {
        recorder.compute("composite", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, picture, &[]);
            pass.set_bind_group(1, sky, &[]);
            pipelines::dispatch(pass, size);
        });
    }
}
