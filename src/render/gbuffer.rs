//! The geometry pass, and what the G-buffer's texels mean.
//!
//! | field | format | holds | where nothing was hit |
//! |---|---|---|---|
//! | `depth` | `Depth32Float` | near / distance along the view axis (metres), reversed: 1 at the near plane | 0 |
//! | `normal` | `Rg16Float` | unit shading normal in world space, octahedral, turned to the side that is seen | 0, 0 |
//! | `albedo` | `Rgba8UnormSrgb` | rgb: diffuse reflectance in [0, 1], the specular share taken out; a: occlusion map | 0 |
//! | `specular` | `Rgba8UnormSrgb` | rgb: F0, 0.04 for dielectrics to the base colour for metals; a: perceptual roughness | 0 |
//! | `emissive` | `Rgba16Float` | rgb: emitted radiance, W/(m²·sr); a: 1 | 0 |
//! | `motion` | `Rg16Float` | texture coordinates in the previous frame minus in this one, free of jitter; y down | 0 |
//!
//! and what later passes add:
//!
//! | field | format | holds | where nothing was hit |
//! |---|---|---|---|
//! | `direct_diffuse` | `Rgba16Float` | E/π of the analytic lights, W/(m²·sr), albedo not multiplied in | 0 |
//! | `direct_specular` | `Rgba16Float` | radiance of the specular lobe under the analytic lights, W/(m²·sr) | 0 |
//! | `indirect` | `Rgba16Float` | E/π of sky and bounces, from a GI method | 0 |
//! | `indirect_specular` | `Rgba16Float` | radiance of the specular lobe under sky and bounces, W/(m²·sr) | 0 |
//! | `hdr` | `Rgba16Float` | the picture: radiance, W/(m²·sr); a: 1 | the environment |
//!
//! The five colour attachments take exactly the 32 bytes a sample that WebGPU grants by default.
//! Unlit materials have albedo and F0 of 0 and their colour in `emissive`. Motion vectors know
//! where the camera was and where each object and each deforming vertex was
//! ([`previous_transforms`](super::previous_transforms), [`deform`](super::deform)); they do not know of lights, nor of
//! textures that move. The background's are 0 whatever the camera does: it follows from the view
//! alone.

use super::blended::Blending;
use super::cull::{Count, Volume};
use super::pipelines;
use super::targets::Targets;
use super::view::View;
use crate::gpu::{shaders, tape, timing::Recorder};
use crate::gpu_scene::{Draw, SceneGpu, material_layout, motion_layouts};
use glam::{Vec3, Vec4};

/// What [`GbufferPass`] draws.
#[derive(Clone, Copy)]
pub struct GbufferInputs<'a> {
    /// The scene.
    pub scene: &'a SceneGpu,
    /// Its instances as they were in the frame before
    /// ([`PreviousTransforms::before`](super::previous_transforms::PreviousTransforms::before)); `scene.instances` where nothing moves.
    pub before: &'a wgpu::Buffer,
    /// Its deforming vertices as they were then
    /// ([`DeformPass::before`](super::deform::DeformPass::before)), if they were elsewhere.
    pub deformed: Option<&'a wgpu::Buffer>,
    /// Who sees it.
    pub view: &'a View,
}

/// Draws a scene into the G-buffer.
pub struct GbufferPass {
    pipelines: Vec<wgpu::RenderPipeline>,
    frame: wgpu::BindGroup,
}

impl GbufferPass {
    /// Builds the pipelines; `frame` is the frame's uniform buffer.
    pub fn new(device: &wgpu::Device, frame: &wgpu::Buffer, blending: Blending) -> Self {
        let stages = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let layout = pipelines::layout(device, "render.gbuffer", stages, &[pipelines::UNIFORM]);
        let frame = pipelines::group(device, "render.gbuffer", &layout, &[frame.as_entire_binding()]);
        let pipeline_layout =
            tape::pipeline_layout(device, "render.gbuffer", &[Some(&layout), Some(&material_layout(device))]);
        let module = shaders::module(device, "render.gbuffer");
        let pipelines = (0..6).map(|i| pipeline(device, (&pipeline_layout, &module), i, blending)).collect();
        Self { pipelines, frame }
    }

    /// Clears the G-buffer and draws into it what the view sees of a scene, which is added to
    /// `count`.
    pub fn record(&self, recorder: &mut Recorder<'_>, inputs: GbufferInputs<'_>, targets: &Targets, count: &mut Count) {
        let GbufferInputs { scene, before, deformed, view } = inputs;
        let colors =
            [&targets.normal, &targets.albedo, &targets.specular, &targets.emissive, &targets.motion].map(|t| {
                Some(wgpu::RenderPassColorAttachment {
                    view: &t.view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })
            });
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &targets.depth.view,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        recorder.render("gbuffer", &colors, Some(depth), |pass| {
            pass.set_bind_group(0, &self.frame, &[]);
            pass.set_vertex_buffer(0, scene.positions.slice(..));
            pass.set_vertex_buffer(1, scene.instances.slice(..));
            pass.set_vertex_buffer(2, scene.attributes.slice(..));
            pass.set_vertex_buffer(3, before.slice(..));
            pass.set_vertex_buffer(4, scene.positions.slice(..));
            let mut past = false;
            pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
            let volume = Volume::new(&view.clip_from_world);
            let (mut pipeline, mut material) = (usize::MAX, usize::MAX);
            for draw in &scene.draws {
                count.runs(scene, draw, &volume, |instances| {
                    let wanted = variant(draw, view);
                    if pipeline != wanted {
                        pipeline = wanted;
                        pass.set_pipeline(&self.pipelines[pipeline]);
                    }
                    if let Some(deformed) = deformed.filter(|_| past != draw.deforms) {
                        past = draw.deforms;
                        pass.set_vertex_buffer(4, if past { deformed } else { &scene.positions }.slice(..));
                    }
                    if material != draw.material {
                        material = draw.material;
                        pass.set_bind_group(1, &scene.material_groups[material], &[]);
                    }
                    pass.draw_indexed(draw.indices.clone(), draw.base_vertex, instances);
                });
            }
        });
    }
}

/// Which pipeline a draw needs: [`culled`] × coverage.
fn variant(draw: &Draw, view: &View) -> usize {
    culled(draw, view) + 3 * usize::from(draw.covered)
}

/// Which faces of a draw are left out: index into [`CULLED`].
///
/// What is closed shows its outer faces alone from outside, whatever its material says: where an
/// inner face meets an outer one at a silhouette, both cover a pixel at depths that only rounding
/// tells apart, and the inner one would now and then win.
pub fn culled(draw: &Draw, view: &View) -> usize {
    if draw.double_sided && !(draw.closed && is_outside(view, draw)) { 2 } else { usize::from(draw.mirrored) }
}

/// Back faces, the front faces of what is mirrored, none.
pub const CULLED: [Option<wgpu::Face>; 3] = [Some(wgpu::Face::Back), Some(wgpu::Face::Front), None];

/// True where the eye is well outside a draw's bounds, and the near plane cuts nothing open.
fn is_outside(view: &View, draw: &Draw) -> bool {
    let (low, high) = (Vec3::from(draw.bounds.0), Vec3::from(draw.bounds.1));
    let eye = Vec3::from(view.eye());
    let margin = 0.05 * (high - low).length();
    let beyond = |margin: f32| eye.cmplt(low - margin).any() || eye.cmpgt(high + margin).any();
    // The near plane of a lens from afar lies right before the scene.
    let back = Vec4::from(view.world_from_view[2]).truncate();
    let nearest = (eye - 0.5 * (low + high)).dot(back) - (0.5 * (high - low)).dot(back.abs());
    beyond(margin) && (beyond(margin + 3.0 * view.near) || nearest > view.near)
}

fn pipeline(
    device: &wgpu::Device,
    (layout, module): (&wgpu::PipelineLayout, &wgpu::ShaderModule),
    variant: usize,
    blending: Blending,
) -> wgpu::RenderPipeline {
    use wgpu::TextureFormat as F;
    let formats = [F::Rg16Float, F::Rgba8UnormSrgb, F::Rgba8UnormSrgb, F::Rgba16Float, F::Rg16Float];
    let constant = |is: bool| f64::from(u8::from(is));
    pipelines::mesh(
        device,
        "render.gbuffer",
        (layout, module),
        pipelines::Drawn {
            buffers: &motion_layouts(),
            targets: &formats.map(|format| Some(format.into())),
            cull: CULLED[variant % 3],
            writes_depth: true,
            constants: &[("ALPHA", constant(variant >= 3)), ("SORTED", constant(blending == Blending::Sorted))],
        },
    )
}
