//! What a driver gets wrong, found by trying it. For `bouncelight doctor`: the passes themselves are
//! written so that neither fault harms a picture.

use super::readback::{self, ReadbackError};
use super::{Gpu, bind, shaders};
use std::time::{Duration, Instant};
use wgpu::util::DeviceExt;

/// A fault of a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriverFault {
    /// It compiles a shader anew for each value of a uniform that decides a branch, and keeps them
    /// all: time and memory of every frame (Mesa's CPU driver before 23).
    Recompiles,
    /// Its anisotropic filter gives no number where texture coordinates stand still (Mesa's CPU
    /// driver from 23 on).
    StillCoordinates,
}

impl DriverFault {
    /// One word, for records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recompiles => "recompiles",
            Self::StillCoordinates => "still_coordinates",
        }
    }

    /// What it is and what to do about it, a sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Recompiles => {
                "this driver compiles shaders anew for each value of a uniform that decides a branch: frames are slow; \
                 a newer driver does not (Mesa 25; on Debian 12: apt-get install -t bookworm-backports \
                 mesa-vulkan-drivers libgl1-mesa-dri)"
            }
            Self::StillCoordinates => {
                "this driver's anisotropic filter gives no number where texture coordinates stand still; \
                 our shaders avoid it"
            }
        }
    }
}

/// The faults of `gpu`'s driver. Submits and waits, a quarter of a second at most.
///
/// # Errors
/// [`ReadbackError`] when the device is lost meanwhile.
pub fn driver_faults(gpu: &Gpu) -> Result<Vec<DriverFault>, ReadbackError> {
    let mut faults = Vec::new();
    if recompiles(gpu)? {
        faults.push(DriverFault::Recompiles);
    }
    if !still_coordinates_are_finite(gpu)? {
        faults.push(DriverFault::StillCoordinates);
    }
    Ok(faults)
}

/// Dispatches of each kind that are timed.
const DISPATCHES: u32 = 12;
/// A dispatch of next to nothing takes a fraction of this, compiling the smallest shader as long.
const COMPILED: Duration = Duration::from_micros(1500);

/// Times dispatches of a shader that a uniform leads, each time to another value, beside those of one
/// that does the same unasked.
fn recompiles(gpu: &Gpu) -> Result<bool, ReadbackError> {
    let device = &gpu.device;
    let module = shaders::module(device, "probe.branch");
    let types = [wgpu::BufferBindingType::Uniform, wgpu::BufferBindingType::Storage { read_only: false }]
        .map(|ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None });
    let mut binder = bind::Binder::new(device, "probe.branch", &types);
    let buffer = |usage| {
        let descriptor = wgpu::util::BufferInitDescriptor { label: Some("probe.branch"), contents: &[0; 16], usage };
        device.create_buffer_init(&descriptor)
    };
    let step = buffer(wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
    let state = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let group = binder.group([(&step).into(), (&state).into()]);
    let typical = |entry: &str| -> Result<Duration, ReadbackError> {
        let pipeline = bind::pipeline(device, "probe.branch", &module, entry, &[binder.layout()]);
        let mut times = Vec::new();
        for number in 0..DISPATCHES {
            gpu.queue.write_buffer(&step, 0, &(number + 1).to_le_bytes());
            let mut encoder = device.create_command_encoder(&Default::default());
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
            drop(pass);
            let begun = Instant::now();
            gpu.queue.submit([encoder.finish()]);
            readback::buffer(device, &gpu.queue, &state, 0, 4)?;
            times.push(begun.elapsed());
        }
        Ok(median(times))
    };
    let (unasked, asked) = (typical("straight")?, typical("branch")?);
    tracing::debug!("a dispatch takes {unasked:?}, where a uniform leads it {asked:?}");
    Ok(asked > COMPILED.max(3 * unasked))
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

fn still_coordinates_are_finite(gpu: &Gpu) -> Result<bool, ReadbackError> {
    let device = &gpu.device;
    let size = |n| wgpu::Extent3d { width: n, height: n, depth_or_array_layers: 1 };
    let texture = |label, n, format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: size(n),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    };
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let white = texture("probe.white", 4, wgpu::TextureFormat::Rgba8Unorm, usage);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16), rows_per_image: None };
    gpu.queue.write_texture(white.as_image_copy(), &[255; 64], layout, size(4));
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let target = texture("probe.still", 2, wgpu::TextureFormat::Rgba32Float, usage);
    let linear = wgpu::FilterMode::Linear;
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("probe.still"),
        mag_filter: linear,
        min_filter: linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        anisotropy_clamp: 16,
        ..Default::default()
    });
    let module = shaders::module(device, "probe.still");
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("probe.still"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("still"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("probe.still"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&white.create_view(&Default::default())),
            },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let view = target.create_view(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("probe.still"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    let bytes = readback::texture(device, &gpu.queue, &target)?;
    let values: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
    Ok(values.iter().all(|v| v.is_finite()))
}
