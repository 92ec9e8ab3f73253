//! The ambient term that suits a scene best.
//!
//! Light is affine in them: E = E₀ + sky · A + bounce · B at every pixel, and three pictures tell
//! E₀, A and B. What is sought is the least Σ|E − reference|, as the error of light is measured; it
//! is found by least squares whose weights are one over the residuals of the round before
//! (Schlossmacher 1973).

use crate::reference::Layer;
use crate::study::{
    judge::{BLOCK, NOTHING},
    truth::Reference,
};
use bouncelight::gi::ambient::AmbientTerm;

/// Numbers that light is asked for: none, the sky alone, surfaces alone.
pub const ASKED: [AmbientTerm; 3] = [
    AmbientTerm { sky: 0.0, bounce: 0.0 },
    AmbientTerm { sky: 1.0, bounce: 0.0 },
    AmbientTerm { sky: 0.0, bounce: 1.0 },
];

/// Rounds of weighted least squares.
const ROUNDS: usize = 30;
/// Residuals below this share of the mean light weigh no more than at it.
const LEAST: f64 = 1e-3;
/// Where one number's light is the other's times something, up to this share of the squares, they
/// cannot be told apart.
const ALIKE: f64 = 1e-6;
/// Largest number.
const MOST: f64 = 16.0;

/// Blocks of all views: what the numbers must make of A and B, and what is left for them to do.
#[derive(Debug, Default)]
pub struct Problem {
    rows: Vec<([f64; 2], f64)>,
}

impl Problem {
    /// Adds a view: light (rgb a pixel) for each of [`ASKED`].
    pub fn add(&mut self, light: &[Vec<f32>], reference: &Reference) {
        let [none, sky, bounce] = light else { return };
        let [width, height] = reference.size.map(|n| n as usize);
        let (wanted, depth) = (reference.layer(Layer::Gi), reference.layer(Layer::Depth));
        for block in 0..(width / BLOCK) * (height / BLOCK) {
            let (x0, y0) = (block % (width / BLOCK) * BLOCK, block / (width / BLOCK) * BLOCK);
            let pixels: Vec<usize> = (0..BLOCK * BLOCK).map(|i| (y0 + i / BLOCK) * width + x0 + i % BLOCK).collect();
            // As where light is judged: no rims, and nothing without a surface.
            if pixels.iter().any(|&p| depth[p] >= NOTHING) {
                continue;
            }
            for c in 0..3 {
                let mean = |rgb: &[f32]| {
                    pixels.iter().map(|p| f64::from(rgb[3 * p + c])).sum::<f64>() / (BLOCK * BLOCK) as f64
                };
                let [none, sky, bounce] = [none, sky, bounce].map(|rgb| mean(rgb));
                self.rows.push(([sky - none, bounce - none], mean(wanted) - none));
            }
        }
    }

    /// The best numbers, none of them negative; `None` where nothing depends on them.
    pub fn solve(&self) -> Option<AmbientTerm> {
        let scale = self.rows.iter().map(|(_, wanted)| wanted.abs()).sum::<f64>() / self.rows.len().max(1) as f64;
        let mut weights = vec![1.0; self.rows.len()];
        let mut best = None;
        for _ in 0..ROUNDS {
            let [sky, bounce] = self.least_squares(&weights)?;
            for (weight, ([a, b], wanted)) in weights.iter_mut().zip(&self.rows) {
                *weight = 1.0 / (wanted - sky * a - bounce * b).abs().max(LEAST * scale);
            }
            best = Some(AmbientTerm { sky: rounded(sky), bounce: rounded(bounce) });
        }
        best
    }

    fn least_squares(&self, weights: &[f64]) -> Option<[f64; 2]> {
        let (mut aa, mut ab, mut bb, mut aw, mut bw) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (([a, b], wanted), weight) in self.rows.iter().zip(weights) {
            aa += weight * a * a;
            ab += weight * a * b;
            bb += weight * b * b;
            aw += weight * a * wanted;
            bw += weight * b * wanted;
        }
        let alone = |square: f64, with: f64| if square > 0.0 { (with / square).clamp(0.0, MOST) } else { 0.0 };
        let determinant = aa * bb - ab * ab;
        if determinant > ALIKE * aa * bb {
            let both = [(bb * aw - ab * bw) / determinant, (aa * bw - ab * aw) / determinant];
            if both.iter().all(|v| (0.0..=MOST).contains(v)) {
                return Some(both);
            }
        } else if aa <= 0.0 && bb <= 0.0 {
            return None;
        }
        // One of them is 0: the one that explains less by itself.
        let [sky, bounce] = [alone(aa, aw), alone(bb, bw)];
        Some(if sky * aw >= bounce * bw { [sky, 0.0] } else { [0.0, bounce] })
    }
}

/// To a thousandth: more digits would promise what noise does not hold.
fn rounded(value: f64) -> f32 {
    ((value * 1000.0).round() / 1000.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(rows: impl Iterator<Item = ([f64; 2], f64)>) -> Problem {
        Problem { rows: rows.collect() }
    }

    #[test]
    fn numbers_are_found_again_whatever_a_few_blocks_say() {
        let ab = |i: usize| [1.0 + (i as f64 * 0.37).sin(), 0.5 + 0.3 * (i as f64 * 0.71).cos()];
        let made = |i: usize| 0.9 * ab(i)[0] + 0.4 * ab(i)[1];
        let found = problem((0..200).map(|i| (ab(i), if i % 10 == 0 { 50.0 } else { made(i) }))).solve().unwrap();
        assert!((found.sky - 0.9).abs() < 0.02 && (found.bounce - 0.4).abs() < 0.03, "{found:?}");
        // Negative control: plain least squares is drawn away by the tenth that is wrong.
        let rows = problem((0..200).map(|i| (ab(i), if i % 10 == 0 { 50.0 } else { made(i) })));
        let plain = rows.least_squares(&[1.0; 200]).unwrap();
        assert!((plain[0] - 0.9).abs() > 0.2 || (plain[1] - 0.4).abs() > 0.2, "{plain:?}");
    }

    #[test]
    fn what_has_no_light_has_no_number() {
        let sky_only = problem((0..50).map(|i| ([1.0 + i as f64, 0.0], 0.95 * (1.0 + i as f64)))).solve().unwrap();
        assert_eq!((sky_only.sky, sky_only.bounce), (0.95, 0.0));
        assert_eq!(problem((0..50).map(|_| ([0.0, 0.0], 1.0))).solve(), None);
        assert_eq!(Problem::default().solve(), None);
        // The best would be negative: none is the best that can be.
        let negative = problem((0..50).map(|i| ([1.0, i as f64], 1.0 - 0.01 * i as f64))).solve().unwrap();
        assert!(negative.bounce == 0.0 && negative.sky > 0.5, "{negative:?}");
    }
}
