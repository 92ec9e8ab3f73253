//! The two compiled kernels of the path tracer and one dispatch of them.

use super::{ReferenceScene, TracerError, job};
use bouncelight::gpu::{shaders, tape};

/// The compiled kernels. Make one for a device and share it: compiling takes far longer than a
/// small picture. Clones are handles to the same kernels.
#[derive(Debug, Clone)]
pub struct Kernel {
    path: wgpu::ComputePipeline,
    first_hit: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// Which kernel a dispatch runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Entry {
    Path,
    FirstHit,
}

impl Kernel {
    /// Compiles `reference.path` and `reference.first_hit`.
    pub fn new(device: &wgpu::Device) -> Self {
        Self::from_wgsl(device, &shaders::source("reference.path", ""), &shaders::source("reference.first_hit", ""))
    }

    /// Kernels of one's own with the entry points `path` and `first_hit` and the same bindings:
    /// what tests of the host trace with, since they want to know every value.
    pub fn from_wgsl(device: &wgpu::Device, path: &str, first_hit: &str) -> Self {
        let layout = job::film_layout(device);
        let scene = ReferenceScene::layout(device);
        let pipeline_layout = tape::pipeline_layout(device, "reference", &[Some(&scene), Some(&layout)]);
        let pipeline = |label, text: &str, entry| {
            tape::compute_pipeline(
                device,
                &wgpu::ComputePipelineDescriptor {
                    label: Some(label),
                    layout: Some(&pipeline_layout),
                    module: &tape::shader_module(device, label, text.to_owned()),
                    entry_point: Some(entry),
                    compilation_options: Default::default(),
                    cache: None,
                },
            )
        };
        Self {
            path: pipeline("reference.path", path, "path"),
            first_hit: pipeline("reference.first_hit", first_hit, "first_hit"),
            layout,
        }
    }

    /// Group 1: the job, the list of points, and the film of one half.
    pub(super) fn group(
        &self,
        device: &wgpu::Device,
        job: &wgpu::Buffer,
        points: &wgpu::Buffer,
        film: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        let entry = |binding, buffer: &wgpu::Buffer| (binding, buffer.clone());
        let bound = [entry(0, job), entry(1, points), entry(2, film)];
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("reference.film"),
            layout: &self.layout,
            entries: &bound
                .iter()
                .map(|(binding, b)| wgpu::BindGroupEntry { binding: *binding, resource: b.as_entire_binding() })
                .collect::<Vec<_>>(),
        })
    }

    /// Runs one kernel on `points` points (one workgroup when there are none) and waits until it is
    /// done.
    pub(super) fn run(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        entry: Entry,
        groups: [&wgpu::BindGroup; 2],
        points: u32,
    ) -> Result<(), TracerError> {
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let (label, pipeline) = match entry {
                Entry::Path => ("reference.path", &self.path),
                Entry::FirstHit => ("reference.first_hit", &self.first_hit),
            };
            let mut pass =
                encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes: None });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, groups[0], &[]);
            pass.set_bind_group(1, groups[1], &[]);
            pass.dispatch_workgroups(points.div_ceil(job::WORKGROUP).max(1), 1, 1);
        }
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| TracerError::Wait(e.to_string()))?;
        Ok(())
    }
}
