//! Tables that do not depend on the scene: the energy that single-scattering GGX keeps, and the
//! pixel filter's inverse.

use super::materials::RefMaterial;
use bouncelight::render::sampling;
use std::sync::OnceLock;

/// Steps of roughness and of n·v.
const SIDE: usize = 32;
/// Steps of the filter's inverse integral.
const FILTER: usize = 1024;
/// Floats in front of the materials.
const HEADER: usize = SIDE * SIDE + SIDE + FILTER;
/// Their bytes; a multiple of a material's alignment.
pub(super) const HEADER_BYTES: usize = 4 * HEADER;
const _: () =
    assert!(HEADER_BYTES.is_multiple_of(align_of::<[f32; 4]>()) && size_of::<RefMaterial>().is_multiple_of(16));

/// The header of the materials' buffer.
pub(super) fn header() -> Vec<f32> {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let mut out = Vec::with_capacity(HEADER);
        let mut means = Vec::with_capacity(SIDE);
        for r in 0..SIDE {
            let alpha = (unit(r, SIDE).powi(2)).max(1e-3);
            let row: Vec<f64> = (0..SIDE).map(|c| kept(alpha, unit(c, SIDE).max(1e-3))).collect();
            // Cosine-weighted mean over the hemisphere: the integral of 2 μ E(μ), piecewise linear.
            let mean = (1..SIDE)
                .map(|c| {
                    let (a, b) = (unit(c - 1, SIDE), unit(c, SIDE));
                    (b - a) * (a * row[c - 1] * 2.0 + b * row[c] * 2.0 + (a * row[c] + b * row[c - 1])) / 3.0
                })
                .sum::<f64>();
            out.extend(row.iter().map(|&e| e as f32));
            means.push(mean as f32);
        }
        out.extend(means);
        out.extend((0..FILTER).map(|i| sampling::inverse(unit(i, FILTER) as f32) / sampling::FILTER_WIDTH));
        out
    });
    table.clone()
}

/// Step `i` of `count` in [0, 1], both ends included.
fn unit(i: usize, count: usize) -> f64 {
    i as f64 / (count - 1) as f64
}

/// Share of the light from direction cosine `mu` that one scattering off GGX of width `alpha` with
/// perfect reflection sends out: the mean of G2/G1 over visible normals (Heitz 2018), on a grid of
/// points of the unit square.
fn kept(alpha: f64, mu: f64) -> f64 {
    const N: usize = 24;
    let lambda = |z: f64| {
        let z2 = (z * z).max(1e-12);
        0.5 * ((1.0 + alpha * alpha * (1.0 - z2) / z2).sqrt() - 1.0)
    };
    let view = [(1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu];
    let mut sum = 0.0;
    for i in 0..N * N {
        let u = [((i % N) as f64 + 0.5) / N as f64, ((i / N) as f64 + 0.5) / N as f64];
        let h = visible_normal(view, alpha, u);
        let v_h = view[0] * h[0] + view[2] * h[2];
        let l_z = 2.0 * v_h * h[2] - mu;
        if l_z > 0.0 {
            sum += (1.0 + lambda(mu)) / (1.0 + lambda(mu) + lambda(l_z));
        }
    }
    sum / (N * N) as f64
}

/// The same as `sample_visible_normal` in `shaders/reference/bsdf.wgsl` (Dupuy and Benyoub 2023).
fn visible_normal(view: [f64; 3], alpha: f64, u: [f64; 2]) -> [f64; 3] {
    let stretch = |v: [f64; 3]| {
        let w = [v[0] * alpha, v[1] * alpha, v[2]];
        let l = (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]).sqrt();
        w.map(|c| c / l)
    };
    let w = stretch(view);
    let phi = std::f64::consts::TAU * u[0];
    let z = (1.0 - u[1]) * (1.0 + w[2]) - w[2];
    let s = (1.0 - z * z).max(0.0).sqrt();
    stretch([s * phi.cos() + w[0], s * phi.sin() + w[1], z + w[2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_is_what_the_integral_says() {
        let t = header();
        assert_eq!(t.len(), HEADER);
        assert!(t[..SIDE * SIDE].iter().all(|&e| e > 0.3 && e <= 1.0 + 1e-6));
        // A mirror loses nothing. Roughness 1 seen along the normal: visible normals are
        // cosine-distributed, half of them reflect below the horizon, and the masking of the rest,
        // 2z/(1 + z), integrates to 1 − ln 2.
        assert!(t[SIDE - 1] > 0.999);
        let rough = t[SIDE * SIDE - 1];
        assert!((rough - (1.0 - 2f32.ln())).abs() < 1e-3, "{rough}");
        assert!(t[SIDE * SIDE..SIDE * SIDE + SIDE].windows(2).all(|w| w[1] <= w[0] + 1e-3));
        let filter = &t[SIDE * SIDE + SIDE..];
        assert!(filter[0] <= -0.9 && filter[FILTER - 1] >= 0.9 && filter.windows(2).all(|w| w[1] >= w[0]));
    }
}
