//! Times as ratios: method to method and pass to pass, so that a baseline can be committed where
//! seconds could not. Methods take turns, and the fastest turn of each counts, which other programs
//! have disturbed least.

use super::bench::Measurement;
use serde::{Deserialize, Serialize};

/// Passes below this share of their method's frame are noise.
const LEAST_SHARE: f64 = 0.03;
/// Least tolerance that a baseline states, as a share.
pub const LEAST_ALLOWED: f64 = 0.25;
/// The method and the pass that others are divided by: every method has the pass, and both are as
/// heavy as what they are compared with.
const METHOD: &str = "direct";
const PASS: &str = "direct";

/// One ratio of times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ratio {
    /// What is divided by what, as in `gather / direct` or `gather: gi.rays / direct`.
    pub of: String,
    /// Of the fastest turns.
    pub value: f64,
    /// How much larger it may be before that is a fault, as a share: twice what one half of the
    /// rounds was off when the baseline was made, and at least [`LEAST_ALLOWED`].
    pub allowed: f64,
}

/// What is committed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ratios {
    /// Version of this record, 1.
    pub schema: u32,
    /// What was typed.
    pub command: String,
    /// Scene.
    pub scene: String,
    /// Pixels.
    pub size: [u32; 2],
    /// The device: a GPU's ratios say nothing of a CPU driver's.
    pub adapter: String,
    /// It has no GPU.
    pub software: bool,
    /// Turns that every method had.
    pub rounds: u32,
    /// Frames of a turn that counted.
    pub frames: u32,
    /// The ratios.
    pub ratios: Vec<Ratio>,
}

/// Ratios of rounds, in each of which every method was measured once.
pub fn of(rounds: &[Vec<Measurement>]) -> Vec<Ratio> {
    let Some(first) = rounds.first() else { return Vec::new() };
    let method = |round: &[Measurement], name: &str| {
        let found = round.iter().find(|m| m.method == name)?;
        Some(found.wall_ms.median)
    };
    let pass = |round: &[Measurement], of: &str, name: &str| {
        let found = round.iter().find(|m| m.method == of)?;
        Some(found.passes.iter().find(|p| p.pass == name)?.ms.median)
    };
    let mut ratios = Vec::new();
    for measured in first {
        let name = &measured.method;
        if name != METHOD {
            ratios.extend(ratio(format!("{name} / {METHOD}"), rounds, &|r| method(r, name), &|r| method(r, METHOD)));
        }
        let frame: f64 = measured.passes.iter().map(|p| p.ms.median).sum();
        // A network's layers run on past their timestamps on some drivers: the method's own ratio
        // holds them.
        let heavy =
            measured.passes.iter().filter(|p| p.ms.median >= LEAST_SHARE * frame && !p.pass.starts_with("net."));
        for p in heavy.filter(|p| p.pass != PASS) {
            let of = format!("{name}: {} / {PASS}", p.pass);
            ratios.extend(ratio(of, rounds, &|r| pass(r, name, &p.pass), &|r| pass(r, name, PASS)));
        }
    }
    ratios
}

/// Finds a time in a round.
type Time<'a> = &'a dyn Fn(&[Measurement]) -> Option<f64>;

fn ratio(of: String, rounds: &[Vec<Measurement>], above: Time<'_>, below: Time<'_>) -> Option<Ratio> {
    let of_every = |first: usize, step: usize| {
        let least = |time: Time<'_>| rounds.iter().skip(first).step_by(step).filter_map(|r| time(r)).reduce(f64::min);
        let value = least(above)? / least(below)?;
        (value.is_finite() && value > 0.0).then_some(value)
    };
    let value = of_every(0, 1)?;
    let halves = [of_every(0, 2), of_every(1, 2)];
    let off = halves.into_iter().flatten().map(|half| (half / value - 1.0).abs()).fold(0.0, f64::max);
    Some(Ratio { of, value, allowed: (2.0 * off).max(LEAST_ALLOWED) })
}

/// What became slower than `base` says by more than it or `allowed` permits, and what became as
/// much faster, which asks for a new baseline; one sentence each.
pub fn compare(base: &[Ratio], now: &[Ratio], allowed: f64) -> (Vec<String>, Vec<String>) {
    let (mut slower, mut faster) = (Vec::new(), Vec::new());
    for base in base {
        let Some(now) = now.iter().find(|r| r.of == base.of) else { continue };
        let (change, limit) = (now.value / base.value, 1.0 + base.allowed.max(allowed));
        let words =
            format!("{} is {:.2}, {:.2} in the base ({:+.0} %)", now.of, now.value, base.value, 100.0 * (change - 1.0));
        if change > limit {
            slower.push(format!("{words}, allowed is {:+.0} %", 100.0 * (limit - 1.0)));
        } else if change * limit < 1.0 {
            faster.push(words);
        }
    }
    (slower, faster)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::bench::{PassTime, Spread};

    fn measurement(method: &str, ms: f64, passes: &[(&str, f64)]) -> Measurement {
        let spread = |ms: f64| Spread { median: ms, p95: ms };
        Measurement {
            method: method.into(),
            passes: passes.iter().map(|(p, ms)| PassTime { pass: p.to_string(), ms: spread(*ms) }).collect(),
            gpu_ms: None,
            wall_ms: spread(ms),
            bytes: Vec::new(),
            costs: Vec::new(),
            drawn: Default::default(),
        }
    }

    fn rounds(load: [f64; 3], rays: f64) -> Vec<Vec<Measurement>> {
        let round = |l: f64| {
            let passes = [("direct", 4.0 * l), ("gi.rays", rays * l), ("tiny", 0.01 * l), ("net.a", 9.0 * l)];
            vec![
                measurement("direct", 10.0 * l, &[("direct", 4.0 * l)]),
                measurement("gather", (18.0 + rays) * l, &passes),
            ]
        };
        load.map(round).into()
    }

    #[test]
    fn load_does_not_show_and_a_slower_pass_does() {
        let base = of(&rounds([1.0, 3.0, 1.5], 2.0));
        let named: Vec<_> = base.iter().map(|r| (r.of.as_str(), r.value)).collect();
        assert_eq!(named, [("gather / direct", 2.0), ("gather: gi.rays / direct", 0.5)]);
        assert!(base.iter().all(|r| r.allowed == LEAST_ALLOWED));
        let busy = of(&rounds([7.0, 5.0, 9.0], 2.0));
        assert_eq!(compare(&base, &busy, 0.05), (vec![], vec![]));
        let (slower, faster) = compare(&base, &of(&rounds([1.0; 3], 4.0)), 0.05);
        assert!(slower.len() == 1 && slower[0].contains("gi.rays") && faster.is_empty(), "{slower:?}");
        let (slower, faster) = compare(&base, &of(&rounds([1.0; 3], 1.0)), 0.05);
        assert!(slower.is_empty() && faster.len() == 1, "{faster:?}");
        // Whoever allows more gets more.
        assert_eq!(compare(&base, &of(&rounds([1.0; 3], 4.0)), 2.0).0.len(), 0);
    }

    #[test]
    fn what_varied_is_allowed_to_vary() {
        let mut uneven = rounds([1.0; 3], 2.0);
        uneven[1][1].wall_ms.median *= 1.5;
        let found = of(&uneven);
        assert!((found[0].allowed - 1.0).abs() < 1e-9 && found[1].allowed == LEAST_ALLOWED, "{found:?}");
        assert!(of(&[]).is_empty());
    }
}
