//! `bouncelight compare A B`: the paper's four metrics and today's, a heat map, a JSON record.

use super::args::usage;
use crate::{
    image_io::{self, Decoded},
    metrics::{self, Comparison, Picture, Views},
    render::tonemap_curve::Tonemap,
};
use anyhow::Result;
use std::path::{Path, PathBuf};

/// Difference that is shown at the hot end of a heat map, in display values.
const HEAT_FULL_SCALE: f32 = 0.25;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// The picture that is judged: PNG, or EXR (linear, Blender's layer names).
    a: PathBuf,
    /// The reference.
    b: PathBuf,
    /// Which metric to print.
    #[arg(long, default_value = "all", value_parser = parse_metric)]
    metric: String,
    /// View transform of EXR pictures for the metrics on display values.
    #[arg(long, default_value = "filmic")]
    tonemap: Tonemap,
    /// Write a picture of where they differ.
    #[arg(long, value_name = "PNG")]
    heatmap: Option<PathBuf>,
    /// Write a JSON record.
    #[arg(long, value_name = "F")]
    json: Option<PathBuf>,
}

fn parse_metric(text: &str) -> Result<String, String> {
    let known = || ["all", "paper"].into_iter().chain(metrics::NAMES.iter().map(|(n, _)| *n));
    if known().any(|n| n == text) {
        return Ok(text.into());
    }
    Err(format!("known metrics are {}", known().collect::<Vec<_>>().join(", ")))
}

pub fn run(args: Args) -> Result<()> {
    let (a, b) = (Shown::read(&args.a, args.tonemap)?, Shown::read(&args.b, args.tonemap)?);
    let comparison = a.against(&b)?;
    if let Some(path) = &args.heatmap {
        a.write_heat_map(&b, path)?;
    }
    if let Some(path) = &args.json {
        image_io::write_whole(path, format!("{}\n", serde_json::to_string_pretty(&comparison)?).as_bytes())?;
    }
    let wanted = |name: &str| match args.metric.as_str() {
        "all" => true,
        "paper" => ["l1", "l2", "paper-ssim", "fid"].contains(&name),
        one => one == name,
    };
    for (name, _) in metrics::NAMES.iter().filter(|(n, _)| wanted(n)) {
        match comparison.value(name) {
            Some(value) => println!("{name:<12}{value:.6}"),
            None if args.metric == *name => return Err(usage(format!("{name} needs two linear pictures (EXR)"))),
            None => {}
        }
    }
    Ok(())
}

/// A picture as it is shown, with its radiance where that is known.
pub struct Shown {
    name: String,
    size: [usize; 2],
    display: Vec<f32>,
    linear: Option<Vec<f32>>,
}

impl Shown {
    /// A PNG as it is, an EXR's beauty through the view transform.
    pub fn read(path: &Path, tonemap: Tonemap) -> Result<Self> {
        let name = path.display().to_string();
        Ok(match image_io::read(path)? {
            Decoded::Display(image) => Self {
                name,
                size: [image.width as usize, image.height as usize],
                display: image.to_rgb(),
                linear: None,
            },
            Decoded::Linear(layers) => {
                layers.check_finite("Combined")?;
                let image = layers.image("Combined")?;
                Self::linear(name, [image.width as usize, image.height as usize], image.to_rgb(), 0.0, tonemap)
            }
        })
    }

    /// Linear RGB, shown `ev` stops brighter through the view transform, in 8-bit steps as a saved picture would be.
    pub fn linear(name: String, size: [usize; 2], linear: Vec<f32>, ev: f32, tonemap: Tonemap) -> Self {
        let display = shown_bytes(&linear, ev, tonemap).into_iter().map(|b| f32::from(b) / 255.0).collect();
        Self { name, size, display, linear: Some(linear) }
    }

    /// All metrics of this picture against `reference`.
    pub fn against(&self, reference: &Shown) -> Result<Comparison> {
        Ok(metrics::compare(self.views()?, reference.views()?)?)
    }

    /// Writes where this picture differs from `reference`; the hot end is a difference of a quarter.
    pub fn write_heat_map(&self, reference: &Shown, path: &Path) -> Result<()> {
        let rgb = metrics::heat_map(self.views()?.display, reference.views()?.display, HEAT_FULL_SCALE)?;
        Ok(image_io::write_png(path, self.size[0] as u32, self.size[1] as u32, &rgb, &[])?)
    }

    fn views(&self) -> Result<Views<'_>> {
        let picture = |pixels| Picture::new(&self.name, self.size[0], self.size[1], pixels);
        Ok(Views { display: picture(&self.display)?, linear: self.linear.as_deref().map(picture).transpose()? })
    }
}

/// 8-bit sRGB of linear RGB, `ev` stops brighter, through the view transform.
pub fn shown_bytes(linear: &[f32], ev: f32, tonemap: Tonemap) -> Vec<u8> {
    let gain = ev.exp2();
    tonemap.apply_to_bytes(&linear.iter().map(|v| v * gain).collect::<Vec<_>>())
}
