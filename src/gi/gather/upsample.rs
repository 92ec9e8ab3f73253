//! Joint bilateral upsampling: evaluates the cells' directional light for the pixel's own normal, and
//! reflects the cells' specular by the split sum.
//!
//! The four cells around a pixel are weighted bilinearly times how much their sample lies on the
//! pixel's own surface: distance from the pixel's plane relative to the pixel's depth, and
//! agreement of normals. Where those four mostly disagree the 4×4 cells around are blended in.
//! Background pixels get 0. A workgroup reads each cell around its 16×8 pixels once, into its shared
//! memory.

use super::bindings;
use crate::gi::stage::cells::{self, DownsamplePass};
use crate::gi::stage::inputs::{BoundInputs, InputGroup};
use crate::gpu::bind::{self, Binder, Bound};
use crate::gpu::{shaders, timing::Recorder};

/// Pixels of a workgroup: `GROUP_WIDTH` and `GROUP_HEIGHT` of the shader.
const GROUP_WIDTH: u32 = 16;
const GROUP_HEIGHT: u32 = 8;

/// Distance from the pixel's plane, relative to the view distance, at which a tap's weight has
/// fallen to a quarter. About half a cell's footprint at 1024×512 and 60°: nothing closer can be
/// told apart at this resolution anyway.
const PLANE_TOLERANCE: f32 = 0.004;
/// Least factor by normals, so that a wrong normal in the right plane still beats a wrong plane.
const NORMAL_FLOOR: f32 = 1e-5;
/// Least weight, so that no sum over hit cells is 0.
const WEIGHT_FLOOR: f32 = 1e-15;

/// Sum of the four weights below which the 4×4 cells around are blended in.
const TRUST: f32 = 0.3;

/// Least cosine to a cell's own normal for which its light is evaluated where no cell agrees with a
/// pixel.
const LEAST_COSINE: f32 = 0.5;

/// The constants as WGSL.
pub fn prelude() -> String {
    let mut text = cells::prelude();
    for (name, value) in [
        ("PLANE_TOLERANCE", PLANE_TOLERANCE),
        ("NORMAL_FLOOR", NORMAL_FLOOR),
        ("WEIGHT_FLOOR", WEIGHT_FLOOR),
        ("TRUST", TRUST),
        ("LEAST_COSINE", LEAST_COSINE),
    ] {
        text.push_str(&format!("const {name} = f32({value:?});\n"));
    }
    text
}

/// The pass.
pub struct UpsamplePass {
    pipeline: wgpu::ComputePipeline,
    binder: Binder,
}

/// What the pass reads and writes.
pub struct Upsampled<'a> {
    /// Of cells: directional light, as [`cells`] says.
    pub cell_light: &'a wgpu::Buffer,
    /// Of cells: specular radiance over the directional albedo (rgb); a: 1, or 0 without a lobe.
    pub specular_filtered: &'a wgpu::Buffer,
    /// Of pixels: F0 and roughness; a smaller texture: nothing is smooth.
    pub specular: &'a wgpu::TextureView,
    /// Specular history of smooth pixels, four halves each.
    pub pixel_specular: &'a wgpu::Buffer,
    /// `Rgba16Float`, storage, full size: E/π.
    pub output: &'a wgpu::TextureView,
    /// The same: specular radiance, W/(m²·sr); a smaller texture where the host asks for none.
    pub specular_output: &'a wgpu::TextureView,
}

impl UpsamplePass {
    /// Compiles the shader.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup) -> Self {
        let binder = Binder::new(device, "gi.upsample", bindings::Upsample::TYPES);
        let module = shaders::module_with(device, "gi.upsample", &prelude());
        let pipeline = bind::pipeline(device, "gi.upsample", &module, "upsample", &[inputs.layout(), binder.layout()]);
        Self { pipeline, binder }
    }

    /// Records pass `gi.upsample`.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        inputs: &BoundInputs,
        cells: &DownsamplePass,
        upsampled: Upsampled<'_>,
    ) {
        let Upsampled { cell_light, specular_filtered, specular, pixel_specular, output, specular_output } = upsampled;
        let [cell_pixels, cell_light, specular_filtered, pixel_specular] =
            [cells.pixels(), cell_light, specular_filtered, pixel_specular].map(Bound::from);
        let [output, specular_output, specular_map] = [output, specular_output, specular].map(Bound::from);
        let group = self.binder.group(bindings::Upsample {
            cell_pixels,
            cell_light,
            specular_filtered,
            output,
            specular_output,
            specular_map,
            pixel_specular,
        });
        recorder.compute("gi.upsample", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(inputs.size[0].div_ceil(GROUP_WIDTH), inputs.size[1].div_ceil(GROUP_HEIGHT), 1);
        });
    }

    /// Drops the kept bind group.
    pub fn release_bindings(&mut self) {
        self.binder.release_bindings();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.binder.made()
    }
}
