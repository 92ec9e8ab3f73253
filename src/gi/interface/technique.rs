//! The trait of methods, by which a frame drives them.
//!
//! ```
//! use bouncelight::gi::{GiError, Inputs, Outputs, technique::Technique};
//! use bouncelight::gpu::timing::Recorder;
//! use bouncelight::wgpu;
//!
//! /// Records a frame; true where the method itself drew it.
//! fn frame(
//!     method: &mut dyn Technique,
//!     (encoder, queue): (&mut wgpu::CommandEncoder, &wgpu::Queue),
//!     (inputs, outputs): (&Inputs<'_>, Outputs<'_>),
//! ) -> Result<bool, GiError> {
//!     method.record(&mut Recorder::new(encoder), queue, inputs, outputs)?;
//!     Ok(method.fallback().is_none())
//! }
//! ```

use super::{GiError, Inputs, Outputs};
use crate::gpu::timing::Recorder;
use crate::net::gpu::LayerReadback;
use crate::net::plan::Plan;

/// The method that draws in another's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fallback<'a> {
    /// Its name on the command line.
    pub method: &'static str,
    /// What is missing for the method that was asked for, one sentence without a full stop.
    pub why: &'a str,
}

/// Buffers of `gather` after a frame, for tools that read them back.
#[derive(Debug, Clone, Copy)]
pub struct Memory<'a> {
    /// Histories of cells: `History` of `history.wgsl`, [`HISTORY`](crate::gi::gather::HISTORY)
    /// bytes each.
    pub histories: &'a wgpu::Buffer,
    /// The pixel that stands for each: [`cells`](crate::gi::stage::cells).
    pub pixels: &'a wgpu::Buffer,
    /// The light that the frame shows, 48 bytes each.
    pub light: &'a wgpu::Buffer,
    /// Where light has changed, 16 bytes each: what it is now, shown without a network's say, and 1;
    /// else 0.
    pub changes: &'a wgpu::Buffer,
    /// Lists of rays; the word at [`RAYS_SENT`](crate::gi::gather::RAYS_SENT) is how many the frame's
    /// cells have sent.
    pub jobs: &'a wgpu::Buffer,
}

/// A method at work: reads a G-buffer, writes indirect light. Allocates only when size or views are new.
/// `Send`, so that a viewer can build one on another thread.
pub trait Technique: Send {
    /// Records all of the method's passes.
    ///
    /// # Errors
    /// [`GiError`] when inputs or outputs do not fit; then nothing was recorded.
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError>;

    /// Records what later frames remember of this one and nothing that only this one shows: outputs
    /// stay as they were, direct light is not read. True when it did; a method that needs whole
    /// frames says false, and nothing was recorded.
    ///
    /// # Errors
    /// As [`Technique::record`].
    fn warm_up(
        &mut self,
        _recorder: &mut Recorder<'_>,
        _queue: &wgpu::Queue,
        _inputs: &Inputs<'_>,
    ) -> Result<bool, GiError> {
        Ok(false)
    }

    /// Number of the frame for methods that may vary their patterns because a history averages
    /// frames; 0 without one.
    fn set_frame(&mut self, _queue: &wgpu::Queue, _frame: u32) {}

    /// The next frame has nothing to do with the last (a camera cut): histories are dropped.
    fn reset_history(&mut self) {}

    /// Sets [`Options::rays`](crate::gi::gather::Options::rays) from the next frame on, for methods that
    /// gather: histories stay.
    fn set_rays(&mut self, _rays: f32) {}

    /// Frames since the last cut, for methods whose answer settles over frames.
    fn settled(&self) -> Option<u32> {
        None
    }

    /// Whether it finds emission and occlusion by rays, so that lights in place of emissive
    /// surfaces ([`Light::is_emissive_proxy`](crate::scene::Light::is_emissive_proxy)) and
    /// occlusion maps would count twice. `rays`: whether there is a BVH.
    fn uses_rays(&self, _rays: bool) -> bool {
        false
    }

    /// The method that drew the last frame in this one's place, and why; `None` where it drew
    /// itself.
    fn fallback(&self) -> Option<Fallback<'_>> {
        None
    }

    /// Whether the last recording has written [`Outputs::specular`], if it was given.
    fn writes_specular(&self) -> bool {
        false
    }

    /// What cells remember after the last recording, where the method gathers.
    fn memory(&self) -> Option<Memory<'_>> {
        None
    }

    /// Names of the network's layers; none without a network.
    fn layers(&self) -> Vec<&str> {
        Vec::new()
    }

    /// What the network does, step by step, where one runs.
    fn plan(&self) -> Option<&Plan> {
        None
    }

    /// What the network is given for `inputs`, which must be those of the last recording; `None`
    /// without a network.
    ///
    /// # Errors
    /// As [`Technique::read_layer`].
    fn read_input(&mut self, _inputs: &Inputs<'_>) -> Result<Option<LayerReadback>, GiError> {
        Ok(None)
    }

    /// What a layer of the network makes of `inputs`, which must be those of the last recording;
    /// `None` where there is no such layer.
    ///
    /// # Errors
    /// [`GiError`] when the inputs do not fit or reading back fails.
    fn read_layer(&mut self, _inputs: &Inputs<'_>, _layer: usize) -> Result<Option<LayerReadback>, GiError> {
        Ok(None)
    }

    /// Drops kept bind groups and texture views: the targets are new.
    fn release_bindings(&mut self);

    /// GPU memory of buffers, textures and weights, bytes.
    fn bytes(&self) -> u64;

    /// Bind groups and rebuilds since the start; stands still in steady frames.
    fn allocations(&self) -> u64;
}
