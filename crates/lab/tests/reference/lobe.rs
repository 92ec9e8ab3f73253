//! The specular lobe's shape: what a floor shows of a small sun, direction by direction, against
//! GGX written down here once more in double precision, with the energy that single scattering
//! loses found by brute-force quadrature. (The furnaces test the lobe's sum over all directions,
//! which a lobe of the wrong width would pass.)

use crate::harness::{Options, lab};
use crate::scenes::*;
use crate::stats::Mean;
use bouncelight::scene::Material;
use glam::DVec3;
use std::f64::consts::PI;

/// D·V of GGX with height-correlated Smith masking (Heitz 2014), in the textbook's form.
fn distribution_and_visibility(alpha: f64, n_h: f64, n_l: f64, n_v: f64) -> f64 {
    let tan2 = |c: f64| (1.0 - c * c) / (c * c);
    let d = 1.0 / (PI * alpha * alpha * n_h.powi(4) * (1.0 + tan2(n_h) / (alpha * alpha)).powi(2));
    let lambda = |c: f64| 0.5 * ((1.0 + alpha * alpha * tan2(c)).sqrt() - 1.0);
    d / (1.0 + lambda(n_l) + lambda(n_v)) / (4.0 * n_l * n_v)
}

/// Share of the light towards `mu` that the lobe with perfect reflection keeps: the sum of D·V·n_l
/// over the hemisphere of half vectors, with the density of the half vector taken along so that
/// narrow lobes are met.
fn kept(alpha: f64, mu: f64) -> f64 {
    const N: usize = 200;
    let v = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
    let mut sum = 0.0;
    for i in 0..N {
        // Half vectors by the distribution of GGX itself.
        let u = (i as f64 + 0.5) / N as f64;
        let cos = ((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)).sqrt();
        let sin = (1.0 - cos * cos).sqrt();
        for k in 0..N {
            let phi = 2.0 * PI * (k as f64 + 0.5) / N as f64;
            let h = DVec3::new(sin * phi.cos(), sin * phi.sin(), cos);
            let v_h = v.dot(h);
            let l = h * (2.0 * v_h) - v;
            if v_h > 0.0 && l.z > 1e-9 {
                // Density of l: D·n_h / (4 v_h); D cancels against D·V, so V alone is left.
                let d = distribution_and_visibility(alpha, h.z, l.z, mu);
                let pure = {
                    let tan2 = (1.0 - h.z * h.z) / (h.z * h.z);
                    1.0 / (PI * alpha * alpha * h.z.powi(4) * (1.0 + tan2 / (alpha * alpha)).powi(2))
                };
                sum += d / pure * l.z * 4.0 * v_h / h.z;
            }
        }
    }
    sum / (N * N) as f64
}

/// [`kept`] at these even steps of `mu` above 0, for interpolation.
const STEPS: usize = 24;

fn kept_table(alpha: f64) -> Vec<f64> {
    (0..=STEPS).map(|i| kept(alpha, (i as f64 / STEPS as f64).max(0.01))).collect()
}

fn look_up(table: &[f64], mu: f64) -> f64 {
    let at = mu * STEPS as f64;
    let i = (at as usize).min(STEPS - 1);
    table[i] + (table[i + 1] - table[i]) * (at - i as f64)
}

/// Mean over the cosine-weighted hemisphere.
fn kept_mean(table: &[f64]) -> f64 {
    const N: usize = 200;
    (0..N).map(|i| ((i as f64 + 0.5) / N as f64).sqrt()).map(|mu| look_up(table, mu)).sum::<f64>() / N as f64
}

/// Fresnel's equations for unpolarised light, by the angle of refraction.
fn dielectric(index: f64, cos: f64) -> f64 {
    let inside = (1.0 - (1.0 - cos * cos) / (index * index)).sqrt();
    let s = (cos - index * inside) / (cos + index * inside);
    let p = (index * cos - inside) / (index * cos + inside);
    0.5 * (s * s + p * p)
}

/// One kind of surface.
struct Kind {
    material: Material,
    /// Fresnel term by v·h.
    fresnel: fn(f64) -> f64,
    /// Its mean over the hemisphere.
    mean: f64,
}

#[test]
fn the_lobe_has_ggxs_shape() {
    let Some(lab) = lab() else { return };
    let size = [64, 64];
    let points = grid(size, 12);
    let mean = |f: fn(f64) -> f64| {
        let n = 2000;
        (0..n).map(|i| f(((f64::from(i) + 0.5) / f64::from(n)).sqrt())).sum::<f64>() / f64::from(n)
    };
    let plastic: fn(f64) -> f64 = |c| dielectric(1.5, c);
    let gold: fn(f64) -> f64 = |c| 0.6 + 0.4 * (1.0 - c).powi(5);
    let kinds = [
        Kind { material: Material { f0: 0.04, ..lambert(0.0) }, fresnel: plastic, mean: mean(plastic) },
        Kind { material: metal(0.6, 0.5), fresnel: gold, mean: mean(gold) },
    ];
    let eye = camera([0.0, 4.0, 4.0], [0.0, 0.0, 0.0], 0.7);
    for (k, kind) in kinds.into_iter().enumerate() {
        for (seed, roughness) in [0.25f32, 0.5, 0.9].into_iter().enumerate() {
            let alpha = f64::from(roughness).powi(2);
            let table = kept_table(alpha);
            // Opposite the eye (the mirror direction and beside it), and from the side.
            for (s, towards) in [DVec3::new(0.1, 1.0, -1.1), DVec3::new(1.0, 0.8, 0.2)].into_iter().enumerate() {
                let l = towards.normalize();
                let material = Material { roughness, ..kind.material.clone() };
                let floor = quad([-20.0, 0.0, 20.0], [40.0, 0.0, 0.0], [0.0, 0.0, -40.0]);
                let lights = vec![sun((-l).as_vec3().into(), 2.0, 1e-4)];
                let scene = scene(vec![(floor, material)], lights);
                let options = Options { samples: 16, seed: (10 * k + seed) as u32, ..Default::default() };
                let t = lab.trace(&scene, &eye, size, &points, &options);

                let (all, mut expected, mut wider) = (kept_mean(&table), 0.0, 0.0);
                let again = kind.mean * all / (1.0 - kind.mean * (1.0 - all));
                for p in &points {
                    let v = -ray(&eye, size, *p).1.normalize();
                    let h = (v + l).normalize();
                    let e = look_up(&table, v.y);
                    let boost = 1.0 + again * (1.0 - e) / e;
                    let at = |alpha| {
                        2.0 * l.y * (kind.fresnel)(v.dot(h)) * boost * distribution_and_visibility(alpha, h.y, l.y, v.y)
                    };
                    expected += at(alpha) / points.len() as f64;
                    wider += at(alpha * 1.1) / points.len() as f64;
                }
                let found: Mean = t.mean(|s| s.gloss_dir[0]);
                println!(
                    "kind {k}, roughness {roughness}, sun {s}: {found:?}, expected {expected:.6}, 10 % wider {wider:.6}"
                );
                let off = (found.value / expected - 1.0).abs();
                assert!(off < 0.01 + 4.0 * found.relative(), "kind {k}, roughness {roughness}, sun {s}: off by {off}");
                // Negative control: a lobe a tenth wider would be noticed.
                assert!((found.value / wider - 1.0).abs() > 0.01, "kind {k}, roughness {roughness}, sun {s}: blind");
            }
        }
    }
}
