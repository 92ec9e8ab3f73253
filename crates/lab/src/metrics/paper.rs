//! The four numbers of Harris-Dewey and Klein 2021 (arXiv 2110.12039), as their published code
//! computes them.
//!
//! Pictures are display values in [0, 1] (8-bit sRGB after Blender's Filmic view). Before anything
//! else each channel of each picture is stretched on its own to its own minimum and maximum. That
//! hides exposure errors and magnifies small ones, so these numbers never stand alone. "FID" is not
//! the Inception distance but the Fréchet distance between the Gaussians of the two pictures' RGB
//! values.

use super::ssim::ssim_of_channels;
use super::{MetricError, Picture};

/// Data range of SSIM: what scikit-image took for floats by default (−1 to 1).
pub const SSIM_DATA_RANGE: f64 = 2.0;

/// The channels of `picture`, each stretched to [0, 1]; a channel of one value becomes 0.
pub fn stretch(picture: Picture<'_>) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|c| {
        let plane = picture.channel(c);
        let low = plane.iter().copied().fold(f64::INFINITY, f64::min);
        let high = plane.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let scale = if high > low { 1.0 / (high - low) } else { 0.0 };
        plane.into_iter().map(|v| (v - low) * scale).collect()
    })
}

/// Sum of |a − b| over all pixels and channels, stretched: grows with the picture's size.
///
/// # Errors
/// Different sizes.
pub fn l1(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    sum(a, b, f64::abs)
}

/// Sum of (a − b)² over all pixels and channels, stretched: grows with the picture's size.
///
/// # Errors
/// Different sizes.
pub fn l2(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    sum(a, b, |d| d * d)
}

/// SSIM with data range 2, stretched.
///
/// # Errors
/// Different sizes; fewer than 7 pixels in width or height.
pub fn ssim(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    let (width, height) = (a.width(), a.height());
    let pairs: Vec<_> = stretch(a).into_iter().zip(stretch(b)).collect();
    ssim_of_channels(&pairs, width, height, SSIM_DATA_RANGE)
}

/// |μa − μb|² + tr(Ca + Cb − 2 (Ca Cb)^½) of the stretched pixels' means and sample covariances.
///
/// # Errors
/// Different sizes; a single pixel.
pub fn fid(a: Picture<'_>, b: Picture<'_>) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    let (width, height) = (a.width(), a.height());
    if width * height < 2 {
        return Err(MetricError::TooSmall { metric: "FID", least: "2 pixels", width, height });
    }
    let ((ma, ca), (mb, cb)) = (gaussian(&stretch(a)), gaussian(&stretch(b)));
    // (Ca Cb)^½ has the eigenvalues of the symmetric (Ca^½ Cb Ca^½)^½, which needs no complex
    // arithmetic.
    let root = square_root(ca);
    let (values, _) = eigen(product(product(root, cb), root));
    let cross: f64 = values.iter().map(|v| v.max(0.0).sqrt()).sum();
    let mean: f64 = (0..3).map(|i| (ma[i] - mb[i]).powi(2)).sum();
    // Rounding can leave equal pictures a hair below zero.
    Ok((mean + (0..3).map(|i| ca[i][i] + cb[i][i]).sum::<f64>() - 2.0 * cross).max(0.0))
}

fn sum(a: Picture<'_>, b: Picture<'_>, f: impl Fn(f64) -> f64) -> Result<f64, MetricError> {
    a.same_size(&b)?;
    let pairs = stretch(a).into_iter().zip(stretch(b));
    Ok(pairs.map(|(a, b)| a.iter().zip(&b).map(|(a, b)| f(a - b)).sum::<f64>()).sum())
}

type Matrix = [[f64; 3]; 3];

/// Mean and sample covariance.
fn gaussian(planes: &[Vec<f64>; 3]) -> ([f64; 3], Matrix) {
    let count = planes[0].len() as f64;
    let mean = [0, 1, 2].map(|c| planes[c].iter().sum::<f64>() / count);
    let covariance = |i: usize, j: usize| {
        let sum: f64 = planes[i].iter().zip(&planes[j]).map(|(x, y)| (x - mean[i]) * (y - mean[j])).sum();
        sum / (count - 1.0)
    };
    (mean, [0, 1, 2].map(|i| [0, 1, 2].map(|j| covariance(i, j))))
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Of a symmetric matrix without negative eigenvalues.
fn square_root(m: Matrix) -> Matrix {
    let (values, vectors) = eigen(m);
    let roots = values.map(|v| v.max(0.0).sqrt());
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| vectors[i][k] * roots[k] * vectors[j][k]).sum()))
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix by Jacobi rotations; 3×3 settles in
/// a few sweeps.
fn eigen(mut m: Matrix) -> ([f64; 3], Matrix) {
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..30 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            // The product in `fid` is symmetric up to rounding only.
            let off = 0.5 * (m[p][q] + m[q][p]);
            if off == 0.0 {
                continue;
            }
            let theta = (m[q][q] - m[p][p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let mut rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            (rotation[p][p], rotation[q][q], rotation[p][q], rotation[q][p]) = (c, c, t * c, -t * c);
            let transposed = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rotation[j][i]));
            m = product(product(transposed, m), rotation);
            vectors = product(vectors, rotation);
        }
    }
    ([m[0][0], m[1][1], m[2][2]], vectors)
}
