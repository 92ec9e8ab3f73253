//! How the work is cut into dispatches: short ones, since a driver's watchdog kills what takes
//! about two seconds, and a viewer wants its frame. No wgpu here.
//!
//! A pass gives every point the same number of samples of one half; a pass that takes too long for
//! one dispatch is cut by points. Passes grow: the first gives one sample, later ones several,
//! since an invocation that has more than one path to trace need not wait for its neighbours' long
//! ones. How long a point takes differs by place (sky against a corner), so speed is remembered by
//! place. Where the time is not in the work (a loaded machine), smaller dispatches gain nothing;
//! then a floor rises.

/// Places that speed is remembered for.
const PLACES: usize = 16;

/// Points times samples of the first dispatch: a few milliseconds on the slowest device.
const FIRST_WORK: u64 = 1024;

/// Most samples that one dispatch gives a point. Mesa's CPU driver silently ends all loops of an
/// invocation after 65,535 turns in all (`LP_MAX_TGSI_LOOP_ITERATIONS`), those of the traversal
/// included: about 1,000 rays.
const MOST_SAMPLES: u32 = 16;

/// Most samples that a dispatch gives a point where that means fewer points at once.
const DEEPEST: u32 = 16;

/// Points of a workgroup: less would leave lanes idle.
const GROUP: u32 = 64;

/// Points that keep several workgroups busy.
const SEVERAL_GROUPS: u32 = 4 * GROUP;

/// One dispatch: `samples` more samples of `half` for points `first..first + count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chunk {
    /// Which half-buffer.
    pub half: usize,
    /// First point, counted from the film's first.
    pub first: u32,
    /// Points.
    pub count: u32,
    /// Number of the first sample within the half.
    pub first_sample: u32,
    /// Samples for each point.
    pub samples: u32,
}

/// A pass under way: samples of a half for all points, done for those before `cursor`.
#[derive(Debug, Clone, Copy)]
struct Pass {
    half: usize,
    samples: u32,
    cursor: u32,
    /// It would have fewer samples if it were not for the floor.
    lifted: bool,
}

/// The work on one film.
#[derive(Debug)]
pub struct Schedule {
    points: u32,
    /// Seconds that a dispatch should take.
    target: f64,
    /// Samples of every point in each half, the pass under way not counted.
    done: [u32; 2],
    pass: Option<Pass>,
    /// Seconds a point and sample by place; `None` where nothing was traced yet.
    cost: [Option<f64>; PLACES],
    last_cost: f64,
    /// The most work that a dispatch has done so far.
    largest: u64,
    /// Work below which a dispatch is not made smaller, and whether the last one would have been.
    floor: u64,
    lifted: bool,
}

impl Schedule {
    /// For `points` points and dispatches of `target` seconds.
    pub fn new(points: u32, target: f64) -> Self {
        Self {
            points,
            target,
            done: [0; 2],
            pass: None,
            cost: [None; PLACES],
            last_cost: 0.0,
            largest: 0,
            floor: FIRST_WORK,
            lifted: false,
        }
    }

    /// The same with other points, at the speed known from these.
    pub fn restart(&self, points: u32) -> Self {
        let known = self.cost.iter().flatten().copied().fold(0.0, f64::max);
        let cost = if known > 0.0 { [Some(known); PLACES] } else { [None; PLACES] };
        Self { points, done: [0; 2], pass: None, cost, ..*self }
    }

    /// Samples that every point has, both halves together.
    pub fn samples(&self) -> u32 {
        self.done[0] + self.done[1]
    }

    /// Samples of `point` in each half, the pass under way included.
    pub fn samples_of(&self, point: u32) -> [u32; 2] {
        let mut samples = self.done;
        if let Some(pass) = self.pass.filter(|p| point < p.cursor) {
            samples[pass.half] += pass.samples;
        }
        samples
    }

    /// The next dispatch on the way to `goal` samples a point, split evenly between the halves;
    /// `None` when it is reached.
    pub fn next(&mut self, goal: u32) -> Option<Chunk> {
        if self.points == 0 {
            return None;
        }
        let pass = match self.pass {
            Some(pass) => pass,
            None => self.begin_pass(goal)?,
        };
        self.pass = Some(pass);
        let room = self.target / f64::from(pass.samples);
        let most = self.most_work() / u64::from(pass.samples);
        let mut end = pass.cursor;
        let mut time = 0.0;
        // Place by place, as far as time and caution allow.
        while end < self.points {
            let place = self.place(end);
            let place_end = self.place_start(place + 1).min(self.points);
            let cost = self.cost[place].unwrap_or(self.last_cost);
            let left = ((room - time) / cost.max(1e-12)).max(0.0) as u64;
            let left = left.min(most.saturating_sub(u64::from(end - pass.cursor)));
            let whole = u64::from(place_end - end);
            end += left.min(whole) as u32;
            time += left.min(whole) as f64 * cost;
            // Nothing is known of places that were not traced yet: not more than one of them.
            if left < whole || self.cost[place].is_none() {
                break;
            }
        }
        let least = (self.floor / u64::from(pass.samples)).clamp(GROUP.into(), self.points.max(GROUP).into()) as u32;
        self.lifted = pass.lifted || (end < self.points && end - pass.cursor < least);
        let count = (end - pass.cursor).max(least).min(self.points - pass.cursor);
        let count = if pass.cursor + count < self.points { count / GROUP * GROUP } else { count };
        let first_sample = self.done[pass.half];
        Some(Chunk { half: pass.half, first: pass.cursor, count, first_sample, samples: pass.samples })
    }

    /// Takes note that `chunk`, which [`Self::next`] gave last, was done in `seconds`.
    pub fn took(&mut self, chunk: Chunk, seconds: f64) {
        let work = u64::from(chunk.count) * u64::from(chunk.samples);
        self.largest = self.largest.max(work);
        self.last_cost = seconds / work as f64;
        // Only what was as large as the floor tells of it.
        if self.lifted && seconds < 2.0 * self.target && 2 * work > self.floor {
            self.floor = self.floor.saturating_mul(2);
        } else if self.lifted && seconds > 4.0 * self.target {
            self.floor = (self.floor / 2).max(GROUP.into());
        }
        for place in self.place(chunk.first)..=self.place(chunk.first + chunk.count - 1) {
            self.cost[place] = Some(self.last_cost);
        }
        if let Some(pass) = &mut self.pass {
            pass.cursor = chunk.first + chunk.count;
            if pass.cursor >= self.points {
                self.done[pass.half] += pass.samples;
                self.pass = None;
            }
        }
    }

    /// The half that is behind gets as many samples as one dispatch can give all points.
    fn begin_pass(&self, goal: u32) -> Option<Pass> {
        let goals = [goal.div_ceil(2), goal / 2];
        let behind = |half: usize| goals[half].saturating_sub(self.done[half]);
        let half = if behind(1) > behind(0) { 1 } else { 0 };
        if behind(half) == 0 {
            return None;
        }
        let time: f64 = (0..PLACES)
            .map(|place| {
                let points = self.place_start(place + 1) - self.place_start(place);
                f64::from(points) * self.cost[place].unwrap_or(f64::INFINITY)
            })
            .filter(|t| !t.is_nan())
            .sum();
        let by_time = (self.target / time.max(1e-12)) as u64;
        let by_caution = self.most_work() / u64::from(self.points);
        let at_once = by_time.min(by_caution).clamp(1, u64::from(MOST_SAMPLES)) as u32;
        let slowest = self.cost.iter().map(|c| c.unwrap_or(f64::INFINITY)).fold(0.0, f64::max);
        let deep = (self.target / (f64::from(SEVERAL_GROUPS) * slowest)) as u32;
        let samples = at_once.max(deep.min(DEEPEST).min(self.done[half]));
        let least = (self.floor / u64::from(self.points)).min(MOST_SAMPLES.into()) as u32;
        let lifted = samples < least && behind(half) > samples;
        let samples = samples.max(least);
        Some(Pass { half, samples: samples.min(behind(half)), cursor: 0, lifted })
    }

    /// Most points times samples of the next dispatch: never more than twice what was tried.
    fn most_work(&self) -> u64 {
        if self.largest == 0 { FIRST_WORK } else { 2 * self.largest }
    }

    fn place(&self, point: u32) -> usize {
        (u64::from(point) * PLACES as u64 / u64::from(self.points)) as usize
    }

    /// First point of a place.
    fn place_start(&self, place: usize) -> u32 {
        (place as u64 * u64::from(self.points)).div_ceil(PLACES as u64) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs to `goal` on a device whose time for a chunk is `seconds`; gives every chunk with its
    /// time.
    fn run(schedule: &mut Schedule, goal: u32, seconds: impl Fn(Chunk) -> f64) -> Vec<(Chunk, f64)> {
        let mut chunks = Vec::new();
        while let Some(chunk) = schedule.next(goal) {
            let time = seconds(chunk);
            schedule.took(chunk, time);
            chunks.push((chunk, time));
            assert!(chunks.len() < 1_000_000, "it never ends");
        }
        chunks
    }

    /// Every point gets every sample of both halves once, in order.
    fn check_complete(chunks: &[(Chunk, f64)], points: u32, goal: u32) {
        for half in 0..2u32 {
            let mut next = vec![0; points as usize];
            for (c, _) in chunks.iter().filter(|(c, _)| c.half == half as usize) {
                for p in c.first..c.first + c.count {
                    assert_eq!(next[p as usize], c.first_sample, "point {p}");
                    next[p as usize] += c.samples;
                }
            }
            let wanted = (goal + 1 - half) / 2;
            assert!(next.iter().all(|&n| n == wanted), "half {half}");
        }
    }

    #[test]
    fn all_points_get_all_samples_once() {
        for (points, goal) in [(1, 1), (1, 7), (17, 3), (1000, 5), (100_003, 4)] {
            let mut schedule = Schedule::new(points, 0.1);
            let chunks = run(&mut schedule, goal, |c| 1e-6 * f64::from(c.count) * f64::from(c.samples));
            check_complete(&chunks, points, goal);
            assert_eq!(schedule.samples(), goal);
            assert_eq!(schedule.samples_of(points - 1), [goal.div_ceil(2), goal / 2]);
        }
    }

    #[test]
    fn no_dispatch_takes_long_where_a_corner_costs_fifty_times_the_sky() {
        // The upper half is sky. 10 µs a sample is a slow CPU, 1 ns faster than any GPU today.
        for base in [1e-5, 1e-6, 1e-8, 1e-9] {
            let points = 300_000;
            let cost = move |p: u32| if p < points / 2 { base / 50.0 } else { base };
            let mut schedule = Schedule::new(points, 0.1);
            let overhead = 1e-4;
            let chunks = run(&mut schedule, 6, |c| {
                let each: f64 = (c.first..c.first + c.count).map(cost).sum();
                overhead + each * f64::from(c.samples)
            });
            check_complete(&chunks, points, 6);
            let longest = chunks.iter().map(|c| c.1).fold(0.0, f64::max);
            assert!(longest < 0.5, "{base}: {longest} s");
            // And they are not cut to dust: the driver's overhead stays small.
            let total: f64 = chunks.iter().map(|c| c.1).sum();
            assert!(chunks.len() as f64 * overhead < 0.05 * total + 0.01, "{base}: {} dispatches", chunks.len());
        }
    }

    #[test]
    fn a_slow_first_dispatch_is_forgotten() {
        let mut schedule = Schedule::new(10_000, 0.1);
        let chunks = run(&mut schedule, 64, |c| {
            let compile = if c.first == 0 && c.first_sample == 0 && c.half == 0 { 5.0 } else { 0.0 };
            compile + 1e-6 * f64::from(c.count) * f64::from(c.samples)
        });
        assert!(chunks.len() < 60, "{} dispatches", chunks.len());
        // Few points: as many samples at once as may be.
        let mut schedule = Schedule::new(10, 0.1);
        let chunks = run(&mut schedule, 100_000, |c| 1e-6 * f64::from(c.count) * f64::from(c.samples));
        assert!(chunks.len() < 100_000 / MOST_SAMPLES as usize + 60, "{} dispatches", chunks.len());
        assert!(chunks.iter().all(|c| c.0.samples <= MOST_SAMPLES));
    }

    #[test]
    fn a_loaded_machine_gets_no_dust() {
        // Every dispatch waits 150 ms for its turn, which is more than it should take in all.
        let mut schedule = Schedule::new(100_000, 0.1);
        let chunks = run(&mut schedule, 16, |c| 0.15 + 1e-6 * f64::from(c.count) * f64::from(c.samples));
        check_complete(&chunks, 100_000, 16);
        assert!(chunks.len() < 60, "{} dispatches", chunks.len());
        assert!(chunks.iter().all(|c| c.1 < 0.6));
        // Few points for a long time: the floor stays where it means something.
        let mut schedule = Schedule::new(153, 0.1);
        let chunks = run(&mut schedule, 50_000, |c| 0.15 + 1e-5 * f64::from(c.count) * f64::from(c.samples));
        check_complete(&chunks, 153, 50_000);
        assert!(chunks.len() < 50_000 / MOST_SAMPLES as usize + 60, "{} dispatches", chunks.len());
        assert!(schedule.floor < 1 << 30, "{}", schedule.floor);
        assert!(chunks.iter().all(|c| c.1 < 0.8));
    }

    #[test]
    fn later_passes_are_deep() {
        let mut schedule = Schedule::new(500_000, 0.1);
        let chunks = run(&mut schedule, 256, |c| 1e-3 + 1e-6 * f64::from(c.count) * f64::from(c.samples));
        check_complete(&chunks, 500_000, 256);
        assert_eq!(chunks[0].0.samples, 1);
        let deep: f64 = chunks.iter().filter(|c| c.0.samples >= 8).map(|c| c.1).sum();
        assert!(deep > 0.8 * chunks.iter().map(|c| c.1).sum::<f64>(), "{deep} s");
        assert!(chunks.iter().all(|c| c.1 < 0.25));
    }

    #[test]
    fn points_ahead_in_a_pass_are_counted_so() {
        let mut schedule = Schedule::new(100_000, 0.01);
        let chunk = schedule.next(8).unwrap();
        schedule.took(chunk, 0.01);
        assert!(chunk.count < 100_000);
        assert_eq!((schedule.samples_of(0), schedule.samples_of(99_999), schedule.samples()), ([1, 0], [0, 0], 0));
        let again = schedule.restart(50);
        assert_eq!((again.samples(), again.samples_of(0)), (0, [0, 0]));
    }
}
