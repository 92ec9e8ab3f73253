//! Error bars from two independent halves of the samples.
//!
//! Point i of n has the mean `a[i]` of the first half and `b[i]` of the second. Both have the same
//! expectation and the same variance, and are independent, so ((a − b)/2)² has the expectation
//! Var((a + b)/2): each point tells its own noise, whatever the picture does from point to point.
//! The mean over the points has the standard error √Σ((a − b)/2)² / n. With 64 points that is known
//! to 1/√128 = 9 %, with 256 to 4 %.

use std::ops::{Add, Div, Mul, Sub};

/// Fewest points that an error bar may rest on.
pub const LEAST_POINTS: usize = 64;

/// How many standard errors an answer may lie off.
pub const SIGMAS: f64 = 4.0;

/// An estimate with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    pub value: f64,
    pub error: f64,
}

impl Mean {
    /// Mean over points of (a + b)/2.
    pub fn of(a: &[f64], b: &[f64]) -> Self {
        assert_eq!(a.len(), b.len());
        assert!(a.len() >= LEAST_POINTS, "{} points are too few for an error bar", a.len());
        let n = a.len() as f64;
        let value = a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).sum::<f64>() / n;
        let square: f64 = a.iter().zip(b).map(|(a, b)| 0.25 * (a - b).powi(2)).sum();
        assert!(value.is_finite() && square.is_finite(), "a sum is not finite");
        Self { value, error: square.sqrt() / n }
    }

    /// Standard error over value.
    pub fn relative(&self) -> f64 {
        self.error / self.value.abs()
    }

    /// Distance to `expected` in standard errors. A part in 10⁵ is left to arithmetic in f32.
    pub fn sigmas(&self, expected: f64) -> f64 {
        ((self.value - expected).abs() - 1e-5 * expected.abs()).max(0.0) / self.error.max(1e-300)
    }

    /// Fails unless `expected` is within the error bar, the bar is short enough to see 2 %, and 2 %
    /// more is seen.
    pub fn assert_is(&self, what: &str, expected: f64) {
        println!(
            "{what}: {:.6} ± {:.6} (expected {expected:.6}, {:.1} σ, {:+.3} %)",
            self.value,
            self.error,
            self.sigmas(expected).min(1e6),
            100.0 * (self.value / expected - 1.0)
        );
        assert!(self.sigmas(expected) <= SIGMAS, "{what}: {self:?} is not {expected}");
        for wrong in [0.98, 1.02] {
            assert!(self.sigmas(wrong * expected) > SIGMAS, "{what}: {self:?} would pass for {wrong} × {expected}");
        }
    }
}

impl Add for Mean {
    type Output = Self;
    /// Sum of independent estimates.
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, error: self.error.hypot(other.error) }
    }
}

impl Sub for Mean {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul<f64> for Mean {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { value: self.value * factor, error: self.error * factor.abs() }
    }
}

impl Div<f64> for Mean {
    type Output = Self;
    fn div(self, by: f64) -> Self {
        Self { value: self.value / by, error: self.error / by.abs() }
    }
}

/// Random numbers for synthetic data: SplitMix64 (Steele, Lea and Flood 2014).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Normal with mean 0 and variance 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

#[test]
fn error_bars_hold_what_they_say() {
    let mut random = Random(1);
    let (mut within, mut far, runs) = (0, 0, 4000);
    for _ in 0..runs {
        // Points of very different brightness and noise.
        let (mut a, mut b, mut truth) = (Vec::new(), Vec::new(), 0.0);
        for i in 0..LEAST_POINTS {
            let (mean, noise) = (1.0 + i as f64, 0.1 + 0.01 * i as f64);
            truth += mean / LEAST_POINTS as f64;
            a.push(mean + noise * random.normal());
            b.push(mean + noise * random.normal());
        }
        let m = Mean::of(&a, &b);
        within += u32::from((m.value - truth).abs() <= m.error);
        far += u32::from((m.value - truth).abs() > SIGMAS * m.error);
    }
    let share = f64::from(within) / f64::from(runs);
    assert!((share - 0.6827).abs() < 0.03, "1 σ holds {share} of the runs");
    assert!(far <= 4, "{far} of {runs} runs beyond 4 σ");
}
