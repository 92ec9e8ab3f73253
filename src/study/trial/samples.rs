//! What networks learn from, of a scene under trial.

use super::{Trial, TrialError};
use crate::{
    gi::{Method, gather},
    reference::{Layer, TracerOptions},
    render::Renderer,
    scene::Camera,
    study::{
        dataset::{self, Sample},
        target::{self, Target},
    },
};

impl Trial<'_> {
    /// A renderer of method `gather`, whose answer networks are given.
    ///
    /// # Errors
    /// [`TrialError`].
    pub fn gatherer(&mut self) -> Result<Renderer, TrialError> {
        self.renderer(&Method::Gather(gather::Options::default()))
    }

    /// What a network is given for `camera` after `frames` more frames.
    ///
    /// # Errors
    /// [`TrialError`].
    pub fn sample(&self, gatherer: &mut Renderer, camera: &Camera, frames: u32) -> Result<Sample, TrialError> {
        self.go_on(0.0)?;
        Ok(dataset::frame(self.gpu, gatherer, &self.uploaded, camera, frames)?)
    }

    /// The light that a network's answer should give at each cell: what references hold of it,
    /// traced at the cells' own points.
    ///
    /// # Errors
    /// [`TrialError`].
    pub fn light_at_cells(&mut self, camera: &Camera, options: TracerOptions) -> Result<Target, TrialError> {
        let options = TracerOptions { layers: vec![Layer::Gi], ..options };
        let (gpu, size) = (self.gpu, self.size);
        self.prepare_tracer()?;
        let (kernel, packed) = (self.kernel.as_ref().expect("prepared"), self.packed.as_ref().expect("prepared"));
        let go_on = || (self.watch)(0.0);
        target::target(gpu, kernel, packed, camera, size, options, go_on)?.ok_or(TrialError::Stopped)
    }

    /// Tells whoever watches how far something is.
    ///
    /// # Errors
    /// [`TrialError::Stopped`] where they say so.
    pub fn go_on(&self, share: f64) -> Result<(), TrialError> {
        if (self.watch)(share) { Ok(()) } else { Err(TrialError::Stopped) }
    }

    /// The device that draws.
    pub fn gpu(&self) -> &crate::gpu::Gpu {
        self.gpu
    }
}
