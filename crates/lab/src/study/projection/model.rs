//! Milliseconds of counted work.

use super::{Card, Cost};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Threads that a multiprocessor holds at a time: half of what there is room for, as kernels have
/// some 64 registers.
pub const HELD: f64 = 1024.0;

/// What is fitted (`fit`): the same for all cards.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Share of a card's arithmetic that full multiprocessors reach.
    pub arithmetic: f64,
    /// Share of a card's bandwidth.
    pub memory: f64,
    /// Nanoseconds of a read that the next waits for: the mean of those that caches answer and
    /// those that they do not.
    pub link_ns: f64,
    /// Cycles of an operation of the slowest thread, in which nothing else of it is done.
    pub step_cycles: f64,
    /// Microseconds of a dispatch.
    pub dispatch_us: f64,
    /// Cycles of a barrier.
    pub barrier_cycles: f64,
    /// Measured over modelled time of passes left out of the fit: the tenth and ninetieth
    /// percentile.
    pub spread: [f64; 2],
}

/// The record of a fit, as `gpu-report --fit` writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// The measured device.
    pub adapter: String,
    /// Of the source that was measured.
    pub commit: Option<String>,
    /// Rows.
    pub rows: usize,
    /// Share of passes left out that are modelled within 1.5 times.
    pub within: f64,
    /// What was found.
    pub parameters: Parameters,
}

/// A time that nobody measured.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Modelled {
    /// Milliseconds.
    pub ms: f64,
    /// Nine of ten passes that the model had not seen took longer.
    pub least: f64,
    /// Nine of ten took less.
    pub most: f64,
}

impl std::ops::Div<f64> for Modelled {
    type Output = Self;

    fn div(self, by: f64) -> Self {
        Self { ms: self.ms / by, least: self.least / by, most: self.most / by }
    }
}

impl std::fmt::Display for Modelled {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let digits = f.precision().unwrap_or(1);
        write!(f, "{:.digits$} ({:.digits$} to {:.digits$})", self.ms, self.least, self.most)
    }
}

/// What was fitted last.
pub fn model() -> &'static Parameters {
    static MODEL: OnceLock<Parameters> = OnceLock::new();
    MODEL.get_or_init(|| {
        let read: Result<Model, _> = serde_json::from_str(include_str!("model.json"));
        // A test reads it, too.
        read.expect("model.json is a record of a fit").parameters
    })
}

/// Milliseconds of `costs`, one after the other, on `card`.
pub fn modelled<'a>(costs: impl IntoIterator<Item = &'a Cost>, card: &Card) -> Modelled {
    let parameters = model();
    let ms: f64 = costs.into_iter().map(|c| parameters.pass_ms(c, card)).sum::<f64>() + 0.0;
    let [least, most] = parameters.spread.map(|factor| factor * ms);
    Modelled { ms, least, most }
}

impl Parameters {
    /// Milliseconds of one pass. What measurements agree with best is the sum: arithmetic and
    /// traffic of all threads, operations of the slowest, reads that wait for one another (of the
    /// longest chain, or of as many rounds as all threads take), dispatches and barriers. Of costs
    /// that were counted without threads only the first two are known.
    pub fn pass_ms(&self, cost: &Cost, card: &Card) -> f64 {
        let arithmetic = (cost.flops + cost.waited) / (self.arithmetic * card.flops);
        let traffic = cost.bytes / (self.memory * card.bandwidth);
        let chain = cost.longest.max(cost.links / (HELD * card.multiprocessors));
        let cycles = self.step_cycles * cost.steps + self.barrier_cycles * cost.barriers;
        let rest = 1e-9 * self.link_ns * chain + cycles / card.clock() + 1e-6 * self.dispatch_us * cost.dispatches;
        1e3 * (arithmetic + traffic + rest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::GTX_1050;
    use super::*;

    /// `threads` threads of 1,000 operations and 50 links each.
    fn cost(threads: f64) -> Cost {
        Cost {
            dispatches: 1.0,
            threads,
            links: 50.0 * threads,
            longest: 50.0,
            steps: 1e3,
            ..Cost::new("a", 1e3 * threads, 8.0 * threads)
        }
    }

    #[test]
    fn more_threads_are_never_slower_each() {
        let each = |threads: f64| model().pass_ms(&cost(threads), &GTX_1050) / threads;
        let times: Vec<f64> = (5..24).map(|n| each(2f64.powi(n))).collect();
        assert!(times.windows(2).all(|w| w[1] <= w[0]), "{times:?}");
    }

    #[test]
    fn chains_take_the_time_of_few_threads_and_peaks_that_of_many() {
        let m = model();
        let time = |c: &Cost| m.pass_ms(c, &GTX_1050) - 1e-3 * m.dispatch_us;
        // Twice as long a chain takes few threads twice as long, twice as many threads nothing.
        let few = cost(64.0);
        let long = Cost { longest: 100.0, links: 6400.0, steps: 2e3, flops: 2.0 * few.flops, ..few.clone() };
        assert!(time(&long) / time(&few) > 1.9, "{}", time(&long) / time(&few));
        assert!(time(&cost(128.0)) / time(&few) < 1.1);
        // Many threads take what arithmetic, bytes and links of all take.
        let many = cost(1e8);
        let roof = many.flops / (m.arithmetic * GTX_1050.flops)
            + many.bytes / (m.memory * GTX_1050.bandwidth)
            + 1e-9 * m.link_ns * many.links / (HELD * GTX_1050.multiprocessors);
        assert!((time(&many) / (1e3 * roof) - 1.0).abs() < 1e-2);
        // What lacks threads in an old record is arithmetic and traffic.
        let old = Cost::new("a", 1.86e9, 0.0);
        assert!((m.pass_ms(&old, &GTX_1050) * m.arithmetic - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_modelled_time_stands_between_its_bounds() {
        let found = modelled(&[cost(1e5)], &GTX_1050);
        assert!(0.0 < found.least && found.least < found.ms && found.ms < found.most, "{found:?}");
        assert_eq!(modelled(&[], &GTX_1050), Modelled::default());
        let text = serde_json::to_string(&found).expect("JSON");
        assert_eq!(serde_json::from_str::<Modelled>(&text).expect("JSON"), found);
    }
}
