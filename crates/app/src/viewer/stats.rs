//! Numbers that come one a frame: median, 95th percentile, and on how many they stand.

use std::cell::OnceCell;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How far back numbers reach …
const WINDOW: Duration = Duration::from_secs(2);
/// … but so many are kept where frames are slow, and never more than
const LEAST: usize = 32;
/// … so many, which are gone through for every percentile.
const MOST: usize = 256;
/// Fewer values have no 95th percentile: it would be the largest of them.
pub const ENOUGH: usize = 20;

/// Milliseconds with their moments.
#[derive(Debug, Clone, Default)]
pub struct Track {
    recent: VecDeque<(Instant, f64)>,
    /// The spread, until another value comes: a layout asks for it several times.
    known: OnceCell<Option<Spread>>,
}

impl Track {
    /// Adds a value that was measured at `now`.
    pub fn add(&mut self, now: Instant, ms: f64) {
        self.known.take();
        self.recent.push_back((now, ms));
        let old = |(t, _): &(Instant, f64)| now.duration_since(*t) > WINDOW;
        while self.recent.len() > MOST || (self.recent.len() > LEAST && self.recent.front().is_some_and(old)) {
            self.recent.pop_front();
        }
    }

    /// Median, 95th percentile (nearest rank) and number of values; `None` without any.
    pub fn spread(&self) -> Option<Spread> {
        *self.known.get_or_init(|| {
            let mut values: Vec<f64> = self.recent.iter().map(|(_, ms)| *ms).collect();
            let (n, sum) = (values.len(), values.iter().sum::<f64>());
            let mut at = |q: f64| {
                let rank = ((n as f64 * q).ceil() as usize).clamp(1, n) - 1;
                *values.select_nth_unstable_by(rank, f64::total_cmp).1
            };
            (n > 0).then(|| Spread {
                median: at(0.5),
                p95: (n >= ENOUGH).then(|| at(0.95)),
                mean: sum / n as f64,
                count: n,
            })
        })
    }

    /// The median.
    pub fn median(&self) -> Option<f64> {
        self.spread().map(|s| s.median)
    }
}

/// What [`Track::spread`] tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    pub median: f64,
    /// `None` below [`ENOUGH`] values.
    pub p95: Option<f64>,
    pub mean: f64,
    pub count: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_two_seconds_count_or_the_last_frames_where_these_are_slow() {
        let (mut track, start) = (Track::default(), Instant::now());
        for i in 0..200u32 {
            track.add(start + Duration::from_millis(20) * i, f64::from(i));
        }
        // 101 values: 99 to 199.
        let s = track.spread().unwrap();
        assert_eq!(s, Spread { median: 149.0, p95: Some(194.0), mean: 149.0, count: 101 });
        let mut slow = Track::default();
        (0..100u32).for_each(|i| slow.add(start + Duration::from_millis(500) * i, 1.0));
        assert_eq!(slow.spread().unwrap().count, LEAST);
        assert_eq!(Track::default().spread(), None);
    }

    #[test]
    fn few_values_have_no_percentile() {
        let (mut track, now) = (Track::default(), Instant::now());
        (0..19).for_each(|_| track.add(now, 1.0));
        assert_eq!(track.spread().unwrap().p95, None);
        track.add(now, 2.0);
        assert_eq!(track.spread().unwrap().p95, Some(1.0));
    }
}
