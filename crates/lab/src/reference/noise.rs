//! How much noise is left, estimated from the difference of two independent halves, and when that
//! is little enough.
//!
//! The halves' means a and b are independent estimates of one number from n_a and n_b samples, so
//! (a − b)² · n_a·n_b / (n_a + n_b)² is an unbiased estimate of the variance of their common mean,
//! already from one sample in each. For one pixel it says next to nothing; the root of its average
//! over a picture is a sound number.

/// Noise that is left in one layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Mean of the layer over points and channels.
    pub mean: f64,
    /// Root mean square error of a pixel, divided by `mean`. 0 where there is none at all, infinite
    /// where it cannot be estimated.
    pub pixel: f64,
    /// What `pixel` is at most, two standard errors of its own estimate away.
    pub pixel_at_most: f64,
    /// Standard error of `mean`, divided by `mean`.
    pub picture: f64,
}

/// Gathers [`Noise`] point by point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    points: f64,
    mean: f64,
    /// Sums over points of the squared error (averaged over channels), of its square, and of the
    /// squared error of the channels' average.
    squares: f64,
    fourths: f64,
    grey: f64,
    /// Points with a half that is still empty.
    unknown: f64,
}

impl Tally {
    /// Adds a point: its value from all samples, the values of both halves and their numbers of
    /// samples.
    pub fn add(&mut self, value: [f64; 3], halves: [[f64; 3]; 2], samples: [u32; 2]) {
        let [a, b] = samples.map(f64::from);
        self.points += 1.0;
        self.mean += (value[0] + value[1] + value[2]) / 3.0;
        if a * b == 0.0 {
            self.unknown += 1.0;
            return;
        }
        let scale = (a * b).sqrt() / (a + b);
        let error: [f64; 3] = std::array::from_fn(|c| (halves[0][c] - halves[1][c]) * scale);
        let square = error.iter().map(|e| e * e).sum::<f64>() / 3.0;
        self.squares += square;
        self.fourths += square * square;
        self.grey += (error.iter().sum::<f64>() / 3.0).powi(2);
    }

    /// Both tallies together.
    pub fn plus(&self, other: &Tally) -> Tally {
        Tally {
            points: self.points + other.points,
            mean: self.mean + other.mean,
            squares: self.squares + other.squares,
            fourths: self.fourths + other.fourths,
            grey: self.grey + other.grey,
            unknown: self.unknown + other.unknown,
        }
    }

    /// The noise of all points added; nothing is noisy where there are none.
    pub fn noise(&self) -> Noise {
        if self.points == 0.0 {
            return Noise { mean: 0.0, pixel: 0.0, pixel_at_most: 0.0, picture: 0.0 };
        }
        let n = self.points;
        let mean = self.mean / n;
        let variance = self.squares / n;
        let spread = if n > 1.0 {
            ((self.fourths / n - variance * variance).max(0.0) / (n - 1.0)).sqrt()
        } else if variance > 0.0 {
            f64::INFINITY
        } else {
            0.0
        };
        let relative = |error: f64| match (self.unknown > 0.0, error == 0.0) {
            (true, _) => f64::INFINITY,
            (_, true) => 0.0,
            _ if mean > 0.0 => error / mean,
            _ => f64::INFINITY,
        };
        Noise {
            mean,
            pixel: relative(variance.sqrt()),
            pixel_at_most: relative((variance + 2.0 * spread).sqrt()),
            picture: relative(self.grey.sqrt() / n),
        }
    }
}

/// Fewest samples of a point, and of all points together, before an estimate is believed: what is
/// bright and rare has to have had a chance of being seen.
const LEAST_SAMPLES: u32 = 16;
const LEAST_IN_ALL: u64 = 1 << 16;

/// Samples after which `points` points are first looked at for whether the noise is small enough.
pub(super) fn first_check(points: u32) -> u32 {
    let share = LEAST_IN_ALL.div_ceil(u64::from(points.max(1)));
    u32::try_from(share).unwrap_or(u32::MAX).max(LEAST_SAMPLES).next_multiple_of(2)
}

/// Samples after which to look again when `noise` was found after `samples` and `bound` is wanted:
/// where the inverse root says that it is reached, but no more than twice and no less than a
/// quarter more.
pub(super) fn next_check(samples: u32, noise: &Noise, bound: f64) -> u32 {
    let wanted = 1.05 * (noise.pixel_at_most / bound).powi(2);
    let factor = if wanted.is_finite() { wanted.clamp(1.25, 2.0) } else { 2.0 };
    ((f64::from(samples) * factor) as u32).saturating_add(1).next_multiple_of(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform in [-1, 1) with variance 1/3, from a hash.
    fn random(i: u32) -> f64 {
        let mut h = i.wrapping_mul(0x9e37_79b9);
        h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
        h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
        f64::from(h ^ (h >> 16)) / f64::from(1u32 << 31) - 1.0
    }

    fn mean_of(n: u32, seed: u32) -> [f64; 3] {
        std::array::from_fn(|c| {
            let first = seed.wrapping_mul(4096).wrapping_add(1024 * c as u32);
            2.0 + (0..n).map(|i| random(first + i)).sum::<f64>() / f64::from(n)
        })
    }

    #[test]
    fn the_noise_of_known_numbers_is_found() {
        for samples in [[8, 8], [20, 4]] {
            let mut tally = Tally::default();
            for p in 0..4000 {
                let halves = [mean_of(samples[0], 2 * p), mean_of(samples[1], 2 * p + 1)];
                let value = std::array::from_fn(|c| {
                    let sum = halves[0][c] * f64::from(samples[0]) + halves[1][c] * f64::from(samples[1]);
                    sum / f64::from(samples[0] + samples[1])
                });
                tally.add(value, halves, samples);
            }
            let noise = tally.noise();
            // Variance 1/3, mean 2, three independent channels.
            let truth = (1.0f64 / 3.0 / f64::from(samples[0] + samples[1])).sqrt() / 2.0;
            assert!((noise.pixel / truth - 1.0).abs() < 0.03, "{samples:?}: {} against {truth}", noise.pixel);
            assert!(noise.pixel_at_most > noise.pixel && noise.pixel_at_most < 1.1 * noise.pixel);
            let picture = truth / (3.0f64 * 4000.0).sqrt();
            assert!((noise.picture / picture - 1.0).abs() < 0.05, "{} against {picture}", noise.picture);
            assert!((noise.mean - 2.0).abs() < 0.01);
        }
    }

    #[test]
    fn what_cannot_be_told_is_not_called_small() {
        let mut one = Tally::default();
        one.add([1.0; 3], [[1.01; 3], [0.99; 3]], [8, 8]);
        assert!(one.noise().pixel < 0.02 && one.noise().pixel_at_most.is_infinite(), "one pixel says nothing");
        let mut half = Tally::default();
        half.add([1.0; 3], [[1.0; 3], [0.0; 3]], [1, 0]);
        assert!(half.noise().pixel.is_infinite());
        let mut black = Tally::default();
        black.add([0.0; 3], [[0.0; 3]; 2], [8, 8]);
        assert_eq!((black.noise().pixel, black.noise().pixel_at_most), (0.0, 0.0));
        // One firefly in a thousand points: the estimate itself is uncertain.
        let mut rare = Tally::default();
        (0..1000).for_each(|i| rare.add([1.0; 3], [[if i == 7 { 60.0 } else { 1.0 }; 3], [1.0; 3]], [8, 8]));
        assert!(rare.noise().pixel_at_most > 1.5 * rare.noise().pixel);
    }

    #[test]
    fn checks_come_neither_too_early_nor_too_often() {
        assert_eq!((first_check(1 << 19), first_check(64), first_check(1)), (16, 1024, 65536));
        let at = |pixel_at_most| Noise { mean: 1.0, pixel: pixel_at_most, pixel_at_most, picture: 0.0 };
        assert_eq!(next_check(16, &at(1.0), 0.01), 34);
        assert_eq!(next_check(16, &at(0.0101), 0.01), 22);
        assert_eq!(next_check(100, &at(0.012), 0.01), 152);
        assert_eq!(next_check(16, &at(f64::INFINITY), 0.01), 34);
    }
}
