//! A forward renderer that knows nothing of global illumination but one texture that its last pass
//! reads. Depth is 0 near and 1 far, normals are in view space in 10 bits, motion is in pixels.

use super::scene::Drawn;
use bouncelight::gi::CameraMatrices;
use bouncelight::wgpu::{
    self, BufferUsages as B, CommandEncoder as Encoder, Device, Queue, TextureFormat as F, TextureUsages as U,
    TextureView,
};
use glam::Vec3;

pub struct Renderer {
    pub device: Device,
    pub queue: Queue,
    pub size: [u32; 2],
    pub matrices: CameraMatrices,
    pub depth: TextureView,
    pub normal: TextureView,
    pub motion: TextureView,
    /// Light that the forward pass multiplies with albedo, E/π.
    pub light: TextureView,
    /// sRGB.
    pub picture: wgpu::Texture,
    picture_view: TextureView,
    pipelines: [wgpu::RenderPipeline; 2],
    group: wgpu::BindGroup,
    corners: wgpu::Buffer,
    drawn: wgpu::Buffer,
    count: u32,
}

impl Renderer {
    pub fn new(device: &Device, queue: &Queue, size: [u32; 2], corners: &[[f32; 6]], count: usize) -> Self {
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("host"),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let [depth, normal, motion] = [F::Depth32Float, F::Rgb10a2Unorm, F::Rg16Float]
            .map(|format| view(&texture(format, U::RENDER_ATTACHMENT | U::TEXTURE_BINDING)));
        let light = view(&texture(F::Rgba16Float, U::STORAGE_BINDING | U::TEXTURE_BINDING | U::COPY_SRC));
        let picture = texture(F::Rgba8UnormSrgb, U::RENDER_ATTACHMENT | U::COPY_SRC);
        let buffer = |usage, size: usize| {
            let (label, size, usage) = (Some("host"), size as u64, usage | B::COPY_DST);
            device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
        };

        let (eye, target) = (Vec3::from(EYE), Vec3::from(TARGET));
        let view_from_world = glam::camera::rh::view::look_at_mat4(eye, target, Vec3::Y);
        let aspect = size[0] as f32 / size[1] as f32;
        let clip_from_view = glam::camera::rh::proj::directx::perspective(YFOV, aspect, 0.1, 50.0);
        let matrices = CameraMatrices {
            view_from_world: view_from_world.to_cols_array_2d(),
            clip_from_view: clip_from_view.to_cols_array_2d(),
        };
        let camera = buffer(B::UNIFORM, 128);
        let uniform = [matrices.view_from_world, matrices.clip_from_view];
        queue.write_buffer(&camera, 0, bytemuck::cast_slice(&uniform));
        let corner_buffer = buffer(B::VERTEX, size_of_val(corners));
        queue.write_buffer(&corner_buffer, 0, bytemuck::cast_slice(corners));

        let visibility = wgpu::ShaderStages::VERTEX_FRAGMENT;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let (uniform, texture) = (wgpu::BufferBindingType::Uniform, wgpu::TextureViewDimension::D2);
        let loaded = wgpu::TextureSampleType::Float { filterable: false };
        let types = [
            wgpu::BindingType::Buffer { ty: uniform, has_dynamic_offset: false, min_binding_size: None },
            wgpu::BindingType::Texture { sample_type: loaded, view_dimension: texture, multisampled: false },
        ];
        let (label, entries) = (Some("host"), &[entry(0, types[0]), entry(1, types[1])]);
        let layout = &device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries });
        let resources = [camera.as_entire_binding(), wgpu::BindingResource::TextureView(&light)];
        let bound = |i: usize| wgpu::BindGroupEntry { binding: i as u32, resource: resources[i].clone() };
        let entries = &[bound(0), bound(1)];
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("host"), layout, entries });
        let pipeline_layout = &device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("host"),
            bind_group_layouts: &[Some(layout)],
            immediate_size: 0,
        });
        Self {
            group,
            pipelines: [true, false].map(|first| pipeline(device, pipeline_layout, first)),
            device: device.clone(),
            queue: queue.clone(),
            size,
            matrices,
            depth,
            normal,
            motion,
            light,
            picture_view: view(&picture),
            picture,
            corners: corner_buffer,
            drawn: buffer(B::VERTEX, count * size_of::<Drawn>()),
            count: count as u32,
        }
    }

    /// Depth, normals and motion of the boxes as they are now.
    pub fn prepass(&self, encoder: &mut Encoder, drawn: &[Drawn]) {
        self.queue.write_buffer(&self.drawn, 0, bytemuck::cast_slice(drawn));
        self.draw(encoder, 0, &[&self.normal, &self.motion], wgpu::LoadOp::Clear(1.0));
    }

    /// The picture.
    pub fn forward(&self, encoder: &mut Encoder) {
        self.draw(encoder, 1, &[&self.picture_view], wgpu::LoadOp::Load);
    }

    fn draw(&self, encoder: &mut Encoder, number: usize, colors: &[&TextureView], load: wgpu::LoadOp<f32>) {
        let store = wgpu::StoreOp::Store;
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store };
        let color = |view| Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &colors.iter().copied().map(color).collect::<Vec<_>>(),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load, store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipelines[number]);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.set_vertex_buffer(1, self.drawn.slice(..));
        pass.draw(0..36, 0..self.count);
    }
}

/// Where the camera stands and what it looks at.
pub const EYE: [f32; 3] = [1.3, 2.3, 6.6];
pub const TARGET: [f32; 3] = [0.0, 1.4, 0.0];
/// Vertical field of view, radians.
pub const YFOV: f32 = 0.62;

fn view(texture: &wgpu::Texture) -> TextureView {
    texture.create_view(&Default::default())
}

/// The prepass writes depth, normals and motion; the forward pass draws what is seen.
fn pipeline(device: &Device, layout: &wgpu::PipelineLayout, first: bool) -> wgpu::RenderPipeline {
    let module = &device.create_shader_module(wgpu::include_wgsl!("renderer.wgsl"));
    let corner = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
    let drawn = wgpu::vertex_attr_array![
        2 => Float32x4, 3 => Float32x4, 4 => Float32x4, 5 => Float32x4, 6 => Float32x4,
        7 => Float32x4, 8 => Float32x4, 9 => Float32x4, 10 => Float32x4
    ];
    let buffer =
        |array_stride, step_mode, attributes| Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes });
    let (compare, formats): (_, &[F]) = match first {
        true => (wgpu::CompareFunction::Less, &[F::Rgb10a2Unorm, F::Rg16Float]),
        false => (wgpu::CompareFunction::Equal, &[F::Rgba8UnormSrgb]),
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("host"),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[
                buffer(24, wgpu::VertexStepMode::Vertex, &corner),
                buffer(size_of::<Drawn>() as u64, wgpu::VertexStepMode::Instance, &drawn),
            ],
        },
        primitive: wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Back), ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: F::Depth32Float,
            depth_write_enabled: Some(first),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(if first { "prepass" } else { "forward" }),
            compilation_options: Default::default(),
            targets: &formats.iter().map(|f| Some((*f).into())).collect::<Vec<_>>(),
        }),
        multiview_mask: None,
        cache: None,
    })
}
