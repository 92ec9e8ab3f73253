//! The rasteriser's passes that every method shares, and what they bind; [`frame`](super::frame) tells
//! their order.

use super::RendererOptions;
use super::blended::{BlendedPass, Blending};
use super::composite::CompositePass;
use super::deform::DeformPass;
use super::direct::DirectPass;
use super::gbuffer::GbufferPass;
use super::lights::LightsPass;
use super::shadow::ShadowPass;
use super::ssr::{SsrPass, SsrPicture};
use super::taa::TaaPass;
use super::targets::Targets;

/// What is bound as long as the targets stay.
pub(super) struct FrameBindings {
    pub lights: wgpu::BindGroup,
    pub direct: wgpu::BindGroup,
    /// Once a method draws that shows no lobes.
    pub ssr: Option<SsrPicture>,
    pub composite: wgpu::BindGroup,
    pub blended: Option<wgpu::BindGroup>,
}

/// The passes that every method shares.
pub(super) struct Passes {
    pub deform: DeformPass,
    pub shadow: ShadowPass,
    pub gbuffer: GbufferPass,
    pub lights: LightsPass,
    pub direct: DirectPass,
    /// The same.
    pub ssr: Option<SsrPass>,
    pub composite: CompositePass,
    /// `None` where what blends is drawn by lot.
    pub blended: Option<BlendedPass>,
}

impl Passes {
    pub fn new(device: &wgpu::Device, frame: &wgpu::Buffer, options: &RendererOptions) -> Self {
        let direct = DirectPass::new(device);
        let blended = (options.blending == Blending::Sorted).then(|| BlendedPass::new(device, direct.light_layout()));
        Self {
            deform: DeformPass::new(device),
            shadow: ShadowPass::new(device, options.shadow),
            gbuffer: GbufferPass::new(device, frame, options.blending),
            lights: LightsPass::new(device),
            direct,
            ssr: None,
            composite: CompositePass::new(device),
            blended,
        }
    }

    pub fn bind(
        &self,
        device: &wgpu::Device,
        frame: &wgpu::Buffer,
        targets: &Targets,
        taa: &mut Option<TaaPass>,
    ) -> FrameBindings {
        if let Some(taa) = taa {
            taa.fit(device, frame, targets);
        }
        let picture = taa.as_ref().map_or(&targets.hdr, TaaPass::current);
        FrameBindings {
            lights: self.lights.picture(device, frame, targets),
            direct: self.direct.picture(device, frame, targets),
            ssr: None,
            composite: self.composite.picture(device, frame, targets, picture),
            blended: self.blended.as_ref().map(|b| b.picture(device, frame, targets)),
        }
    }
}
