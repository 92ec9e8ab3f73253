//! Networks that guide the filter of `gather`: by networks that answer the same everywhere, or what
//! chance makes of a cell.

use crate::common;
use crate::linear::linear_bytes;
use crate::weights::{constant_filter, random_filter};
use crate::world::{BACKWARDS, difference, hall, light, mean, renderer, sun};
use bouncelight::gi::{GiError, Method, Neural, gather::Options};
use bouncelight::gpu::Gpu;
use bouncelight::net::format::{CELLS_V1, CELLS_V2, FeatureRow, IMAGES_V1, Weights};
use bouncelight::net::gpu::LayerReadback;
use bouncelight::net::plan::Precision;
use bouncelight::render::{RenderError, Renderer, RendererOptions, View};
use bouncelight::scene::Scene;
use bouncelight_lab::network::cpu;

const SIZE: [u32; 2] = [96, 64];

/// With the cache of `neural`'s.
fn gather() -> Method {
    Method::Gather(Options::default())
}

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
    let of = |table: &str, rows: &[FeatureRow], meaning: &str, outputs: usize| {
        let channels: u32 = rows.iter().map(|r| r.channels).sum();
        linear_bytes(table, rows, meaning, &vec![0.0; outputs * channels as usize], &vec![0.0; outputs])
    };
    assert_eq!(refusal(of("cells", CELLS_V1, "filter", 12)), "");
    assert_eq!(refusal(of("cells", CELLS_V2, "filter", 12)), "");
    for (bytes, named) in [
        (of("images", IMAGES_V1, "filter", 12), "images"),
        (of("cells", &CELLS_V1[..9], "filter", 12), "the whole table"),
        (of("cells", CELLS_V1, "filter", 8), "8 channels"),
        (of("cells", CELLS_V1, "plain", 12), "`plain`"),
    ] {
        let error = refusal(bytes);
        assert!(error.contains(named), "{named}: {error}");
    }
}

/// What the shipped network is given and makes of it, read back after frames in which its layers
/// overwrote each other.
#[test]
fn the_network_is_seen_at_work() {
    let Some(gpu) = common::gpu() else { return };
    let weights = Weights::shipped().expect("they are read");
    // Of 32 bits, as the CPU reference.
    let neural = Neural::from(weights.clone()).stored(Some(Precision::F32));
    let mut drawn = renderer(&gpu, SIZE, Method::Neural(Box::new(neural)));
    let scene = room(1.0);
    light(&gpu, &mut drawn, &scene);
    let (view, sky) = (View::new(&scene.cameras[0], SIZE, [0.0; 2]), scene.environment.radiance);
    let given = drawn.read_network_input(&view, sky).expect("it is read").expect("there is a network");
    assert_eq!([given.shape.channels, given.shape.width, given.shape.height], [15, 24, 16]);
    let hits = &given.values[11 * 384..12 * 384];
    assert!(hits.iter().all(|x| *x == 0.0 || *x == 1.0) && hits.contains(&1.0), "channel 11 is `hit`");
    let input = cpu::Tensor { shape: given.shape, data: given.values.clone() };
    let answer = cpu::run(&weights, &input).expect("it runs").data;
    let last = drawn.layers().len() - 1;
    let mut layer = |i| drawn.read_layer(&view, sky, i).expect("it is read").expect("there is one");
    let off = |tap: &LayerReadback| tap.values.iter().zip(&answer).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    let largest = answer.iter().fold(0.0f32, |most, x| most.max(x.abs()));
    let (first, again) = (layer(last), layer(last));
    assert!(off(&first) < 1e-3 * largest && largest > 0.1, "{} of {largest}", off(&first));
    assert_eq!(first, again, "reading changes nothing");
    // Negative control: an answer to other features is another one.
    let other = cpu::Tensor { data: input.data.iter().map(|x| 0.9 * x).collect(), ..input };
    let other = cpu::run(&weights, &other).expect("it runs").data;
    assert!(other.iter().zip(&answer).any(|(a, b)| (a - b).abs() > 1e-3 * largest));
    // A method without a network has nothing to show.
    let mut plain = renderer(&gpu, SIZE, gather());
    light(&gpu, &mut plain, &scene);
    assert_eq!(plain.read_network_input(&view, sky).expect("no error"), None);
}

#[test]
fn numbers_are_stored_as_asked() {
    let Some(gpu) = common::gpu() else { return };
    let of = |precision| {
        let neural = Neural::from(random_filter(2.0)).stored(Some(precision));
        light(&gpu, &mut renderer(&gpu, SIZE, Method::Neural(Box::new(neural))), &room(1.0))
    };
    let (half, full) = (of(Precision::F16), of(Precision::F32));
    let off = difference(&half, &full);
    assert!(half != full && off < 0.01, "16 bits differ, but little: {off}");
}
