//! The cheapest method: constant light (of the sky and the picture's surfaces) times ambient
//! occlusion. Its limits: [`crate::gi`].
//!
//! ```
//! use bouncelight::gi::{Method, ambient::AmbientTerm};
//! let term: AmbientTerm = "sky=0.5".parse()?;
//! assert_eq!(term, AmbientTerm { sky: 0.5, ..AmbientTerm::default() });
//! let method = Method::Ambient(term);
//! # Ok::<_, String>(())
//! ```

use super::bitmask::{March, bind};
use super::occlusion::OcclusionPass;
use crate::gi::interface::technique::Technique;
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::stage::ViewCache;
use crate::gi::stage::exposure::{self, ExposurePass, output_entry, storage_entry};
use crate::gi::stage::inputs::{InputGroup, check_outputs, texture_entry};
use crate::gpu::timing::Recorder;
use crate::gpu::{pipeline_cache, shaders, tape};
use std::str::FromStr;

/// The environment's share in what the screen does not show. Fitted with [`BOUNCE`] to paper rooms
/// 2, 3, 6, 7, 60 and 61: least mean of Σ|ΔE| / ΣE after 4×4 pooling, for this method and
/// [`ssgi`](super::ssgi) together. The rooms are open above; a room with a roof gets too much sky.
pub const SKY: f32 = 0.83;

/// What the picture's surfaces send on (mean of albedo · direct light + emission), as a multiple of
/// it: stands for all bounces.
pub const BOUNCE: f32 = 0.56;

/// Light of what the screen does not show, by two shares. Light is linear in both, so a scene's own
/// can be found from pictures of each alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmbientTerm {
    /// Share of the environment's radiance, 0 to 16; [`SKY`] by default. Too large: closed rooms
    /// glow. Too small: open scenes are dark.
    pub sky: f32,
    /// Share of the picture's mean outgoing radiance, 0 to 16; [`BOUNCE`] by default. Too large:
    /// flat, bright shadows. Too small: black ones.
    pub bounce: f32,
}

impl Default for AmbientTerm {
    fn default() -> Self {
        Self { sky: SKY, bounce: BOUNCE }
    }
}

impl AmbientTerm {
    /// As [`FromStr`] reads them.
    pub fn words(&self) -> String {
        format!("sky={},bounce={}", self.sky, self.bounce)
    }
}

/// `sky=X,bounce=Y`, either of which may be left out.
impl FromStr for AmbientTerm {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut ambient_term = Self::default();
        for word in text.split(',') {
            let (name, value) = word.split_once('=').ok_or_else(|| format!("`{word}` is none of: sky=X, bounce=Y"))?;
            let number = value.parse::<f32>().ok().filter(|v| (0.0..=16.0).contains(v));
            let number = number.ok_or_else(|| format!("`{word}`: must be a number from 0 to 16"))?;
            match name {
                "sky" => ambient_term.sky = number,
                "bounce" => ambient_term.bounce = number,
                _ => return Err(format!("`{word}` is none of: sky=X, bounce=Y")),
            }
        }
        Ok(ambient_term)
    }
}

/// The constants of the ambient term as WGSL (`shaders/gi/ambient_term.wgsl`).
pub fn ambient_prelude(sky: f32, bounce: f32) -> String {
    format!("const SKY = f32({sky:?});\nconst BOUNCE = f32({bounce:?});\n")
}

/// Shaders of the method, each with an example of its prelude.
pub(crate) fn preludes() -> Vec<(&'static str, String)> {
    vec![("gi.ambient", ambient_prelude(1.0, 0.5))]
}

/// The method: exposure, occlusion and one write a pixel (`gi.exposure`, `gi.occlusion`,
/// `gi.occlusion_full`, `gi.ambient`).
pub struct AmbientGi {
    device: wgpu::Device,
    inputs: InputGroup,
    exposure: ExposurePass,
    occlusion: OcclusionPass,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    outputs: ViewCache<1>,
    size: [u32; 2],
}

impl AmbientGi {
    /// Makes pipelines and buffers of a few kilobytes; works for every picture size.
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with(device, AmbientTerm::default())
    }

    /// As [`AmbientGi::new`], with a scene's own numbers.
    pub fn with(device: &wgpu::Device, ambient_term: AmbientTerm) -> Self {
        let inputs = InputGroup::new(device);
        let exposure = ExposurePass::new(device, &inputs);
        let occlusion = OcclusionPass::new(device, &inputs, March::NEAR);
        let layout = pipeline_cache::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor {
                label: Some("gi.ambient"),
                entries: &[storage_entry(0, true), texture_entry(1), output_entry(2)],
            },
        );
        let module =
            shaders::module_with(device, "gi.ambient", &ambient_prelude(ambient_term.sky, ambient_term.bounce));
        let pipeline = exposure::pipeline(device, "gi.ambient", &module, "ambient", &inputs, &layout);
        Self {
            device: device.clone(),
            inputs,
            exposure,
            occlusion,
            pipeline,
            layout,
            outputs: ViewCache::new(),
            size: [0; 2],
        }
    }

    /// The exposure of the last recording, see [`exposure::read`].
    pub fn exposure_buffer(&self) -> &wgpu::Buffer {
        self.exposure.buffer()
    }

    /// The visibility of the last recording, see [`OcclusionPass::visibility`].
    pub fn visibility(&self) -> &wgpu::TextureView {
        self.occlusion.visibility()
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        self.inputs.made() + self.outputs.made() + self.occlusion.made()
    }
}

impl Technique for AmbientGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        check_outputs(outputs, inputs.size)?;
        if inputs.size != self.size {
            self.release_bindings();
            self.size = inputs.size;
        }
        let bound = self.inputs.bind(queue, inputs)?;
        if self.occlusion.fit(inputs.size) {
            self.outputs.clear();
        }
        let group = self.outputs.get([outputs.light], || {
            let entries = [
                wgpu::BindGroupEntry { binding: 0, resource: self.exposure.buffer().as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: bind(self.occlusion.visibility()) },
                wgpu::BindGroupEntry { binding: 2, resource: bind(outputs.light) },
            ];
            let label = Some("gi.ambient");
            let descriptor = wgpu::BindGroupDescriptor { label, layout: &self.layout, entries: &entries };
            Ok::<_, GiError>(tape::bind_group(&self.device, &descriptor))
        })?;
        self.exposure.record(recorder, &bound);
        self.occlusion.record(recorder, &bound);
        recorder.compute("gi.ambient", |pass| {
            bound.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(bound.size[0].div_ceil(8), bound.size[1].div_ceil(8), 1);
        });
        Ok(())
    }

    fn set_frame(&mut self, queue: &wgpu::Queue, frame: u32) {
        self.occlusion.set_frame(queue, frame);
    }

    fn release_bindings(&mut self) {
        self.inputs.release_bindings();
        self.outputs.clear();
    }

    fn allocations(&self) -> u64 {
        self.allocations()
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.exposure.bytes() + self.occlusion.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_and_wrong_ones_named() {
        let ambient_term = AmbientTerm { sky: 1.0, bounce: 0.25 };
        assert_eq!((ambient_term.words().parse(), "sky=0.83".parse()), (Ok(ambient_term), Ok(AmbientTerm::default())));
        for bad in ["", "sky", "sky=-1", "sky=nan", "bounce=17", "moon=1"] {
            assert!(bad.parse::<AmbientTerm>().unwrap_err().contains(bad), "{bad}");
        }
    }
}
