//! What networks that correct `cache` make of it, by networks that answer the same everywhere.

use crate::common;
use crate::world::{BACKWARDS, difference, hall, light, mean, renderer, sun};
use bouncelight::gi::Method;
use bouncelight::gi::reconstruct::MOST_GAIN;
use bouncelight::gpu::Gpu;

/// A hall, and what a network that answers the same everywhere makes of `cache`.
fn corrected(gpu: &Gpu, answer: [f32; 6], factor: f32) -> Vec<f32> {
    let method = Method::Neural(Box::new(crate::weights::constant_gain(answer).into()));
    light(
        gpu,
        &mut renderer(gpu, [96, 64], method),
        &hall([0.8, 0.1, 0.1], &[sun(BACKWARDS, 3.0 * factor)], 0.2 * factor, 1.0),
    )
}

#[test]
fn an_untrained_network_is_cache() {
    let Some(gpu) = common::gpu() else { return };
    let hall = hall([0.8, 0.1, 0.1], &[sun(BACKWARDS, 3.0)], 0.2, 1.0);
    let cache = light(&gpu, &mut renderer(&gpu, [96, 64], Method::Cache), &hall);
    assert!(mean(&cache) > 0.01);
    // To a half float's last bit, which a driver may round towards zero.
    let ulps = |other: &[f32]| {
        let bits = |x: f32| i32::from(half::f16::from_f32(x).to_bits());
        cache.iter().zip(other).map(|(a, b)| (bits(*a) - bits(*b)).abs()).max()
    };
    assert!(ulps(&corrected(&gpu, [0.0; 6], 1.0)) <= Some(1));
    assert!(ulps(&corrected(&gpu, [0.01; 6], 1.0)) > Some(1), "sees one percent");
    // A gain of ln 1.25 in red is a quarter more red and nothing else; of 9 it is what the limit says.
    for (gain, factor) in [(1.25f32.ln(), 1.25), (9.0, MOST_GAIN.exp())] {
        let red = corrected(&gpu, [gain, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0);
        let times = |i: usize| if i.is_multiple_of(3) { factor } else { 1.0 };
        let expected: Vec<f32> = cache.iter().enumerate().map(|(i, c)| times(i) * c).collect();
        assert!(difference(&red, &expected) < 1e-3 && difference(&red, &cache) > 0.03, "{gain}");
    }
}

#[test]
fn a_corrected_guess_is_linear_and_none_gives_none() {
    let Some(gpu) = common::gpu() else { return };
    let answer = [0.3, -0.2, 0.1, 0.05, 0.02, -0.03];
    let one = corrected(&gpu, answer, 1.0);
    let doubled: Vec<f32> = one.iter().map(|x| 2.0 * x).collect();
    let two = corrected(&gpu, answer, 2.0);
    assert!(difference(&two, &doubled) < 1e-3 && difference(&two, &one) > 0.4);
    assert!(corrected(&gpu, answer, 0.0).iter().all(|x| *x == 0.0));
}
