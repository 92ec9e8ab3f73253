//! The pass `wires`: edges of all triangles that are seen, a pixel wide, for the view `wireframe`.

use bouncelight::gpu::{pipeline_cache, shaders, tape, timing::Recorder};
use bouncelight::gpu_scene::{SceneGpu, position_layouts};
use bouncelight::render::cull::{Count, Volume};
use bouncelight::render::{Renderer, View, gbuffer, pipelines, targets::Target};

/// What a device needs to draw lines where it would fill triangles.
pub const NEEDS: wgpu::Features = wgpu::Features::POLYGON_MODE_LINE;

/// By how much an edge is nearer than the surface that it belongs to: this many steps of a float's
/// depth, and as many times what depth changes by from pixel to pixel, since a line's pixels lie
/// beside those of the surface.
const NEARER: (i32, f32) = (64, 1.5);

/// Draws edges against the depth of the last frame.
pub struct WiresPass {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    /// As [`gbuffer::culled`] counts them.
    pipelines: [wgpu::RenderPipeline; 3],
    lines: Option<Target>,
}

impl WiresPass {
    /// Builds the pipelines; `None` where the device has no lines.
    pub fn new(device: &wgpu::Device) -> Option<Self> {
        if !device.features().contains(NEEDS) {
            return None;
        }
        let layout = pipelines::layout(device, "viewer.wires", wgpu::ShaderStages::VERTEX, &[pipelines::UNIFORM]);
        let pipelines = gbuffer::CULLED.map(|cull| pipeline(device, &layout, cull));
        Some(Self { device: device.clone(), layout, pipelines, lines: None })
    }

    /// Draws the edges of `scene` as `renderer` has drawn it last, seen by `view`.
    pub fn record(&mut self, recorder: &mut Recorder<'_>, scene: &SceneGpu, renderer: &Renderer, view: &View) {
        let size = renderer.size();
        let fits = |t: &Target| [t.texture.width(), t.texture.height()] == size;
        let known = self.lines.take().filter(fits);
        let format = wgpu::TextureFormat::R8Unorm;
        let lines = self.lines.insert(known.unwrap_or_else(|| {
            Target::new(&self.device, "viewer.wires", size, format, wgpu::TextureUsages::RENDER_ATTACHMENT)
        }));
        let group =
            pipelines::group(&self.device, "viewer.wires", &self.layout, &[renderer.frame().as_entire_binding()]);
        let color = wgpu::RenderPassColorAttachment {
            view: &lines.view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        };
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &renderer.targets().depth.view,
            depth_ops: None,
            stencil_ops: None,
        };
        recorder.render("viewer.wires", &[Some(color)], Some(depth), |pass| {
            pass.set_bind_group(0, &group, &[]);
            pass.set_vertex_buffer(0, scene.positions.slice(..));
            pass.set_vertex_buffer(1, scene.instances.slice(..));
            pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
            let volume = Volume::new(&view.clip_from_world);
            for draw in &scene.draws {
                pass.set_pipeline(&self.pipelines[gbuffer::culled(draw, view)]);
                Count::default().runs(scene, draw, &volume, |instances| {
                    pass.draw_indexed(draw.indices.clone(), draw.base_vertex, instances);
                });
            }
        });
    }

    /// What was drawn last.
    pub fn lines(&self) -> Option<&wgpu::TextureView> {
        self.lines.as_ref().map(|t| &t.view)
    }

    /// Bytes on the GPU.
    pub fn bytes(&self) -> u64 {
        self.lines.as_ref().map_or(0, Target::bytes)
    }
}

fn pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, cull: Option<wgpu::Face>) -> wgpu::RenderPipeline {
    let module = shaders::module(device, "viewer.wires");
    let layout = tape::pipeline_layout(device, "viewer.wires", &[Some(layout)]);
    pipeline_cache::render_pipeline(
        device,
        &wgpu::RenderPipelineDescriptor {
            label: Some("viewer.wires"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &position_layouts(),
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: cull,
                polygon_mode: wgpu::PolygonMode::Line,
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: Default::default(),
                bias: wgpu::DepthBiasState { constant: NEARER.0, slope_scale: NEARER.1, clamp: 0.0 },
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::TextureFormat::R8Unorm.into())],
            }),
            multiview_mask: None,
            cache: None,
        },
    )
}
