//! From directional light of cells to light at every pixel: a joint bilateral filter that evaluates each cell's light
//! for the pixel's own normal.
//!
//! The four cells around a pixel are weighted bilinearly times how much their sample lies on the pixel's own surface:
//! distance from the pixel's plane relative to the pixel's depth, and agreement of normals (the tolerances are
//! [`reconstruct`](super::reconstruct)'s). Where those four mostly disagree the 4×4 cells around are blended in. Background pixels get 0. A
//! workgroup reads each cell around its 8×8 pixels once, into its shared memory.
//!
//! Alpha says how many times as bright as from all of its side the light is that a pixel's surface mirrors to the eye, as far as the cells'
//! vectors tell: radiance a + g·ω has the vector a n + ⅔ g over the hemisphere of n (per π), so the part of the vector in the
//! surface's plane gives g. It is what `gi.glossy` shows where a ray finds nothing.

use super::cells::{CellSide, CellsPass};
use super::inputs::{BoundInputs, InputGroup};
use super::reconstruct::{NORMAL_FLOOR, NORMAL_POWER, PLANE_TOLERANCE, WEIGHT_FLOOR};
use super::rung::Cost;
use super::{GiError, ambient};
use crate::gpu::bind::{self, Binder};
use crate::gpu::{shaders, timing::Recorder};
use crate::render::tool::{READ, STORE_HALF};

/// Sum of the four weights below which the 4×4 cells around are blended in.
pub const TRUST: f32 = 0.3;

/// Least cosine to a cell's own normal for which its light is evaluated where no cell agrees with a pixel.
pub const LEAST_COSINE: f32 = 0.5;

/// The constants as WGSL.
pub fn prelude(side: CellSide) -> String {
    let mut text = side.prelude();
    for (name, value) in [
        ("PLANE_TOLERANCE", PLANE_TOLERANCE),
        ("NORMAL_POWER", NORMAL_POWER),
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

impl UpsamplePass {
    /// Compiles the shader.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup, side: CellSide) -> Self {
        let binder = Binder::new(device, "gi.bring", &[READ, READ, STORE_HALF]);
        let module = shaders::module_with(device, "gi.bring", &prelude(side));
        let pipeline = bind::pipeline(device, "gi.bring", &module, "upsample", &[inputs.layout(), binder.layout()]);
        Self { pipeline, binder }
    }

    /// Records pass `gi.bring`. `light` is laid out as [`cells`](super::cells) says. `output` (`Rgba16Float`, storage, full size) becomes E/π, and in alpha how many times as
    /// bright the mirrored direction is.
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
        let (pixels, light, output) = (cells.pixels().into(), light.into(), output.into());
        let group = self.binder.group([pixels, light, output]);
        recorder.compute("gi.bring", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(inputs.size[0].div_ceil(8), inputs.size[1].div_ceil(8), 1);
        });
        Ok(())
    }

    /// Lets go of output views and of the buffers bound with them.
    pub fn forget(&mut self) {
        self.binder.forget();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.binder.made()
    }

    /// What the pass costs for a picture of `size` pixels. A pixel: 4 cells of 72 operations, its own place, normal and mirrored
    /// direction 72, the means 30; a workgroup stages 36 cells of 72 operations and 64 bytes, most of which the chip's cache has, so
    /// that each cell comes from memory once. Pixels at edges that ask 16 cells (about 3 % of a picture) are counted with 1,000 more.
    pub fn cost(side: CellSide, size: [u32; 2]) -> Cost {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        let staged = f64::from(8 / side.pixels() + 4).powi(2) * 72.0 / 64.0;
        Cost::new(
            "gi.bring",
            pixels * (4.0 * 72.0 + 72.0 + 30.0 + staged + 30.0),
            pixels * 16.0 + side.count(size) as f64 * 60.0,
        )
    }
}
