//! What "good enough" means: a metric and its bound, and how well the truth has to be known for
//! that.

use crate::metrics;
use crate::reference::{Layer, TracerOptions};
use crate::study::{judge, session::Frame, truth};
use bouncelight::render::capture;
use std::cmp::Ordering;
use std::str::FromStr;

/// Which number.
#[derive(Debug, Clone, PartialEq)]
pub enum Metric {
    /// Error of the light that a method has to add ([`judge::light_error`]).
    Light,
    /// A metric of `bouncelight compare`, by name.
    Shown(String),
}

/// A metric and the bound that must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct QualityTarget {
    /// Which number.
    pub metric: Metric,
    /// Its bound.
    pub target: f64,
}

/// Share of the target that the reference's own noise may make.
const NOISE: f64 = 0.25;
/// Noise of a pixel that references have for metrics of what is shown, whose own floor nobody can
/// tell.
const SHOWN_NOISE: f64 = 0.03;
/// Frames that are averaged for metrics of what is shown, which see aliasing.
const SHOWN_SAMPLES: u32 = 4;

/// `light=8%` or a metric of `compare` with a number, such as `flip=0.06`.
impl FromStr for QualityTarget {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("write it as METRIC=BOUND, such as light=8%")?;
        let (number, share) = match value.strip_suffix('%') {
            Some(number) => (number, 0.01),
            None => (value, 1.0),
        };
        let target = number.trim().parse::<f64>().map_err(|e| format!("{value}: {e}"))? * share;
        if !(target.is_finite() && target > 0.0) {
            return Err(format!("{value}: the bound must be above 0"));
        }
        let metric = match name {
            "light" => Metric::Light,
            // A second kind of FLIP and the bias add nothing to judge methods by.
            "hdrflip" | "bias" => {
                return Err(format!("`{name}` cannot be a target; use light, flip, l1, psnr, ssim or mre"));
            }
            name if metrics::NAMES.iter().any(|(known, _)| *known == name) => Metric::Shown(name.into()),
            name => {
                let known = metrics::NAMES.map(|(n, _)| n).join(", ");
                return Err(format!("`{name}` is not a metric; there are: light, {known}"));
            }
        };
        if metric == Metric::Light && target >= 1.0 {
            return Err(format!("{value}: a share is below 1; write it as light=8%"));
        }
        Ok(Self { metric, target })
    }
}

impl QualityTarget {
    /// The metric's name.
    pub fn name(&self) -> &str {
        match &self.metric {
            Metric::Light => "light",
            Metric::Shown(name) => name,
        }
    }

    /// Whether larger numbers are better.
    fn more_is_better(&self) -> bool {
        metrics::NAMES.iter().any(|(name, more)| *name == self.name() && *more)
    }

    /// Whether `value` is on the good side. What is no number is not.
    pub fn is_met(&self, value: f64) -> bool {
        if self.more_is_better() { value >= self.target } else { value <= self.target }
    }

    /// The better of two first.
    pub(super) fn order(&self, a: f64, b: f64) -> Ordering {
        if self.more_is_better() { b.total_cmp(&a) } else { a.total_cmp(&b) }
    }

    /// The worst of the views' values.
    pub(super) fn worst(&self, values: &[f64]) -> f64 {
        values.iter().copied().max_by(|a, b| self.order(*a, *b)).unwrap_or(f64::NAN)
    }

    /// How references are traced: to the error that the target needs, and no more.
    pub fn reference(&self, max_samples: u32) -> TracerOptions {
        match self.metric {
            // Blocks of 4×4 pixels average a pixel's noise; of a Gaussian the mean |Δ| is √(2/π) of
            // the root mean square.
            Metric::Light => {
                let pixel = NOISE * self.target * judge::BLOCK as f64 / std::f64::consts::FRAC_2_PI.sqrt();
                truth::until(Layer::Gi, pixel, max_samples, 0)
            }
            Metric::Shown(_) => truth::until(Layer::Combined, SHOWN_NOISE, max_samples, 0),
        }
    }

    /// How much of the target the reference's own noise may make, in the metric's unit.
    pub(super) fn noise_allowed(&self) -> f64 {
        NOISE * self.target
    }

    /// Frames that are averaged for a picture.
    pub(super) fn samples(&self) -> u32 {
        if self.metric == Metric::Light { 1 } else { SHOWN_SAMPLES }
    }

    /// What the metric would say of the reference's own noise; 0 where that is unknown.
    pub(super) fn noise(&self, reference: &truth::Reference) -> Result<f64, String> {
        match self.metric {
            Metric::Light => judge::light_error(reference.layer(Layer::Gi), reference)
                .map(|l| l.floor)
                .ok_or_else(|| "its reference has no light that a method could add".into()),
            Metric::Shown(_) => Ok(0.0),
        }
    }

    /// What the metric says of one picture.
    pub(super) fn of(&self, shot: &Frame, reference: &truth::Reference) -> Result<f64, String> {
        match &self.metric {
            Metric::Light => {
                let light = &shot.layer(capture::Layer::DiffInd).data;
                let found = judge::light_error(light, reference);
                found.map(|l| l.error).ok_or_else(|| "its reference has no light that a method could add".into())
            }
            Metric::Shown(name) => {
                let flip = name == "flip";
                let compared = judge::compare(&shot.rgb(), reference, flip).map_err(|e| e.to_string())?;
                compared.value(name).ok_or_else(|| format!("`{name}` cannot be computed here"))
            }
        }
    }

    /// A value for people.
    pub fn show(&self, value: f64) -> String {
        match self.metric {
            _ if value.is_nan() => "-".into(),
            Metric::Light => format!("{:.1} %", value * 100.0),
            Metric::Shown(_) if value.abs() >= 100.0 => format!("{value:.0}"),
            Metric::Shown(_) => format!("{value:.4}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_read_and_wrong_ones_named() {
        let light: QualityTarget = "light=8%".parse().unwrap();
        assert_eq!((light.metric.clone(), (light.target * 100.0).round()), (Metric::Light, 8.0));
        assert_eq!("flip=0.06".parse::<QualityTarget>().unwrap().target, 0.06);
        for bad in ["", "light", "light=", "light=-1%", "light=0", "light=120%", "light=nan", "magic=1", "bias=0.1"] {
            assert!(bad.parse::<QualityTarget>().is_err(), "{bad}");
        }
    }

    #[test]
    fn what_is_worst_depends_on_the_metric() {
        let (light, psnr): (QualityTarget, QualityTarget) = ("light=8%".parse().unwrap(), "psnr=30".parse().unwrap());
        assert_eq!((light.worst(&[0.1, 0.3]), psnr.worst(&[28.0, 33.0])), (0.3, 28.0));
        assert!(light.is_met(0.08) && !light.is_met(0.081) && psnr.is_met(30.0) && !psnr.is_met(29.9));
        assert!(!light.is_met(f64::NAN) && !psnr.is_met(f64::NAN), "no number is good enough");
    }

    #[test]
    fn references_are_no_better_than_the_target_needs() {
        let bound = |text: &str| text.parse::<QualityTarget>().unwrap().reference(4096).until_error.unwrap().1;
        assert!((bound("light=8%") - 0.1003).abs() < 1e-3, "{}", bound("light=8%"));
        assert!(bound("light=16%") > 1.9 * bound("light=8%"));
    }
}
