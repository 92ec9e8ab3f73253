//! From scene-linear radiance to a display target.

use super::pipelines;
use super::tonemap_curve::Tonemap;
use crate::gpu::timing::Recorder;
use bytemuck::{Pod, Zeroable};

/// Exposure and curve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TonemapOptions {
    /// Exposure value: radiance is multiplied by 2^ev.
    pub ev: f32,
    /// Curve.
    pub tonemap: Tonemap,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct Uniform {
    pub exposure: f32,
    pub kind: u32,
    pub linear_target: u32,
    pub pad: u32,
}

/// Draws `hdr` through a curve into a colour target of one format.
pub struct TonemapPass {
    device: wgpu::Device,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
    linear_target: bool,
    bound: Option<(wgpu::TextureView, wgpu::BindGroup)>,
}

impl TonemapPass {
    /// For targets of `format`; sRGB formats encode by themselves and are given linear light.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let stages = wgpu::ShaderStages::FRAGMENT;
        let layout = pipelines::layout(device, "render.tonemap", stages, &[pipelines::UNIFORM, pipelines::LOAD]);
        let pipeline = pipelines::screen(device, "render.tonemap", format, &layout);
        let uniform = pipelines::uniform(device, "render.tonemap", size_of::<Uniform>());
        Self { device: device.clone(), pipeline, layout, uniform, linear_target: format.is_srgb(), bound: None }
    }

    /// Draws `hdr` (same size as the target) into `target`.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        options: TonemapOptions,
        hdr: &wgpu::TextureView,
        target: &wgpu::TextureView,
    ) {
        let uniform = Uniform {
            exposure: options.ev.exp2(),
            kind: options.tonemap.kind(),
            linear_target: u32::from(self.linear_target),
            pad: 0,
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        if self.bound.as_ref().is_none_or(|(view, _)| view != hdr) {
            let resources = [self.uniform.as_entire_binding(), wgpu::BindingResource::TextureView(hdr)];
            let group = pipelines::group(&self.device, "render.tonemap", &self.layout, &resources);
            self.bound = Some((hdr.clone(), group));
        }
        let Some((_, group)) = &self.bound else { return };
        let attachment = wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        };
        recorder.render("tonemap", &[Some(attachment)], None, |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.draw(0..3, 0..1);
        });
    }
}
