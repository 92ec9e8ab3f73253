//! Rays as a scene needs them: a budget is kept and changes no light; a picture at rest is drawn in one frame of four,
//! and wakes at once.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, GREY, HALF_CEILING, difference, mean};
use bouncelight::gi::{Method, gather::Options, gather::RAYS_SENT};
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{Renderer, View, sampling};
use bouncelight::scene::{AlphaMode, Camera, LightKind, Scene};

const SIZE: [u32; 2] = [96, 64];
const CELLS: f64 = 24.0 * 16.0;

/// A room with half a ceiling under a sky, and a lamp.
fn room(intensity: f32) -> Scene {
    let blocks = world::room(&[HALF_CEILING, ([-1.0, 0.0, -2.0], [1.0, 1.5, -1.0], GREY)]);
    let mut scene = world::scene(&blocks, &[], 1.0, Camera::look_at([0.0, 1.6, 5.0], [0.0, 1.0, -3.0], 1.0));
    scene.lights = vec![LightKind::Point { position: [1.5, 2.0, 0.5], intensity, radius: 0.05, range: None }.into()];
    scene
}

fn renderer(gpu: &Gpu, rays: f32, seed: u32) -> Renderer {
    world::renderer(gpu, SIZE, Method::Gather(Options { rays, seed, slots: world::FEW_SLOTS, ..Default::default() }))
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
    for (rays, frames) in [(0.5 * CELLS as f32, 40), (0.25 * CELLS as f32, 120), (0.125, 90)] {
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

/// Draws so many frames, with jitter as temporal anti-aliasing has it where asked for; the last one's light.
fn go(gpu: &Gpu, renderer: &mut Renderer, drawn: &SceneGpu, camera: &Camera, frames: u32, jitter: bool) -> Vec<f32> {
    for i in 0..frames - 1 {
        let offset = if jitter { sampling::offset(i, 1) } else { [0.0; 2] };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = View::new(camera, SIZE, offset).with_seed(i);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, drawn, &view).expect("the frame is drawn");
        gpu.queue.submit([encoder.finish()]);
    }
    // Through the pixels' centres, so that pictures can be compared.
    go_on(gpu, renderer, drawn, camera, 1)
}

/// What happened after some frames at rest.
#[derive(Debug)]
struct Dimmed {
    /// Frames drawn, and rays a cell in the last one.
    drawn: u32,
    rays: f64,
    /// How far light is off in the frame in which the lamp is dimmed to a half, how far it was before, and rays a
    /// cell in that frame.
    off: f64,
    before: f64,
    rays_at_once: f64,
}

fn dimmed_after(gpu: &Gpu, frames: u32, truth: &[f32], jitter: bool) -> Dimmed {
    let (scene, dimmed) = (room(20.0), room(10.0));
    let (mut renderer, mut uploaded) = (renderer(gpu, 1.0, 0), uploaded(gpu, &scene));
    let before = difference(&go(gpu, &mut renderer, &uploaded, &scene.cameras[0], frames, jitter), truth);
    let (drawn, rays) = (renderer.settled().expect("it settles"), rays_of(gpu, &renderer));
    uploaded.set_lights(&gpu.device, &gpu.queue, &dimmed);
    let off = difference(&go_on(gpu, &mut renderer, &uploaded, &scene.cameras[0], 1), truth);
    Dimmed { drawn, rays, off, before, rays_at_once: rays_of(gpu, &renderer) }
}

/// Four rounds after `first` frames: which directions are traced again depends on the frame.
fn round(gpu: &Gpu, first: u32, truth: &[f32], jitter: bool) -> (Vec<u32>, Dimmed) {
    let all: Vec<_> = (first..first + 4).map(|frames| dimmed_after(gpu, frames, truth, jitter)).collect();
    let mean = |part: fn(&Dimmed) -> f64| all.iter().map(part).sum::<f64>() / 4.0;
    let mean = Dimmed {
        drawn: 0,
        rays: mean(|r| r.rays),
        off: mean(|r| r.off),
        before: mean(|r| r.before),
        rays_at_once: mean(|r| r.rays_at_once),
    };
    (all.iter().map(|r| r.drawn).collect(), mean)
}

#[test]
fn a_picture_at_rest_does_less_and_wakes_at_once() {
    let Some(gpu) = common::gpu() else { return };
    let dimmed = room(10.0);
    let truth = go_on(&gpu, &mut renderer(&gpu, 1.0, 0), &uploaded(&gpu, &dimmed), &dimmed.cameras[0], 60);
    for jitter in [false, true] {
        let [(drawn, awake), (drawn_at_rest, asleep)] = [57, 70].map(|first| round(&gpu, first, &truth, jitter));
        println!("jitter {jitter}: {drawn:?} {awake:.3?}, {drawn_at_rest:?} {asleep:.3?}");
        assert_eq!(drawn, [57, 58, 59, 60]);
        if jitter {
            assert_eq!(drawn_at_rest, [70, 71, 72, 73]);
            assert!((0.25..0.3).contains(&(asleep.rays / awake.rays)));
        } else {
            assert_eq!(drawn_at_rest, [66, 66, 66, 67]);
        }
        // The lamp is followed as if there had been no rest, by every cell; nearly where only a fourth of the
        // last frame's rays can be traced again.
        assert!(asleep.rays_at_once > 0.95 * awake.rays_at_once);
        assert!(asleep.off < if jitter { 1.2 } else { 1.15 } * awake.off);
        // Negative control: what was there before is further off.
        assert!(awake.rays > 0.85 && awake.before > 1.5 * awake.off);
    }
}

/// Frames that are not drawn show the cells of the last one; light at rest is that of a picture that goes on.
#[test]
fn nothing_is_lost_at_rest() {
    let Some(gpu) = common::gpu() else { return };
    let scene = room(20.0);
    let drawn = uploaded(&gpu, &scene);
    let gather = |rest| {
        world::renderer(&gpu, SIZE, Method::Gather(Options { rest, slots: world::FEW_SLOTS, ..Default::default() }))
    };
    let go_on = |rest, frames: &[u32]| {
        let mut renderer = gather(rest);
        frames.iter().map(|&n| go_on(&gpu, &mut renderer, &drawn, &scene.cameras[0], n)).collect::<Vec<_>>()
    };
    let (resting, going) = (go_on(true, &[65, 1, 2, 1, 131]), go_on(false, &[65, 1, 134]));
    assert!(resting[0] == going[0] && resting[1] == resting[0] && resting[2] == resting[0]);
    // Negative control: without rest the next frame is another.
    assert!(going[1] != going[0] && resting[3] == going[1]);
    // What is cut out by lot is another surface in each frame: all are drawn.
    let mut leaves = room(20.0);
    leaves.materials.iter_mut().for_each(|m| m.alpha_mode = AlphaMode::Blend);
    let (mut renderer, drawn_leaves) = (gather(true), uploaded(&gpu, &leaves));
    let _ = crate::gather::go_on(&gpu, &mut renderer, &drawn_leaves, &leaves.cameras[0], 80);
    assert_eq!(renderer.settled(), Some(80));
    let jittered = |rest| go(&gpu, &mut gather(rest), &drawn, &scene.cameras[0], 200, true);
    for [asleep, awake] in [[resting[4].clone(), going[2].clone()], [jittered(true), jittered(false)]] {
        println!("{:.2} % off", 100.0 * difference(&asleep, &awake));
        assert!(difference(&asleep, &awake) < 0.02 && (mean(&asleep) / mean(&awake) - 1.0).abs() < 0.003);
    }
}
