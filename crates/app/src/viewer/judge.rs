//! How far apart both sides are, in numbers: computed on a thread from pictures that stand still.

use crate::viewer::choice::Source;
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight_lab::metrics::{self, Picture};
use std::sync::Arc;

/// Two pictures of one view: linear RGB, the right one taken for the truth.
pub struct Pair {
    /// What has drawn them.
    pub by: [Source; 2],
    pub size: [u32; 2],
    pub left: Vec<f32>,
    pub right: Vec<f32>,
    pub ev: f32,
    pub tonemap: Tonemap,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// What has drawn the two pictures.
    pub by: [Source; 2],
    /// Decibels, on display values.
    pub psnr: f64,
    /// On display values.
    pub ssim: f64,
    /// Mean |a − b| on display values.
    pub mae: f64,
    /// On radiance.
    pub rel_mse: f64,
    /// Mean of left / mean of right − 1, on radiance.
    pub bias: f64,
    /// Mean |a − b| of the channels of each pixel, on display values.
    pub map: Arc<Vec<f32>>,
}

impl Verdict {
    /// True where more than half of the difference is the noise of the right picture: `noise` of a
    /// pixel, as a share of the mean.
    pub fn is_noise(&self, noise: f64) -> bool {
        noise.is_finite() && noise * noise > 0.5 * self.rel_mse
    }
}

/// Compares.
///
/// # Errors
/// Pictures of different sizes or with values that are no numbers.
pub fn judge(pair: &Pair) -> Result<Verdict, String> {
    let [w, h] = pair.size.map(|n| n as usize);
    let gain = pair.ev.exp2();
    let shown = |linear: &[f32]| -> Vec<f32> {
        linear.chunks_exact(3).flat_map(|p| pair.tonemap.apply([p[0] * gain, p[1] * gain, p[2] * gain])).collect()
    };
    let (left, right) = (shown(&pair.left), shown(&pair.right));
    let compare = || -> Result<Verdict, metrics::MetricError> {
        let (a, b) = (Picture::new("left", w, h, &left)?, Picture::new("right", w, h, &right)?);
        let (c, d) = (Picture::new("left", w, h, &pair.left)?, Picture::new("right", w, h, &pair.right)?);
        Ok(Verdict {
            by: pair.by,
            psnr: metrics::psnr(a, b)?,
            ssim: metrics::ssim(a, b, 1.0)?,
            mae: metrics::mean_absolute_error(a, b)?,
            rel_mse: metrics::rel_mse(c, d)?,
            bias: metrics::bias(c, d)?,
            map: Arc::new(map(&left, &right)),
        })
    };
    compare().map_err(|e| e.to_string())
}

fn map(left: &[f32], right: &[f32]) -> Vec<f32> {
    let pixels = left.chunks_exact(3).zip(right.chunks_exact(3));
    pixels.map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / 3.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_are_equal_and_brighter_ones_are_not() {
        let picture: Vec<f32> = (0..16 * 16 * 3).map(|i| 0.1 + (i % 7) as f32 * 0.05).collect();
        let pair = |left: Vec<f32>| Pair {
            by: [Source::Direct, Source::Reference],
            size: [16, 16],
            left,
            right: picture.clone(),
            ev: 0.0,
            tonemap: Tonemap::None,
        };
        let same = judge(&pair(picture.clone())).unwrap();
        assert_eq!((same.mae, same.rel_mse, same.bias), (0.0, 0.0, 0.0));
        assert!(same.psnr.is_infinite() && same.ssim > 0.999);
        let other = judge(&pair(picture.iter().map(|v| v * 1.1).collect())).unwrap();
        assert!((other.bias - 0.1).abs() < 1e-5 && other.psnr < 40.0, "{other:?}");
        let mean = other.map.iter().sum::<f32>() / 256.0;
        assert!(other.map.len() == 256 && (f64::from(mean) - other.mae).abs() < 1e-6);
        // Noise of a tenth explains a relative error of 0.01.
        assert!(other.is_noise(0.1) && !other.is_noise(0.01) && !other.is_noise(f64::NAN));
        assert!(judge(&pair(vec![1.0; 3])).is_err());
    }
}
