//! How far two noisy pictures of the same thing lie apart, noise taken off.
//!
//! Ours come as two independent halves A and B, theirs as two independent renders C and D. With d
//! the true difference, every product of one of ours-minus-theirs with the other, (A − C)(B − D),
//! has the expectation d² exactly: no noise is in both factors, so no noise level has to be
//! estimated and subtracted. Its mean over the pixels is the mean square difference, its spread
//! over them gives the error bar. (A − D)(B − C) is as good; the mean of both is used. Averages
//! over tiles of neighbours first see smaller differences, where those keep their sign over a tile.

use crate::stats::{Mean, Random};

/// One value of both pictures, twice each.
#[derive(Debug, Clone, Copy, Default)]
pub struct Value {
    pub ours: [f64; 2],
    pub theirs: [f64; 2],
}

/// What is measured, relative to the mean of theirs.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// Mean of ours minus theirs.
    pub bias: Mean,
    /// Mean square of the true difference.
    pub square: Mean,
}

impl Agreement {
    /// `pixels`: the three channels of each pixel (or tile).
    pub fn of(pixels: &[[Value; 3]]) -> Self {
        let n = pixels.len() as f64;
        assert!(n >= 64.0, "{n} pixels or tiles are too few");
        let all = || pixels.iter().flatten();
        let level = all().map(|v| 0.5 * (v.theirs[0] + v.theirs[1])).sum::<f64>() / (3.0 * n);
        let channels = |f: &dyn Fn(&Value) -> f64| -> Vec<f64> {
            pixels.iter().map(|p| p.iter().map(f).sum::<f64>() / 3.0 / level).collect()
        };
        // A pixel's two estimates of the same difference are independent: they tell the bias's
        // noise.
        let first = channels(&|v| v.ours[0] - v.theirs[0]);
        let second = channels(&|v| v.ours[1] - v.theirs[1]);
        let products: Vec<f64> = channels(&|v| {
            let [a, b] = v.ours;
            let [c, d] = v.theirs;
            0.5 * ((a - c) * (b - d) + (a - d) * (b - c))
        })
        .into_iter()
        .map(|p| p / level)
        .collect();
        let mean = products.iter().sum::<f64>() / n;
        let variance = products.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { bias: Mean::of(&first, &second), square: Mean { value: mean, error: (variance / n).sqrt() } }
    }

    /// Is the rms difference at most `bound`, as far as noise lets one say (2 σ)?
    pub fn within(&self, bound: f64) -> bool {
        self.square.value <= bound * bound + 2.0 * self.square.error
    }

    /// Root of the mean square difference, which bounds the mean absolute one from above; noise
    /// below 0 counts as 0.
    pub fn rms(&self) -> f64 {
        self.square.value.max(0.0).sqrt()
    }

    /// The rms difference that the error bar (1 σ) cannot tell from 0.
    pub fn resolution(&self) -> f64 {
        self.square.error.sqrt()
    }
}

/// Means over groups of pixels; `tile` says to which group a pixel belongs. Groups of fewer than
/// `least` are left out.
pub fn tiles(pixels: &[[Value; 3]], tile: &[usize], least: usize) -> Vec<[Value; 3]> {
    let count = tile.iter().max().map_or(0, |m| m + 1);
    let mut sums = vec![([Value::default(); 3], 0usize); count];
    for (pixel, &t) in pixels.iter().zip(tile) {
        let (sum, n) = &mut sums[t];
        *n += 1;
        for (s, v) in sum.iter_mut().zip(pixel) {
            for k in 0..2 {
                s.ours[k] += v.ours[k];
                s.theirs[k] += v.theirs[k];
            }
        }
    }
    let mean = |(sum, n): ([Value; 3], usize)| {
        sum.map(|v| Value { ours: v.ours.map(|x| x / n as f64), theirs: v.theirs.map(|x| x / n as f64) })
    };
    sums.into_iter().filter(|(_, n)| *n >= least.max(1)).map(mean).collect()
}

/// A picture that varies, noise of 15 % and 12 %, and a true difference that varies too.
fn synthetic(random: &mut Random, n: usize, difference: impl Fn(usize) -> f64) -> Vec<[Value; 3]> {
    (0..n)
        .map(|i| {
            [0, 1, 2].map(|c| {
                // Whole periods: the mean is 0.05.
                let truth = 0.05 + 0.04 * (i as f64 * std::f64::consts::TAU / 512.0 + f64::from(c)).sin();
                let mut noisy = |level: f64, noise: f64| level + noise * truth * random.normal();
                let ours = truth + difference(i) * 0.05;
                Value { ours: [noisy(ours, 0.15), noisy(ours, 0.15)], theirs: [noisy(truth, 0.12), noisy(truth, 0.12)] }
            })
        })
        .collect()
}

#[test]
fn a_known_difference_is_found_under_the_noise() {
    let mut random = Random(3);
    for (off, wave) in [(0.0, 0.0), (0.005, 0.0), (0.0, 0.03), (0.01, 0.05)] {
        let difference = |i: usize| off + wave * if (i / 64).is_multiple_of(2) { 1.0 } else { -1.0 };
        let pixels = synthetic(&mut random, 1 << 17, difference);
        let a = Agreement::of(&pixels);
        let square = off * off + wave * wave;
        println!("off {off}, wave {wave}: {a:.6?}, rms {:.4}, resolution {:.4}", a.rms(), a.resolution());
        assert!((a.bias.value - off).abs() <= 4.0 * a.bias.error && a.bias.error < 0.001, "{a:?}");
        assert!((a.square.value - square).abs() <= 4.0 * a.square.error && a.resolution() < 0.013, "{a:?}");
        // Tiles of 64 pixels see the same wave with much less noise.
        let groups: Vec<usize> = (0..pixels.len()).map(|i| i / 64).collect();
        let t = Agreement::of(&tiles(&pixels, &groups, 64));
        assert!((t.square.value - square).abs() <= 4.0 * t.square.error && t.resolution() < 0.008, "{t:?}");
    }
    // The plain mean square without this care is the noise's, ten times the answer that matters.
    let pixels = synthetic(&mut random, 1 << 14, |_| 0.0);
    let plain = pixels.iter().flatten().map(|v| (v.ours[0] - v.theirs[0]).powi(2)).sum::<f64>()
        / (3.0 * pixels.len() as f64)
        / 0.05f64.powi(2);
    assert!(plain.sqrt() > 0.15, "{plain}");
}
