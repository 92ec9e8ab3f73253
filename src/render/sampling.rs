//! Where in the pixel the samples of a picture lie: drawn from the filter itself, so that equal weights are right.

/// Filter width of Cycles' default, pixels.
pub const FILTER_WIDTH: f32 = 1.5;

/// Steps of the tabulated integral.
const STEPS: usize = 1024;

/// Offset of sample `i` from the pixel's centre, pixels. Sample 0 is the centre; the others follow the R2 sequence
/// (Roberts 2018) through the inverse integral of Cycles' Blackman-Harris filter. `seed` shifts them.
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

/// Blackman-Harris window over [−w, w], about 0 at its ends and not meant beyond them, for the
/// filter's nominal width w: Cycles stretches the window to twice its width setting.
pub(crate) fn window(x: f32) -> f32 {
    let v = std::f32::consts::TAU * (x / (2.0 * FILTER_WIDTH) + 0.5);
    0.35875 - 0.48829 * v.cos() + 0.14128 * (2.0 * v).cos() - 0.01168 * (3.0 * v).cos()
}

/// Position below which a share `u` of the window's integral lies.
pub(crate) fn inverse(u: f32) -> f32 {
    static TABLE: std::sync::OnceLock<Vec<f32>> = std::sync::OnceLock::new();
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
}
