//! Runs the path tracer's kernel at given points of a picture and keeps both halves of what comes
//! back. It has a host of its own, a page long, because it wants what no picture needs: each half
//! by itself, and the pixel filter around chosen points.

use crate::stats::Mean;
use bouncelight::gpu::{Gpu, readback, shaders};
use bouncelight::scene::{Camera, Scene};
use bouncelight::wgpu;
use bouncelight_lab::reference::film::{POINT_BYTES, Sums as Raw};
use bouncelight_lab::reference::{Job, ReferenceScene, job};
use std::sync::{Mutex, OnceLock};

/// The device with the compiled kernel, shared by all tests, since compiling takes seconds.
pub struct Lab {
    pub gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    busy: Mutex<()>,
}

/// The lab, or `None` after a skip, which each test says for itself.
pub fn lab() -> Option<&'static Lab> {
    static LAB: OnceLock<Lab> = OnceLock::new();
    match LAB.get() {
        None => crate::common::gpu().map(|gpu| LAB.get_or_init(|| Lab::new(gpu))),
        lab => lab,
    }
}

impl Lab {
    fn new(gpu: Gpu) -> Self {
        let device = &gpu.device;
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&ReferenceScene::layout(device)), Some(&job::film_layout(device))],
            immediate_size: 0,
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("reference.path"),
            source: wgpu::ShaderSource::Wgsl(shaders::source("reference.path", "").into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("reference.path"),
            layout: Some(&layout),
            module: &module,
            entry_point: Some("path"),
            compilation_options: Default::default(),
            cache: None,
        });
        Self { gpu, pipeline, busy: Mutex::new(()) }
    }

    /// Traces `points` (picture coordinates) of a picture of `size` pixels.
    pub fn trace(
        &self,
        scene: &Scene,
        camera: &Camera,
        size: [u32; 2],
        points: &[[f32; 2]],
        options: &Options,
    ) -> Traced {
        // One test at a time has the memory; the driver uses all cores anyway.
        let _busy = self.busy.lock().unwrap_or_else(|e| e.into_inner());
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let packed = ReferenceScene::new(device, queue, scene).unwrap_or_else(|e| panic!("{e}"));
        let buffer = |size: u64, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
            device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let job_buffer = buffer(size_of::<Job>() as u64, wgpu::BufferUsages::STORAGE);
        let list = buffer(8 * points.len() as u64, wgpu::BufferUsages::STORAGE);
        queue.write_buffer(&list, 0, bytemuck::cast_slice(points));
        let job = options.job(camera, size);
        let bytes = POINT_BYTES * points.len() as u64;
        let halves = [0, 1].map(|half| {
            let film = buffer(bytes, wgpu::BufferUsages::STORAGE);
            let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &job::film_layout(device),
                entries: &[entry(0, &job_buffer), entry(1, &list), entry(2, &film)],
            });
            // Dispatches of about a million samples, so that no watchdog minds.
            let step = ((1 << 20) / points.len() as u32).clamp(1, options.samples.min(16));
            for first_sample in (0..options.samples).step_by(step as usize) {
                let job = Job {
                    half,
                    first_sample,
                    sample_count: step.min(options.samples - first_sample),
                    point_count: points.len() as u32,
                    ..job
                };
                queue.write_buffer(&job_buffer, 0, bytemuck::bytes_of(&job));
                let mut encoder = device.create_command_encoder(&Default::default());
                {
                    let mut pass = encoder.begin_compute_pass(&Default::default());
                    pass.set_pipeline(&self.pipeline);
                    pass.set_bind_group(0, packed.group(), &[]);
                    pass.set_bind_group(1, &group, &[]);
                    pass.dispatch_workgroups((points.len() as u32).div_ceil(job::WORKGROUP), 1, 1);
                }
                queue.submit([encoder.finish()]);
                device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
            }
            let raw = readback::buffer(device, queue, &film, 0, bytes).expect("the film is read");
            raw.chunks_exact(POINT_BYTES as usize).map(|p| Sums::new(p, options.samples)).collect::<Vec<_>>()
        });
        Traced { halves }
    }
}

fn entry(binding: u32, buffer: &wgpu::Buffer) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }
}

/// Which ways of finding light count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Strategy {
    /// Both, weighted.
    #[default]
    Both,
    /// Sampling lights alone.
    LightsOnly,
    /// Rays that happen to hit light alone.
    HitsOnly,
    /// Both in full, which is wrong.
    CountTwice,
}

/// How to trace.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Samples a point in each half.
    pub samples: u32,
    pub seed: u32,
    pub strategy: Strategy,
    /// Pixel filter's width; 0 goes through the points.
    pub filter: f32,
    /// Most bounces; none for no limit.
    pub bounces: Option<u32>,
    /// Cycles' limits: 12 bounces, 4 diffuse, 4 glossy, clamp 10.
    pub like_cycles: bool,
    /// Purely diffuse surfaces of their base colour.
    pub lambert: bool,
    /// More mode flags.
    pub flags: u32,
    /// The analytic lights alone, as the rasteriser has them.
    pub analytic_only: bool,
}

/// Mean of the samples of one point in one half; radiances have their colours multiplied in.
#[derive(Debug, Clone, Copy)]
pub struct Sums(Raw);

impl Options {
    fn job(&self, camera: &Camera, size: [u32; 2]) -> Job {
        let strategy = match self.strategy {
            Strategy::Both => 0,
            Strategy::LightsOnly => job::LIGHTS_ONLY,
            Strategy::HitsOnly => job::HITS_ONLY,
            Strategy::CountTwice => job::COUNT_TWICE,
        };
        let mut job = Job {
            seed: self.seed,
            filter_width: self.filter,
            flags: job::POINTS
                | self.flags
                | strategy
                | if self.lambert { job::LAMBERT } else { 0 }
                | if self.analytic_only { job::ANALYTIC_ONLY } else { 0 },
            ..Job::new(camera, size)
        };
        if self.like_cycles {
            (job.bounces, job.diffuse_bounces, job.glossy_bounces, job.clamp) = (12, 4, 4, 10.0);
            job.filter_glossy = 1.0;
        }
        job.bounces = self.bounces.unwrap_or(job.bounces);
        job
    }
}

impl std::ops::Deref for Sums {
    type Target = Raw;
    fn deref(&self) -> &Raw {
        &self.0
    }
}

impl Sums {
    fn new(bytes: &[u8], samples: u32) -> Self {
        let floats: Vec<f32> = bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
        let sums = Raw::from_floats(&floats);
        assert_eq!(sums.dropped, 0.0, "some samples were no numbers");
        let n = f64::from(samples);
        let mean = |v: [f64; 3]| v.map(|v| v / n);
        Self(Raw {
            diff_dir: mean(sums.diff_dir),
            diff_ind: mean(sums.diff_ind),
            gloss_dir: mean(sums.gloss_dir),
            gloss_ind: mean(sums.gloss_ind),
            emit: mean(sums.emit),
            diff_col: mean(sums.diff_col),
            gloss_col: mean(sums.gloss_col),
            analytic: mean(sums.analytic),
            alpha: sums.alpha / n,
            normal: mean(sums.normal),
            background: mean(sums.background),
            dropped: 0.0,
        })
    }

    /// Radiance of channel `c` that the camera sees.
    pub fn channel(&self, c: usize) -> f64 {
        let s = &self.0;
        s.diff_dir[c] + s.diff_ind[c] + s.gloss_dir[c] + s.gloss_ind[c] + s.emit[c] + s.background[c]
    }

    /// Red radiance that the camera sees.
    pub fn radiance(&self) -> f64 {
        self.channel(0)
    }
}

/// What came back.
pub struct Traced {
    halves: [Vec<Sums>; 2],
}

impl Traced {
    /// By half, then by point.
    pub fn halves(&self) -> &[Vec<Sums>; 2] {
        &self.halves
    }

    /// Mean over the points, with its standard error.
    pub fn mean(&self, f: impl Fn(&Sums) -> f64) -> Mean {
        let [a, b] = self.halves.each_ref().map(|h| h.iter().map(&f).collect::<Vec<_>>());
        Mean::of(&a, &b)
    }
}
