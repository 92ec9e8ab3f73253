//! G-buffer to network input: one thread a cell writes the features that the weights name.

use super::features::FeatureSet;
use crate::gi::interface::{GiError, Inputs};
use crate::gi::stage::exposure::{ExposurePass, pipeline, storage_entry};
use crate::gi::stage::inputs::{BoundInputs, InputGroup, cells_of, check, texture_entry};
use crate::gpu::timing::Recorder;
use crate::gpu::{readback, shaders, shared, tape};

/// The pack stage, bound to one input buffer.
pub struct PackPass {
    pipeline: wgpu::ComputePipeline,
    group: wgpu::BindGroup,
}

impl PackPass {
    /// Compiles the shader for `features` and binds `target` (NHWC f32, `features.padded()`
    /// channels a cell) and `guess`, what method `gather` answers (`Rgba16Float`, of the picture's
    /// size; any texture if `features` has no `guess`).
    pub fn new(
        device: &wgpu::Device,
        inputs: &InputGroup,
        exposure: &ExposurePass,
        features: &FeatureSet,
        target: wgpu::BindingResource<'_>,
        guess: &wgpu::TextureView,
    ) -> Self {
        let layout = shared::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor {
                label: Some("gi.pack"),
                entries: &[storage_entry(0, true), storage_entry(1, false), texture_entry(2)],
            },
        );
        let module = shaders::module_with(device, "gi.pack", &features.prelude());
        let group = tape::bind_group(
            device,
            &wgpu::BindGroupDescriptor {
                label: Some("gi.pack"),
                layout: &layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: exposure.buffer().as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: target },
                    wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(guess) },
                ],
            },
        );
        Self { pipeline: pipeline(device, "gi.pack", &module, "pack", inputs, &layout), group }
    }

    /// Records pass `gi.pack`; the exposure must have been recorded before.
    pub fn record(&self, recorder: &mut Recorder<'_>, inputs: &BoundInputs) {
        recorder.compute("gi.pack", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &self.group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(inputs.cells[0].div_ceil(8), inputs.cells[1].div_ceil(8), 1);
        });
    }
}

/// What a network is given for one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkInputs {
    /// Width and height in cells.
    pub cells: [u32; 2],
    /// Names of the features in channel order.
    pub names: Vec<&'static str>,
    /// Channels, without padding.
    pub channels: u32,
    /// CHW: `channels × cells[1] × cells[0]` values.
    pub features: Vec<f32>,
    /// The exposure that radiances were divided by and that the answer is to be multiplied by.
    pub exposure: crate::gi::stage::exposure::Exposure,
}

/// Computes and reads back the features of one picture, without any network. `guess` is what method
/// `gather` made of the same inputs, not read if `features` has no `guess`. Makes its own buffers,
/// submits and waits: for the `dataset` command and tests, not for frames.
///
/// # Errors
/// [`GiError`] for inputs that do not fit and for features larger than the device binds.
pub fn read_features(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    features: &FeatureSet,
    inputs: &Inputs<'_>,
    guess: &wgpu::TextureView,
) -> Result<NetworkInputs, GiError> {
    let size = inputs.size;
    if features.offset("guess").is_some() {
        check("guess", guess, size, wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::TEXTURE_BINDING)?;
    }
    let cells = cells_of(size);
    let bytes = feature_bytes(device, features, size)?;
    let mut group = InputGroup::new(device);
    let bound = group.bind(queue, inputs)?;
    let exposure = ExposurePass::new(device, &group);
    let target = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("gi.features"),
        size: bytes,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let pack = PackPass::new(device, &group, &exposure, features, target.as_entire_binding(), guess);
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(&mut encoder);
    exposure.record(&mut recorder, &bound);
    pack.record(&mut recorder, &bound);
    queue.submit([encoder.finish()]);
    let raw = readback::buffer(device, queue, &target, 0, bytes)?;
    let rows: Vec<f32> = bytemuck::pod_collect_to_vec(&raw);
    let padded = features.padded() as usize;
    let channels = features.channels();
    let chw = (0..channels as usize).flat_map(|c| rows.iter().skip(c).step_by(padded).copied()).collect();
    Ok(NetworkInputs {
        cells,
        names: features.names().collect(),
        channels,
        features: chw,
        exposure: crate::gi::stage::exposure::read(device, queue, exposure.buffer())?,
    })
}

/// Size of the packed features, bytes.
///
/// # Errors
/// [`GiError::Size`] when the device cannot bind as much (WebGPU's default is 128 MiB) or the
/// picture is empty.
pub(crate) fn feature_bytes(device: &wgpu::Device, features: &FeatureSet, size: [u32; 2]) -> Result<u64, GiError> {
    if size.contains(&0) {
        return Err(GiError::Size { size, reason: "it is empty".into() });
    }
    let [w, h] = cells_of(size).map(u64::from);
    let bytes = w * h * u64::from(features.padded()) * 4;
    let limit = device.limits().max_storage_buffer_binding_size;
    if bytes > limit {
        let reason = format!("its network input takes {bytes} bytes, the device binds {limit}");
        return Err(GiError::Size { size, reason });
    }
    Ok(bytes)
}
