//! Times of the last two seconds: median, 95th percentile, and the curve.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How far back numbers reach.
pub const WINDOW: Duration = Duration::from_secs(2);
/// Points of the curve.
pub const CURVE: usize = 240;

/// Milliseconds with their moments.
#[derive(Debug, Default)]
pub struct Track {
    recent: VecDeque<(Instant, f64)>,
    curve: VecDeque<f32>,
}

impl Track {
    /// Adds a value that was measured at `now`.
    pub fn add(&mut self, now: Instant, ms: f64) {
        self.recent.push_back((now, ms));
        while self.recent.front().is_some_and(|(t, _)| now.duration_since(*t) > WINDOW) {
            self.recent.pop_front();
        }
        self.curve.push_back(ms as f32);
        if self.curve.len() > CURVE {
            self.curve.pop_front();
        }
    }

    /// Median, 95th percentile (nearest rank) and number of values; `None` without any.
    pub fn spread(&self) -> Option<Spread> {
        let mut values: Vec<f64> = self.recent.iter().map(|(_, ms)| *ms).collect();
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let at = |q: f64| values[((n as f64 * q).ceil() as usize).clamp(1, n) - 1];
        (n > 0).then(|| Spread {
            median: at(0.5),
            p95: at(0.95),
            mean: values.iter().sum::<f64>() / n as f64,
            count: n,
        })
    }

    /// The latest values, oldest first.
    pub fn curve(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        self.curve.iter().copied()
    }
}

/// What [`Track::spread`] tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    pub median: f64,
    pub p95: f64,
    pub mean: f64,
    pub count: usize,
}

/// A pass or another thing that takes time.
#[derive(Debug)]
pub struct Row {
    pub name: String,
    pub track: Track,
}

/// All that is measured.
#[derive(Debug, Default)]
pub struct Times {
    /// GPU time of each pass in the order of the frame.
    pub passes: Vec<Row>,
    /// Sum of all passes.
    pub gpu: Track,
    /// From before recording to after submission.
    pub cpu: Track,
    /// The overlay's own share of it: layout, tessellation, upload.
    pub overlay: Track,
    /// Recording until the device is idle, where there are no timestamps.
    pub wall: Track,
}

impl Times {
    /// Takes a frame's passes in; those with one label are added up.
    pub fn frame(&mut self, now: Instant, passes: &[(String, f64)]) {
        let mut order: Vec<(&str, f64)> = Vec::new();
        for (label, ms) in passes {
            match order.iter_mut().find(|(l, _)| l == label) {
                Some(row) => row.1 += ms,
                None => order.push((label, *ms)),
            }
        }
        // Rows of a method that is not drawn any more go.
        self.passes.retain(|row| order.iter().any(|(l, _)| *l == row.name));
        for (i, (label, ms)) in order.iter().enumerate() {
            let at = match self.passes.iter().position(|row| row.name == *label) {
                Some(at) => at,
                None => {
                    let at = i.min(self.passes.len());
                    self.passes.insert(at, Row { name: (*label).into(), track: Track::default() });
                    at
                }
            };
            self.passes[at].track.add(now, *ms);
        }
        self.gpu.add(now, order.iter().map(|(_, ms)| ms).sum());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_last_two_seconds_count() {
        let (mut track, start) = (Track::default(), Instant::now());
        for i in 0..100u32 {
            track.add(start + Duration::from_millis(100) * i, f64::from(i));
        }
        // 21 values: 79 to 99.
        let s = track.spread().unwrap();
        assert_eq!(s, Spread { median: 89.0, p95: 98.0, mean: 89.0, count: 21 });
        assert_eq!(track.curve().len(), 100);
        assert_eq!(Track::default().spread(), None);
    }

    #[test]
    fn passes_are_added_up_and_old_ones_go() {
        let (mut times, now) = (Times::default(), Instant::now());
        let row = |l: &str, ms| (l.to_string(), ms);
        times.frame(now, &[row("shadow", 1.0), row("shadow", 2.0), row("net.a", 3.0), row("composite", 1.0)]);
        assert_eq!(times.passes[0].track.spread().unwrap().median, 3.0);
        times.frame(now, &[row("shadow", 1.0), row("gi.ambient", 3.0), row("composite", 1.0)]);
        let names: Vec<_> = times.passes.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["shadow", "gi.ambient", "composite"]);
        assert_eq!(times.gpu.spread().unwrap().count, 2);
    }
}
