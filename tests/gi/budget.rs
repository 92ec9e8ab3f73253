//! Rays as a scene needs them: a budget is kept and changes no light; a picture at rest sends a fourth, and wakes at
//! once.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, GREY, HALF_CEILING, difference, mean};
use bouncelight::gi::{Method, gather::Options, gather::RAYS_SENT};
use bouncelight::gpu::{Gpu, readback};
use bouncelight::render::Renderer;
use bouncelight::scene::{Camera, LightKind, Scene};

const SIZE: [u32; 2] = [128, 96];
const CELLS: f64 = 32.0 * 24.0;

/// A room with half a ceiling under a sky, and a lamp.
fn room(intensity: f32) -> Scene {
    let blocks = world::room(&[HALF_CEILING, ([-1.0, 0.0, -2.0], [1.0, 1.5, -1.0], GREY)]);
    let mut scene = world::scene(&blocks, &[], 1.0, Camera::look_at([0.0, 1.6, 5.0], [0.0, 1.0, -3.0], 1.0));
    scene.lights = vec![LightKind::Point { position: [1.5, 2.0, 0.5], intensity, radius: 0.05, range: None }.into()];
    scene
}

fn renderer(gpu: &Gpu, rays: f32, seed: u32) -> Renderer {
    world::renderer(gpu, SIZE, Method::Gather(Options { rays, seed, ..Default::default() }))
}

/// Rays of the last frame's cells, a cell.
fn rays_of(gpu: &Gpu, renderer: &Renderer) -> f64 {
    let jobs = renderer.memory().expect("it remembers").jobs;
    let word = readback::buffer(&gpu.device, &gpu.queue, jobs, RAYS_SENT, 4).expect("reading back works");
    f64::from(bytemuck::pod_read_unaligned::<u32>(&word)) / CELLS
}

/// Rays a cell of each of so many frames along a walk, a step of 2 cm each.
fn along_a_walk(gpu: &Gpu, rays: f32, frames: u32) -> Vec<f64> {
    let (mut renderer, scene) = (renderer(gpu, rays, 0), room(20.0));
    let drawn = uploaded(gpu, &scene);
    let walk = |frame| {
        let x = 0.02 * frame as f32;
        go_on(gpu, &mut renderer, &drawn, &Camera::look_at([x, 1.6, 5.0], [x, 1.0, -3.0], 1.0), 1);
        rays_of(gpu, &renderer)
    };
    (0..frames).map(walk).collect()
}

#[test]
fn a_budget_is_kept_along_a_walk() {
    let Some(gpu) = common::gpu() else { return };
    let budget = 0.4 * CELLS as f32;
    let found = along_a_walk(&gpu, budget, 30);
    println!("{found:.2?}");
    // A first frame's cells have one ray each; a tenth of them sees the sky.
    assert!((0.85..1.5).contains(&found[0]), "{}", found[0]);
    let kept = |found: &[f64]| {
        let of = |rays: &f64| rays / 0.4;
        let mean = found[6..].iter().map(of).sum::<f64>() / (found.len() - 6) as f64;
        (0.85..1.05).contains(&mean) && found[6..].iter().all(|rays| (0.65..1.25).contains(&of(rays)))
    };
    assert!(kept(&found));
    // Negative control: without one there are more, and first frames many more.
    let all = along_a_walk(&gpu, 1.0, 30);
    assert!(!kept(&all) && all[0] > 7.0, "{all:.2?}");
}

/// Rays are sent where the noise is, by what the rays themselves have found: this must not make the
/// mean darker or brighter.
#[test]
fn a_budget_changes_no_light() {
    let Some(gpu) = common::gpu() else { return };
    let scene = room(20.0);
    let drawn = uploaded(&gpu, &scene);
    let light = |rays, frames| -> Vec<f32> {
        let seeds = [1, 2].map(|seed| go_on(&gpu, &mut renderer(&gpu, rays, seed), &drawn, &scene.cameras[0], frames));
        seeds[0].iter().zip(&seeds[1]).map(|(a, b)| 0.5 * (a + b)).collect()
    };
    let all = light(1.0, 100);
    for (rays, frames) in [(0.5 * CELLS as f32, 40), (0.25 * CELLS as f32, 80), (0.125, 90)] {
        let found = light(rays, frames);
        let ratio = mean(&found) / mean(&all);
        println!("{rays}: {ratio:.4} of the light, {:.2} % off", 100.0 * difference(&found, &all));
        assert!((ratio - 1.0).abs() < 0.015, "{rays}: {ratio}");
    }
    // Negative control: a lamp that is a fifth weaker is seen.
    let weaker = room(16.0);
    let found = go_on(&gpu, &mut renderer(&gpu, 1.0, 1), &uploaded(&gpu, &weaker), &scene.cameras[0], 100);
    assert!(mean(&found) / mean(&all) < 0.985);
}

/// After so many frames at rest: rays a cell; how far light is off in the frame in which the lamp is dimmed to a half,
/// and how far it was before; rays a cell in that frame.
fn dimmed_after(gpu: &Gpu, frames: u32) -> (f64, [f64; 2], f64) {
    let (scene, dimmed) = (room(20.0), room(10.0));
    let (mut renderer, mut drawn) = (renderer(gpu, 1.0, 0), uploaded(gpu, &scene));
    let before = go_on(gpu, &mut renderer, &drawn, &scene.cameras[0], frames);
    let rest = rays_of(gpu, &renderer);
    drawn.set_lights(&gpu.device, &gpu.queue, &dimmed);
    let now = go_on(gpu, &mut renderer, &drawn, &scene.cameras[0], 1);
    let rays = rays_of(gpu, &renderer);
    let truth = go_on(gpu, &mut renderer, &drawn, &scene.cameras[0], 40);
    (rest, [difference(&now, &truth), difference(&before, &truth)], rays)
}

#[test]
fn a_picture_at_rest_sends_a_fourth_of_its_rays_and_wakes_at_once() {
    let Some(gpu) = common::gpu() else { return };
    // Which directions are traced again depends on the frame: four are a round.
    let round = |first: u32| {
        let all: Vec<_> = (first..first + 4).map(|frames| dimmed_after(&gpu, frames)).collect();
        let mean = |part: fn(&(f64, [f64; 2], f64)) -> f64| all.iter().map(part).sum::<f64>() / 4.0;
        [mean(|r| r.0), mean(|r| r.1[0]), mean(|r| r.1[1]), mean(|r| r.2)]
    };
    let [awake, asleep] = [round(57), round(70)];
    println!("rays a cell, off at once, off before, rays at once: {awake:.3?}, {asleep:.3?}");
    assert!(awake[0] > 0.85 && (0.25..0.3).contains(&(asleep[0] / awake[0])));
    // The lamp is followed as if there had been no rest, by every cell.
    assert!(asleep[3] > 0.95 * awake[3] && asleep[1] < 1.15 * awake[1]);
    // Negative control: what was there before is further off.
    assert!(awake[2] > 1.5 * awake[1]);
}

/// Light of a picture at rest is that of one whose rays go on.
#[test]
fn nothing_is_lost_at_rest() {
    let Some(gpu) = common::gpu() else { return };
    let scene = room(20.0);
    let drawn = uploaded(&gpu, &scene);
    let mut renderer = renderer(&gpu, 1.0, 0);
    let [before, later] = [60, 200].map(|frames| go_on(&gpu, &mut renderer, &drawn, &scene.cameras[0], frames));
    println!("{:.2} % off", 100.0 * difference(&later, &before));
    assert!(difference(&later, &before) < 0.02 && (mean(&later) / mean(&before) - 1.0).abs() < 0.003);
}
