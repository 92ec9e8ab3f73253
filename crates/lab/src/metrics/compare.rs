//! Every metric of one pair of pictures.

use super::flip::{self, Exposures, FlipMap};
use super::{MetricError, Picture, basic, paper, ssim};
use serde::Serialize;

/// One rendering, as shown and, where it is known, as linear radiance.
#[derive(Debug, Clone, Copy)]
pub struct Views<'a> {
    /// Display-encoded sRGB in [0, 1].
    pub display: Picture<'a>,
    /// Linear Rec.709 radiance.
    pub linear: Option<Picture<'a>>,
}

/// All metrics of a pair; serialises to the record that `compare --json` writes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Version of this record.
    pub schema: u32,
    /// Name of the compared picture.
    pub a: String,
    /// Name of the reference.
    pub b: String,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The seed paper's numbers.
    pub paper: PaperMetrics,
    /// On display values.
    pub display: DisplayMetrics,
    /// On linear radiance, where both pictures have it.
    pub linear: Option<LinearMetrics>,
    /// See [`flip`]; null where it was not asked for.
    pub flip: Option<f64>,
    /// See [`flip::hdr_flip`]; null where it was not asked for or a picture has no radiance.
    pub hdr_flip: Option<HdrFlip>,
    /// What FLIP took for the viewing distance.
    pub pixels_per_degree: f32,
}

/// See [`paper`]. Sums grow with the picture: the paper's table is for 1024×512.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PaperMetrics {
    /// Sum of absolute differences, stretched.
    pub l1: f64,
    /// Sum of squared differences, stretched.
    pub l2: f64,
    /// SSIM with data range 2, stretched.
    pub ssim: f64,
    /// Fréchet distance of RGB Gaussians, stretched.
    pub fid: f64,
}

/// On display values in [0, 1], not stretched.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DisplayMetrics {
    /// Decibels; infinite, in JSON null, for equal pictures.
    pub psnr: f64,
    /// SSIM with data range 1.
    pub ssim: f64,
    /// Mean |a − b|.
    pub mean_absolute_error: f64,
}

/// On linear radiance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearMetrics {
    /// See [`basic::rel_mse`].
    pub rel_mse: f64,
    /// Mean |a − b|.
    pub mean_absolute_error: f64,
    /// See [`basic::mean_relative_error`]; in JSON null where only the reference is black.
    pub mean_relative_error: f64,
    /// See [`basic::bias`].
    pub bias: f64,
}

/// HDR-FLIP and where it looked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HdrFlip {
    /// The number that is reported.
    pub mean: f64,
    /// Chosen from the reference.
    pub exposures: Exposures,
}

/// Metrics of one layer of two files; serialises to the record that `compare --layer --json`
/// writes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerComparison {
    /// Version of this record.
    pub schema: u32,
    /// Name of the compared picture.
    pub a: String,
    /// Name of the reference.
    pub b: String,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The layer.
    pub layer: String,
    /// Over all its pixels and channels.
    pub linear: LinearMetrics,
}

impl LayerComparison {
    /// `a` and `b` hold the same channels of every pixel in the same order, finite.
    ///
    /// # Errors
    /// [`MetricError::Shape`] where they cannot.
    pub fn new(
        names: [&str; 2],
        [width, height]: [usize; 2],
        layer: &str,
        a: &[f32],
        b: &[f32],
    ) -> Result<Self, MetricError> {
        let fits = |values: &[f32]| {
            !values.is_empty() && values.len() == a.len() && values.len().is_multiple_of(width * height)
        };
        for (name, values) in names.into_iter().zip([a, b]) {
            if width == 0 || height == 0 || !fits(values) {
                return Err(MetricError::Shape { picture: name.into(), width, height, values: values.len() });
            }
        }
        let [first, second] = names.map(String::from);
        let linear = LinearMetrics::of(a, b);
        Ok(Self { schema: 1, a: first, b: second, width, height, layer: layer.into(), linear })
    }
}

/// What takes long and may be left out, and how FLIP looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Compute FLIP.
    pub flip: bool,
    /// Compute HDR-FLIP where both pictures have radiance; as long as about ten times FLIP.
    pub hdr_flip: bool,
    /// Viewing distance for both.
    pub pixels_per_degree: f32,
}

impl Default for Options {
    /// Everything, at FLIP's own distance.
    fn default() -> Self {
        Self { flip: true, hdr_flip: true, pixels_per_degree: flip::PIXELS_PER_DEGREE }
    }
}

/// Where the pictures differ, for what was computed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FlipMaps {
    /// Of FLIP.
    pub flip: Option<FlipMap>,
    /// Of HDR-FLIP.
    pub hdr_flip: Option<FlipMap>,
}

/// Names that [`Comparison::value`] knows, and whether more is better.
pub const NAMES: [(&str, bool); 12] = [
    ("l1", false),
    ("l2", false),
    ("paper-ssim", true),
    ("fid", false),
    ("psnr", true),
    ("ssim", true),
    ("mae", false),
    ("flip", false),
    ("relmse", false),
    ("mre", false),
    ("bias", false),
    ("hdrflip", false),
];

/// The names of metrics of radiance; the others are for display values.
pub const NEEDS_RADIANCE: [&str; 4] = ["relmse", "mre", "bias", "hdrflip"];

impl Comparison {
    /// The metric called `name` (one of [`NAMES`]); `None` for other names, for what was not asked
    /// for, and for metrics of radiance without linear pictures.
    pub fn value(&self, name: &str) -> Option<f64> {
        Some(match name {
            "l1" => self.paper.l1,
            "l2" => self.paper.l2,
            "paper-ssim" => self.paper.ssim,
            "fid" => self.paper.fid,
            "psnr" => self.display.psnr,
            "ssim" => self.display.ssim,
            "mae" => self.display.mean_absolute_error,
            "flip" => self.flip?,
            "relmse" => self.linear.as_ref()?.rel_mse,
            "mre" => self.linear.as_ref()?.mean_relative_error,
            "bias" => self.linear.as_ref()?.bias,
            "hdrflip" => self.hdr_flip.as_ref()?.mean,
            _ => return None,
        })
    }

    /// Whether the metric called `name` is on the good side of `threshold` (equal counts; of `bias`
    /// the size counts and not the sign); `None` as in [`Self::value`].
    pub fn passes(&self, name: &str, threshold: f64) -> Option<bool> {
        let value = self.value(name)?;
        let (_, more_is_better) = NAMES.iter().find(|(n, _)| *n == name)?;
        Some(if *more_is_better { value >= threshold } else { value.abs() <= threshold })
    }
}

/// Every metric of `a` against the reference `b`.
///
/// # Errors
/// Different sizes; fewer than 7 pixels in width or height.
pub fn compare(a: Views<'_>, b: Views<'_>) -> Result<Comparison, MetricError> {
    Ok(compare_with(a, b, Options::default())?.0)
}

/// The metrics that `options` ask for, of `a` against the reference `b`.
///
/// # Errors
/// As [`compare`]; a viewing distance that [`flip::flip`] refuses.
pub fn compare_with(a: Views<'_>, b: Views<'_>, options: Options) -> Result<(Comparison, FlipMaps), MetricError> {
    let (x, y) = (a.display, b.display);
    let linear = a.linear.zip(b.linear);
    if let Some((a, b)) = linear {
        a.same_size(&b)?;
    }
    let ppd = options.pixels_per_degree;
    let seen = options.flip.then(|| flip::flip(x, y, ppd)).transpose()?;
    let hdr = linear.filter(|_| options.hdr_flip).map(|(a, b)| flip::hdr_flip(a, b, ppd)).transpose()?;
    let comparison = Comparison {
        schema: 1,
        a: x.name().into(),
        b: y.name().into(),
        width: x.width(),
        height: x.height(),
        paper: PaperMetrics {
            l1: paper::l1(x, y)?,
            l2: paper::l2(x, y)?,
            ssim: paper::ssim(x, y)?,
            fid: paper::fid(x, y)?,
        },
        display: DisplayMetrics {
            psnr: basic::psnr(x, y)?,
            ssim: ssim(x, y, 1.0)?,
            mean_absolute_error: basic::mean_absolute_error(x, y)?,
        },
        linear: linear.map(|(a, b)| LinearMetrics::of(a.pixels(), b.pixels())),
        flip: seen.as_ref().map(FlipMap::mean),
        hdr_flip: hdr.as_ref().map(|(map, exposures)| HdrFlip { mean: map.mean(), exposures: *exposures }),
        pixels_per_degree: ppd,
    };
    Ok((comparison, FlipMaps { flip: seen, hdr_flip: hdr.map(|(map, _)| map) }))
}
