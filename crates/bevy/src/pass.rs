//! The render world's side: the world on the GPU, a view for each camera, and in schedule `Core3d`
//! the pass and its composite.

use crate::{Bouncelight, LUMENS_PER_WATT};
use bevy::core_pipeline::prepass::ViewPrepassTextures;
use bevy::log::{error, error_once, info, warn};
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;
use bevy::render::camera::{ExtractedCamera, TemporalJitter};
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::{ExtractedView, ViewTarget};
use bouncelight::gi::{
    CameraMatrices, Conventions, Inputs, Method, MotionSense, NormalEncoding, NormalRange, Outputs, View, World,
    WorldOptions,
};
use bouncelight::wgpu;
use std::sync::{Mutex, PoisonError};

/// The scene as rays meet it.
#[derive(Resource)]
pub(crate) struct Lit {
    pub(crate) world: World,
    /// Keys that are there.
    pub(crate) meshes: HashSet<u64>,
    pub(crate) instances: HashSet<u64>,
}

/// What each camera has, in the render world.
#[derive(Resource, Default)]
pub struct Views {
    cameras: HashMap<Entity, Camera>,
    specular: Option<wgpu::RenderPipeline>,
    composites: HashMap<wgpu::TextureFormat, wgpu::RenderPipeline>,
}

struct Camera {
    size: [u32; 2],
    /// Nothing where it could not be made.
    pass: Option<Mutex<Pass>>,
    /// E/π, and what lobes reflect.
    light: wgpu::TextureView,
    reflected: wgpu::TextureView,
    /// F0 and roughness.
    specular: wgpu::TextureView,
    /// `Camera` of `composite.wgsl`.
    matrices: wgpu::Buffer,
    checked: bool,
}

struct Pass {
    view: View,
    /// Bevy makes another view of the same depth each frame; what a pass binds it remembers by
    /// view.
    depth: Option<wgpu::TextureView>,
}

impl Pass {
    fn depth(&mut self, of: &wgpu::TextureView) -> wgpu::TextureView {
        let known = self.depth.take().filter(|d| d.texture() == of.texture());
        self.depth.insert(known.unwrap_or_else(|| of.clone())).clone()
    }
}

impl Views {
    /// Bind groups and rebuilds of all cameras' passes since the start; stands still in steady
    /// frames.
    pub fn allocations(&self) -> u64 {
        let of = |c: &Camera| Some(c.pass.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner).view.allocations());
        self.cameras.values().filter_map(of).sum()
    }
}

/// What [`View::check`] said of each camera, once it was asked (`BouncelightPlugin::check`), in the
/// render world.
#[derive(Resource, Default, Debug)]
pub struct Complaints {
    /// Cameras that were checked.
    pub cameras: usize,
    /// What is wrong.
    pub found: Vec<String>,
}

pub(crate) fn start(mut commands: Commands, device: Res<RenderDevice>) {
    let world = World::new(device.wgpu_device(), WorldOptions::default());
    commands.insert_resource(Lit { world, meshes: HashSet::new(), instances: HashSet::new() });
}

/// Brings the GPU up to date and makes what new cameras and sizes need.
pub(crate) fn prepare(
    lit: Option<ResMut<Lit>>,
    mut views: ResMut<Views>,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    cameras: Query<(Entity, &ExtractedView), With<Bouncelight>>,
) {
    let Some(mut lit) = lit else { return };
    if let Err(e) = lit.world.prepare(&queue) {
        error_once!("{e}");
    }
    let views = &mut *views;
    let device = device.wgpu_device();
    views.cameras.retain(|entity, _| cameras.contains(*entity));
    for (entity, view) in &cameras {
        let format = view.target_format;
        let add = || screen(device, "composite", format, Some(ADD));
        views.composites.entry(format).or_insert_with(add);
        views.specular.get_or_insert_with(|| screen(device, "specular", SPECULAR, None));
        let size = [view.viewport.z, view.viewport.w];
        if views.cameras.get(&entity).is_some_and(|c| c.size == size) || size.contains(&0) {
            continue;
        }
        let texture = |label, format, usage| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let [light, reflected] = ["bouncelight.light", "bouncelight.reflected"]
            .map(|label| texture(label, wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::STORAGE_BINDING));
        let specular = texture("bouncelight.specular", SPECULAR, wgpu::TextureUsages::RENDER_ATTACHMENT);
        let matrices = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("bouncelight.camera"),
            size: 48,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let made = match views.cameras.remove(&entity) {
            // It takes another size by itself.
            Some(before) => before.pass,
            None => match View::new(device, &queue, size, &Method::Gather(Default::default())) {
                Ok(view) => Some(Mutex::new(Pass { view, depth: None })),
                Err(e) => {
                    error!("{e}");
                    None
                }
            },
        };
        views.cameras.insert(entity, Camera { size, pass: made, light, reflected, specular, matrices, checked: false });
    }
}

type Seen<'a> =
    (&'a ExtractedView, &'a ExtractedCamera, &'a ViewTarget, &'a ViewPrepassTextures, Option<&'a TemporalJitter>);

/// Bevy's conventions: depth reversed with the far plane at infinity, normals in the world, motion
/// from the past.
fn inputs<'a>(
    view: &ExtractedView,
    textures: &'a ViewPrepassTextures,
    (depth, specular): (&'a wgpu::TextureView, &'a wgpu::TextureView),
    jitter: Option<&TemporalJitter>,
) -> Option<Inputs<'a>> {
    let size = [view.viewport.z, view.viewport.w];
    if [textures.size.width, textures.size.height] != size {
        error_once!("a camera with a viewport of a part of its target is not lit");
        return None;
    }
    let mut clip_from_view = view.clip_from_view;
    if let Some(jitter) = jitter {
        jitter.jitter_projection(&mut clip_from_view, view.viewport.zw().as_vec2());
    }
    let camera = CameraMatrices {
        view_from_world: view.world_from_view.to_matrix().inverse().to_cols_array_2d(),
        clip_from_view: clip_from_view.to_cols_array_2d(),
    };
    let conventions = Conventions {
        normal_encoding: NormalEncoding::Xyz,
        normal_range: NormalRange::Unsigned,
        motion_sense: MotionSense::FromPast,
        ..Default::default()
    };
    let motion = textures.motion_vectors_view().map(|v| &**v);
    let inputs = Inputs::new(size, depth, textures.normal_view()?, camera);
    Some(Inputs { motion, specular: Some(specular), conventions, ..inputs })
}

/// Records the pass and adds what it finds to the picture.
pub(crate) fn light(
    seen: ViewQuery<Seen<'static>, With<Bouncelight>>,
    (lit, views): (Option<Res<Lit>>, Res<Views>),
    queue: Res<RenderQueue>,
    mut context: RenderContext,
) {
    let camera = views.cameras.get(&seen.entity());
    let (view, camera_of, target, textures, jitter) = seen.into_inner();
    let (Some(lit), Some(camera), Some(first)) = (lit, camera, &views.specular) else { return };
    let (Some(pass), Some(gbuffer)) = (&camera.pass, textures.deferred_view()) else { return };
    let Some(last) = views.composites.get(&target.main_texture_format()) else { return };
    let Some(depth) = textures.depth_only_view() else { return };

    let mut pass = pass.lock().unwrap_or_else(PoisonError::into_inner);
    let depth = pass.depth(depth);
    let Some(inputs) = inputs(view, textures, (&depth, &camera.specular), jitter) else { return };
    let device = context.render_device().wgpu_device().clone();
    let group = |pipeline: &wgpu::RenderPipeline, bound: &[wgpu::BindingResource<'_>]| {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("bouncelight"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries(bound),
        })
    };
    let texture = |view| wgpu::BindingResource::TextureView(view);
    let to_specular = wgpu::RenderPassColorAttachment {
        view: &camera.specular,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
    };
    let encoder = context.command_encoder();
    draw(encoder, first, &group(first, &[texture(gbuffer)]), to_specular, 0.0);
    let outputs = Outputs { light: &camera.light, specular: Some(&camera.reflected) };
    if let Err(e) = pass.view.record(encoder, &lit.world, &inputs, outputs) {
        error_once!("{e}");
        return;
    }
    let known = matrices(&inputs.camera, pass.view.writes_specular());
    queue.write_buffer(&camera.matrices, 0, bytemuck::cast_slice(&known));
    let bound = [
        texture(gbuffer),
        texture(&camera.light),
        texture(&camera.reflected),
        texture(inputs.normal),
        camera.matrices.as_entire_binding(),
    ];
    let scale = f64::from(LUMENS_PER_WATT * camera_of.exposure);
    draw(encoder, last, &group(last, &bound), target.get_color_attachment(), scale);
}

fn entries<'a>(bound: &[wgpu::BindingResource<'a>]) -> Vec<wgpu::BindGroupEntry<'a>> {
    (0..).zip(bound).map(|(binding, r)| wgpu::BindGroupEntry { binding, resource: r.clone() }).collect()
}

/// A triangle over the whole target.
fn draw(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::RenderPipeline,
    group: &wgpu::BindGroup,
    target: wgpu::RenderPassColorAttachment<'_>,
    scale: f64,
) {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("bouncelight"),
        color_attachments: &[Some(target)],
        ..Default::default()
    });
    pass.set_blend_constant(wgpu::Color { r: scale, g: scale, b: scale, a: 0.0 });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, group, &[]);
    pass.draw(0..3, 0..1);
}

/// `Camera` of `composite.wgsl`.
fn matrices(camera: &CameraMatrices, writes_specular: bool) -> [[f32; 4]; 3] {
    let (view, p) = (Mat4::from_cols_array_2d(&camera.view_from_world), camera.clip_from_view);
    let axis = |row: usize, over: f32, with: f32| (view.row(row).truncate() / over).extend(with).to_array();
    [axis(0, p[0][0], p[2][0]), axis(1, p[1][1], p[2][1]), axis(2, 1.0, f32::from(u8::from(writes_specular)))]
}

const SPECULAR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Times the blend constant, onto what is there.
const ADD: wgpu::BlendState = {
    let (operation, dst_factor) = (wgpu::BlendOperation::Add, wgpu::BlendFactor::One);
    wgpu::BlendState {
        color: wgpu::BlendComponent { src_factor: wgpu::BlendFactor::Constant, dst_factor, operation },
        alpha: wgpu::BlendComponent { src_factor: wgpu::BlendFactor::Zero, dst_factor, operation },
    }
};

fn screen(
    device: &wgpu::Device,
    entry: &str,
    format: wgpu::TextureFormat,
    blend: Option<wgpu::BlendState>,
) -> wgpu::RenderPipeline {
    let source = concat!(include_str!("../../../shaders/lib/brdf.wgsl"), include_str!("composite.wgsl"));
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("bouncelight.composite"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("bouncelight"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Asks what is wrong, once a camera, when it has settled a little.
pub(crate) fn check(
    lit: Option<Res<Lit>>,
    mut views: ResMut<Views>,
    mut complaints: ResMut<Complaints>,
    device: Res<RenderDevice>,
    cameras: Query<Seen<'static>, With<Bouncelight>>,
) {
    let Some(lit) = lit else { return };
    for (entity, camera) in views.cameras.iter_mut().filter(|(_, c)| !c.checked) {
        let (Ok((view, _, _, textures, jitter)), Some(pass)) = (cameras.get(*entity), &camera.pass) else { continue };
        let mut pass = pass.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(depth) = textures.depth_only_view().map(|depth| pass.depth(depth)) else { continue };
        if pass.view.settled().is_none_or(|frames| frames < 8) {
            continue;
        }
        camera.checked = true;
        complaints.cameras += 1;
        let found = inputs(view, textures, (&depth, &camera.specular), jitter);
        let found = found.map(|i| pass.view.check(device.wgpu_device(), &lit.world, &i));
        let found: Vec<String> = match found.transpose() {
            Ok(found) => found.unwrap_or_default().iter().map(ToString::to_string).collect(),
            Err(e) => vec![e.to_string()],
        };
        found.iter().for_each(|c| warn!("{c}"));
        info!("the pass's inputs were checked: {} complaints", found.len());
        complaints.found.extend(found);
    }
}
