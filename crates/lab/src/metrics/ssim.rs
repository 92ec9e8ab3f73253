//! Structural similarity over a 7×7 uniform window, as scikit-image's `structural_similarity`
//! computes it by default: sample covariance, K1 = 0.01, K2 = 0.03, mean over the windows that lie
//! inside, then over the channels. (Wang, Bovik, Sheikh, Simoncelli 2004, with a uniform in place
//! of a Gaussian window.)

use super::{MetricError, Picture};

/// Edge of the window, pixels.
pub const SSIM_WINDOW: usize = 7;

/// SSIM of two pictures whose values span `data_range`: 1 for display values as they are; see
/// [`super::paper::ssim`].
///
/// # Errors
/// Different sizes; fewer than 7 pixels in width or height.
pub fn ssim(a: Picture<'_>, b: Picture<'_>, data_range: f64) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    let channels = [0, 1, 2].map(|c| (a.channel(c), b.channel(c)));
    ssim_of_channels(&channels, a.width(), a.height(), data_range)
}

/// Mean over channels given as pairs of planes.
pub(super) fn ssim_of_channels(
    channels: &[(Vec<f64>, Vec<f64>)],
    width: usize,
    height: usize,
    data_range: f64,
) -> Result<f64, MetricError> {
    if width < SSIM_WINDOW || height < SSIM_WINDOW {
        return Err(MetricError::TooSmall { metric: "SSIM", least: "7×7 pixels", width, height });
    }
    let sum: f64 = channels.iter().map(|(a, b)| plane(a, b, width, data_range)).sum();
    Ok(sum / channels.len() as f64)
}

fn plane(a: &[f64], b: &[f64], width: usize, data_range: f64) -> f64 {
    let samples = (SSIM_WINDOW * SSIM_WINDOW) as f64;
    let unbiased = samples / (samples - 1.0);
    let (c1, c2) = ((0.01 * data_range).powi(2), (0.03 * data_range).powi(2));
    let product = |x: &[f64], y: &[f64]| -> Vec<f64> { x.iter().zip(y).map(|(x, y)| x * y).collect() };
    let means = [a.to_vec(), b.to_vec(), product(a, a), product(b, b), product(a, b)].map(|p| window_means(&p, width));
    let windows = means[0].len();
    let total: f64 = (0..windows)
        .map(|i| {
            let [ma, mb, aa, bb, ab] = [0, 1, 2, 3, 4].map(|k| means[k][i]);
            let (va, vb, cov) = (unbiased * (aa - ma * ma), unbiased * (bb - mb * mb), unbiased * (ab - ma * mb));
            ((2.0 * ma * mb + c1) * (2.0 * cov + c2)) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
        })
        .sum();
    total / windows as f64
}

/// Mean of every window that lies inside the plane, rows from the top.
fn window_means(plane: &[f64], width: usize) -> Vec<f64> {
    let across: Vec<Vec<f64>> =
        plane.chunks_exact(width).map(|row| row.windows(SSIM_WINDOW).map(|w| w.iter().sum()).collect()).collect();
    let inside = width - SSIM_WINDOW + 1;
    let scale = 1.0 / (SSIM_WINDOW * SSIM_WINDOW) as f64;
    across
        .windows(SSIM_WINDOW)
        .flat_map(|rows| (0..inside).map(|x| rows.iter().map(|r| r[x]).sum::<f64>() * scale).collect::<Vec<_>>())
        .collect()
}
