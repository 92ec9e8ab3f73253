//! PSNR, relative squared error, mean absolute error. The second picture is the reference.

use super::{MetricError, Picture};

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

/// Mean of (a − b)² / (b² + 0.01) over pixels and channels, for linear radiance (Rousselle, Knaus, Zwicker 2011): errors
/// weigh by how bright the reference `b` is, and 0.01 keeps black pixels from deciding alone.
///
/// # Errors
/// Different sizes.
pub fn rel_mse(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    mean(a, b, |a, b| (a - b) * (a - b) / (b * b + 0.01))
}

fn mean(a: Picture<'_>, b: Picture<'_>, f: impl Fn(f64, f64) -> f64) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    let sum: f64 = a.pixels().iter().zip(b.pixels()).map(|(&a, &b)| f(f64::from(a), f64::from(b))).sum();
    Ok(sum / a.pixels().len() as f64)
}
