//! `bouncelight compare A B`: the paper's four metrics and today's, a heat map, a JSON record; or
//! one layer of two EXR.

use super::args::usage;
use super::stdout::say;
use anyhow::Result;
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight_lab::metrics::{
    self, Comparison, FlipMaps, LayerComparison, MetricError, Options, Picture, Views, flip,
};
use bouncelight_scene::image_io::{self, Decoded, ImageError, Layers};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Difference that is shown at the hot end of a heat map of `mae`, in display values.
const HEAT_FULL_SCALE: f32 = 0.25;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options")]
pub struct Args {
    /// Picture to judge: PNG, or EXR (linear, Blender's layer names).
    #[arg(help_heading = None)]
    a: PathBuf,
    /// The reference.
    #[arg(help_heading = None)]
    b: PathBuf,
    /// Metric by name, `all`, or `paper` (its four); docs/internals/metrics.md explains them.
    #[arg(long, default_value = "all", value_parser = parse_metric)]
    metric: String,
    /// View transform of EXR for metrics of display values: filmic, agx, neutral or none.
    #[arg(long, default_value = "filmic")]
    tonemap: Tonemap,
    /// Compare this layer of two EXR, linear, by relmse, mre, bias and mae.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["tonemap", "pixels_per_degree", "heatmap_metric"])]
    layer: Option<String>,
    /// Pixels per degree of vision, above 0, for flip and hdrflip; 67: 0.7 m from a 4K display.
    #[arg(long, default_value_t = flip::PIXELS_PER_DEGREE, value_parser = parse_pixels_per_degree, value_name = "PPD")]
    pixels_per_degree: f32,
    /// Picture of the differences to write, in magma.
    #[arg(long, value_name = "PNG")]
    heatmap: Option<PathBuf>,
    /// What it shows: flip or hdrflip from 0 to 1, or mae from 0 to 0.25.
    #[arg(long, value_enum, default_value = "flip", requires = "heatmap", value_name = "METRIC")]
    heatmap_metric: Heat,
    /// Record to write; `-`: standard output, which then holds nothing else.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight compare ours.exr reference.exr
  bouncelight compare ours.png reference.png --metric flip --heatmap differences.png
  bouncelight compare ours.exr reference.exr --layer DiffInd";

/// What a heat map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[allow(missing_docs, reason = "the variants are their own words on the command line")]
pub enum Heat {
    Flip,
    Hdrflip,
    // Mean difference of the channels.
    Mae,
}

impl Heat {
    /// The map that goes with a metric: its own, or the mean difference.
    pub fn of_metric(name: &str) -> Self {
        match name {
            "flip" => Heat::Flip,
            "hdrflip" => Heat::Hdrflip,
            _ => Heat::Mae,
        }
    }
}

const PAPER: [&str; 4] = ["l1", "l2", "paper-ssim", "fid"];

fn parse_metric(text: &str) -> Result<String, String> {
    let known = || ["all", "paper"].into_iter().chain(metrics::NAMES.iter().map(|(n, _)| *n));
    if known().any(|n| n == text) {
        return Ok(text.into());
    }
    Err(format!("known metrics are {}", known().collect::<Vec<_>>().join(", ")))
}

fn parse_pixels_per_degree(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(ppd) if ppd > 0.0 && ppd <= flip::MAX_PIXELS_PER_DEGREE => Ok(ppd),
        Ok(_) => Err(format!("more than 0 and at most {}", flip::MAX_PIXELS_PER_DEGREE)),
        Err(e) => Err(e.to_string()),
    }
}

pub fn run(args: Args) -> Result<()> {
    for path in args.heatmap.iter().chain(&args.json) {
        image_io::check_writable(path)?;
    }
    match &args.layer {
        Some(layer) => compare_layer(&args, layer),
        None => compare_pictures(&args),
    }
}

fn compare_pictures(args: &Args) -> Result<()> {
    let heat = args.heatmap.as_ref().map(|_| args.heatmap_metric);
    let wants = |name: &str| ["all", name].contains(&args.metric.as_str());
    let options = Options {
        flip: wants("flip") || heat == Some(Heat::Flip),
        hdr_flip: wants("hdrflip") || heat == Some(Heat::Hdrflip),
        pixels_per_degree: args.pixels_per_degree,
    };
    let [a, b] = [&args.a, &args.b].map(|path| Shown::read(path, args.tonemap, 0.0));
    let (a, b) = (a?, b?);
    let (comparison, maps) = a.against(&b, options)?;
    let needs_light = |name: &str| {
        let why = "two linear pictures (EXR); a PNG holds what is shown, not light";
        usage(format!("{name} needs {why}: {} and {}", args.a.display(), args.b.display()))
    };
    let mut rows = Vec::new();
    for (name, _) in metrics::NAMES {
        let wanted = match args.metric.as_str() {
            "all" => true,
            "paper" => PAPER.contains(&name),
            one => one == name,
        };
        match comparison.value(name) {
            Some(value) if wanted => rows.push((name, value)),
            None if args.metric == name => return Err(needs_light(name)),
            _ => {}
        }
    }
    if let (Some(path), Some(heat)) = (&args.heatmap, heat) {
        let rgb = a.heat_map(&b, heat, &maps)?.ok_or_else(|| needs_light("--heatmap-metric hdrflip"))?;
        image_io::write_png(path, a.size[0] as u32, a.size[1] as u32, &rgb, &[])?;
    }
    report(args, &comparison, &rows)
}

/// The record into its file, the rows on standard output.
fn report(args: &Args, record: &impl Serialize, rows: &[(&str, f64)]) -> Result<()> {
    if let Some(path) = &args.json {
        super::record::write(path, record)?;
    }
    if args.json.as_deref() != Some(Path::new("-")) {
        rows.iter().for_each(|(name, value)| say!("{name:<12}{value:.6}"));
    }
    Ok(())
}

/// One layer of two EXR, as it is stored.
fn compare_layer(args: &Args, layer: &str) -> Result<()> {
    let (a, b) = (read_layers(&args.a, layer)?, read_layers(&args.b, layer)?);
    let values = |layers: &Layers| -> Result<(Vec<String>, Vec<f32>)> {
        // Coverage is no light.
        let channels = layers.layer(layer)?.channels.iter().filter(|(name, _)| name != "A");
        let (names, planes): (Vec<_>, Vec<_>) = channels.cloned().unzip();
        Ok((names, planes.concat()))
    };
    let ((a_names, a_values), (b_names, b_values)) = (values(&a)?, values(&b)?);
    if (a.width, a.height) != (b.width, b.height) {
        return Err(MetricError::sizes(
            (&args.a.display().to_string(), a.width as usize, a.height as usize),
            (&args.b.display().to_string(), b.width as usize, b.height as usize),
        )
        .into());
    }
    if a_names != b_names || a_names.is_empty() {
        let (a, b) = (a_names.join(" "), b_names.join(" "));
        return Err(usage(format!(
            "layer {layer} has the channels {a} in {} and {b} in {}",
            args.a.display(),
            args.b.display()
        )));
    }
    let [a_name, b_name] = [&args.a, &args.b].map(|p| p.display().to_string());
    let size = [a.width as usize, a.height as usize];
    let record = LayerComparison::new([&a_name, &b_name], size, layer, &a_values, &b_values)?;
    let linear = &record.linear;
    let all = [
        ("relmse", linear.rel_mse),
        ("mre", linear.mean_relative_error),
        ("bias", linear.bias),
        ("mae", linear.mean_absolute_error),
    ];
    let rows: Vec<_> = all.into_iter().filter(|(name, _)| ["all", name].contains(&args.metric.as_str())).collect();
    if rows.is_empty() {
        return Err(usage(format!(
            "{} is for whole pictures; a layer has all, relmse, mre, bias and mae",
            args.metric
        )));
    }
    if let Some(path) = &args.heatmap {
        let (x, y) = (a.image(layer)?.to_rgb(), b.image(layer)?.to_rgb());
        let [x, y] = [(&a_name, &x), (&b_name, &y)].map(|(name, pixels)| Picture::new(name, size[0], size[1], pixels));
        // The hot end is the reference's mean.
        let mean = b_values.iter().map(|v| f64::from(v.abs())).sum::<f64>() / b_values.len() as f64;
        image_io::write_png(path, a.width, a.height, &metrics::heat_map(x?, y?, mean as f32)?, &[])?;
    }
    report(args, &record, &rows)
}

/// An EXR whose layer `layer` holds numbers only.
fn read_layers(path: &Path, layer: &str) -> Result<Layers> {
    let Decoded::Linear(layers) = image_io::read(path)? else {
        return Err(usage(format!("{}: is a PNG, which has no layers; --layer needs two EXR", path.display())));
    };
    match layers.check_finite(layer) {
        // Which layer is the command line's to say.
        Err(e @ ImageError::NoLayer { .. }) => Err(usage(e.to_string())),
        checked => Ok(checked.map(|()| layers)?),
    }
}

/// A picture as it is shown, with its radiance where that is known.
pub struct Shown {
    name: String,
    size: [usize; 2],
    display: Vec<f32>,
    linear: Option<Vec<f32>>,
}

impl Shown {
    /// A PNG as it is, an EXR's beauty through the view transform, `ev` stops brighter.
    pub fn read(path: &Path, tonemap: Tonemap, ev: f32) -> Result<Self> {
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
                Self::linear(name, [image.width as usize, image.height as usize], image.to_rgb(), ev, tonemap)
            }
        })
    }

    /// A picture to judge a rendering of `size` pixels by. What makes that impossible is reported
    /// here, before the rendering.
    pub fn reference(path: &Path, tonemap: Tonemap, ev: f32, size: [u32; 2], metric: &str) -> Result<Self> {
        let shown = Self::read(path, tonemap, ev)?;
        let size = size.map(|n| n as usize);
        if shown.size != size {
            let [width, height] = shown.size;
            return Err(MetricError::sizes(("the rendering", size[0], size[1]), (&shown.name, width, height)).into());
        }
        if shown.linear.is_none() && metrics::NEEDS_RADIANCE.contains(&metric) {
            return Err(usage(format!("{metric} needs a linear reference (EXR), not {}", shown.name)));
        }
        Ok(shown)
    }

    /// Linear RGB, shown `ev` stops brighter through the view transform, in 8-bit steps as a saved
    /// picture would be.
    pub fn linear(name: String, size: [usize; 2], linear: Vec<f32>, ev: f32, tonemap: Tonemap) -> Self {
        let display = crate::shown::rgb(&linear, ev, tonemap).into_iter().map(|b| f32::from(b) / 255.0).collect();
        Self { name, size, display, linear: Some(linear) }
    }

    /// The metrics that `options` ask for, of this picture against `reference`.
    pub fn against(&self, reference: &Shown, options: Options) -> Result<(Comparison, FlipMaps)> {
        Ok(metrics::compare_with(self.views()?, reference.views()?, options)?)
    }

    /// sRGB bytes of where this picture differs from `reference`; `None` for FLIP maps that `maps`
    /// lacks.
    pub fn heat_map(&self, reference: &Shown, heat: Heat, maps: &FlipMaps) -> Result<Option<Vec<u8>>> {
        Ok(match heat {
            Heat::Flip => maps.flip.as_ref().map(|m| m.heat_map()),
            Heat::Hdrflip => maps.hdr_flip.as_ref().map(|m| m.heat_map()),
            Heat::Mae => Some(metrics::heat_map(self.views()?.display, reference.views()?.display, HEAT_FULL_SCALE)?),
        })
    }

    fn views(&self) -> Result<Views<'_>> {
        let picture = |pixels| Picture::new(&self.name, self.size[0], self.size[1], pixels);
        Ok(Views { display: picture(&self.display)?, linear: self.linear.as_deref().map(picture).transpose()? })
    }
}
