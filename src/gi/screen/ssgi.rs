//! One bounce in screen space: every pixel gathers what the pixels around it send on, by visibility
//! bitmask ([`bitmask`](super::bitmask)), and the ambient term (the sky and a stand-in for later
//! bounces, [`ambient`]) through what nothing blocks.
//!
//! What it cannot do: anything off the screen or hidden in it. A red wall lights the floor until it
//! leaves the picture; a roof that is not in view is sky; the back of a lamp shade is dark.
//! Thickness is assumed, so light passes behind thick things. Surfaces finer than two pixels send
//! and receive through their neighbours.

use super::ambient;
use super::bitmask::{Kernel, March, Pattern, Stage, bind, half_of, pattern_entry, write_entry};
use crate::gi::interface::technique::Technique;
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::stage::ViewCache;
use crate::gi::stage::exposure::{ExposurePass, output_entry, storage_entry};
use crate::gi::stage::inputs::{InputGroup, texture_entry};
use crate::gpu::timing::Recorder;

/// Options of the method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SsgiOptions {
    /// How the depth buffer is walked.
    pub march: March,
    /// The environment's share in what the screen does not show, see [`ambient::SKY`].
    pub sky: f32,
    /// Surfaces' share in it, see [`ambient::BOUNCE`].
    pub bounce: f32,
}

impl Default for SsgiOptions {
    fn default() -> Self {
        Self { march: March::FAR, sky: ambient::SKY, bounce: ambient::BOUNCE }
    }
}

impl SsgiOptions {
    /// The constants as WGSL, for `gi.ssgi` and `gi.radiance`.
    pub fn prelude(&self) -> String {
        self.march.prelude() + &ambient::ambient_prelude(self.sky, self.bounce)
    }
}

/// Shaders of the method, each with an example of its prelude.
pub(crate) fn preludes() -> Vec<(&'static str, String)> {
    ["gi.radiance", "gi.ssgi"].map(|shader| (shader, SsgiOptions::default().prelude())).into()
}

/// The method.
pub struct SsgiGi {
    device: wgpu::Device,
    inputs: InputGroup,
    exposure: ExposurePass,
    radiance: Kernel,
    gather: Kernel,
    full: Kernel,
    pattern: Pattern,
    fine: Stage,
    coarse: Stage,
    half: Stage,
    groups: Option<[wgpu::BindGroup; 2]>,
    outputs: ViewCache<1>,
}

impl SsgiGi {
    /// Compiles the stages; works for every picture size.
    pub fn new(device: &wgpu::Device, options: SsgiOptions) -> Self {
        use wgpu::TextureFormat::{Rgba16Float, Rgba32Float};
        let inputs = InputGroup::new(device);
        let exposure = ExposurePass::new(device, &inputs);
        let prelude = options.prelude();
        let entries = [storage_entry(0, true), write_entry(1, Rgba16Float), write_entry(2, Rgba16Float)];
        let radiance = Kernel::new(device, &inputs, "gi.radiance", &prelude, &entries);
        let entries =
            [pattern_entry(0), storage_entry(1, true), texture_entry(2), texture_entry(3), write_entry(4, Rgba32Float)];
        let gather = Kernel::new(device, &inputs, "gi.ssgi", &prelude, &entries);
        let full = Kernel::new(device, &inputs, "gi.ssgi_full", "", &[texture_entry(0), output_entry(1)]);
        Self {
            device: device.clone(),
            inputs,
            exposure,
            radiance,
            gather,
            full,
            pattern: Pattern::new(device),
            fine: Stage::new("gi.radiance", Rgba16Float),
            coarse: Stage::new("gi.radiance_coarse", Rgba16Float),
            half: Stage::new("gi.ssgi", Rgba32Float),
            groups: None,
            outputs: ViewCache::new(),
        }
    }

    /// Bind groups made since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        self.inputs.made() + self.outputs.made()
    }

    fn fit(&mut self, size: [u32; 2]) {
        let half = half_of(size);
        let fresh = self.fine.fit(&self.device, half) | self.half.fit(&self.device, half);
        if self.coarse.fit(&self.device, half.map(|n| n.div_ceil(4))) | fresh {
            self.inputs.release_bindings();
            self.outputs.clear();
            let light = self.exposure.buffer().as_entire_binding();
            let (fine, coarse) = (bind(self.fine.get()), bind(self.coarse.get()));
            let radiance = self.radiance.group(&self.device, &[light.clone(), fine.clone(), coarse.clone()]);
            let resources = [self.pattern.binding(), light, fine, coarse, bind(self.half.get())];
            self.groups = Some([radiance, self.gather.group(&self.device, &resources)]);
        }
    }
}

impl Technique for SsgiGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        crate::gi::stage::inputs::check_outputs(outputs, inputs.size)?;
        let bound = self.inputs.bind(queue, inputs)?;
        self.fit(inputs.size);
        let full = self.outputs.get([outputs.light], || {
            Ok::<_, GiError>(self.full.group(&self.device, &[bind(self.half.get()), bind(outputs.light)]))
        })?;
        let Some([radiance, gather]) = &self.groups else { return Ok(()) };
        let half = half_of(inputs.size);
        self.exposure.record(recorder, &bound);
        self.radiance.record(recorder, &bound, radiance, half);
        self.gather.record(recorder, &bound, gather, half);
        self.full.record(recorder, &bound, &full, inputs.size);
        Ok(())
    }

    fn set_frame(&mut self, queue: &wgpu::Queue, frame: u32) {
        self.pattern.set(queue, frame);
    }

    fn release_bindings(&mut self) {
        self.inputs.release_bindings();
        self.outputs.clear();
    }

    fn allocations(&self) -> u64 {
        self.allocations()
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.exposure.bytes() + self.fine.bytes() + self.coarse.bytes() + self.half.bytes() + 16
    }
}
