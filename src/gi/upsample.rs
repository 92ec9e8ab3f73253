//! From directional light of cells to light at every pixel: a joint bilateral filter that evaluates each cell's light
//! for the pixel's own normal.
//!
//! The four cells around a pixel are weighted bilinearly times how much their sample lies on the pixel's own surface:
//! distance from the pixel's plane relative to the pixel's depth, and agreement of normals. Where those four mostly
//! disagree the 4×4 cells around are asked. Background pixels get 0.

use super::cells::{CellSide, CellsPass};
use super::exposure::{output_entry, pipeline, storage_entry};
use super::inputs::{BoundInputs, InputGroup};
use super::rung::Cost;
use super::{GiError, ambient, reconstruct, view_cache::ViewCache};
use crate::gpu::shaders;
use crate::gpu::timing::Recorder;

/// The constants as WGSL.
pub fn prelude(side: CellSide) -> String {
    side.prelude() + &reconstruct::prelude()
}

/// The pass.
pub struct UpsamplePass {
    device: wgpu::Device,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    outputs: ViewCache<1>,
}

impl UpsamplePass {
    /// Compiles the shader.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup, side: CellSide) -> Self {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("gi.upsample"),
            entries: &[storage_entry(0, true), storage_entry(1, true), output_entry(2)],
        });
        let module = shaders::module_with(device, "gi.upsample", &prelude(side));
        let pipeline = pipeline(device, "gi.upsample", &module, "upsample", inputs, &layout);
        Self { device: device.clone(), pipeline, layout, outputs: ViewCache::new() }
    }

    /// Records pass `gi.upsample`. `light` is laid out as [`cells`](super::cells) says; it and the cells' buffer must be
    /// the same until [`forget`](Self::forget). `output` (`Rgba16Float`, storage, full size) becomes E/π.
    ///
    /// # Errors
    /// [`GiError::Texture`] when `output` does not fit.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        inputs: &BoundInputs,
        cells: &CellsPass,
        light: &wgpu::Buffer,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        ambient::check_output(output, inputs.size)?;
        let group = self.outputs.get([output], || {
            Ok::<_, GiError>(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("gi.upsample"),
                layout: &self.layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: cells.pixels().as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: light.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(output) },
                ],
            }))
        })?;
        recorder.compute("gi.upsample", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(inputs.size[0].div_ceil(8), inputs.size[1].div_ceil(8), 1);
        });
        Ok(())
    }

    /// Lets go of output views and of the buffers bound with them.
    pub fn forget(&mut self) {
        self.outputs.clear();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.outputs.made()
    }

    /// What the pass costs for a picture of `size` pixels.
    pub fn cost(side: CellSide, size: [u32; 2]) -> Cost {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        Cost::new("gi.upsample", pixels * 400.0, pixels * 16.0 + side.count(size) as f64 * 60.0)
    }
}
