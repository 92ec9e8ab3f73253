//! Where two pictures differ, as a picture.

use super::{MetricError, Picture};

/// Colour of `t` in [0, 1] as sRGB bytes: black over purple and orange to pale yellow, lightness
/// rising evenly, to be read without red-green vision. A polynomial of degree 5 fitted to
/// matplotlib's magma (within 6 of 255).
pub fn heat_color(t: f32) -> [u8; 3] {
    const POWERS: [[f32; 3]; 6] = [
        [-0.021, 0.011, -0.004],
        [1.083, 0.182, 2.247],
        [-0.073, 1.587, 2.842],
        [6.17, -6.577, -23.746],
        [-11.408, 11.196, 31.858],
        [5.234, -5.416, -12.442],
    ];
    let t = t.clamp(0.0, 1.0);
    [0, 1, 2].map(|c| {
        let value = POWERS.iter().rev().fold(0.0, |sum, row| sum * t + row[c]);
        (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    })
}

/// `3 · width · height` sRGB bytes of the mean |a − b| over the channels of each pixel;
/// `full_scale` and more is the brightest colour.
///
/// # Errors
/// Different sizes.
pub fn heat_map(a: Picture<'_>, b: Picture<'_>, full_scale: f32) -> Result<Vec<u8>, MetricError> {
    a.same_size(&b)?;
    let pairs = a.pixels().chunks_exact(3).zip(b.pixels().chunks_exact(3));
    // A scale of zero or less shows every difference at its brightest instead of dividing by it.
    let scale = full_scale.max(f32::MIN_POSITIVE);
    Ok(pairs.flat_map(|(a, b)| heat_color((0..3).map(|c| (a[c] - b[c]).abs() / 3.0).sum::<f32>() / scale)).collect())
}
