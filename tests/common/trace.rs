//! The path tracer's kernel without film or schedule: one dispatch after the other, sums read back.

#![allow(dead_code, reason = "each test binary uses a part")]

use bouncelight::gpu::{Gpu, readback, shaders};
use bouncelight::scene::Scene;
use bouncelight::wgpu;
use bouncelight_lab::reference::job::{self, Job};
use bouncelight_lab::reference::scene::ReferenceScene;

/// Sums of a point: diffuse direct, indirect, glossy direct, indirect, emitted, diffuse colour,
/// glossy colour, analytic; the fourth components as `reference::film` tells.
pub type Point = [[f64; 4]; 8];

/// A scene and the pipeline of `reference.path`.
pub struct Tracer {
    pipeline: wgpu::ComputePipeline,
    scene: ReferenceScene,
}

impl Tracer {
    pub fn new(gpu: &Gpu, scene: &Scene) -> Self {
        let layouts = [ReferenceScene::layout(&gpu.device), job::film_layout(&gpu.device)];
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts.each_ref().map(Some),
            immediate_size: 0,
        });
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("reference.path"),
            layout: Some(&layout),
            module: &shaders::module(&gpu.device, "reference.path"),
            entry_point: Some("path"),
            compilation_options: Default::default(),
            cache: None,
        });
        let scene = ReferenceScene::new(&gpu.device, &gpu.queue, scene).expect("the test's scene packs");
        Self { pipeline, scene }
    }

    /// Means over the samples of each pixel of `job`'s picture.
    pub fn trace(&self, gpu: &Gpu, job: Job) -> Vec<Point> {
        let count = job.size[0] * job.size[1];
        let job = Job { point_count: count, ..job };
        let make = |size: u64, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
            gpu.device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let job_buffer = make(size_of::<Job>() as u64, wgpu::BufferUsages::STORAGE);
        gpu.queue.write_buffer(&job_buffer, 0, bytemuck::bytes_of(&job));
        let points = make(16, wgpu::BufferUsages::STORAGE);
        let film = make(256 * u64::from(count), wgpu::BufferUsages::STORAGE);
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &job::film_layout(&gpu.device),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: job_buffer.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: points.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 2, resource: film.as_entire_binding() },
            ],
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, self.scene.group(), &[]);
            pass.set_bind_group(1, &group, &[]);
            pass.dispatch_workgroups(count.div_ceil(job::WORKGROUP), 1, 1);
        }
        gpu.queue.submit([encoder.finish()]);
        let bytes = readback::buffer(&gpu.device, &gpu.queue, &film, 0, film.size()).expect("reading back works");
        let floats: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        let scale = 1.0 / f64::from(job.sample_count);
        let at = |p: &[f32], i: usize, c: usize| (f64::from(p[4 * i + c]) + f64::from(p[4 * (i + 8) + c])) * scale;
        floats.chunks_exact(64).map(|p| std::array::from_fn(|i| std::array::from_fn(|c| at(p, i, c)))).collect()
    }
}

/// Mean over points and colours of each of the eight slots.
pub fn means(points: &[Point]) -> [f64; 8] {
    std::array::from_fn(|i| points.iter().map(|p| p[i][0] + p[i][1] + p[i][2]).sum::<f64>() / (3 * points.len()) as f64)
}
