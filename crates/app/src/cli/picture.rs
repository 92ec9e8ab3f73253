//! Flags of a picture that becomes a file, drawn or traced: where it goes, how bright it is shown,
//! and what it is held against.

use super::{
    args::usage,
    compare::{Heat, Shown},
    drawn::{Drawn, Format},
    error::CliError,
    showing::Showing,
};
use anyhow::Result;
use bouncelight::render::{Exposure, tonemap_curve::Tonemap};
use bouncelight::scene::Scene;
use bouncelight_lab::metrics;
use bouncelight_scene::image_io;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Output")]
pub struct PictureArgs {
    /// Picture to write: .png, .exr, or `-` for a PNG on standard output.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Layers of an EXR: `all`, or Blender's pass names, such as DiffInd,Normal,Depth.
    #[arg(long, value_name = "LAYERS")]
    pub aov: Option<String>,
    /// Stops by which a PNG is brighter; auto: mean at middle grey [default: 0; auto for files
    /// without lights].
    #[arg(long, allow_hyphen_values = true, value_name = "EV|auto")]
    exposure: Option<Exposure>,
    /// View transform of a PNG: filmic, agx, neutral or none.
    #[arg(long, default_value = "filmic")]
    tonemap: Tonemap,
    /// EXR or PNG of the same size to compare the picture with.
    #[arg(long, value_name = "FILE", help_heading = COMPARISON)]
    reference: Option<PathBuf>,
    /// Metric of the comparison.
    #[arg(long, default_value = "mae", requires = "reference", value_parser = metrics::NAMES.map(|(n, _)| n),
        help_heading = COMPARISON)]
    metric: String,
    /// Exit with code 5 if the metric is worse than T.
    #[arg(long, requires = "reference", value_name = "T", help_heading = COMPARISON)]
    threshold: Option<f64>,
    /// Picture of the differences to write.
    #[arg(long, requires = "reference", value_name = "PNG", help_heading = COMPARISON)]
    diff: Option<PathBuf>,
}

/// Heading of the help.
const COMPARISON: &str = "Comparison";

impl PictureArgs {
    /// Faults that can be found before anything is drawn.
    pub fn check(&self) -> Result<Format> {
        let format = Format::of(&self.output, self.tonemap)?;
        if self.aov.is_some() && format != Format::Exr {
            return Err(usage("--aov needs an .exr: a PNG holds one picture".into()));
        }
        if self.exposure == Some(Exposure::Auto) && self.reference.is_some() {
            return Err(usage(
                "--exposure auto measures this picture; with --reference both need a number of stops".into(),
            ));
        }
        image_io::check_writable(&self.output)?;
        if let Some(diff) = &self.diff {
            image_io::check_writable(diff)?;
        }
        Ok(format)
    }

    /// The picture to compare with, if there is one, which must be `size` pixels large.
    pub fn reference(&self, size: [u32; 2]) -> Result<Option<Shown>> {
        let shown = |path| Shown::reference(path, self.tonemap, self.stops(), size, &self.metric);
        self.reference.as_deref().map(shown).transpose()
    }

    /// How pictures of the scene become files.
    pub fn showing(&self, format: Format, scene: &Scene, quiet: bool) -> Showing {
        Showing::new(self.exposure, self.reference.is_some(), format, scene, quiet)
    }

    /// Stops of a picture that is compared.
    fn stops(&self) -> f32 {
        if let Some(Exposure::Stops(stops)) = self.exposure { stops } else { 0.0 }
    }

    /// Prints the metric and fails when it is on the wrong side of the threshold.
    pub fn judge(&self, drawn: &Drawn, reference: Option<&Shown>) -> Result<()> {
        let Some(reference) = reference else { return Ok(()) };
        let name = self.output.display().to_string();
        let [width, height] = [drawn.frame.beauty.width, drawn.frame.beauty.height];
        let ours = Shown::linear(name, [width, height], drawn.rgb(), self.stops(), self.tonemap);
        let heat = Heat::of_metric(&self.metric);
        let options = metrics::Options {
            flip: heat == Heat::Flip,
            hdr_flip: heat == Heat::Hdrflip,
            ..metrics::Options::default()
        };
        let (comparison, maps) = ours.against(reference, options)?;
        let Some(value) = comparison.value(&self.metric) else {
            return Err(usage(format!("{} needs a linear reference (EXR)", self.metric)));
        };
        if let (Some(path), Some(rgb)) = (&self.diff, ours.heat_map(reference, heat, &maps)?) {
            image_io::write_png(path, width as u32, height as u32, &rgb, &[])?;
        }
        // The picture itself may be on standard output.
        eprintln!("{} {value:.6}", self.metric);
        match self.threshold {
            Some(threshold) if comparison.passes(&self.metric, threshold) == Some(false) => {
                Err(CliError::AboveThreshold { metric: self.metric.clone(), value, threshold }.into())
            }
            _ => Ok(()),
        }
    }
}
