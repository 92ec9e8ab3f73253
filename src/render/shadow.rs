//! Shadow maps of all lights: the passes that draw them. `shadow_maps.rs` says who gets how many.
//!
//! A sun gets cascades (layers of one array), a spot one map, a point light or a spot wider than
//! 60° six faces (layers of another array). A map is drawn again when its camera has moved, or when
//! something that it sees has moved or shows another lot (`shadow_kept.rs`). Memory is bounded: at
//! most [`MAX_SUNS`] suns share 64 MiB (one alone has four maps of 2048², several have 1024²), and
//! the local lights share [`MAX_LOCAL_LAYERS`] layers (1024² up to 24 of them, then 512²): 96 MiB.
//! Where lights need more, those that give most to the view have shadows
//! ([`light_choice`](super::light_choice)); the others shine without, and a warning says so once.

use super::cull::{Count, DrawnCount, Volume};
use super::pipelines;
use super::shadow_kept::Kept;
use super::shadow_maps::{Audience, CAMERA_STRIDE};
pub use super::shadow_maps::{MAX_LOCAL_LAYERS, MAX_SUNS, ShadowMaps, ShadowOptions};
pub use super::shadow_view::ShadowViewGpu;
use crate::gpu::{pipeline_cache, shaders, tape, timing::Recorder};
use crate::gpu_scene::{SceneGpu, coverage_layouts, material_layout, position_layouts};

/// Draws depth from the lights.
pub struct ShadowPass {
    layout: wgpu::BindGroupLayout,
    opaque: wgpu::RenderPipeline,
    covered: wgpu::RenderPipeline,
    options: ShadowOptions,
}

/// A camera: matrix and seed.
const CAMERA_SIZE: u64 = 80;

impl ShadowPass {
    /// Builds the pipelines.
    pub fn new(device: &wgpu::Device, options: ShadowOptions) -> Self {
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        };
        let layout = pipelines::layout(device, "render.shadow", wgpu::ShaderStages::VERTEX_FRAGMENT, &[uniform]);
        let module = shaders::module(device, "render.shadow");
        let pipeline = |covered: bool| {
            let material = covered.then(|| material_layout(device));
            let groups = [Some(&layout), material.as_ref()];
            let pipeline_layout = tape::pipeline_layout(device, "render.shadow", &groups[..1 + usize::from(covered)]);
            let (positions, all) = (position_layouts(), coverage_layouts());
            pipeline_cache::render_pipeline(
                device,
                &wgpu::RenderPipelineDescriptor {
                    label: Some("render.shadow"),
                    layout: Some(&pipeline_layout),
                    vertex: wgpu::VertexState {
                        module: &module,
                        entry_point: Some(if covered { "covered" } else { "opaque" }),
                        compilation_options: Default::default(),
                        buffers: if covered { &all } else { &positions },
                    },
                    // Both faces cast: single-sided walls must not let light through from behind.
                    primitive: Default::default(),
                    depth_stencil: Some(wgpu::DepthStencilState {
                        format: wgpu::TextureFormat::Depth32Float,
                        depth_write_enabled: Some(true),
                        depth_compare: Some(wgpu::CompareFunction::Greater),
                        stencil: Default::default(),
                        bias: Default::default(),
                    }),
                    multisample: Default::default(),
                    fragment: covered.then(|| wgpu::FragmentState {
                        module: &module,
                        entry_point: Some("coverage"),
                        compilation_options: Default::default(),
                        targets: &[],
                    }),
                    multiview_mask: None,
                    cache: None,
                },
            )
        };
        let (opaque, covered) = (pipeline(false), pipeline(true));
        Self { layout, opaque, covered, options }
    }

    /// Makes the maps that the lights of `scene` need.
    pub fn maps(&self, device: &wgpu::Device, scene: &SceneGpu) -> ShadowMaps {
        ShadowMaps::new(device, scene, &self.options, |cameras| {
            let camera = wgpu::BufferBinding { buffer: cameras, offset: 0, size: wgpu::BufferSize::new(CAMERA_SIZE) };
            pipelines::group(device, "render.shadow", &self.layout, &[wgpu::BindingResource::Buffer(camera)])
        })
    }

    /// Gives the maps to lights of `audience.scene`, fits them to what is seen and draws those that
    /// do not hold already what they would, which is added to `count`.
    pub(super) fn record(
        &self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        audience: &Audience<'_>,
        maps: &mut ShadowMaps,
        count: &mut DrawnCount,
    ) {
        maps.allot(queue, audience);
        let (scene, seed) = (audience.scene, audience.view.seed);
        for (i, map) in maps.maps.iter().enumerate() {
            let (camera, volume) = (map.view.clip_from_world, map.volume);
            let kept = &mut maps.kept[map.layer];
            if let Some(kept) = kept
                && kept.holds(scene, &camera, &volume, seed)
            {
                count.maps_kept += 1;
                count.kept += kept.count;
                continue;
            }
            let kept = kept.insert(Kept::new(scene, camera, volume, seed));
            let depth = wgpu::RenderPassDepthStencilAttachment {
                view: &maps.layers[map.layer],
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            };
            recorder.render("shadow", &[], Some(depth), |pass| {
                let camera = (&maps.group, (i as u64 * CAMERA_STRIDE) as u32);
                self.draw(pass, scene, camera, &volume, &mut kept.count);
            });
            count.maps += 1;
            count.shadows += kept.count;
        }
    }

    fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        scene: &SceneGpu,
        (group, camera): (&wgpu::BindGroup, u32),
        volume: &Volume,
        count: &mut Count,
    ) {
        pass.set_vertex_buffer(0, scene.positions.slice(..));
        pass.set_vertex_buffer(1, scene.instances.slice(..));
        pass.set_vertex_buffer(2, scene.attributes.slice(..));
        pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
        for covered in [false, true] {
            let mut draws = scene.draws.iter().filter(|d| d.covered == covered).peekable();
            if draws.peek().is_none() {
                continue;
            }
            pass.set_pipeline(if covered { &self.covered } else { &self.opaque });
            pass.set_bind_group(0, group, &[camera]);
            let mut material = usize::MAX;
            for draw in draws {
                count.runs(scene, draw, volume, |instances| {
                    if covered && material != draw.material {
                        material = draw.material;
                        pass.set_bind_group(1, &scene.material_groups[material], &[]);
                    }
                    pass.draw_indexed(draw.indices.clone(), draw.base_vertex, instances);
                });
            }
        }
    }
}
