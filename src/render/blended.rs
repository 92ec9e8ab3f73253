//! Surfaces that cover a share of what is behind them, drawn over the picture from far to near.

use super::cull::{Count, Volume};
use super::pipelines;
use super::targets::Targets;
use super::view::View;
use crate::gpu::{shaders, tape, timing::Recorder};
use crate::gpu_scene::{Draw, SceneGpu, attribute_layouts, material_layout};
use glam::Vec3;

/// Drawing of veils: panes, smoke and whatever else covers a share of what is behind (glTF's
/// `BLEND`, transmission). Cut-outs (leaves on a sheet that is called `BLEND`) are drawn by lot in
/// either case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Blending {
    /// Over the picture, objects from far to near: no grain. What is wholly covered is in the
    /// G-buffer. Light from all around is that of the surface behind.
    #[default]
    Sorted,
    /// By lot in the G-buffer, whose means over many frames are those of the path tracer: every
    /// pass sees the surface, and whatever order triangles have is right. Single frames are grainy.
    Stochastic,
}

impl std::str::FromStr for Blending {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "sorted" => Ok(Self::Sorted),
            "stochastic" => Ok(Self::Stochastic),
            _ => Err(format!("`{name}` is none of: sorted, stochastic")),
        }
    }
}

/// What [`BlendedPass`] draws.
#[derive(Clone, Copy)]
pub struct BlendedInputs<'a> {
    /// The scene.
    pub scene: &'a SceneGpu,
    /// Who sees it.
    pub view: &'a View,
    /// From [`BlendedPass::picture`].
    pub picture: &'a wgpu::BindGroup,
    /// From [`DirectPass::lights`](super::direct::DirectPass::lights).
    pub lights: &'a wgpu::BindGroup,
    /// The picture, and the depth of what is opaque.
    pub hdr: &'a wgpu::TextureView,
    /// Depth of the G-buffer.
    pub depth: &'a wgpu::TextureView,
}

/// Draws what is blended.
pub struct BlendedPass {
    pipelines: [wgpu::RenderPipeline; 3],
    layout: wgpu::BindGroupLayout,
}

impl BlendedPass {
    /// Builds the pipelines. `lights`: from
    /// [`DirectPass::light_layout`](super::direct::DirectPass::light_layout).
    pub fn new(device: &wgpu::Device, lights: &wgpu::BindGroupLayout) -> Self {
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let layout = pipelines::layout(
            device,
            "render.blended",
            stages,
            &[pipelines::UNIFORM, pipelines::LOAD, pipelines::LOAD],
        );
        let pipeline_layout = tape::pipeline_layout(
            device,
            "render.blended",
            &[Some(&layout), Some(&material_layout(device)), Some(lights)],
        );
        let module = shaders::module(device, "render.blended");
        let target = wgpu::ColorTargetState {
            format: wgpu::TextureFormat::Rgba16Float,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        };
        let pipelines = [Some(wgpu::Face::Back), Some(wgpu::Face::Front), None].map(|cull| {
            let drawn = pipelines::Drawn {
                buffers: &attribute_layouts(),
                targets: &[Some(target.clone())],
                cull,
                writes_depth: false,
                constants: &[],
            };
            pipelines::mesh(device, "render.blended", (&pipeline_layout, &module), drawn)
        });
        Self { pipelines, layout }
    }

    /// Binds what is known of the surfaces behind; rebuilt on resize.
    pub fn picture(&self, device: &wgpu::Device, frame: &wgpu::Buffer, targets: &Targets) -> wgpu::BindGroup {
        let resources =
            [frame.as_entire_binding(), pipelines::view(&targets.indirect), pipelines::view(&targets.emissive)];
        pipelines::group(device, "render.blended", &self.layout, &resources)
    }

    /// Draws over `hdr`, and adds to `count`; nothing is recorded where nothing that blends is to
    /// be seen.
    pub fn record(&self, recorder: &mut Recorder<'_>, inputs: BlendedInputs<'_>, count: &mut Count) {
        let BlendedInputs { scene, view, .. } = inputs;
        let eye = Vec3::from(view.eye());
        let away = |draw: &Draw| (0.5 * (Vec3::from(draw.bounds.0) + Vec3::from(draw.bounds.1)) - eye).length_squared();
        let volume = Volume::new(&view.clip_from_world);
        let seen = scene.draws.iter().filter(|d| d.veil && volume.meets(&d.bounds));
        let mut draws: Vec<(f32, &Draw)> = seen.map(|d| (away(d), d)).collect();
        if draws.is_empty() {
            return;
        }
        draws.sort_by(|a, b| b.0.total_cmp(&a.0));
        let color = wgpu::RenderPassColorAttachment {
            view: inputs.hdr,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        };
        let depth = wgpu::RenderPassDepthStencilAttachment { view: inputs.depth, depth_ops: None, stencil_ops: None };
        recorder.render("blended", &[Some(color)], Some(depth), |pass| {
            pass.set_bind_group(0, inputs.picture, &[]);
            pass.set_bind_group(2, inputs.lights, &[]);
            pass.set_vertex_buffer(0, scene.positions.slice(..));
            pass.set_vertex_buffer(1, scene.instances.slice(..));
            pass.set_vertex_buffer(2, scene.attributes.slice(..));
            pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
            for (_, draw) in draws {
                let cull = if draw.double_sided { 2 } else { usize::from(draw.mirrored) };
                pass.set_pipeline(&self.pipelines[cull]);
                pass.set_bind_group(1, &scene.material_groups[draw.material], &[]);
                count.runs(scene, draw, &volume, |instances| {
                    pass.draw_indexed(draw.indices.clone(), draw.base_vertex, instances);
                });
            }
        });
    }
}
