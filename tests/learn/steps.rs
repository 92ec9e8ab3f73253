//! What steps do to a network: nothing without them, the same twice, less loss on a target that can
//! be met.

use super::{common, hashed, learner};
use bouncelight::gpu::Gpu;
use bouncelight::net::format::Weights;
use bouncelight::net::learn::{Example, LearnError, check};

const CELLS: [u32; 2] = [12, 9];
const PIXELS: usize = 12 * 9;

/// A picture whose right light is the guess times `gain`.
fn example(name: &str, gain: f32) -> Example {
    let input: Vec<f32> = hashed::values(name, 24 * PIXELS).iter().map(|v| 0.5 + 0.5 * v).collect();
    let guess: Vec<f32> = input[21 * PIXELS..].iter().map(|v| v.exp_m1()).collect();
    let target = guess.iter().map(|v| v * gain).collect();
    Example { input, guess, target, counts: vec![1.0; PIXELS] }
}

/// Weights after `steps` steps, and the losses before each.
fn learnt(gpu: &Gpu, examples: &[Example], steps: u32) -> (Weights, Vec<f32>) {
    let mut learner = learner(gpu, &Weights::corrector().unwrap(), CELLS);
    let loaded: Vec<_> = examples.iter().map(|e| learner.load(e).unwrap()).collect();
    let pictures: Vec<_> = loaded.iter().collect();
    let losses = (0..steps).map(|_| learner.step(&pictures, 2e-3).unwrap().loss).collect();
    (learner.weights().unwrap(), losses)
}

#[test]
fn without_a_step_the_file_is_the_same() {
    let Some(gpu) = common::gpu() else { return };
    let start = Weights::corrector().unwrap();
    let same = |weights: &Weights| weights.to_bytes() == start.to_bytes();
    assert!(same(&learnt(&gpu, &[example("a", 1.2)], 0).0));
    assert!(!same(&learnt(&gpu, &[example("a", 1.2)], 1).0), "a step changes it");
}

#[test]
fn what_can_be_met_is_met_and_two_runs_are_the_same() {
    let Some(gpu) = common::gpu() else { return };
    let examples = [example("a", 1.2), example("b", 1.2)];
    let (weights, losses) = learnt(&gpu, &examples, 60);
    let (first, last) = (losses[0], losses[59]);
    println!("{first} to {last}");
    // The answer is a gain of ln 1.2 everywhere, which the last layer's biases can give by
    // themselves: no loss at all.
    assert!(first > 0.01 && last < 0.02 * first, "{first} to {last}");
    assert_eq!(weights.to_bytes(), learnt(&gpu, &examples, 60).0.to_bytes(), "two runs are the same to the bit");
    // Asking what the error is on other pictures teaches nothing.
    let mut asked = learner(&gpu, &Weights::corrector().unwrap(), CELLS);
    let loaded: Vec<_> = examples.iter().map(|e| asked.load(e).unwrap()).collect();
    let before = asked.error(&loaded).unwrap();
    let steps = (0..60).map(|_| {
        asked.error(&loaded[..1]).unwrap();
        asked.step(&loaded.iter().collect::<Vec<_>>(), 2e-3).unwrap().error
    });
    let steps: Vec<f32> = steps.collect();
    assert_eq!(asked.weights().unwrap().to_bytes(), weights.to_bytes());
    // It is that of the next step, but of the average over steps, which comes a few steps behind.
    let after = asked.error(&loaded).unwrap();
    assert!((before / steps[0] - 1.0).abs() < 1e-5, "{before}, {}", steps[0]);
    assert!(after < 0.5 * before && after > 0.0, "{before} to {after}");
    // Cells that do not count teach nothing.
    let blind = examples.map(|e| Example { counts: vec![0.0; PIXELS], ..e });
    assert_eq!(learnt(&gpu, &blind, 3).1, [0.0; 3]);
}

#[test]
fn what_cannot_be_learnt_is_told() {
    let Some(gpu) = common::gpu() else { return };
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/weights-format/fixtures/unet.safetensors");
    let other = Weights::load(path.as_ref()).unwrap();
    let error = check(&other, CELLS).unwrap_err();
    assert!(matches!(error, LearnError::Meaning { .. }), "{error}");
    let mut learner = learner(&gpu, &other, CELLS);
    assert!(matches!(learner.step(&[], 1e-3), Err(LearnError::Meaning { .. })));
    assert!(check(&Weights::corrector().unwrap(), CELLS).is_ok());
    // Numbers that run away are an error in the very step.
    let mut learner = super::learner(&gpu, &Weights::corrector().unwrap(), CELLS);
    let broken = Example { target: vec![f32::INFINITY; 3 * PIXELS], ..example("a", 1.0) };
    let loaded = learner.load(&broken).unwrap();
    assert!(matches!(learner.step(&[&loaded], 1e-3), Err(LearnError::Diverged { step: 1, .. })));
    let short = learner.load(&Example { counts: Vec::new(), ..example("a", 1.0) });
    assert!(matches!(short, Err(LearnError::Picture { what: "cells", found: 0, wanted: PIXELS })));
}
