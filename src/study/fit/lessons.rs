//! What is learnt from a scene: cameras scattered through it, drawn by `gather` from a cut to
//! settled, with the light traced at each cell.

use super::FitError;
use crate::{
    gi::{GiError, features::FeatureSet, inputs::cells_of},
    net::{format::Weights, learn::Example},
    numbers::SplitMix,
    reference::Layer,
    render::RenderError,
    scene::{Camera, bounds::world_bounds},
    study::{
        dataset::Sample,
        target::Target,
        trial::{Trial, TrialError},
        truth,
        views::around,
    },
};
use glam::Vec3;

/// Seed of the cameras that are learnt from; those that judge have another ([`super::covering`]).
const SEED: u64 = 2;
/// Most views: more than these take longer to draw than a few minutes of steps can use.
const MOST_VIEWS: usize = 48;
/// Cameras that are looked at before the first that is a view has been found; and for each, if all
/// the views are wanted.
const TRIED: usize = 32;
/// A view shows surfaces in at least this share of its cells, and at most a tenth of them nearer
/// than this, in sizes of the scene.
const LEAST_SHOWN: f32 = 0.5;
const NEAREST: f32 = 0.03;
/// Light is traced until the root mean square error of a cell is this share of the mean light, or
/// by so many samples: noise has no bias, and the same samples teach more in many views than in
/// few. (With 1,024 one view of `interior` took three minutes on two busy cores.)
const NOISE: f64 = 0.5;
const MOST_SAMPLES: u32 = 128;
/// Frames after a cut at which a view is learnt from, the first of all and a later one, beside the
/// last, which is what judges.
const FRAMES: [u32; 2] = [1, 6];
/// One view of so many is held out, the second first.
const HELD_OUT: usize = 4;

/// What a weights file says of these numbers.
pub(super) const SENTENCE: &str = "views of the scene, gather's answer after 1, 6 and all frames, light by bouncelight's path tracer, up to 128 samples a cell";

/// Pictures to learn from.
pub(super) struct Lessons {
    /// Width and height of each.
    pub cells: [u32; 2],
    /// Cameras.
    pub views: usize,
    /// Pictures to learn from, each camera's one after the other.
    pub examples: Vec<Example>,
    /// Pictures of views that are not learnt from, which tell when what is learnt helps elsewhere
    /// in the scene; none of a single view.
    pub held_out: Vec<Example>,
    /// Input planes that turn their sign when left and right are exchanged.
    turning: Vec<usize>,
}

impl Lessons {
    /// Draws and traces until `more`, which hears the number of the next view, says no; at least
    /// one view.
    ///
    /// # Errors
    /// [`FitError::NoFreeViews`] where none of many cameras sees enough; [`FitError::Trial`].
    pub fn draw(
        trial: &mut Trial<'_>,
        weights: &Weights,
        settled: u32,
        more: &mut dyn FnMut(usize) -> bool,
    ) -> Result<Self, FitError> {
        let features = features_of(weights).map_err(|e| TrialError::Render(RenderError::from(e)))?;
        let mut lessons = Self {
            cells: cells_of(trial.size()),
            views: 0,
            examples: Vec::new(),
            held_out: Vec::new(),
            // The first of the three planes of each is the way to the right.
            turning: ["normal", "position"].iter().filter_map(|n| features.offset(n)).map(|o| o as usize).collect(),
        };
        let size = world_bounds(trial.scene()).map_or(1.0, |(low, high)| Vec3::from(low).distance(high.into()));
        let frames: Vec<u32> = FRAMES.into_iter().filter(|f| *f < settled).chain([settled]).collect();
        let cameras: Vec<Camera> = around(trial.scene(), SEED).take(TRIED * MOST_VIEWS).collect();
        let mut gatherer = trial.gatherer()?;
        for (tried, camera) in cameras.into_iter().enumerate() {
            let enough = lessons.views == MOST_VIEWS || !more(lessons.views);
            let hopeless = lessons.views == 0 && tried == TRIED;
            if hopeless || (lessons.views > 0 && enough) {
                break;
            }
            gatherer.cut();
            let mut samples = vec![trial.sample(&mut gatherer, &camera, 1)?];
            if !is_a_view(&samples[0], size) {
                continue;
            }
            for pair in frames.windows(2) {
                samples.push(trial.sample(&mut gatherer, &camera, pair[1] - pair[0])?);
            }
            let options = truth::until(Layer::Gi, NOISE, MOST_SAMPLES, lessons.views as u32);
            let target = trial.light_at_cells(&camera, options)?;
            let held_out = is_held_out(lessons.views);
            let examples = if held_out { &mut lessons.held_out } else { &mut lessons.examples };
            examples.extend(samples.iter().map(|s| example(s, &target, &features)));
            lessons.views += 1;
        }
        if lessons.views == 0 { Err(FitError::NoFreeViews) } else { Ok(lessons) }
    }

    /// Views that are learnt from.
    pub fn learnt_views(&self) -> usize {
        (0..self.views).filter(|view| !is_held_out(*view)).count()
    }

    /// A picture, or with left and right exchanged. (A cell's sample point is half a pixel right of
    /// its middle, mirrored half a pixel left; that is ignored, as in training.)
    pub fn example(&self, picture: usize, mirrored: bool) -> Example {
        let mut example = self.examples[picture].clone();
        if mirrored {
            let width = self.cells[0] as usize;
            let Example { input, guess, target, counts } = &mut example;
            for planes in [&mut *input, guess, target, counts] {
                planes.chunks_exact_mut(width).for_each(<[f32]>::reverse);
            }
            let plane = counts.len();
            for &turned in &self.turning {
                input[turned * plane..][..plane].iter_mut().for_each(|v| *v = -*v);
            }
        }
        example
    }
}

fn is_held_out(view: usize) -> bool {
    view % HELD_OUT == 1
}

/// The features that the weights use.
fn features_of(weights: &Weights) -> Result<FeatureSet, GiError> {
    FeatureSet::new(weights.inputs.iter().map(|f| (f.name.as_str(), f.channels)))
}

/// Neither in front of a wall nor mostly sky, and lit.
fn is_a_view(sample: &Sample, scene_size: f32) -> bool {
    let shown = sample.depth.iter().filter(|d| **d > 0.0).count() as f32;
    shown >= LEAST_SHOWN * sample.depth.len() as f32
        && sample.closer_than(NEAREST * scene_size) <= 0.1
        && sample.inputs.exposure.s > 0.0
}

/// What a sample and its light teach a network that is given `features`.
fn example(sample: &Sample, target: &Target, features: &FeatureSet) -> Example {
    let (all, plane) = (FeatureSet::all(), sample.depth.len());
    let inputs = &sample.inputs;
    let planes = |name: &str, set: &FeatureSet| {
        let first = set.offset(name).unwrap_or(0) as usize;
        let channels = crate::gi::features::FEATURES.iter().find(|f| f.name == name).map_or(0, |f| f.channels as usize);
        first * plane..(first + channels) * plane
    };
    Example {
        input: features.names().flat_map(|name| inputs.features[planes(name, &all)].iter().copied()).collect(),
        guess: inputs.features[planes("guess", &all)].iter().map(|v| v.exp_m1()).collect(),
        target: target.light.iter().map(|v| v * inputs.exposure.inv_s).collect(),
        counts: sample.depth.iter().map(|d| f32::from(u8::from(*d > 0.0))).collect(),
    }
}

/// Pictures in the order of learning: all once, shuffled, then all again; half of them mirrored.
/// The same every time.
pub(super) struct Order {
    numbers: SplitMix,
    round: Vec<usize>,
    at: usize,
}

impl Order {
    pub fn new(pictures: usize) -> Self {
        Self { numbers: SplitMix::new(SEED), round: (0..pictures).collect(), at: pictures }
    }

    /// Which picture, and whether it is mirrored.
    pub fn next(&mut self) -> (usize, bool) {
        if self.at == self.round.len() {
            self.at = 0;
            // Fisher and Yates.
            for i in (1..self.round.len()).rev() {
                let other = (self.numbers.next() * (i + 1) as f32) as usize;
                self.round.swap(i, other.min(i));
            }
        }
        self.at += 1;
        (self.round[self.at - 1], self.numbers.next() < 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_picture_comes_once_a_round() {
        let mut order = Order::new(7);
        let rounds: Vec<Vec<usize>> = (0..6).map(|_| (0..7).map(|_| order.next().0).collect()).collect();
        for round in &rounds {
            let mut sorted = round.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..7).collect::<Vec<_>>());
        }
        assert!(rounds.windows(2).any(|r| r[0] != r[1]), "not the same order each time");
        let mirrored = (0..200).filter(|_| order.next().1).count();
        assert!((60..140).contains(&mirrored), "{mirrored} of 200");
    }

    #[test]
    fn a_mirrored_picture_looks_the_other_way() {
        let example = Example {
            input: vec![1.0, 2.0, 3.0, 4.0],
            guess: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            target: vec![6.0, 5.0, 4.0, 3.0, 2.0, 1.0],
            counts: vec![1.0, 0.0],
        };
        let (examples, held_out) = (vec![example.clone()], Vec::new());
        let lessons = Lessons { cells: [2, 1], views: 1, examples, held_out, turning: vec![1] };
        assert_eq!(lessons.example(0, false), example);
        let mirrored = lessons.example(0, true);
        assert_eq!(mirrored.input, [2.0, 1.0, -4.0, -3.0]);
        assert_eq!((mirrored.guess[..2].to_vec(), mirrored.counts), (vec![2.0, 1.0], vec![0.0, 1.0]));
    }
}
