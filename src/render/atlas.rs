//! Tiny G-buffers in one atlas: what lies beyond the screen, seen from lights ([`rsm`](super::rsm)) and from a cube
//! around the camera ([`around`](super::around)). One render pass draws all tiles with the frame's own list of draws;
//! each tile has its viewport, and what a tile's view cannot see is left out by the draws' bounds.
//!
//! | field | format | holds | where nothing was hit |
//! |---|---|---|---|
//! | `depth` | `Depth32Float` | reversed: 1 at the near plane | 0 |
//! | `albedo` | `Rgba8UnormSrgb` | rgb: diffuse reflectance, the specular share taken out; a: 1 | 0 |
//! | `normal` | `Rg16Float` | unit normal in world space, octahedral, turned to the side that is seen | 0, 0 |
//! | `emissive` | `Rgba16Float` | rgb: emitted radiance, W/(m²·sr), or in a light's view the share of its light that the specular lobe reflects; a: 1 | 0 |

use super::gbuffer::mesh_pipeline;
use super::tool;
use crate::gpu::{shaders, timing::Recorder};
use crate::scene::upload::{Draw, SceneGpu, attribute_layouts, material_layout};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, Mat4, Vec3, Vec4};

/// One tile's view; the twin of `AtlasView` in `shaders/lib/atlas.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct AtlasViewGpu {
    /// Reversed-Z clip space.
    pub clip_from_world: [[f32; 4]; 4],
    /// Its inverse.
    pub world_from_clip: [[f32; 4]; 4],
    /// Unit direction of view.
    pub axis: [f32; 3],
    /// Square root of a texel's area: metres (parallel) or tangent units (perspective).
    pub texel: f32,
    /// Where a perspective view stands.
    pub eye: [f32; 3],
    /// Near plane, metres; 0 marks a parallel view.
    pub near: f32,
    /// The tile's first texel.
    pub origin: [u32; 2],
    /// The tile's side, texels.
    pub side: u32,
    /// Index of the light it belongs to.
    pub light: u32,
    /// Metres from near to far plane (parallel).
    pub range: f32,
    /// Where the view's blocks of emitters begin.
    pub first_block: u32,
    /// Share of the specular lobes' light that counts as albedo; below 0 in views of lights, whose emitters have lobes.
    pub specular: f32,
    /// Share of surfaces' own glow that counts: 0 where lights stand in for it.
    pub glow: f32,
}

/// A tile's place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tile {
    pub origin: [u32; 2],
    pub side: u32,
    pub light: u32,
    pub first_block: u32,
}

/// A view from `eye` along the last of `axes` (right, up, forward) that shows `tangent` to each side.
pub(super) fn perspective(eye: Vec3, axes: [Vec3; 3], tangent: f32, near: f32, tile: Tile) -> AtlasViewGpu {
    let focal = 1.0 / tangent;
    let row = |axis: Vec3, scale: f32| (axis * scale).extend(-axis.dot(eye) * scale);
    let clip = Mat4::from_cols(row(axes[0], focal), row(axes[1], focal), Vec4::W * near, row(axes[2], 1.0)).transpose();
    finish(clip, axes[2], 2.0 * tangent / tile.side as f32, eye, near, 0.0, tile)
}

/// A parallel view along −`axes[2]` of the box `low`..`high` in those axes.
pub(super) fn parallel(axes: [Vec3; 3], low: Vec3, high: Vec3, tile: Tile) -> AtlasViewGpu {
    let (middle, extent) = (0.5 * (low + high), high - low);
    let row = |axis: Vec3, scale: f32, offset: f32| (axis * scale).extend(-offset * scale);
    let clip = Mat4::from_cols(
        row(axes[0], 2.0 / extent.x, middle.x),
        row(axes[1], 2.0 / extent.y, middle.y),
        row(axes[2], 1.0 / extent.z, low.z),
        Vec4::W,
    )
    .transpose();
    let texel = (extent.x * extent.y).sqrt() / tile.side as f32;
    finish(clip, -axes[2], texel, Vec3::ZERO, 0.0, extent.z, tile)
}

fn finish(clip: Mat4, axis: Vec3, texel: f32, eye: Vec3, near: f32, range: f32, tile: Tile) -> AtlasViewGpu {
    let double = DMat4::from_cols_array(&clip.to_cols_array().map(f64::from));
    AtlasViewGpu {
        clip_from_world: clip.to_cols_array_2d(),
        world_from_clip: double.inverse().as_mat4().to_cols_array_2d(),
        axis: axis.to_array(),
        texel,
        eye: eye.to_array(),
        near,
        origin: tile.origin,
        side: tile.side,
        light: tile.light,
        range,
        first_block: tile.first_block,
        specular: -1.0,
        glow: 1.0,
    }
}

/// Spacing of the cameras in their uniform buffer: the largest alignment a device may ask for.
const CAMERA_STRIDE: u64 = 256;
/// A camera: matrix, place and share of specular light.
const CAMERA_SIZE: u64 = 96;

/// The textures of an atlas and the cameras of its tiles.
pub struct Atlas {
    /// Reversed depth.
    pub depth: wgpu::TextureView,
    /// Diffuse reflectance.
    pub albedo: wgpu::TextureView,
    /// Octahedral normal.
    pub normal: wgpu::TextureView,
    /// Emitted radiance.
    pub emissive: wgpu::TextureView,
    /// [`AtlasViewGpu`] of each tile, a storage buffer.
    pub views: wgpu::Buffer,
    cameras: wgpu::Buffer,
    group: wgpu::BindGroup,
    camera_bytes: Vec<u8>,
    size: [u32; 2],
}

impl Atlas {
    /// GPU memory of the textures, bytes.
    pub fn bytes(&self) -> u64 {
        20 * u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

/// Draws atlases.
pub struct AtlasPass {
    layout: wgpu::BindGroupLayout,
    opaque: wgpu::RenderPipeline,
    covered: wgpu::RenderPipeline,
}

impl AtlasPass {
    /// Builds the pipelines.
    pub fn new(device: &wgpu::Device) -> Self {
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        };
        let layout = tool::layout(device, "render.atlas", wgpu::ShaderStages::VERTEX_FRAGMENT, &[uniform]);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("render.atlas"),
            bind_group_layouts: &[Some(&layout), Some(&material_layout(device))],
            immediate_size: 0,
        });
        let module = shaders::module(device, "render.atlas");
        use wgpu::TextureFormat as F;
        let formats = [F::Rgba8UnormSrgb, F::Rg16Float, F::Rgba16Float];
        // Both faces, as in the shadow maps: a single-sided wall stops light from behind, too.
        let drawn = (&attribute_layouts()[..], &formats[..]);
        let [opaque, covered] = [false, true]
            .map(|covered| mesh_pipeline(device, "render.atlas", (&pipeline_layout, &module), drawn, None, covered));
        Self { layout, opaque, covered }
    }

    /// Makes an atlas of `size` texels for `views` tiles.
    pub(super) fn atlas(&self, device: &wgpu::Device, label: &str, size: [u32; 2], views: usize) -> Atlas {
        let texture = |format| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let buffer = |size: u64, usage: wgpu::BufferUsages| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let count = views.max(1) as u64;
        let cameras = buffer(count * CAMERA_STRIDE, wgpu::BufferUsages::UNIFORM);
        let camera = wgpu::BufferBinding { buffer: &cameras, offset: 0, size: wgpu::BufferSize::new(CAMERA_SIZE) };
        let group = tool::group(device, "render.atlas", &self.layout, &[wgpu::BindingResource::Buffer(camera)]);
        Atlas {
            depth: texture(wgpu::TextureFormat::Depth32Float),
            albedo: texture(wgpu::TextureFormat::Rgba8UnormSrgb),
            normal: texture(wgpu::TextureFormat::Rg16Float),
            emissive: texture(wgpu::TextureFormat::Rgba16Float),
            views: buffer(count * size_of::<AtlasViewGpu>() as u64, wgpu::BufferUsages::STORAGE),
            group,
            cameras,
            camera_bytes: vec![0; views * CAMERA_STRIDE as usize],
            size,
        }
    }

    /// Clears the atlas and draws `scene` into the tile of every view, as pass `label`.
    pub(super) fn record(
        &self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        label: &str,
        scene: &SceneGpu,
        atlas: &mut Atlas,
        views: &[AtlasViewGpu],
    ) {
        if views.is_empty() {
            return;
        }
        for (view, bytes) in views.iter().zip(atlas.camera_bytes.chunks_exact_mut(CAMERA_STRIDE as usize)) {
            bytes[..64].copy_from_slice(bytemuck::bytes_of(&view.clip_from_world));
            let ([x, y, z], w) = if view.near > 0.0 { (view.eye, 1.0) } else { (view.axis, 0.0) };
            bytes[64..96].copy_from_slice(bytemuck::bytes_of(&[x, y, z, w, view.specular, view.glow, 0.0, 0.0]));
        }
        queue.write_buffer(&atlas.cameras, 0, &atlas.camera_bytes);
        queue.write_buffer(&atlas.views, 0, bytemuck::cast_slice(views));
        let colors = [&atlas.albedo, &atlas.normal, &atlas.emissive].map(|view| {
            let load = wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT);
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        });
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &atlas.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        recorder.render(label, &colors, Some(depth), |pass| {
            pass.set_vertex_buffer(0, scene.positions.slice(..));
            pass.set_vertex_buffer(1, scene.instances.slice(..));
            pass.set_vertex_buffer(2, scene.attributes.slice(..));
            pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
            for (i, view) in views.iter().enumerate() {
                let ([x, y], side) = (view.origin.map(|v| v as f32), view.side as f32);
                pass.set_viewport(x, y, side, side, 0.0, 1.0);
                pass.set_bind_group(0, &atlas.group, &[(i as u64 * CAMERA_STRIDE) as u32]);
                self.tile(pass, scene, view);
            }
        });
    }

    fn tile(&self, pass: &mut wgpu::RenderPass<'_>, scene: &SceneGpu, view: &AtlasViewGpu) {
        for covered in [false, true] {
            let mut draws = scene.draws.iter().filter(|d| d.covered == covered && sees(view, d)).peekable();
            if draws.peek().is_some() {
                pass.set_pipeline(if covered { &self.covered } else { &self.opaque });
            }
            for draw in draws {
                pass.set_bind_group(1, &scene.material_groups[draw.material], &[]);
                pass.draw_indexed(draw.indices.clone(), draw.base_vertex, draw.instances.clone());
            }
        }
    }
}

/// False when all corners of the draw's bounds lie outside one side of the view.
fn sees(view: &AtlasViewGpu, draw: &Draw) -> bool {
    let clip = Mat4::from_cols_array_2d(&view.clip_from_world);
    let (low, high) = (Vec3::from(draw.bounds.0), Vec3::from(draw.bounds.1));
    let mut outside = [true; 5];
    for i in 0..8 {
        let pick = |bit: usize, low, high| if i & bit == 0 { low } else { high };
        let p = Vec3::new(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z));
        let c = clip * p.extend(1.0);
        let sides = [c.x > c.w, c.x < -c.w, c.y > c.w, c.y < -c.w, c.z > c.w];
        outside.iter_mut().zip(sides).for_each(|(all, one)| *all &= one);
    }
    !outside.contains(&true)
}

/// Right, up and forward of a cube's face: +X, −X, +Y, −Y, +Z, −Z in this order.
pub(super) fn cube_axes(face: usize) -> [Vec3; 3] {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let sign = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
    let [forward, up, right] = [0, 1, 2].map(|i| axes[(face / 2 + i) % 3]);
    [right * sign, up, forward * sign]
}

/// Right and up for a view along `forward`: right × up looks back, so front faces wind as in any camera.
pub(super) fn upright(forward: Vec3) -> [Vec3; 3] {
    let (up, right) = forward.any_orthonormal_pair();
    [right, up, forward]
}
