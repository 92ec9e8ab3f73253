//! The render world's side: the world on the GPU, a view for each camera, and in schedule `Core3d` the pass and its
//! composite.

use crate::{Bouncelight, LUMENS_PER_WATT};
use bevy::core_pipeline::prepass::ViewPrepassTextures;
use bevy::log::{error, error_once, info, warn};
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;
use bevy::render::camera::{ExtractedCamera, TemporalJitter};
use bevy::render::renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery};
use bevy::render::view::{ExtractedView, ViewTarget};
use bouncelight::gi::{
    CameraMatrices, Conventions, Inputs, Method, MotionSense, NormalEncoding, NormalRange, View, World, WorldOptions,
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
    composites: HashMap<wgpu::TextureFormat, wgpu::RenderPipeline>,
}

struct Camera {
    size: [u32; 2],
    /// Nothing where it could not be made.
    pass: Option<Mutex<Pass>>,
    /// E/π.
    light: wgpu::TextureView,
    checked: bool,
}

struct Pass {
    view: View,
    /// Bevy makes another view of the same depth each frame; what a pass binds it remembers by view.
    depth: Option<wgpu::TextureView>,
}

impl Pass {
    fn depth(&mut self, of: &wgpu::TextureView) -> wgpu::TextureView {
        let known = self.depth.take().filter(|d| d.texture() == of.texture());
        self.depth.insert(known.unwrap_or_else(|| of.clone())).clone()
    }
}

impl Views {
    /// Bind groups and rebuilds of all cameras' passes since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        let of = |c: &Camera| Some(c.pass.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner).view.allocations());
        self.cameras.values().filter_map(of).sum()
    }
}

/// What [`View::check`] said of each camera, once it was asked (`BouncelightPlugin::check`), in the render world.
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
        views.composites.entry(format).or_insert_with(|| composite(device, format));
        let size = [view.viewport.z, view.viewport.w];
        if views.cameras.get(&entity).is_some_and(|c| c.size == size) || size.contains(&0) {
            continue;
        }
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("bouncelight.light"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let light = texture.create_view(&Default::default());
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
        views.cameras.insert(entity, Camera { size, pass: made, light, checked: false });
    }
}

type Seen<'a> =
    (&'a ExtractedView, &'a ExtractedCamera, &'a ViewTarget, &'a ViewPrepassTextures, Option<&'a TemporalJitter>);

/// Bevy's conventions: depth reversed with the far plane at infinity, normals in the world, motion from the past.
fn inputs<'a>(
    view: &ExtractedView,
    textures: &'a ViewPrepassTextures,
    depth: &'a wgpu::TextureView,
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
    Some(Inputs { motion, conventions, ..Inputs::new(size, depth, textures.normal_view()?, camera) })
}

/// Records the pass and adds what it finds to the picture.
pub(crate) fn light(
    seen: ViewQuery<Seen<'static>, With<Bouncelight>>,
    (lit, views): (Option<Res<Lit>>, Res<Views>),
    mut context: RenderContext,
) {
    let camera = views.cameras.get(&seen.entity());
    let (view, camera_of, target, textures, jitter) = seen.into_inner();
    let (Some(lit), Some(camera)) = (lit, camera) else { return };
    let (Some(pass), Some(gbuffer)) = (&camera.pass, textures.deferred_view()) else { return };
    let Some(pipeline) = views.composites.get(&target.main_texture_format()) else { return };
    let Some(depth) = textures.depth_only_view() else { return };

    let mut pass = pass.lock().unwrap_or_else(PoisonError::into_inner);
    let depth = pass.depth(depth);
    let Some(inputs) = inputs(view, textures, &depth, jitter) else { return };
    if let Err(e) = pass.view.record(context.command_encoder(), &lit.world, &inputs, &camera.light) {
        error_once!("{e}");
        return;
    }
    let group = context.render_device().wgpu_device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("bouncelight.composite"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(gbuffer) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&camera.light) },
        ],
    });
    let mut draw = context.command_encoder().begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("bouncelight.composite"),
        color_attachments: &[Some(target.get_color_attachment())],
        ..Default::default()
    });
    let scale = f64::from(LUMENS_PER_WATT * camera_of.exposure);
    draw.set_blend_constant(wgpu::Color { r: scale, g: scale, b: scale, a: 0.0 });
    draw.set_pipeline(pipeline);
    draw.set_bind_group(0, &group, &[]);
    draw.draw(0..3, 0..1);
}

fn composite(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("bouncelight.composite"),
        source: wgpu::ShaderSource::Wgsl(include_str!("composite.wgsl").into()),
    });
    let add =
        |src_factor, dst_factor| wgpu::BlendComponent { src_factor, dst_factor, operation: wgpu::BlendOperation::Add };
    let blend = wgpu::BlendState {
        color: add(wgpu::BlendFactor::Constant, wgpu::BlendFactor::One),
        alpha: add(wgpu::BlendFactor::Zero, wgpu::BlendFactor::One),
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("bouncelight.composite"),
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
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: Some(blend),
                write_mask: wgpu::ColorWrites::COLOR,
            })],
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
        let found = inputs(view, textures, &depth, jitter);
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
