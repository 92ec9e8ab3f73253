//! PSNR, mean absolute error and the relative errors of radiance. The second picture is the
//! reference.

use super::{LinearMetrics, MetricError, Picture};

/// Peak signal-to-noise ratio in decibels for values that span 1; infinite for equal pictures.
///
/// # Errors
/// Different sizes.
pub fn psnr(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    Ok(-10.0 * mean(a, b, |a, b| (a - b) * (a - b))?.log10())
}

/// Mean of |a − b| over pixels and channels.
///
/// # Errors
/// Different sizes.
pub fn mean_absolute_error(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    mean(a, b, |a, b| (a - b).abs())
}

/// Mean of (a − b)² / (b² + 0.01) over pixels and channels, for linear radiance (Rousselle, Knaus,
/// Zwicker 2011): errors weigh by how bright the reference `b` is, and 0.01 keeps black pixels from
/// deciding alone.
///
/// # Errors
/// Different sizes.
pub fn rel_mse(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    mean(a, b, relative_square)
}

/// Mean |a − b| divided by mean |b|, for linear radiance: 0.02 means that the errors together are 2
/// % of the light. Zero for equal pictures, infinite where only the reference is black.
///
/// # Errors
/// Different sizes.
pub fn mean_relative_error(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    Ok(LinearMetrics::of(a.pixels(), b.pixels()).mean_relative_error)
}

/// Mean (a − b) divided by mean |b|, for linear radiance: positive where `a` is too bright. What of
/// [`mean_relative_error`] is systematic; noise averages out of it.
///
/// # Errors
/// Different sizes.
pub fn bias(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    Ok(LinearMetrics::of(a.pixels(), b.pixels()).bias)
}

impl LinearMetrics {
    /// Of as many values of each picture, in the same order, finite.
    pub(crate) fn of(a: &[f32], b: &[f32]) -> Self {
        let mean_absolute_error = mean_of(a, b, |a, b| (a - b).abs());
        let light = mean_of(a, b, |_, b| b.abs());
        // Nothing is off by nothing, even in the dark.
        let relative = |error: f64| if error == 0.0 { 0.0 } else { error / light };
        Self {
            rel_mse: mean_of(a, b, relative_square),
            mean_absolute_error,
            mean_relative_error: relative(mean_absolute_error),
            bias: relative(mean_of(a, b, |a, b| a - b)),
        }
    }
}

fn relative_square(a: f64, b: f64) -> f64 {
    (a - b) * (a - b) / (b * b + 0.01)
}

fn mean(a: Picture<'_>, b: Picture<'_>, f: impl Fn(f64, f64) -> f64) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    Ok(mean_of(a.pixels(), b.pixels(), f))
}

fn mean_of(a: &[f32], b: &[f32], f: impl Fn(f64, f64) -> f64) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(&a, &b)| f(f64::from(a), f64::from(b))).sum();
    sum / a.len() as f64
}
