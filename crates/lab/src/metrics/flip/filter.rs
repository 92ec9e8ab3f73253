//! The filters of FLIP and their separable convolution; a picture goes on beyond its border as its
//! outermost pixels.

use std::f64::consts::PI;

/// Weights around a middle one; always an odd number of them.
pub struct Kernel(Vec<f32>);

/// What the eye resolves in each channel: Gaussians fitted to its contrast sensitivity (FLIP 2020,
/// table 1).
pub struct SpatialKernels {
    /// Achromatic.
    pub y: Kernel,
    /// Red against green.
    pub cx: Kernel,
    /// Yellow against blue: the filter is the sum of two Gaussians, so the results of these two are
    /// added.
    pub cz: [Kernel; 2],
}

impl SpatialKernels {
    /// For a display that shows `ppd` pixels in a degree of the field of view.
    pub fn new(ppd: f32) -> Self {
        // Weight and width of each Gaussian, weight · √(π/width) · exp(−π² x²/width) with x in
        // degrees.
        let (y, cx) = ((1.0, 0.0047), (1.0, 0.0053));
        let cz: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];
        let ppd = f64::from(ppd);
        // One size for all, three deviations of the widest, as the reference has it.
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i64;
        let gaussian = |(weight, width): (f64, f64)| -> Vec<f64> {
            let bell = |i: i64| (-(PI * i as f64 / ppd).powi(2) / width).exp();
            // Both passes apply it, so the root stands for the weight.
            let scale = (weight * (PI / width).sqrt()).sqrt();
            (-radius..=radius).map(|i| scale * bell(i)).collect()
        };
        let sum = |weights: &[f64]| weights.iter().sum::<f64>();
        let alone = |g| {
            let weights = gaussian(g);
            Kernel::scaled(&weights, 1.0 / sum(&weights))
        };
        let pair = cz.map(gaussian);
        // The two passes of each make the square of its sum; all together is 1.
        let scale = 1.0 / pair.iter().map(|g| sum(g).powi(2)).sum::<f64>().sqrt();
        Self { y: alone(y), cx: alone(cx), cz: pair.map(|g| Kernel::scaled(&g, scale)) }
    }
}

/// A Gaussian and its derivatives, which answer to edges and to points (FLIP 2020, section 4.3).
pub struct FeatureKernels {
    /// The Gaussian; sums to 1.
    pub smooth: Kernel,
    /// First derivative; its positive and its negative weights sum to 1 and −1.
    pub edge: Kernel,
    /// Second derivative; normalised likewise.
    pub point: Kernel,
}

impl FeatureKernels {
    /// For `ppd` pixels in a degree: an edge is 0.082 degrees wide.
    pub fn new(ppd: f32) -> Self {
        let deviation = 0.5 * 0.082 * f64::from(ppd);
        let radius = (3.0 * deviation).ceil() as i64;
        let weights = |f: fn(f64, f64) -> f64| -> Vec<f64> {
            let bell = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
            (-radius..=radius).map(|x| f(x as f64, deviation) * bell(x as f64)).collect()
        };
        Self {
            smooth: Kernel::balanced(&weights(|_, _| 1.0)),
            edge: Kernel::balanced(&weights(|x, _| -x)),
            point: Kernel::balanced(&weights(|x, deviation| (x / deviation).powi(2) - 1.0)),
        }
    }
}

impl Kernel {
    fn scaled(weights: &[f64], scale: f64) -> Self {
        Self(weights.iter().map(|w| (w * scale) as f32).collect())
    }

    /// Positive weights sum to 1 and negative ones to −1.
    fn balanced(weights: &[f64]) -> Self {
        let side = |sign: f64| weights.iter().map(|w| (w * sign).max(0.0)).sum::<f64>();
        let (positive, negative) = (side(1.0), side(-1.0));
        // Where a degree has hardly a pixel, every weight beside the middle underflows to 0; it
        // then stays 0.
        let share = |w: &f64| match *w {
            w if w > 0.0 => w / positive,
            w if w < 0.0 => w / negative,
            _ => 0.0,
        };
        Self(weights.iter().map(|w| share(w) as f32).collect())
    }

    /// Filters every row of a plane `width` wide.
    pub fn across(&self, plane: &[f32], width: usize) -> Vec<f32> {
        let radius = self.0.len() / 2;
        let mut padded = vec![0.0; width + 2 * radius];
        let mut out = vec![0.0; plane.len()];
        for (row, out) in plane.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
            padded[..radius].fill(row[0]);
            padded[radius..radius + width].copy_from_slice(row);
            padded[radius + width..].fill(row[width - 1]);
            for (tap, &weight) in self.0.iter().enumerate() {
                add_scaled(out, &padded[tap..tap + width], weight);
            }
        }
        out
    }

    /// Filters every column of a plane `width` wide.
    pub fn down(&self, plane: &[f32], width: usize) -> Vec<f32> {
        let (radius, height) = (self.0.len() / 2, plane.len() / width);
        let mut out = vec![0.0; plane.len()];
        for (y, out) in out.chunks_exact_mut(width).enumerate() {
            for (tap, &weight) in self.0.iter().enumerate() {
                let from = (y + tap).saturating_sub(radius).min(height - 1) * width;
                add_scaled(out, &plane[from..from + width], weight);
            }
        }
        out
    }
}

fn add_scaled(sum: &mut [f32], values: &[f32], weight: f32) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_what_they_should() {
        for ppd in [1.0, 20.0, super::super::PIXELS_PER_DEGREE, 300.0] {
            let sum = |k: &Kernel| k.0.iter().map(|&w| f64::from(w)).sum::<f64>();
            let spatial = SpatialKernels::new(ppd);
            assert!((sum(&spatial.y) - 1.0).abs() < 1e-6 && (sum(&spatial.cx) - 1.0).abs() < 1e-6);
            let squares: f64 = spatial.cz.iter().map(|k| sum(k).powi(2)).sum();
            assert!((squares - 1.0).abs() < 1e-6, "{squares}");
            let feature = FeatureKernels::new(ppd);
            assert!((sum(&feature.smooth) - 1.0).abs() < 1e-6);
            assert!(sum(&feature.edge).abs() < 1e-6);
            assert!(feature.point.0.iter().all(|w| w.is_finite()) && feature.edge.0.iter().all(|w| w.is_finite()));
        }
        // The sizes that the reference uses at its default distance.
        let feature = FeatureKernels::new(super::super::PIXELS_PER_DEGREE);
        assert_eq!((SpatialKernels::new(super::super::PIXELS_PER_DEGREE).y.0.len(), feature.edge.0.len()), (21, 19));
    }

    #[test]
    fn the_border_goes_on() {
        let box_filter = Kernel(vec![1.0 / 3.0; 3]);
        assert_eq!(box_filter.across(&[3.0, 6.0, 9.0], 3), [4.0, 6.0, 8.0]);
        assert_eq!(box_filter.down(&[3.0, 6.0, 9.0], 1), [4.0, 6.0, 8.0]);
        assert_eq!(Kernel(vec![0.2; 5]).across(&[1.0], 1), Kernel(vec![0.2; 5]).down(&[1.0], 1));
    }
}
