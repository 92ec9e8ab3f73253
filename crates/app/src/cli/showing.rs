//! How bright pictures are when they become files.

use super::drawn::{Drawn, Format};
use anyhow::Result;
use bouncelight::gpu::Gpu;
use bouncelight::render::Exposure;
use bouncelight::scene::Scene;
use std::path::Path;

/// How pictures become files.
pub(super) struct Showing {
    format: Format,
    exposure: Exposure,
    /// Radiance where nothing is, if it is the same everywhere.
    background: Option<[f32; 3]>,
    quiet: bool,
}

impl Showing {
    /// `asked` is what the command line says; `compared` that the picture is held against another
    /// one.
    pub fn new(asked: Option<Exposure>, compared: bool, format: Format, scene: &Scene, quiet: bool) -> Self {
        let by_file = if scene.lightless && !compared { Exposure::Auto } else { Exposure::Stops(0.0) };
        let exposure = asked.unwrap_or(by_file);
        let background = scene.environment.image.is_none().then_some(scene.environment.radiance);
        Self { format, exposure, background, quiet }
    }

    /// Writes a picture `stops` brighter, or as it was asked for; returns what that came to.
    pub fn write(&self, gpu: &Gpu, output: &Path, drawn: &Drawn, stops: Option<f32>) -> Result<f32> {
        if self.format == Format::Exr {
            // Radiance is as it is.
            drawn.write(gpu, output, self.format, 0.0)?;
            return Ok(0.0);
        }
        let found = stops.unwrap_or_else(|| drawn.stops(self.exposure, self.background));
        if stops.is_none() && self.exposure == Exposure::Auto && !self.quiet {
            eprintln!("exposure {found:+} EV, measured from the picture; --exposure sets another");
        }
        drawn.write(gpu, output, self.format, found)?;
        Ok(found)
    }
}
