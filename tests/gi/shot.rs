//! Hand-made pictures for the tests of `gi/`: G-buffers as CPU arrays, traced or random, and their
//! upload.

use bouncelight::gi::cpu::{GBuffer, Picture, oct_encode};
use bouncelight::gi::inputs::Params;
use bouncelight::gi::{CameraMatrices, Inputs};
use glam::{Mat4, Vec3};
use half::f16;

/// A small reproducible generator (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// One picture, already rounded to the textures' precision, so that the CPU reference sees what the
/// GPU sees.
#[derive(Clone)]
pub struct Shot {
    pub size: [u32; 2],
    pub camera: CameraMatrices,
    pub environment: [f32; 3],
    pub buffers: GBuffer,
}

pub const NEAR: f32 = 0.1;

pub fn half(x: f32) -> f32 {
    f16::from_f32(x).to_f32()
}

fn byte(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// A camera at `eye` looking at `target`, 60 degrees high, infinite reversed Z, with a jitter in
/// ndc.
pub fn camera(size: [u32; 2], eye: Vec3, target: Vec3, jitter: [f32; 2]) -> CameraMatrices {
    let focal = 1.0 / 30f32.to_radians().tan();
    let aspect = size[0] as f32 / size[1] as f32;
    let up = if (target - eye).normalize().y.abs() > 0.99 { Vec3::NEG_Z } else { Vec3::Y };
    CameraMatrices {
        view_from_world: glam::camera::rh::view::look_at_mat4(eye, target, up).to_cols_array_2d(),
        clip_from_view: [
            [focal / aspect, 0.0, 0.0, 0.0],
            [0.0, focal, 0.0, 0.0],
            [-jitter[0], -jitter[1], 0.0, -1.0],
            [0.0, 0.0, NEAR, 0.0],
        ],
    }
}

/// What a ray hit: distance along the view axis is derived from the point.
pub struct Hit {
    pub point: Vec3,
    pub normal: Vec3,
    pub surface: usize,
}

impl Shot {
    pub fn empty(size: [u32; 2]) -> Self {
        let n = (size[0] * size[1]) as usize;
        let buffers = GBuffer {
            depth: vec![0.0; n],
            normal: vec![[0.0; 2]; n],
            albedo: vec![[0.0; 4]; n],
            emissive: vec![[0.0; 3]; n],
            direct: vec![[0.0; 3]; n],
        };
        Self { size, camera: camera(size, Vec3::ZERO, Vec3::NEG_Z, [0.0; 2]), environment: [0.0; 3], buffers }
    }

    pub fn set_albedo(&mut self, i: usize, rgb: [f32; 3], occlusion: f32) {
        self.buffers.albedo[i] = [rgb[0], rgb[1], rgb[2], occlusion].map(|x| f32::from(byte(x)) / 255.0);
    }

    /// Random texels; a fifth of the pixels is background, depth comes in plateaus with noise.
    pub fn random(size: [u32; 2], seed: u64) -> Self {
        let mut r = Random(seed);
        let mut shot = Self::empty(size);
        shot.camera = camera(size, Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, -1.0), [0.002, -0.001]);
        shot.environment = [0.05, 0.06, 0.08];
        for i in 0..shot.buffers.depth.len() {
            let plateau = [2.0, 2.5, 9.0, 40.0][(r.unit() * 4.0) as usize];
            if r.unit() > 0.2 {
                shot.buffers.depth[i] = NEAR / (plateau * (1.0 + 0.01 * r.unit()));
            }
            let n = Vec3::new(r.unit() - 0.5, r.unit() - 0.5, r.unit() - 0.5).normalize_or(Vec3::Y);
            shot.buffers.normal[i] = oct_encode(n.to_array()).map(half);
            shot.buffers.direct[i] = [r.unit(), r.unit(), 0.1 * r.unit()].map(half);
            shot.buffers.emissive[i] = if r.unit() > 0.9 { [2.0, r.unit(), 0.5].map(half) } else { [0.0; 3] };
            let rgb = [r.unit(), r.unit(), r.unit()];
            shot.set_albedo(i, rgb, r.unit());
        }
        shot
    }

    /// Traces every pixel centre; returns the shot and the surface of each pixel (`usize::MAX` =
    /// background).
    pub fn traced(
        size: [u32; 2],
        eye: Vec3,
        target: Vec3,
        trace: impl Fn(Vec3, Vec3) -> Option<Hit>,
    ) -> (Self, Vec<usize>) {
        let mut shot = Self::empty(size);
        shot.camera = camera(size, eye, target, [0.0; 2]);
        let view = Mat4::from_cols_array_2d(&shot.camera.view_from_world);
        let world = view.inverse();
        let p = shot.camera.clip_from_view;
        let mut surfaces = vec![usize::MAX; shot.buffers.depth.len()];
        for (i, surface) in surfaces.iter_mut().enumerate() {
            let pixel = [i as u32 % size[0], i as u32 / size[0]];
            let x = 2.0 * (pixel[0] as f32 + 0.5) / size[0] as f32 - 1.0;
            let y = 1.0 - 2.0 * (pixel[1] as f32 + 0.5) / size[1] as f32;
            let ray = world.transform_vector3(Vec3::new(x / p[0][0], y / p[1][1], -1.0));
            if let Some(hit) = trace(eye, ray) {
                shot.buffers.depth[i] = NEAR / -view.transform_point3(hit.point).z;
                shot.buffers.normal[i] = oct_encode(hit.normal.to_array()).map(half);
                shot.buffers.direct[i] = [1.0; 3];
                shot.set_albedo(i, [0.5; 3], 1.0);
                *surface = hit.surface;
            }
        }
        (shot, surfaces)
    }

    pub fn params(&self) -> Params {
        Params::new(self.size, &self.camera, self.environment).expect("a sound camera")
    }

    pub fn picture(&self) -> Picture<'_> {
        Picture::new(&self.buffers, self.params())
    }

    /// All light times `k` (a power of two keeps half floats exact).
    pub fn scaled(&self, k: f32) -> Self {
        let mut shot = self.clone();
        let light = shot.buffers.direct.iter_mut().chain(&mut shot.buffers.emissive);
        light.for_each(|c| *c = c.map(|x| x * k));
        shot.environment = shot.environment.map(|x| x * k);
        shot
    }

    /// Uploads all textures. Depth goes through a fragment shader: depth textures take no copies.
    pub fn upload(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Textures {
        use wgpu::TextureFormat as F;
        let b = &self.buffers;
        let wide =
            |v: &[[f32; 3]]| v.iter().flat_map(|c| [c[0], c[1], c[2], 1.0].map(f16::from_f32)).collect::<Vec<_>>();
        let normal: Vec<f16> = b.normal.iter().flatten().map(|x| f16::from_f32(*x)).collect();
        // Linear bytes: drivers decode sRGB only to about 1e-3, which would hide the shader's own
        // error.
        let albedo: Vec<u8> = b.albedo.iter().flatten().map(|x| byte(*x)).collect();
        let make = |format, bytes: &[u8]| texture_with(device, queue, self.size, format, bytes);
        let raw_depth = make(F::R32Float, bytemuck::cast_slice(&b.depth));
        let depth = empty_texture(
            device,
            self.size,
            F::Depth32Float,
            wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        );
        write_depth(device, queue, &raw_depth, &depth);
        Textures {
            depth: view(&depth),
            normal: view(&make(F::Rg16Float, bytemuck::cast_slice(&normal))),
            albedo: view(&make(F::Rgba8Unorm, &albedo)),
            emissive: view(&make(F::Rgba16Float, bytemuck::cast_slice(&wide(&b.emissive)))),
            direct: view(&make(F::Rgba16Float, bytemuck::cast_slice(&wide(&b.direct)))),
        }
    }
}

/// The uploaded inputs.
pub struct Textures {
    depth: wgpu::TextureView,
    normal: wgpu::TextureView,
    albedo: wgpu::TextureView,
    emissive: wgpu::TextureView,
    direct: wgpu::TextureView,
}

impl Textures {
    pub fn inputs(&self, shot: &Shot) -> Inputs<'_> {
        Inputs {
            albedo: Some(&self.albedo),
            emissive: Some(&self.emissive),
            direct: Some(&self.direct),
            environment: shot.environment,
            ..Inputs::new(shot.size, &self.depth, &self.normal, shot.camera)
        }
    }
}

pub fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&Default::default())
}

pub fn empty_texture(
    device: &wgpu::Device,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// The output texture of a method, readable.
pub fn output(device: &wgpu::Device, size: [u32; 2]) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
    empty_texture(device, size, wgpu::TextureFormat::Rgba16Float, usage)
}

pub fn texture_with(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    bytes: &[u8],
) -> wgpu::Texture {
    let usage = wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::TEXTURE_BINDING;
    let texture = empty_texture(device, size, format, usage);
    let row = bytes.len() as u32 / size[1];
    queue.write_texture(
        texture.as_image_copy(),
        bytes,
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None },
        texture.size(),
    );
    texture
}

const WRITE: &str = "
@group(0) @binding(0) var source: texture_2d<f32>;
@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i32(i) / 2) * 4.0 - 1.0, f32(i32(i) % 2) * 4.0 - 1.0, 0.0, 1.0);
}
@fragment fn depth(@builtin(position) at: vec4f) -> @builtin(frag_depth) f32 {
    return textureLoad(source, vec2i(at.xy), 0).r;
}
@fragment fn color(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return textureLoad(source, vec2i(at.xy), 0);
}";

/// Draws one texture's texels into a target that takes no copies: a depth texture, or a colour
/// texture of the frame.
pub struct Write {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

impl Write {
    /// Texels of `source`; the target's format is `Depth32Float`, which takes red, or
    /// `Rgba16Float`.
    pub fn new(device: &wgpu::Device, source: &wgpu::Texture, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(WRITE.into()),
        });
        let depth = format.is_depth_stencil_format();
        let color = [Some(wgpu::TextureFormat::Rgba16Float.into())];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: depth.then(|| wgpu::DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(if depth { "depth" } else { "color" }),
                compilation_options: Default::default(),
                targets: if depth { &[] } else { &color },
            }),
            multiview_mask: None,
            cache: None,
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view(source)),
            }],
        });
        Self { pipeline, group }
    }

    /// Draws them in an open pass on the target.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn write_depth(device: &wgpu::Device, queue: &wgpu::Queue, source: &wgpu::Texture, target: &wgpu::Texture) {
    let write = Write::new(device, source, target.format());
    let mut encoder = device.create_command_encoder(&Default::default());
    write.draw(&mut encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &view(target),
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    }));
    queue.submit([encoder.finish()]);
}
