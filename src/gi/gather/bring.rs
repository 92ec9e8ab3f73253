//! From light of cells to light at every pixel: a joint bilateral filter that evaluates each cell's
//! light for the pixel's own normal, and takes what lobes show along, by the split sum.
//!
//! The four cells around a pixel are weighted bilinearly times how much their sample lies on the
//! pixel's own surface: distance from the pixel's plane relative to the pixel's depth, and
//! agreement of normals. Where those four mostly disagree the 4×4 cells around are blended in.
//! Background pixels get 0. A workgroup reads each cell around its 16×8 pixels once, into its shared
//! memory.

use super::bindings;
use crate::gi::stage::cells::{self, CellsPass};
use crate::gi::stage::inputs::{BoundInputs, InputGroup};
use crate::gpu::bind::{self, Binder, Bound};
use crate::gpu::{shaders, timing::Recorder};

/// Pixels of a workgroup: `WIDE` and `HIGH` of the shader.
const WIDE: u32 = 16;
const HIGH: u32 = 8;

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
pub struct BringPass {
    pipeline: wgpu::ComputePipeline,
    binder: Binder,
}

/// What the pass reads and writes.
pub struct Brought<'a> {
    /// Of cells: directional light, as [`cells`] says.
    pub light: &'a wgpu::Buffer,
    /// Of cells: what lobes show over their directional albedo (rgb); a: 1, or 0 without a lobe.
    pub glosses: &'a wgpu::Buffer,
    /// Of pixels: F0 and roughness; a smaller texture: nothing is smooth.
    pub specular: &'a wgpu::TextureView,
    /// Of smooth pixels: what their own rays have found, four halves each.
    pub mirrored: &'a wgpu::Buffer,
    /// `Rgba16Float`, storage, full size: E/π.
    pub output: &'a wgpu::TextureView,
    /// The same: light that lobes reflect, W/(m²·sr); a smaller texture where nobody asks.
    pub specular_output: &'a wgpu::TextureView,
}

impl BringPass {
    /// Compiles the shader.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup) -> Self {
        let binder = Binder::new(device, "gi.bring", bindings::Bring::TYPES);
        let module = shaders::module_with(device, "gi.bring", &prelude());
        let pipeline = bind::pipeline(device, "gi.bring", &module, "bring", &[inputs.layout(), binder.layout()]);
        Self { pipeline, binder }
    }

    /// Records pass `gi.bring`.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        inputs: &BoundInputs,
        cells: &CellsPass,
        brought: Brought<'_>,
    ) {
        let Brought { light, glosses, specular, mirrored, output, specular_output } = brought;
        let [cell_pixels, light, glosses, mirrored] = [cells.pixels(), light, glosses, mirrored].map(Bound::from);
        let [output, specular_output, specular_map] = [output, specular_output, specular].map(Bound::from);
        let group = self.binder.group(bindings::Bring {
            cell_pixels,
            light,
            glosses,
            output,
            specular_output,
            specular_map,
            mirrored,
        });
        recorder.compute("gi.bring", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(inputs.size[0].div_ceil(WIDE), inputs.size[1].div_ceil(HIGH), 1);
        });
    }

    /// Lets go of what is bound.
    pub fn forget(&mut self) {
        self.binder.forget();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.binder.made()
    }
}
