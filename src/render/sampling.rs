//! Where in the pixel the samples of a picture lie: drawn from the filter itself, so that equal
//! weights are right.

use std::sync::OnceLock;

/// Filter width of Cycles' default, pixels.
pub const FILTER_WIDTH: f32 = 1.5;

/// Steps of the tabulated integral.
const STEPS: usize = 1024;

/// Offset of sample `i` from the pixel's centre, pixels. Sample 0 is the centre; the others follow
/// the R2 sequence (Roberts 2018) through the inverse integral of Cycles' Blackman-Harris filter.
/// `seed` shifts them.
pub fn offset(i: u32, seed: u32) -> [f32; 2] {
    if i == 0 {
        return [0.0; 2];
    }
    // Powers of the inverse of the plastic number.
    let alpha = [0.754_877_666_246_692_8_f64, 0.569_840_290_998_053_3];
    std::array::from_fn(|axis| {
        let shift = f64::from(seed) * [0.618_033_988_749_894_9, 0.414_213_562_373_095][axis];
        let u = (0.5 + f64::from(i) * alpha[axis] + shift).fract();
        inverse(u as f32)
    })
}

/// Offset of sample `i` of a picture of `of` samples, pixels. Sample 0 is the pixel's centre; the
/// others are those of [`offset`], moved and stretched so that all have the filter's mean and
/// width: the first four of the sequence lie a fifth of a pixel to the left and above, and so would
/// all that the picture shows.
pub fn offset_of(i: u32, of: u32, seed: u32) -> [f32; 2] {
    let others = of.saturating_sub(1);
    // One other sample cannot have the filter's width and leave the mean where it is; more than a
    // thousand do by themselves.
    if i == 0 || !(2..=1024).contains(&others) {
        return offset(i, seed);
    }
    let [mean, scale] = moments(others, seed);
    let at = offset(i, seed);
    std::array::from_fn(|axis| ((at[axis] - mean[axis]) * scale[axis]).clamp(-FILTER_WIDTH, FILTER_WIDTH))
}

/// Mean of the samples 1 to `others`, and what their distance to it is to be multiplied by so that
/// together with one in the centre they have the filter's second moment.
fn moments(others: u32, seed: u32) -> [[f32; 2]; 2] {
    let (mut sum, mut squares) = ([0.0f64; 2], [0.0f64; 2]);
    for point in (1..=others).map(|i| offset(i, seed)) {
        for axis in 0..2 {
            sum[axis] += f64::from(point[axis]);
            squares[axis] += f64::from(point[axis]).powi(2);
        }
    }
    let n = f64::from(others);
    let mean = sum.map(|s| s / n);
    let wanted = second_moment() * (n + 1.0) / n;
    let scale = |axis: usize| (wanted / (squares[axis] / n - mean[axis].powi(2)).max(1e-6)).sqrt();
    [mean.map(|m| m as f32), [scale(0) as f32, scale(1) as f32]]
}

/// Mean square distance from the centre along an axis under the filter, pixels².
fn second_moment() -> f64 {
    static MOMENT: OnceLock<f64> = OnceLock::new();
    *MOMENT.get_or_init(|| {
        let at = |i: usize| FILTER_WIDTH * (2.0 * (i as f32 + 0.5) / STEPS as f32 - 1.0);
        let sum = |f: &dyn Fn(f32) -> f32| (0..STEPS).map(|i| f64::from(f(at(i)))).sum::<f64>();
        sum(&|x| window(x) * x * x) / sum(&window)
    })
}

/// Blackman-Harris window over [−w, w], about 0 at its ends and not meant beyond them, for the
/// filter's nominal width w: Cycles stretches the window to twice its width setting.
pub(crate) fn window(x: f32) -> f32 {
    let v = std::f32::consts::TAU * (x / (2.0 * FILTER_WIDTH) + 0.5);
    0.35875 - 0.48829 * v.cos() + 0.14128 * (2.0 * v).cos() - 0.01168 * (3.0 * v).cos()
}

/// Position below which a share `u` of the window's integral lies.
pub fn inverse(u: f32) -> f32 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let at = |i: usize| FILTER_WIDTH * (2.0 * i as f32 / STEPS as f32 - 1.0);
        let mut sum = 0.0;
        let mut table = vec![0.0];
        for i in 0..STEPS {
            sum += 0.5 * (window(at(i)) + window(at(i + 1)));
            table.push(sum);
        }
        table.iter().map(|t| t / sum).collect()
    });
    let u = u.clamp(0.0, 1.0);
    let i = table.partition_point(|&t| t < u).clamp(1, STEPS);
    let (a, b) = (table[i - 1], table[i]);
    let t = if b > a { (u - a) / (b - a) } else { 0.5 };
    FILTER_WIDTH * (2.0 * ((i - 1) as f32 + t) / STEPS as f32 - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_the_filters_moments() {
        let n = 4096;
        let points: Vec<_> = (0..n).map(|i| offset(i, 0)).collect();
        assert_eq!(points[0], [0.0, 0.0]);
        // Second moment of the window by direct integration.
        let steps = 20_000;
        let x = |i: usize| FILTER_WIDTH * (2.0 * (i as f32 + 0.5) / steps as f32 - 1.0);
        let (mut mass, mut second) = (0.0f64, 0.0f64);
        for i in 0..steps {
            mass += f64::from(window(x(i)));
            second += f64::from(window(x(i)) * x(i) * x(i));
        }
        for axis in 0..2 {
            let mean = points.iter().map(|p| f64::from(p[axis])).sum::<f64>() / f64::from(n);
            let square = points.iter().map(|p| f64::from(p[axis]).powi(2)).sum::<f64>() / f64::from(n);
            assert!(mean.abs() < 2e-3, "axis {axis}: mean {mean}");
            assert!((square / (second / mass) - 1.0).abs() < 0.01, "axis {axis}: {square} against {}", second / mass);
        }
        assert_ne!(offset(1, 0), offset(1, 1));
    }

    #[test]
    fn few_samples_have_the_filters_moments_too() {
        for (of, seed) in [(3, 0), (4, 0), (4, 7), (5, 1), (8, 0), (16, 0), (64, 3)] {
            let points: Vec<_> = (0..of).map(|i| offset_of(i, of, seed)).collect();
            assert_eq!(points[0], [0.0, 0.0]);
            for axis in 0..2 {
                let sum = |f: &dyn Fn(f64) -> f64| points.iter().map(|p| f(f64::from(p[axis]))).sum::<f64>();
                let (mean, square) = (sum(&|x| x) / f64::from(of), sum(&|x| x * x) / f64::from(of));
                assert!(mean.abs() < 2e-3, "{of} samples, axis {axis}: mean {mean}");
                assert!((square / second_moment() - 1.0).abs() < 0.02, "{of} samples, axis {axis}: {square}");
            }
            // Negative control: the sequence itself is off.
            let first = (0..of).map(|i| f64::from(offset(i, seed)[0])).sum::<f64>() / f64::from(of);
            assert!(of > 16 || first.abs() > 2e-3, "{of} {first}");
        }
        // What leaves no choice.
        assert_eq!((offset_of(0, 1, 0), offset_of(1, 2, 0)), ([0.0; 2], offset(1, 0)));
    }
}
