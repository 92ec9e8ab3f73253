//! Fine-tuning a network to the scene, on views of its own; the views that judge are never learnt
//! from.
//!
//! Half of the time at most goes into pictures (`lessons`), the rest into steps (`net::learn`), as
//! training takes them. What has been learnt is judged as every candidate is, and stays only if it
//! beats `gather`, the network it began as, and what was chosen before, by more than the noise of
//! the references explains. What is judged is the state that is best on views held out from the
//! steps.

use super::lessons::{self, Lessons};
use super::{Candidate, Fit, FitError, FitOptions, Network, Search};
use crate::{
    gi::pass::Neural,
    net::{format::Provenance, format::Weights, learn::Learner},
    study::trial::Trial,
};
use serde::Serialize;
use serde_json::{Value, json};
use std::time::Instant;

/// Share of the time after which no picture is begun any more.
const DRAWING: f64 = 0.5;
/// Pictures of a step; AdamW's rate at the beginning and at the end, and the steps over which it
/// rises first.
const BATCH: usize = 2;
const RATE: [f32; 2] = [5e-4, 2e-5];
const RISING: u32 = 20;
/// Steps from one look at the held-out views to the next.
const LOOKING: u32 = 20;
/// Standard deviations of the references' noise that a win must exceed: chance alone does so once
/// in forty times.
const SURE: f64 = 2.0;
/// What tables call what has been learnt and is no file.
const NAME: &str = "learned";

/// What is asked for.
pub struct Learning {
    /// Minutes for pictures and steps together.
    pub minutes: f64,
    /// The network to begin with: its index in [`FitOptions::networks`].
    pub start: usize,
    /// The scene, for the weights' name.
    pub scene: String,
    /// The command line, for their provenance.
    pub command: String,
}

/// What came of it. Errors are in the metric's own unit: `gather`'s, those of the network that it
/// began as, and of what was learnt.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Learned {
    /// What the weights that it began as are called.
    pub started_from: String,
    /// Views that were learnt from.
    pub views: usize,
    /// Pictures of these, at several frames after a cut each.
    pub pictures: usize,
    /// Seconds that drawing and tracing them took.
    pub drawing_seconds: f64,
    /// Seconds of the steps.
    pub step_seconds: f64,
    /// Steps of two pictures each.
    pub steps: u32,
    /// Pictures of views that no step learnt from, and by which the best state was kept.
    pub held_out: usize,
    /// Steps of the state that was kept, and error there at the beginning and of that state; absent
    /// where no view is held out.
    pub best: Option<Best>,
    /// Multiplications and additions of a step, by count.
    pub step_flops: u64,
    /// Relative error of the light that is learnt (root of the mean square, the noise of targets
    /// included): median of the first twentieth of the steps, and of the last.
    pub error: [f32; 2],
    /// Errors in the worst of the views that judge.
    pub worst: [f64; 3],
    /// Mean errors of the views that judge.
    pub mean: [f64; 3],
    /// By how much to win in the worst view, and on average: what the references' noise explains.
    pub margin: [f64; 2],
    /// It is better than both by more than that in the worst view and on average, and in the worst
    /// view than what was chosen before.
    pub kept: bool,
}

/// The state that is best on views that are not learnt from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Best {
    /// After so many steps.
    pub step: u32,
    /// Relative error of its light there, as [`Learned::error`].
    pub error: f32,
    /// That of the network that it began as.
    pub before: f32,
}

/// Learns, judges, and where that wins, chooses it and returns the weights file; [`Fit::learned`]
/// tells how it came about. The network is the last of `options` afterwards. Where `gather` or the
/// network to begin with could not be judged, there is nothing to win against, and nothing is
/// learnt. `told` hears what is being done and the seconds that are gone. Blocks.
///
/// # Errors
/// A network that cannot be learnt; a scene without free views; [`FitError::Trial`].
pub fn learn(
    trial: &mut Trial<'_>,
    found: &mut Fit,
    options: &mut FitOptions,
    learning: &Learning,
    told: &mut dyn FnMut(&str, f64),
) -> Result<Option<Vec<u8>>, FitError> {
    let judged =
        |candidate: &Candidate| found.rows.iter().position(|r| r.candidate == *candidate && !r.errors.is_empty());
    let start = Candidate::Neural(learning.start);
    let (Some(gather), Some(before)) = (judged(&Candidate::Gather(Default::default())), judged(&start)) else {
        return Ok(None);
    };
    let start = &options.networks[learning.start];
    let (started_from, start) = (start.file.display().to_string(), start.neural.clone());
    let begun = Instant::now();
    let (seconds, gone) = (60.0 * learning.minutes, || begun.elapsed().as_secs_f64());
    let lessons = Lessons::draw(trial, &start.weights, options.frames, &mut |view| {
        told(&format!("view {view} to learn from"), gone());
        gone() < DRAWING * seconds
    })?;
    let drawing_seconds = gone();
    let gpu = trial.gpu();
    let mut learner = Learner::new(&gpu.device, &gpu.queue, &start.weights, lessons.cells)?;
    let Steps { errors, best, mut weights } = steps(&mut learner, &lessons, &mut |step, error| {
        let share = (gone() - drawing_seconds) / (seconds - drawing_seconds).max(1e-9);
        told(&format!("step {step}, error of light {:.0} %", 100.0 * error), gone());
        trial.go_on(share.min(1.0))?;
        Ok(share as f32)
    })?;
    let step_seconds = gone() - drawing_seconds;

    weights.name = format!("{started_from} fitted to {}", learning.scene);
    let neural = Neural { weights: Weights::from_bytes(&weights.to_bytes())?, ..start.clone() };
    options.networks.push(Network { file: NAME.into(), neural });
    let network = options.networks.len() - 1;
    let mut tell = |what: &str, _, _| told(what, gone());
    let Some(row) = found.again(trial, options, &mut tell, |search| search.judge(network, before))? else {
        return Ok(None);
    };
    let rows = [gather, before, row].map(|i| &found.rows[i]);
    let worst = rows.map(|r| r.worst);
    let mean = rows.map(|r| r.errors.iter().sum::<f64>() / r.errors.len().max(1) as f64);
    let margin = margin(&found.views.iter().map(|v| v.doubt).collect::<Vec<_>>());
    let beats = |errors: [f64; 3], margin| (0..2).all(|i| options.yardstick.beats(errors[2], errors[i], margin));
    let kept = beats(worst, margin[0])
        && beats(mean, margin[1])
        && options.yardstick.beats(worst[2], found.choice().worst, margin[0]);
    let twentieth = errors.len().div_ceil(20);
    let learned = Learned {
        started_from,
        views: lessons.learnt_views(),
        pictures: lessons.examples.len(),
        drawing_seconds,
        step_seconds,
        steps: learner.steps(),
        held_out: lessons.held_out.len(),
        best,
        step_flops: BATCH as u64 * learner.flops()?,
        error: [median(&errors[..twentieth]), median(&errors[errors.len() - twentieth..])],
        worst,
        mean,
        margin,
        kept,
    };
    weights.provenance = provenance(&learned, learning, trial, &start.weights);
    found.learned = Some(learned);
    if !kept {
        return Ok(None);
    }
    let file = weights.to_bytes();
    options.networks[network].neural.weights = Weights::from_bytes(&file)?;
    (found.chosen, found.reached) = (row, options.yardstick.is_met(worst[2]));
    found.again(trial, options, &mut tell, |search| search.settle(row, options.yardstick.is_met(worst[2])))?;
    Ok(Some(file))
}

/// By how much to win in the worst view and on average, of the views' doubts: the worst may be any
/// of them, and independent ones average out.
fn margin(doubts: &[f64]) -> [f64; 2] {
    let worst = doubts.iter().copied().fold(0.0, f64::max);
    let mean = doubts.iter().map(|d| d * d).sum::<f64>().sqrt() / doubts.len().max(1) as f64;
    [SURE * worst, SURE * mean]
}

/// What came of the steps.
struct Steps {
    /// Errors of the pictures of each step.
    errors: Vec<f32>,
    best: Option<Best>,
    /// The best state; the last where no view is held out.
    weights: Weights,
}

/// Steps until `told`, which hears how many there were and the median of the last errors, says that
/// all the time (1) is gone.
fn steps(
    learner: &mut Learner,
    lessons: &Lessons,
    told: &mut dyn FnMut(u32, f32) -> Result<f32, FitError>,
) -> Result<Steps, FitError> {
    let held_out = lessons.held_out.iter().map(|e| learner.load(e)).collect::<Result<Vec<_>, _>>()?;
    let mut kept = learner.weights()?;
    let before = if held_out.is_empty() { None } else { Some(learner.error(&held_out)?) };
    let mut best = before.map(|before| Best { step: 0, error: before, before });
    let mut order = lessons::Order::new(lessons.examples.len());
    let (mut errors, mut share) = (Vec::new(), 0f32);
    while share < 1.0 {
        let loaded = (0..BATCH).map(|_| {
            let (picture, mirrored) = order.next();
            learner.load(&lessons.example(picture, mirrored))
        });
        let loaded = loaded.collect::<Result<Vec<_>, _>>()?;
        // Half a cosine, as training has it.
        let falling = RATE[1] + 0.5 * (RATE[0] - RATE[1]) * (1.0 + (std::f32::consts::PI * share).cos());
        let rising = ((learner.steps() + 1) as f32 / RISING as f32).min(1.0);
        let stride = learner.step(&loaded.iter().collect::<Vec<_>>(), rising * falling)?;
        errors.push(stride.error);
        let step = learner.steps();
        share = told(step, median(&errors[errors.len().saturating_sub(20)..]))?;
        if let Some(best) = &mut best
            && (step.is_multiple_of(LOOKING) || share >= 1.0)
        {
            let error = learner.error(&held_out)?;
            if error < best.error {
                (best.step, best.error, kept) = (step, error, learner.weights()?);
            }
        }
    }
    let weights = if best.is_some() { kept } else { learner.weights()? };
    Ok(Steps { errors, best, weights })
}

fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f32::NAN)
}

/// What the weights file says of how it was made.
fn provenance(learned: &Learned, learning: &Learning, trial: &mut Trial<'_>, start: &Weights) -> Provenance {
    let mut before = start.provenance.clone();
    before.remove("last_epochs");
    let about = json!({
        "command": learning.command, "program": env!("CARGO_PKG_VERSION"), "device": trial.gpu().sentence(),
        "scene": learning.scene, "scene_hash": trial.hash(),
        "training_minutes": learning.minutes, "samples_seen": BATCH as u32 * learned.steps,
        "data": lessons::SENTENCE, "learned": learned,
        "started_from": {"name": start.name, "hash": start.hash_text(), "provenance": before},
    });
    match about {
        Value::Object(about) => about,
        _ => Provenance::new(),
    }
}

impl Fit {
    /// Goes on with the search that led here.
    fn again<T>(
        &mut self,
        trial: &mut Trial<'_>,
        options: &FitOptions,
        told: &mut dyn FnMut(&str, u32, u32),
        work: impl FnOnce(&mut Search<'_, '_>) -> Result<T, FitError>,
    ) -> Result<T, FitError> {
        let (views, rows) = (std::mem::take(&mut self.views), std::mem::take(&mut self.rows));
        let mut search = Search { trial, options, views, rows, costs: Vec::new(), told, done: 0, expected: 0 };
        let done = work(&mut search);
        (self.views, self.rows) = (search.views, search.rows);
        done
    }
}

impl Search<'_, '_> {
    /// Tries the network of that index, which costs what that of row `like` does.
    fn judge(&mut self, network: usize, like: usize) -> Result<Option<usize>, FitError> {
        self.costs.push((Candidate::Neural(network), self.rows[like].cost_ms));
        self.attempt(Candidate::Neural(network), self.options.frames)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_win_is_more_than_noise_explains() {
        let [worst, mean] = margin(&[0.01, 0.02, 0.02]);
        assert!((worst - 0.04).abs() < 1e-12 && (mean - 0.02).abs() < 1e-12, "{worst} {mean}");
        assert_eq!(margin(&[0.0]), [0.0; 2]);
        let light: super::super::Yardstick = "light=5%".parse().unwrap();
        assert!(light.beats(0.10, 0.15, worst) && !light.beats(0.12, 0.15, worst) && !light.beats(0.15, 0.10, worst));
        // Any win counts where the references have no noise, but a draw is none.
        assert!(light.beats(0.149, 0.15, 0.0) && !light.beats(0.15, 0.15, 0.0));
    }
}
