//! Layers of the frame just drawn: into floats that are read back, for [`capture`](super::capture),
//! or into a texture each, for temporal anti-aliasing.

use super::targets::{Target, Targets};
use super::{RenderError, Renderer, pipelines};
use crate::gpu::{Gpu, readback, timing::Recorder};

/// The shader's number for the picture itself.
pub(super) const PICTURE: u32 = 0;

/// What either way reads.
fn read_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let mut types = vec![pipelines::UNIFORM];
    types.extend([pipelines::LOAD; 11]);
    pipelines::layout(device, "render.layers", wgpu::ShaderStages::COMPUTE, &types)
}

/// The frame's textures with `picture` for the picture.
fn read(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    frame: &wgpu::Buffer,
    t: &Targets,
    picture: &Target,
) -> wgpu::BindGroup {
    let views = [
        &t.depth,
        &t.normal,
        &t.albedo,
        &t.specular,
        &t.emissive,
        &t.motion,
        &t.direct_diffuse,
        &t.direct_specular,
        &t.indirect,
        &t.indirect_specular,
        picture,
    ];
    let mut resources = vec![frame.as_entire_binding()];
    resources.extend(views.map(pipelines::view));
    pipelines::group(device, "render.layers", layout, &resources)
}

/// Turns G-buffer texels into textures of layers.
pub(super) struct LayerWriter {
    pipeline: wgpu::ComputePipeline,
    read_layout: wgpu::BindGroupLayout,
    options_layout: wgpu::BindGroupLayout,
    write_layout: wgpu::BindGroupLayout,
}

/// What [`LayerWriter`] binds for one layer.
pub(super) struct LayerGroups([wgpu::BindGroup; 3]);

impl LayerWriter {
    pub fn new(device: &wgpu::Device) -> Self {
        let stage = wgpu::ShaderStages::COMPUTE;
        let read_layout = read_layout(device);
        let options_layout = pipelines::layout(device, "render.layers", stage, &[pipelines::READ]);
        let write_layout = pipelines::layout(device, "render.layers", stage, &[pipelines::STORE_HALF]);
        let layouts = [&read_layout, &options_layout, &write_layout];
        let pipeline = pipelines::compute(device, "render.layers", "layer_texture", &layouts);
        Self { pipeline, read_layout, options_layout, write_layout }
    }

    /// Layer number `layer` goes into `texture`, half floats of `targets`' size.
    pub fn bind(
        &self,
        device: &wgpu::Device,
        frame: &wgpu::Buffer,
        targets: &Targets,
        (layer, texture): (u32, &Target),
    ) -> LayerGroups {
        use wgpu::util::DeviceExt;
        let options = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("render.layers"),
            contents: bytemuck::cast_slice(&[layer, 0, targets.size[1], 0]),
            usage: wgpu::BufferUsages::STORAGE,
        });
        LayerGroups([
            read(device, &self.read_layout, frame, targets, &targets.hdr),
            pipelines::group(device, "render.layers", &self.options_layout, &[options.as_entire_binding()]),
            pipelines::group(device, "render.layers", &self.write_layout, &[pipelines::view(texture)]),
        ])
    }

    pub fn record(&self, recorder: &mut Recorder<'_>, groups: &LayerGroups, size: [u32; 2]) {
        recorder.compute("layers", |pass| {
            pass.set_pipeline(&self.pipeline);
            for (i, group) in (0..).zip(&groups.0) {
                pass.set_bind_group(i, group, &[]);
            }
            pipelines::dispatch(pass, size);
        });
    }
}

/// Largest band of rows that is decoded at once, bytes.
const BAND: u64 = 64 << 20;

/// Turns G-buffer texels into floats on the GPU and reads them back in bands of rows.
pub(super) struct Decoder {
    pipeline: wgpu::ComputePipeline,
    picture: wgpu::BindGroup,
    /// Layers that temporal anti-aliasing averages, by number, each in the picture's place.
    means: Vec<(u32, wgpu::BindGroup)>,
    output: wgpu::BindGroup,
    options: wgpu::Buffer,
    buffer: wgpu::Buffer,
    rows: u32,
}

impl Decoder {
    pub fn new(device: &wgpu::Device, renderer: &Renderer) -> Self {
        use pipelines::*;
        let t = renderer.targets();
        let stage = wgpu::ShaderStages::COMPUTE;
        let read_layout = read_layout(device);
        let output_layout = layout(device, "render.layers", stage, &[READ, READ_WRITE]);
        let pipeline = compute(device, "render.layers", "layers", &[&read_layout, &output_layout]);
        let reads = |picture| read(device, &read_layout, renderer.frame(), t, picture);
        let picture = reads(&t.hdr);
        let means = renderer.averaged().map(|(layer, mean)| (layer, reads(mean))).collect();
        let row = 16 * u64::from(t.size[0]);
        let rows = (BAND / row).clamp(1, u64::from(t.size[1])) as u32;
        let make = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("render.layers"),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let options = make(16, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST);
        let buffer = make(row * u64::from(rows), wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let resources = [options.as_entire_binding(), buffer.as_entire_binding()];
        let output = group(device, "render.layers", &output_layout, &resources);
        Self { pipeline, picture, means, output, options, buffer, rows }
    }

    /// Adds layer number `layer` of the frame just drawn to `sum`, which has `channels` values a
    /// pixel.
    pub fn add(
        &self,
        gpu: &Gpu,
        size: [u32; 2],
        layer: u32,
        sum: &mut [f32],
        channels: usize,
    ) -> Result<(), RenderError> {
        let mean = self.means.iter().find(|(number, _)| *number == layer).map(|(_, group)| (group, PICTURE));
        let (picture, layer) = mean.unwrap_or((&self.picture, layer));
        let band = self.rows as usize * size[0] as usize * channels;
        for (i, sum) in sum.chunks_mut(band).enumerate() {
            let first = i as u32 * self.rows;
            let rows = self.rows.min(size[1] - first);
            gpu.queue.write_buffer(&self.options, 0, bytemuck::cast_slice(&[layer, first, rows, 0]));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            Recorder::new(&mut encoder).compute("layers", |pass| {
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, picture, &[]);
                pass.set_bind_group(1, &self.output, &[]);
                pipelines::dispatch(pass, [size[0], rows]);
            });
            gpu.queue.submit([encoder.finish()]);
            let bytes = u64::from(rows) * u64::from(size[0]) * 16;
            let read = readback::buffer(&gpu.device, &gpu.queue, &self.buffer, 0, bytes)?;
            for (sum, value) in sum.chunks_exact_mut(channels).zip(read.chunks_exact(16)) {
                for (s, v) in sum.iter_mut().zip(value.chunks_exact(4)) {
                    *s += f32::from_ne_bytes([v[0], v[1], v[2], v[3]]);
                }
            }
        }
        Ok(())
    }
}
