//! What networks that correct `gather` make of it, by networks that answer the same everywhere.

use crate::common;
use crate::world::{BACKWARDS, difference, gather, hall, light, mean, renderer, sun};
use bouncelight::gi::Method;
use bouncelight::gi::reconstruct::MOST_GAIN;
use bouncelight::gpu::Gpu;

/// A hall, and what a network that answers the same everywhere makes of `gather`.
fn corrected(gpu: &Gpu, answer: [f32; 6], factor: f32) -> Vec<f32> {
    let method = Method::Neural(Box::new(crate::weights::constant_gain(answer).into()));
    light(
        gpu,
        &mut renderer(gpu, [96, 64], method),
        &hall([0.8, 0.1, 0.1], &[sun(BACKWARDS, 3.0 * factor)], 0.2 * factor, 1.0),
    )
}

#[test]
fn an_untrained_network_is_gather() {
    let Some(gpu) = common::gpu() else { return };
    let hall = hall([0.8, 0.1, 0.1], &[sun(BACKWARDS, 3.0)], 0.2, 1.0);
    let guess = light(&gpu, &mut renderer(&gpu, [96, 64], gather()), &hall);
    assert!(mean(&guess) > 0.01);
    let apart = |answer| difference(&corrected(&gpu, answer, 1.0), &guess);
    let (none, five) = (apart([0.0; 6]), apart([0.05, 0.05, 0.05, 0.0, 0.0, 0.0]));
    println!("untrained {:.4} % from the guess, with a gain of 0.05 {:.2} %", 100.0 * none, 100.0 * five);
    // Half floats.
    assert!(none < 1e-3 && five > 0.03, "{none} {five}");
    // A gain of ln 1.25 in red is a quarter more red and nothing else; of 9 it is what the limit
    // says.
    for (gain, factor) in [(1.25f32.ln(), 1.25), (9.0, MOST_GAIN.exp())] {
        let red = corrected(&gpu, [gain, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0);
        let times = |i: usize| if i.is_multiple_of(3) { factor } else { 1.0 };
        let expected: Vec<f32> = guess.iter().enumerate().map(|(i, c)| times(i) * c).collect();
        assert!(difference(&red, &expected) < 0.01 && difference(&red, &guess) > 0.03, "{gain}");
    }
}

#[test]
fn a_corrected_guess_is_linear_and_none_gives_none() {
    let Some(gpu) = common::gpu() else { return };
    let answer = [0.3, -0.2, 0.1, 0.05, 0.02, -0.03];
    let one = corrected(&gpu, answer, 1.0);
    let doubled: Vec<f32> = one.iter().map(|x| 2.0 * x).collect();
    let two = corrected(&gpu, answer, 2.0);
    assert!(difference(&two, &doubled) < 0.01 && difference(&two, &one) > 0.4);
    assert!(corrected(&gpu, answer, 0.0).iter().all(|x| *x == 0.0));
}
