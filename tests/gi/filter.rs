//! Networks that guide the filter of `gather`: by networks that answer the same everywhere, or what
//! chance makes of a cell.

use crate::common;
use crate::weights::{constant_filter, linear_bytes, random_filter};
use crate::world::{BACKWARDS, difference, gather, hall, light, mean, renderer, sun};
use bouncelight::gi::{GiError, Method};
use bouncelight::gpu::Gpu;
use bouncelight::net::format::{CELLS_V1, FeatureRow, SCREEN_V1, Weights};
use bouncelight::render::{RenderError, Renderer, RendererOptions};
use bouncelight::scene::Scene;

const SIZE: [u32; 2] = [96, 64];

fn room(factor: f32) -> Scene {
    hall([0.8, 0.1, 0.1], &[sun(BACKWARDS, 3.0 * factor)], 0.2 * factor, 1.0)
}

fn filtered(gpu: &Gpu, weights: Weights, scene: &Scene) -> Vec<f32> {
    light(gpu, &mut renderer(gpu, SIZE, Method::Neural(Box::new(weights.into()))), scene)
}

#[test]
fn an_answer_of_zeros_is_gather_to_the_bit() {
    let Some(gpu) = common::gpu() else { return };
    let alone = light(&gpu, &mut renderer(&gpu, SIZE, gather()), &room(1.0));
    assert!(mean(&alone) > 0.01);
    assert_eq!(filtered(&gpu, constant_filter([0.0; 12]), &room(1.0)), alone);
    // Places and trust that are the same everywhere say nothing.
    let mut same = [2.0; 12];
    (same[9], same[10], same[11]) = (0.0, 5.0, 5.0);
    let apart = difference(&filtered(&gpu, constant_filter(same), &room(1.0)), &alone);
    // What differs from cell to cell says something, and so does a tolerance.
    let other = difference(&filtered(&gpu, random_filter(3.0), &room(1.0)), &alone);
    println!("the same everywhere {apart:e}, by chance {other:.5}");
    assert!(apart < 1e-3 && other > 2e-3, "{apart} {other}");
}

#[test]
fn twice_the_light_is_twice_the_answer_and_none_gives_none() {
    let Some(gpu) = common::gpu() else { return };
    let weights = || random_filter(2.0);
    let one = filtered(&gpu, weights(), &room(1.0));
    let doubled: Vec<f32> = one.iter().map(|x| 2.0 * x).collect();
    let two = filtered(&gpu, weights(), &room(2.0));
    let off = difference(&two, &doubled);
    assert!(off < 1e-3 && difference(&two, &one) > 0.4, "{off}");
    assert!(filtered(&gpu, weights(), &room(0.0)).iter().all(|x| *x == 0.0));
}

#[test]
fn numbers_beyond_all_bounds_leave_a_picture() {
    let Some(gpu) = common::gpu() else { return };
    let alone = light(&gpu, &mut renderer(&gpu, SIZE, gather()), &room(1.0));
    // Features times this are infinite, their differences no numbers.
    let found = filtered(&gpu, random_filter(3e38), &room(1.0));
    assert!(found.iter().all(|x| x.is_finite() && *x >= 0.0));
    let ratio = mean(&found) / mean(&alone);
    assert!((0.6..1.6).contains(&ratio), "{ratio}");
}

#[test]
fn weights_of_something_else_are_refused_by_name() {
    let Some(gpu) = common::gpu() else { return };
    let refusal = |bytes: Vec<u8>| {
        let weights = Weights::from_bytes(&bytes).expect("a sound file");
        let method = Method::Neural(Box::new(weights.into()));
        let options = RendererOptions { method, ..Default::default() };
        match Renderer::new(&gpu.device, &gpu.queue, SIZE, options) {
            Err(RenderError::Gi(error @ (GiError::Feature { .. } | GiError::Output(_)))) => error.to_string(),
            Err(other) => panic!("{other}"),
            Ok(_) => String::new(),
        }
    };
    let of = |table: &str, rows: &[FeatureRow], outputs: usize| {
        let channels: u32 = rows.iter().map(|r| r.channels).sum();
        linear_bytes(table, rows, "filter", &vec![0.0; outputs * channels as usize], &vec![0.0; outputs])
    };
    assert_eq!(refusal(of("cells", CELLS_V1, 12)), "");
    for (bytes, named) in [
        (of("screen", SCREEN_V1, 12), "screen"),
        (of("cells", &CELLS_V1[..9], 12), "the whole table"),
        (of("cells", CELLS_V1, 8), "8 channels"),
    ] {
        let error = refusal(bytes);
        assert!(error.contains(named), "{named}: {error}");
    }
}
