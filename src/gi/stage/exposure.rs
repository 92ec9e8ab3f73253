//! One exposure for the picture: the scalar that makes the network's inputs free of units and its
//! answer linear in the light. A two-level reduction of fixed order over the low-resolution cells.

use super::inputs::{BoundInputs, InputGroup};
use crate::gi::interface::GiError;
use crate::gpu::timing::Recorder;
use crate::gpu::{bind, pipeline_cache, readback, shaders, tape};

/// Most workgroups of the first level; `MAX_GROUPS` in the shader.
const MAX_GROUPS: u32 = 256;

/// What the reduction finds. `Exposure` in `shaders/gi/inputs.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Exposure {
    /// Mean over all cells of the luminance of direct light (E/π) and emission, background counting
    /// as 0, plus the environment's luminance; W/(m²·sr). Exactly 0 at or below 1e-20.
    pub s: f32,
    /// Mean over hit cells of ln(view distance in metres); 0 when nothing is hit.
    pub ln_m: f32,
    /// Share of cells whose sample hit something.
    pub hit_fraction: f32,
    /// Cells whose sample had NaN or infinity in depth, normal, direct light or emission (all read
    /// as 0).
    pub nonfinite: u32,
    /// Mean over all cells of the radiance that surfaces send on at once, albedo · direct light +
    /// emission, background counting as 0; W/(m²·sr).
    pub outgoing: [f32; 3],
}

/// The reduction.
pub struct ExposurePass {
    sum: wgpu::ComputePipeline,
    finish: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
    partials: wgpu::Buffer,
    result: wgpu::Buffer,
}

impl ExposurePass {
    /// Makes pipelines and the two small buffers. `inputs` gives the layout of group 0.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup) -> Self {
        let buffer = |label, size, extra| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | extra,
                mapped_at_creation: false,
            })
        };
        let partials = buffer("gi.exposure.partials", u64::from(MAX_GROUPS) * 32, wgpu::BufferUsages::COPY_SRC);
        let result = buffer("gi.exposure", size_of::<Exposure>() as u64, wgpu::BufferUsages::COPY_SRC);
        let layout = pipeline_cache::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor {
                label: Some("gi.exposure"),
                entries: &[storage_entry(0, false), storage_entry(1, false)],
            },
        );
        let group = tape::bind_group(
            device,
            &wgpu::BindGroupDescriptor {
                label: Some("gi.exposure"),
                layout: &layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: partials.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: result.as_entire_binding() },
                ],
            },
        );
        let module = shaders::module(device, "gi.exposure");
        let pipeline = |entry| pipeline(device, "gi.exposure", &module, entry, inputs, &layout);
        Self { sum: pipeline("sum_cells"), finish: pipeline("sum_groups"), group, partials, result }
    }

    /// Records both levels as pass `gi.exposure`.
    pub fn record(&self, recorder: &mut Recorder<'_>, inputs: &BoundInputs) {
        let [w, h] = inputs.cells;
        let groups = (u64::from(w) * u64::from(h)).div_ceil(256).min(u64::from(MAX_GROUPS)) as u32;
        recorder.compute("gi.exposure", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &self.group, &[]);
            pass.set_pipeline(&self.sum);
            pass.dispatch_workgroups(groups, 1, 1);
            pass.set_pipeline(&self.finish);
            pass.dispatch_workgroups(1, 1, 1);
        });
    }

    /// The result, one [`Exposure`] (usages STORAGE and COPY_SRC).
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.result
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.partials.size() + self.result.size()
    }
}

/// Reads an exposure back. Submits and waits: for tools and tests.
///
/// # Errors
/// [`GiError::Readback`].
pub fn read(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Result<Exposure, GiError> {
    let bytes = readback::buffer(device, queue, buffer, 0, size_of::<Exposure>() as u64)?;
    Ok(bytemuck::pod_read_unaligned(&bytes))
}

/// A storage buffer of a compute stage.
pub(crate) fn storage_entry(binding: u32, read_only: bool) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        count: None,
    }
}

/// The full-resolution output of a compute stage.
pub(crate) fn output_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: wgpu::TextureFormat::Rgba16Float,
            view_dimension: wgpu::TextureViewDimension::D2,
        },
        count: None,
    }
}

/// A pipeline over group 0 of `inputs` and a group 1 of its own.
pub(crate) fn pipeline(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    entry: &str,
    inputs: &InputGroup,
    own: &wgpu::BindGroupLayout,
) -> wgpu::ComputePipeline {
    bind::pipeline(device, label, module, entry, &[inputs.layout(), own])
}
