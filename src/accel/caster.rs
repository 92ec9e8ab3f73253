//! Lists of rays through the traversal, for tests and for measuring its speed: shader `accel.rays`.

use bytemuck::{Pod, Zeroable};
use wgpu::util::DeviceExt;

use super::AccelGpu;
use crate::gpu::{pipeline_cache, readback, shaders, tape};

/// A ray as `rays.wgsl` reads it.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RayGpu {
    /// Start, world space, metres.
    pub origin: [f32; 3],
    /// Hits farther than this many lengths of `direction` do not count.
    pub t_max: f32,
    /// Direction of any length.
    pub direction: [f32; 3],
    /// 1 stops at the first hit found, 0 finds the nearest.
    pub any: u32,
}

/// A hit as `traverse.wgsl` returns it.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct HitGpu {
    /// Distance in lengths of the ray's direction; `t_max` where nothing was hit.
    pub t: f32,
    /// Index of the triangle, `u32::MAX` where nothing was hit.
    pub triangle: u32,
    /// Barycentric weights of the second and third corner.
    pub uv: [f32; 2],
    /// Block of the instance, `u32::MAX` outside of instances.
    pub instance: u32,
    /// Block of the leaf; the highest bit marks its second triangle.
    pub leaf: u32,
}

/// Rays of a workgroup.
const GROUP: u32 = 64;

/// The pipeline.
#[derive(Debug)]
pub struct RayCaster {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// Rays on the GPU, with room for their hits.
#[derive(Debug)]
pub struct RayBatch {
    hits: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    count: u32,
}

impl RayCaster {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        let storage = |binding, read_only| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only },
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let layout = pipeline_cache::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor {
                label: Some("accel.rays"),
                entries: &[storage(0, true), AccelGpu::layout_entry(), storage(3, false)],
            },
        );
        let pipeline_layout = tape::pipeline_layout(device, "accel.rays", &[Some(&layout)]);
        let pipeline = tape::compute_pipeline(
            device,
            &wgpu::ComputePipelineDescriptor {
                label: Some("accel.rays"),
                layout: Some(&pipeline_layout),
                module: &shaders::module(device, "accel.rays"),
                entry_point: Some("main"),
                compilation_options: Default::default(),
                cache: None,
            },
        );
        Self { pipeline, layout }
    }

    /// Uploads `rays` (one at least, and no more than fit a binding) to be traced through `accel`.
    pub fn batch(&self, device: &wgpu::Device, accel: &AccelGpu, rays: &[RayGpu]) -> RayBatch {
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("rays"),
            contents: bytemuck::cast_slice(rays),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let hits = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("hits"),
            size: std::mem::size_of::<HitGpu>() as u64 * rays.len() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("accel.rays"),
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                accel.entry(),
                wgpu::BindGroupEntry { binding: 3, resource: hits.as_entire_binding() },
            ],
        });
        RayBatch { hits, bind_group, count: rays.len() as u32 }
    }

    /// Records the tracing of `batch`.
    pub fn record(&self, encoder: &mut wgpu::CommandEncoder, batch: &RayBatch) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &batch.bind_group, &[]);
        pass.dispatch_workgroups(batch.count.div_ceil(GROUP), 1, 1);
    }

    /// Traces `rays` and waits for the hits.
    ///
    /// # Errors
    /// When the hits cannot be read back.
    pub fn trace(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        accel: &AccelGpu,
        rays: &[RayGpu],
    ) -> Result<Vec<HitGpu>, readback::ReadbackError> {
        let batch = self.batch(device, accel, rays);
        let mut encoder = device.create_command_encoder(&Default::default());
        self.record(&mut encoder, &batch);
        queue.submit([encoder.finish()]);
        let bytes = readback::buffer(device, queue, &batch.hits, 0, batch.hits.size())?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }
}
