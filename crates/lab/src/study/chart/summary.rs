//! Means over scenes, their spread, the Pareto frontier, and how long paths take to come as near.

use super::{Kind, Metric, Record, Unit};
use crate::study::{
    bench::{self, Spread},
    projection::{Cost, GTX_1050, modelled},
};

/// Mean over scenes, and the scenes that are best and worst.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bars {
    /// Mean.
    pub mean: f64,
    /// Least.
    pub low: f64,
    /// Most.
    pub high: f64,
}

impl Bars {
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.collect();
        let fold = |f: fn(f64, f64) -> f64| values.iter().copied().reduce(f);
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Some(Self { mean, low: fold(f64::min)?, high: fold(f64::max)? })
    }
}

/// Which time counts, the same for everything on a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// Timestamps on the GPU, checked against the clock.
    Gpu,
    /// From recording until the device is idle.
    Wall,
}

impl Clock {
    /// Timestamps, where all methods have them and none is more than [`bench::AGREEMENT`] away from
    /// the synchronised clock.
    pub fn of(record: &Record) -> Self {
        let agrees = |unit: &Unit| match &unit.time {
            Some(time) => time.gpu_ms.is_some_and(|gpu| bench::disagreement(time.wall_ms.median, gpu.median).is_none()),
            None => true,
        };
        let drawn = |unit: &&Unit| record.kind(&unit.entry) == Some(Kind::Method);
        if record.units.iter().filter(drawn).all(agrees) { Clock::Gpu } else { Clock::Wall }
    }

    /// What an axis says.
    pub fn title(self) -> &'static str {
        match self {
            Clock::Gpu => "GPU time of a whole frame, ms (timestamps, within 10 % of the synchronised clock)",
            Clock::Wall => "time of a whole frame by the synchronised clock, ms",
        }
    }
}

/// One entry over all scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Paths a pixel.
    pub paths: Option<u32>,
    /// Scenes that it was judged in.
    pub scenes: usize,
    /// Its error.
    pub error: Option<Bars>,
    /// The same in the first frame after a cut.
    pub cold: Option<Bars>,
    /// Milliseconds of a frame.
    pub ms: Option<Bars>,
    /// Milliseconds of the first frame after a cut.
    pub cold_ms: Option<Bars>,
    /// The synchronised clock beside timestamps, mean milliseconds.
    pub wall_ms: Option<f64>,
    /// Modelled milliseconds of its own passes on a GTX 1050; absent where threads were not counted.
    pub projected_ms: Option<f64>,
    /// Counted arithmetic, GFLOP.
    pub gflop: f64,
    /// Counted traffic, MB.
    pub mb: f64,
    /// Counted rays; of paths, the paths.
    pub rays: f64,
    /// GPU memory, bytes, of the scene that takes most.
    pub bytes: u64,
    /// It was judged in every scene, so that it can be compared.
    pub whole: bool,
    /// Nothing that is drawn in a frame is faster and nearer.
    pub best: bool,
    /// The same by projected time.
    pub best_projected: bool,
    /// How many times as long paths take to come as near, and whether that lies beyond the paths
    /// that were traced.
    pub against_paths: Option<(f64, bool)>,
}

impl Record {
    /// What the entry called `name` is.
    pub fn kind(&self, name: &str) -> Option<Kind> {
        self.entries.iter().find(|e| e.name == name).map(|e| e.kind)
    }

    /// Scenes that could be drawn at all.
    pub fn sound_scenes(&self) -> usize {
        self.scenes.iter().filter(|s| s.failed.is_none()).count()
    }
}

/// A row for each entry, in the record's order.
pub fn rows(record: &Record, metric: Metric) -> Vec<Row> {
    let clock = Clock::of(record);
    let all = record.sound_scenes();
    let mut rows: Vec<Row> = record
        .entries
        .iter()
        .map(|entry| {
            let units: Vec<&Unit> =
                record.units.iter().filter(|u| u.entry == entry.name && u.failed.is_none()).collect();
            let scores = |cold: bool| {
                Bars::of(
                    units.iter().filter_map(|u| metric.of(if cold { u.cold.as_ref() } else { u.scores.as_ref() }?)),
                )
            };
            let time = |cold: bool| {
                let times = units.iter().filter_map(|u| if cold { u.cold_time.as_ref() } else { u.time.as_ref() });
                Bars::of(times.map(|t| match (clock, t.gpu_ms) {
                    (Clock::Gpu, Some(gpu)) => gpu.median,
                    _ => t.wall_ms.median,
                }))
            };
            let mean =
                |f: &dyn Fn(&Unit) -> f64| units.iter().map(|u| f(u)).sum::<f64>() / units.len().max(1) as f64 + 0.0;
            let counted = |f: fn(&Cost) -> f64| mean(&|u| u.costs.iter().map(f).sum::<f64>());
            let wall: Vec<&Spread> = units.iter().filter_map(|u| Some(&u.time.as_ref()?.wall_ms)).collect();
            let judged = units.iter().filter(|u| u.scores.as_ref().is_some_and(|s| metric.of(s).is_some())).count();
            Row {
                name: entry.name.clone(),
                kind: entry.kind,
                paths: entry.paths,
                scenes: judged,
                error: scores(false),
                cold: scores(true),
                ms: time(false),
                cold_ms: time(true),
                wall_ms: (!wall.is_empty()).then(|| wall.iter().map(|s| s.median).sum::<f64>() / wall.len() as f64),
                projected_ms: (entry.kind != Kind::Paths
                    && units.iter().all(|u| u.costs.iter().all(Cost::has_threads)))
                .then(|| mean(&|u| modelled(&u.costs, &GTX_1050).ms)),
                gflop: counted(|c| c.flops) / 1e9,
                mb: counted(|c| c.bytes) / 1e6,
                rays: counted(|c| c.rays),
                bytes: units.iter().map(|u| u.bytes).max().unwrap_or(0),
                whole: judged == all && all > 0,
                best: false,
                best_projected: false,
                against_paths: None,
            }
        })
        .collect();
    let drawn: Vec<usize> = (0..rows.len()).filter(|&i| rows[i].kind != Kind::Paths && rows[i].whole).collect();
    let points = |time: &dyn Fn(&Row) -> Option<f64>| -> Vec<(usize, f64, f64)> {
        drawn.iter().filter_map(|&i| Some((i, time(&rows[i])?, rows[i].error?.mean))).collect()
    };
    let measured = frontier(&points(&|r| r.ms.map(|b| b.mean)));
    let projected = frontier(&points(&|r| r.projected_ms));
    let curve: Vec<(f64, f64)> = rows
        .iter()
        .filter(|r| r.kind == Kind::Paths && r.whole)
        .filter_map(|r| Some((r.ms?.mean, r.error?.mean)))
        .collect();
    for (i, row) in rows.iter_mut().enumerate() {
        row.best = measured.contains(&i);
        row.best_projected = projected.contains(&i);
        if row.kind != Kind::Paths
            && row.whole
            && let (Some(ms), Some(error)) = (row.ms, row.error)
        {
            row.against_paths = time_to(&curve, error.mean).map(|(path_ms, beyond)| (path_ms / ms.mean, beyond));
        }
    }
    rows
}

/// Numbers of those (number, cost, error) that no other beats in both, cheapest first.
pub fn frontier(points: &[(usize, f64, f64)]) -> Vec<usize> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    let mut least = f64::INFINITY;
    sorted.retain(|p| {
        let better = p.2 < least;
        least = least.min(p.2);
        better
    });
    sorted.into_iter().map(|p| p.0).collect()
}

/// Milliseconds at which a curve of (milliseconds, error) reaches `error`: between its points by
/// powers, before and after them by the square root that paths obey; true for the latter.
pub fn time_to(curve: &[(f64, f64)], error: f64) -> Option<(f64, bool)> {
    let mut curve = curve.to_vec();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (first, last) = (*curve.first()?, *curve.last()?);
    if error <= 0.0 || curve.iter().any(|p| p.1 <= 0.0) {
        return None;
    }
    let root = |from: (f64, f64)| (from.0 * (from.1 / error).powi(2), true);
    if error >= first.1 {
        return Some(root(first));
    }
    let between = curve.windows(2).find(|w| w[0].1 >= error && error >= w[1].1 && w[0].1 > w[1].1);
    Some(match between {
        Some(w) => {
            let share = (w[0].1 / error).ln() / (w[0].1 / w[1].1).ln();
            ((w[0].0.ln() + share * (w[1].0 / w[0].0).ln()).exp(), false)
        }
        None => root(last),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frontier_is_what_nothing_beats() {
        let points = [(0, 1.0, 9.0), (1, 2.0, 9.5), (2, 3.0, 4.0), (3, 3.0, 5.0), (4, 9.0, 4.0), (5, 8.0, 1.0)];
        assert_eq!(frontier(&points), [0, 2, 5]);
        assert_eq!(frontier(&[]), [0usize; 0]);
    }

    #[test]
    fn paths_take_four_times_as_long_for_half_the_error() {
        let curve = [(1.0, 0.8), (4.0, 0.4), (16.0, 0.2)];
        let (ms, beyond) = time_to(&curve, 0.4 / 2f64.sqrt()).unwrap();
        assert!((ms - 8.0).abs() < 1e-9 && !beyond);
        let (ms, beyond) = time_to(&curve, 0.1).unwrap();
        assert!((ms - 64.0).abs() < 1e-9 && beyond);
        let (ms, beyond) = time_to(&curve, 1.6).unwrap();
        assert!((ms - 0.25).abs() < 1e-9 && beyond);
        assert_eq!(time_to(&[], 0.1), None);
        assert_eq!(time_to(&curve, 0.0), None);
    }
}
