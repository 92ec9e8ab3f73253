//! The cheapest method: the picture's mean light times one constant, everywhere the same.
//!
//! What it cannot do: see [`crate::gi`].

use super::exposure::{self, ExposurePass, output_entry, storage_entry};
use super::inputs::{InputGroup, check};
use super::view_cache::ViewCache;
use super::{GiError, Inputs};
use crate::gpu::shaders;
use crate::gpu::timing::Recorder;

/// Light that direct lighting misses (E/π, linear Rec.709) as a multiple of the exposure `s`. The one place of this
/// number: the method uses it everywhere, reconstruction where no cell can answer.
/// Fitted to 400 views of the 50 training rooms: grey, least absolute error of albedo · (direct + light) under Filmic's
/// logarithmic encoding (`python -m bouncelight_training.baseline`, "grey least absolute of the picture").
pub const AMBIENT: [f32; 3] = [0.3985, 0.3985, 0.3985];

/// The constant as WGSL.
pub fn prelude() -> String {
    let [r, g, b] = AMBIENT;
    format!("const AMBIENT = vec3f({r:?}, {g:?}, {b:?});\n")
}

/// The method: exposure and one write a pixel.
pub struct AmbientGi {
    device: wgpu::Device,
    inputs: InputGroup,
    exposure: ExposurePass,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    outputs: ViewCache<1>,
    size: [u32; 2],
}

impl AmbientGi {
    /// Makes pipelines and buffers of a few kilobytes; works for every picture size.
    pub fn new(device: &wgpu::Device) -> Self {
        let inputs = InputGroup::new(device);
        let exposure = ExposurePass::new(device, &inputs);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("gi.ambient"),
            entries: &[storage_entry(0, true), output_entry(1)],
        });
        let module = shaders::module_with(device, "gi.ambient", &prelude());
        let pipeline = exposure::pipeline(device, "gi.ambient", &module, "ambient", &inputs, &layout);
        Self { device: device.clone(), inputs, exposure, pipeline, layout, outputs: ViewCache::new(), size: [0; 2] }
    }

    /// Records `gi.exposure` and `gi.ambient`: `output` (`Rgba16Float`, storage, full size) becomes E/π; 0 on the
    /// background.
    ///
    /// # Errors
    /// [`GiError`] when inputs or output do not fit; nothing is recorded then.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        check_output(output, inputs.size)?;
        if inputs.size != self.size {
            self.forget();
            self.size = inputs.size;
        }
        let bound = self.inputs.bind(queue, inputs)?;
        let group = self.outputs.get([output], || {
            Ok::<_, GiError>(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("gi.ambient"),
                layout: &self.layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: self.exposure.buffer().as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(output) },
                ],
            }))
        })?;
        self.exposure.record(recorder, &bound);
        recorder.compute("gi.ambient", |pass| {
            bound.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(bound.size[0].div_ceil(8), bound.size[1].div_ceil(8), 1);
        });
        Ok(())
    }

    /// The exposure of the last recording, see [`exposure::read`].
    pub fn exposure_buffer(&self) -> &wgpu::Buffer {
        self.exposure.buffer()
    }

    /// Lets go of the texture views it remembers; call it when targets are rebuilt.
    pub fn forget(&mut self) {
        self.inputs.forget();
        self.outputs.clear();
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.exposure.bytes()
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        self.inputs.made() + self.outputs.made()
    }
}

/// The output of every method.
pub(crate) fn check_output(output: &wgpu::TextureView, size: [u32; 2]) -> Result<(), GiError> {
    check("output", output, size, wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::STORAGE_BINDING)
}
