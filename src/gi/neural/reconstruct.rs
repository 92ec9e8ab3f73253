//! From one answer per 4×4 cell to light at every pixel: a joint bilateral upsampling in f32.
//!
//! The four cells around a pixel are weighted bilinearly times how much their sample lies on the
//! pixel's own surface: distance from the pixel's plane relative to the pixel's depth, and
//! agreement of normals. Where those four mostly disagree (an edge, something thin) the 4×4 cells
//! around are asked, then 8×8; where even those show only background the first guess stays, or the
//! ambient constant answers. Background pixels get 0. Cells whose sample is background never give
//! light.

use crate::gi::interface::GiError;
use crate::gi::stage::ViewCache;
use crate::gi::stage::exposure::{ExposurePass, output_entry, pipeline, storage_entry};
use crate::gi::stage::inputs::{BoundInputs, InputGroup, texture_entry};
use crate::gi::stage::weights::{NORMAL_FLOOR, NORMAL_POWER, PLANE_TOLERANCE, WEIGHT_FLOOR};
use crate::gpu::timing::Recorder;
use crate::gpu::{shaders, shared, tape};

/// Sum of the four weights below which more cells are asked.
pub const TRUST: f32 = 0.1;
/// Sum over the 4×4 cells below which 8×8 are asked.
pub const LOST: f32 = 1e-3;

/// What a network's numbers mean. s is the exposure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// Three numbers y: E/π = s·exp(y), y clamped to [−10, 6].
    Light,
    /// Six numbers g, r: E/π = guess·exp(g) + s·r at the pixel, not below 0; g clamped to
    /// ±[`MOST_GAIN`], r to ±[`MOST_ADDED`]. The guess is what method `gather` answers at that
    /// pixel, so its detail stays.
    Gain,
}

/// Largest |g|: a cell makes the guess at most a third brighter or darker. (On rooms 2 to 5 that
/// changes nothing that can be measured; but where a network meets what it never learnt it does
/// little harm: `small` lit a sharp shadow of room 0 three times too brightly at ±2, paper's L1
/// 38,976 against 18,664.)
pub const MOST_GAIN: f32 = 0.3;
/// Largest |r|, in units of the exposure.
pub const MOST_ADDED: f32 = 0.1;

impl Answer {
    /// The meaning's name in weights files, see `net::format::MEANINGS`.
    pub fn name(self) -> &'static str {
        match self {
            Answer::Light => "log_irradiance_over_exposure",
            Answer::Gain => "gain_and_rest_on_guess",
        }
    }

    /// Numbers for each cell.
    pub fn channels(self) -> u32 {
        match self {
            Answer::Light => 3,
            Answer::Gain => 6,
        }
    }

    /// Least and largest exponent.
    pub fn range(self) -> [f32; 2] {
        match self {
            Answer::Light => [-10.0, 6.0],
            Answer::Gain => [-MOST_GAIN, MOST_GAIN],
        }
    }

    /// The factor where no cell can answer: the guess stays, or the constant ambient.
    pub fn fallback(self) -> [f32; 3] {
        match self {
            Answer::Light => crate::gi::screen::ambient::AMBIENT,
            Answer::Gain => [1.0; 3],
        }
    }
}

/// The constants as WGSL.
pub fn prelude(answer: Answer) -> String {
    let [r, g, b] = answer.fallback();
    let gain = answer == Answer::Gain;
    let mut text = format!("const GAIN = {gain};\nconst FALLBACK = vec3f({r:?}, {g:?}, {b:?});\n");
    let [lowest, highest] = answer.range();
    for (name, value) in [
        ("LOWEST", lowest),
        ("HIGHEST", highest),
        ("MOST", MOST_ADDED),
        ("PLANE_TOLERANCE", PLANE_TOLERANCE),
        ("NORMAL_POWER", NORMAL_POWER),
        ("NORMAL_FLOOR", NORMAL_FLOOR),
        ("WEIGHT_FLOOR", WEIGHT_FLOOR),
        ("TRUST", TRUST),
        ("LOST", LOST),
    ] {
        text.push_str(&format!("const {name} = f32({value:?});\n"));
    }
    text
}

/// The reconstruction stage.
pub struct ReconstructPass {
    device: wgpu::Device,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    outputs: ViewCache<1>,
}

impl ReconstructPass {
    /// Compiles the shader.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup, answer: Answer) -> Self {
        let layout = shared::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor {
                label: Some("gi.reconstruct"),
                entries: &[storage_entry(0, true), storage_entry(1, true), output_entry(2), texture_entry(3)],
            },
        );
        let module = shaders::module_with(device, "gi.reconstruct", &prelude(answer));
        let pipeline = pipeline(device, "gi.reconstruct", &module, "reconstruct", inputs, &layout);
        Self { device: device.clone(), pipeline, layout, outputs: ViewCache::new() }
    }

    /// Records pass `gi.reconstruct`. `answers` holds what [`Answer`] says, NHWC with the channels
    /// padded to a multiple of 4; `guess` is the first guess, E/π (`Rgba16Float`, the picture's
    /// size; any texture for [`Answer::Light`]). Both must be the same until
    /// [`forget`](Self::forget). `output` (`Rgba16Float`, storage, full size) becomes E/π.
    ///
    /// # Errors
    /// [`GiError::Texture`] when `output` does not fit.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        inputs: &BoundInputs,
        exposure: &ExposurePass,
        answers: wgpu::BindingResource<'_>,
        guess: &wgpu::TextureView,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        crate::gi::stage::inputs::check_outputs(output.into(), inputs.size)?;
        let group = self.outputs.get([output], || {
            Ok::<_, GiError>(tape::bind_group(
                &self.device,
                &wgpu::BindGroupDescriptor {
                    label: Some("gi.reconstruct"),
                    layout: &self.layout,
                    entries: &[
                        wgpu::BindGroupEntry { binding: 0, resource: exposure.buffer().as_entire_binding() },
                        wgpu::BindGroupEntry { binding: 1, resource: answers },
                        wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(output) },
                        wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::TextureView(guess) },
                    ],
                },
            ))
        })?;
        recorder.compute("gi.reconstruct", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(inputs.size[0].div_ceil(8), inputs.size[1].div_ceil(8), 1);
        });
        Ok(())
    }

    /// Lets go of output views, of the answers' buffer and of the guess.
    pub fn forget(&mut self) {
        self.outputs.clear();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.outputs.made()
    }
}
