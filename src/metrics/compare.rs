//! Every metric of one pair of pictures.

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
}

/// Names that [`Comparison::value`] knows, and whether more is better.
pub const NAMES: [(&str, bool); 8] = [
    ("l1", false),
    ("l2", false),
    ("paper-ssim", true),
    ("fid", false),
    ("psnr", true),
    ("ssim", true),
    ("mae", false),
    ("relmse", false),
];

impl Comparison {
    /// The metric called `name` (one of [`NAMES`]); `None` for other names and for `relmse` without linear pictures.
    pub fn value(&self, name: &str) -> Option<f64> {
        Some(match name {
            "l1" => self.paper.l1,
            "l2" => self.paper.l2,
            "paper-ssim" => self.paper.ssim,
            "fid" => self.paper.fid,
            "psnr" => self.display.psnr,
            "ssim" => self.display.ssim,
            "mae" => self.display.mean_absolute_error,
            "relmse" => self.linear.as_ref()?.rel_mse,
            _ => return None,
        })
    }

    /// Whether the metric called `name` is on the good side of `threshold` (equal counts); `None` as in [`Self::value`].
    pub fn passes(&self, name: &str, threshold: f64) -> Option<bool> {
        let value = self.value(name)?;
        let (_, more_is_better) = NAMES.iter().find(|(n, _)| *n == name)?;
        Some(if *more_is_better { value >= threshold } else { value <= threshold })
    }
}

/// Every metric of `a` against the reference `b`.
///
/// # Errors
/// Different sizes; fewer than 7 pixels in width or height.
pub fn compare(a: Views<'_>, b: Views<'_>) -> Result<Comparison, MetricError> {
    let (x, y) = (a.display, b.display);
    let linear = match (a.linear, b.linear) {
        (Some(a), Some(b)) => Some(LinearMetrics {
            rel_mse: basic::rel_mse(a, b)?,
            mean_absolute_error: basic::mean_absolute_error(a, b)?,
        }),
        _ => None,
    };
    Ok(Comparison {
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
        linear,
    })
}
