//! A method that needs rays, and the fallback that draws where there are none: while the BVH is
//! built, or where scene or device have no room for it.

use crate::gi::interface::technique::{Fallback, Memory, Technique};
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::screen::ssgi::{SsgiGi, SsgiOptions};
use crate::gpu::timing::Recorder;
use crate::net::gpu::LayerReadback;
use crate::net::plan::Plan;

/// The method, or why the device cannot run it, with its fallback.
pub(super) struct WithFallback {
    device: wgpu::Device,
    above: Result<Box<dyn Technique>, String>,
    /// Made when it is first needed.
    below: Option<SsgiGi>,
    /// Why the last frame is of the method below.
    why: Option<String>,
    /// That is for the size of the picture.
    too_small: bool,
}

impl WithFallback {
    /// `above`: the method, or one sentence that says what the device lacks for it.
    pub fn new(device: &wgpu::Device, above: Result<Box<dyn Technique>, String>) -> Self {
        let why = above.as_ref().err().cloned();
        Self { device: device.clone(), above, below: None, why, too_small: false }
    }

    /// What drew the last frame.
    fn drew(&self) -> Option<&dyn Technique> {
        match (&self.why, &self.above) {
            (None, Ok(above)) => Some(above.as_ref()),
            _ => self.below.as_ref().map(|b| b as &dyn Technique),
        }
    }
}

impl Technique for WithFallback {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        if let Ok(above) = &mut self.above {
            match above.record(recorder, queue, inputs, outputs) {
                // Nothing was recorded.
                Err(lacks @ (GiError::Rays | GiError::Device(_))) => {
                    above.reset_history();
                    self.too_small = matches!(lacks, GiError::Device(_));
                    self.why = Some(lacks.to_string());
                }
                recorded => {
                    (self.why, self.too_small) = (None, false);
                    return recorded;
                }
            }
        }
        let below = self.below.get_or_insert_with(|| SsgiGi::new(&self.device, SsgiOptions::default()));
        below.record(recorder, queue, inputs, outputs)
    }

    fn warm_up(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
    ) -> Result<bool, GiError> {
        let Ok(above) = &mut self.above else { return Ok(false) };
        match above.warm_up(recorder, queue, inputs) {
            // The whole frame will be drawn by the method below, and say why.
            Err(GiError::Rays | GiError::Device(_)) => Ok(false),
            recorded => {
                (self.why, self.too_small) = (None, false);
                recorded
            }
        }
    }

    fn fallback(&self) -> Option<Fallback<'_>> {
        Some(Fallback { method: "ssgi", why: self.why.as_deref()? })
    }

    fn writes_specular(&self) -> bool {
        self.drew().is_some_and(|drew| drew.writes_specular())
    }

    fn memory(&self) -> Option<Memory<'_>> {
        self.drew()?.memory()
    }

    fn read_input(&mut self, inputs: &Inputs<'_>) -> Result<Option<LayerReadback>, GiError> {
        self.above.as_mut().map_or(Ok(None), |above| above.read_input(inputs))
    }

    fn layers(&self) -> Vec<&str> {
        self.above.as_ref().map(|a| a.layers()).unwrap_or_default()
    }

    fn plan(&self) -> Option<&Plan> {
        self.drew()?.plan()
    }

    fn read_layer(&mut self, inputs: &Inputs<'_>, layer: usize) -> Result<Option<LayerReadback>, GiError> {
        self.above.as_mut().map_or(Ok(None), |a| a.read_layer(inputs, layer))
    }

    fn uses_rays(&self, rays: bool) -> bool {
        self.above.as_ref().is_ok_and(|a| a.uses_rays(rays)) && !self.too_small
    }

    fn set_frame(&mut self, queue: &wgpu::Queue, frame: u32) {
        if let Ok(above) = &mut self.above {
            above.set_frame(queue, frame);
        }
        if let Some(below) = &mut self.below {
            below.set_frame(queue, frame);
        }
    }

    fn reset_history(&mut self) {
        if let Ok(above) = &mut self.above {
            above.reset_history();
        }
    }

    fn set_rays(&mut self, rays: f32) {
        if let Ok(above) = &mut self.above {
            above.set_rays(rays);
        }
    }

    fn settled(&self) -> Option<u32> {
        self.drew()?.settled()
    }

    fn release_bindings(&mut self) {
        if let Ok(above) = &mut self.above {
            above.release_bindings();
        }
        if let Some(below) = &mut self.below {
            below.release_bindings();
        }
    }

    fn allocations(&self) -> u64 {
        self.above.as_ref().map_or(0, |a| a.allocations()) + self.below.as_ref().map_or(0, |b| b.allocations())
    }

    fn bytes(&self) -> u64 {
        self.above.as_ref().map_or(0, |a| a.bytes()) + self.below.as_ref().map_or(0, |b| b.bytes())
    }
}
