//! Shadow maps of all lights: who gets how many, and the passes that draw them.
//!
//! A sun gets cascades (layers of one array), a spot one map, a point light or a spot wider than 60° six faces (layers
//! of another array). A map is drawn again when its camera has moved, or when something that it sees has moved or shows
//! another lot ([`shadow_kept`](super::shadow_kept)). Memory is bounded: at most [`MAX_SUNS`] suns share 64 MiB (one alone has four maps of 2048²,
//! several have 1024²), and the local lights share [`MAX_LOCAL_LAYERS`] layers (1024² up to 12 of them, then 512²).
//! Lights beyond that shine without shadow, and a warning says so once.

use super::cull::{Count, DrawnCount, Volume};
use super::shadow_kept::Kept;
pub use super::shadow_view::ShadowViewGpu;
use super::view::View;
use super::{shadow_local, shadow_sun, tool};
use crate::gpu::{shaders, timing::Recorder};
use crate::scene::upload::{SceneGpu, attribute_layouts, fits_one_map, material_layout, position_layouts};
use crate::scene::{Light, LightKind};
use glam::Vec3;

/// Suns that cast shadows.
pub const MAX_SUNS: u32 = 4;
/// Maps that point and spot lights share.
pub const MAX_LOCAL_LAYERS: u32 = 48;

/// Sizes of shadow maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShadowOptions {
    /// Side of a cascade's map for a single sun, texels; several suns get half. From 64 to 4096.
    pub sun_size: u32,
    /// Cascades a sun, 1 to 4.
    pub cascades: u32,
    /// Side of a local light's map, texels; many lights get half. From 64 to 2048.
    pub local_size: u32,
}

impl Default for ShadowOptions {
    fn default() -> Self {
        Self { sun_size: 2048, cascades: 4, local_size: 1024 }
    }
}

/// What of the shadow maps depends on the lights only.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Plan {
    /// First view and number of views for each light; none means no shadow.
    of_light: Vec<[u32; 2]>,
    views: u32,
    sun_size: u32,
    sun_layers: u32,
    local_size: u32,
    local_layers: u32,
    unshadowed: usize,
}

impl Plan {
    fn new(lights: &[Light], options: &ShadowOptions) -> Self {
        let cascades = options.cascades.clamp(1, 4);
        let (mut suns, mut local_layers, mut views, mut unshadowed) = (0, 0, 0, 0);
        let mut of_light = Vec::with_capacity(lights.len());
        for light in lights {
            let maps = match light.kind {
                LightKind::Directional { .. } if suns < MAX_SUNS => {
                    suns += 1;
                    cascades
                }
                LightKind::Directional { .. } => 0,
                kind => {
                    let maps = if fits_one_map(&kind) { 1 } else { 6 };
                    if local_layers + maps <= MAX_LOCAL_LAYERS {
                        local_layers += maps;
                        maps
                    } else {
                        0
                    }
                }
            };
            unshadowed += usize::from(maps == 0);
            of_light.push([views, maps]);
            views += maps;
        }
        let sun_size = options.sun_size.clamp(64, 4096) >> u32::from(suns > 1);
        let local_size = options.local_size.clamp(64, 2048) >> u32::from(local_layers > 24);
        Self { of_light, views, sun_size, sun_layers: suns * cascades, local_size, local_layers, unshadowed }
    }
}

/// The maps of one scene, with what the direct pass binds.
pub struct ShadowMaps {
    plan: Plan,
    sun: wgpu::Texture,
    local: wgpu::Texture,
    layers: Vec<wgpu::TextureView>,
    cameras: wgpu::Buffer,
    group: wgpu::BindGroup,
    views: Vec<ShadowViewGpu>,
    /// What each view sees.
    volumes: Vec<Volume>,
    /// What each layer was drawn of.
    kept: Vec<Option<Kept>>,
    camera_bytes: Vec<u8>,
    /// All cascades.
    pub sun_view: wgpu::TextureView,
    /// All local maps.
    pub local_view: wgpu::TextureView,
    /// [`ShadowViewGpu`] of each map.
    pub view_buffer: wgpu::Buffer,
    /// First view and number of views for each light.
    pub light_buffer: wgpu::Buffer,
}

impl ShadowMaps {
    /// Bytes of the depth maps.
    pub fn bytes(&self) -> Vec<(&'static str, u64)> {
        let bytes = |t: &wgpu::Texture| 4 * u64::from(t.width()).pow(2) * u64::from(t.depth_or_array_layers());
        vec![("shadow_sun", bytes(&self.sun)), ("shadow_local", bytes(&self.local))]
    }
}

/// Draws depth from the lights.
pub struct ShadowPass {
    layout: wgpu::BindGroupLayout,
    opaque: wgpu::RenderPipeline,
    covered: wgpu::RenderPipeline,
    options: ShadowOptions,
}

/// Spacing of the cameras in their uniform buffer: the largest alignment a device may ask for.
const CAMERA_STRIDE: u64 = 256;
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
        let layout = tool::layout(device, "render.shadow", wgpu::ShaderStages::VERTEX_FRAGMENT, &[uniform]);
        let module = shaders::module(device, "render.shadow");
        let pipeline = |covered: bool| {
            let material = covered.then(|| material_layout(device));
            let groups = [Some(&layout), material.as_ref()];
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("render.shadow"),
                bind_group_layouts: &groups[..1 + usize::from(covered)],
                immediate_size: 0,
            });
            let (positions, all) = (position_layouts(), attribute_layouts());
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
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
            })
        };
        let (opaque, covered) = (pipeline(false), pipeline(true));
        Self { layout, opaque, covered, options }
    }

    /// Makes the maps that the lights of `scene` need.
    pub fn maps(&self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &SceneGpu) -> ShadowMaps {
        let plan = Plan::new(&scene.lights, &self.options);
        if plan.unshadowed > 0 {
            tracing::warn!("{} lights beyond the shadow maps' budget shine without shadow", plan.unshadowed);
        }
        let array = |label, size: u32, layers: u32| {
            let size = if layers == 0 { 1 } else { size };
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size, height: size, depth_or_array_layers: array_layers(layers) },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Depth32Float,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let sun = array("shadow_sun", plan.sun_size, plan.sun_layers);
        let local = array("shadow_local", plan.local_size, plan.local_layers);
        let whole = |texture: &wgpu::Texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        };
        let layer = |texture: &wgpu::Texture, i: u32| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: i,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        let (mut layers, mut sun_layer, mut local_layer) = (Vec::new(), 0, 0);
        for (light, &[_, count]) in scene.lights.iter().zip(&plan.of_light) {
            let is_sun = matches!(light.kind, LightKind::Directional { .. });
            let (texture, next) = if is_sun { (&sun, &mut sun_layer) } else { (&local, &mut local_layer) };
            layers.extend((*next..*next + count).map(|i| layer(texture, i)));
            *next += count;
        }
        let buffer = |label, size: u64, usage: wgpu::BufferUsages| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let views = u64::from(plan.views.max(1));
        let storage = wgpu::BufferUsages::STORAGE;
        let cameras = buffer("shadow.cameras", views * CAMERA_STRIDE, wgpu::BufferUsages::UNIFORM);
        let light_buffer = buffer("shadow.lights", 8 * plan.of_light.len().max(1) as u64, storage);
        if !plan.of_light.is_empty() {
            queue.write_buffer(&light_buffer, 0, bytemuck::cast_slice(&plan.of_light));
        }
        let camera = wgpu::BufferBinding { buffer: &cameras, offset: 0, size: wgpu::BufferSize::new(CAMERA_SIZE) };
        let group = tool::group(device, "render.shadow", &self.layout, &[wgpu::BindingResource::Buffer(camera)]);
        ShadowMaps {
            sun_view: whole(&sun),
            local_view: whole(&local),
            view_buffer: buffer("shadow.views", views * size_of::<ShadowViewGpu>() as u64, storage),
            views: Vec::with_capacity(plan.views as usize),
            volumes: Vec::with_capacity(plan.views as usize),
            kept: vec![None; plan.views as usize],
            camera_bytes: vec![0; (u64::from(plan.views) * CAMERA_STRIDE) as usize],
            plan,
            sun,
            local,
            layers,
            cameras,
            group,
            light_buffer,
        }
    }

    /// Fits the maps to `view` and draws those that do not hold already what they would.
    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        scene: &SceneGpu,
        view: &View,
        maps: &mut ShadowMaps,
        count: &mut DrawnCount,
    ) {
        if maps.plan.views == 0 {
            return;
        }
        fit(scene, view, maps, self.options.cascades.clamp(1, 4));
        for (v, bytes) in maps.views.iter().zip(maps.camera_bytes.chunks_exact_mut(CAMERA_STRIDE as usize)) {
            bytes[..64].copy_from_slice(bytemuck::bytes_of(&v.clip_from_world));
            bytes[64..68].copy_from_slice(&view.seed.to_ne_bytes());
        }
        queue.write_buffer(&maps.cameras, 0, &maps.camera_bytes);
        queue.write_buffer(&maps.view_buffer, 0, bytemuck::cast_slice(&maps.views));
        for (i, layer) in maps.layers.iter().enumerate() {
            let (camera, volume) = (maps.views[i].clip_from_world, maps.volumes[i]);
            let kept = maps.kept[i].as_mut().filter(|k| k.holds(scene, &camera, &volume, view.seed));
            if let Some(kept) = kept {
                count.maps_kept += 1;
                count.kept += kept.count;
                continue;
            }
            let kept = maps.kept[i].insert(Kept::new(scene, camera, volume, view.seed));
            let depth = wgpu::RenderPassDepthStencilAttachment {
                view: layer,
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

/// Fills `maps.views` and `maps.volumes` for what `view` sees.
fn fit(scene: &SceneGpu, view: &View, maps: &mut ShadowMaps, cascades: u32) {
    let bounds = scene.bounds.map_or((Vec3::ZERO, Vec3::ZERO), |(low, high)| (low.into(), high.into()));
    maps.views.clear();
    maps.volumes.clear();
    let (mut sun_layer, mut local_layer) = (0, 0);
    let size = maps.plan.local_size;
    for (light, &[_, count]) in scene.lights.iter().zip(&maps.plan.of_light) {
        match light.kind {
            _ if count == 0 => {}
            LightKind::Directional { direction, .. } => {
                maps.views.extend(shadow_sun::cascades(
                    view,
                    direction.into(),
                    bounds,
                    cascades,
                    maps.plan.sun_size,
                    sun_layer,
                ));
                sun_layer += count;
            }
            LightKind::Spot { position, direction, radius, outer_angle, .. } if count == 1 => {
                let (p, d) = (position.into(), direction.into());
                maps.views.push(shadow_local::spot(p, d, outer_angle, radius, size, local_layer));
                local_layer += 1;
            }
            LightKind::Point { position, radius, .. } | LightKind::Spot { position, radius, .. } => {
                maps.views.extend(shadow_local::cube(position.into(), radius, size, local_layer));
                local_layer += 6;
            }
        }
        let reach = match light.kind {
            LightKind::Point { position, range, .. } | LightKind::Spot { position, range, .. } => {
                range.map(|r| (Vec3::from(position), r))
            }
            LightKind::Directional { .. } => None,
        };
        for v in &maps.views[maps.volumes.len()..] {
            let volume = Volume::new(&v.clip_from_world);
            maps.volumes.push(reach.map_or(volume, |(p, r)| volume.within(p, r)));
        }
    }
}

/// Layers to allocate for `used` ones. wgpu's GL backend guesses what an array is from its shape: one layer becomes a
/// plain texture and a square multiple of six a cube map, neither of which binds as the array that the shader reads.
fn array_layers(used: u32) -> u32 {
    let layers = used.max(2);
    if layers.is_multiple_of(6) { layers + 1 } else { layers }
}
