//! Helpers to make layouts, bind groups and pipelines of passes.

pub use crate::gpu::binding::*;
use crate::gpu::{pipeline_cache, tape};

/// A bind group layout entry for one stage set, numbered by the list it stands in.
pub fn layout(
    device: &wgpu::Device,
    label: &str,
    visibility: wgpu::ShaderStages,
    types: &[wgpu::BindingType],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0u32..)
        .zip(types)
        .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None })
        .collect();
    pipeline_cache::bind_group_layout(
        device,
        &wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries },
    )
}

/// A bind group whose bindings are numbered by the list.
pub fn group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0u32..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    tape::bind_group(device, &wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// A target as something to bind.
pub fn view(target: &super::targets::Target) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::TextureView(&target.view)
}

/// A compute pipeline of shader `name` whose entry point is `entry`.
pub fn compute(
    device: &wgpu::Device,
    name: &str,
    entry: &str,
    layouts: &[&wgpu::BindGroupLayout],
) -> wgpu::ComputePipeline {
    let layouts: Vec<_> = layouts.iter().map(|&l| Some(l)).collect();
    compute_with(device, name, entry, &layouts)
}

/// As [`compute`], where some groups are left out.
pub fn compute_with(
    device: &wgpu::Device,
    name: &str,
    entry: &str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::ComputePipeline {
    let module = crate::gpu::shaders::module(device, name);
    let layout = tape::pipeline_layout(device, name, layouts);
    let descriptor = wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(entry),
        compilation_options: crate::gpu::bind::compilation(),
        cache: None,
    };
    tape::compute_pipeline(device, &descriptor)
}

/// Dispatches enough 8×8 workgroups for `size`.
pub fn dispatch(pass: &mut crate::gpu::timing::Pass<'_>, size: [u32; 2]) {
    pass.dispatch_workgroups(size[0].div_ceil(8), size[1].div_ceil(8), 1);
}

/// A pipeline that draws the fragments of shader `name` over a whole target of `format`; it needs
/// `lib/screen.wgsl`.
pub fn screen(
    device: &wgpu::Device,
    name: &str,
    format: wgpu::TextureFormat,
    layout: &wgpu::BindGroupLayout,
) -> wgpu::RenderPipeline {
    let module = crate::gpu::shaders::module(device, name);
    let layout = tape::pipeline_layout(device, name, &[Some(layout)]);
    pipeline_cache::render_pipeline(
        device,
        &wgpu::RenderPipelineDescriptor {
            label: Some(name),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        },
    )
}

/// How [`mesh`] draws.
pub struct Drawn<'a> {
    /// Where vertices come from.
    pub buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    pub targets: &'a [Option<wgpu::ColorTargetState>],
    pub cull: Option<wgpu::Face>,
    /// Else only what is nearer than the depth that is there is drawn, and leaves it.
    pub writes_depth: bool,
    /// Of the fragment stage.
    pub constants: &'a [(&'a str, f64)],
}

/// A pipeline that draws a scene's meshes with reversed depth.
pub fn mesh(
    device: &wgpu::Device,
    label: &str,
    (layout, module): (&wgpu::PipelineLayout, &wgpu::ShaderModule),
    drawn: Drawn<'_>,
) -> wgpu::RenderPipeline {
    pipeline_cache::render_pipeline(
        device,
        &wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: drawn.buffers,
            },
            primitive: wgpu::PrimitiveState { cull_mode: drawn.cull, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(drawn.writes_depth),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: drawn.constants,
                    ..Default::default()
                },
                targets: drawn.targets,
            }),
            multiview_mask: None,
            cache: None,
        },
    )
}

/// A uniform buffer of `size` bytes that the queue writes.
pub fn uniform(device: &wgpu::Device, label: &str, size: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
