//! Many lights: a few that are drawn by lot stand for all of them.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, GREY, hall, mean, sun};
use bouncelight::gi::{Method, gather::Options};
use bouncelight::gpu::Gpu;
use bouncelight::lights::LightGpu;
use bouncelight::render::{Renderer, RendererOptions, shadow::ShadowOptions};
use bouncelight::scene::{LightKind, Scene};

/// Lamps all over a hall, of very different power, and a sun.
fn lights(count: usize) -> Vec<LightKind> {
    let lamp = |i: usize| {
        // Golden-ratio lattices: no two alike, none in a row.
        let along = |step: f32| 0.5 - (step * i as f32).fract();
        let position = [11.0 * along(0.754_877_7), 2.0 + 3.0 * along(0.618_034).abs(), 11.0 * along(0.569_840_3)];
        let intensity = 0.02 + if i % 16 == 3 { 1.5 } else { 0.3 * along(0.414_213_6).abs() };
        match i % 5 {
            0 => LightKind::Spot {
                position,
                direction: [0.3, -1.0, 0.1],
                intensity,
                radius: 0.02,
                range: None,
                inner_angle: 0.3,
                outer_angle: 1.0,
            },
            _ => LightKind::Point { position, intensity, radius: 0.02, range: None },
        }
    };
    let mut all: Vec<LightKind> = (0..count).map(lamp).collect();
    all.insert(count / 2, sun([0.3, -1.0, 0.4], 0.8));
    all
}

/// Upper and lower half of the picture; with `whole` each light of the list is looked at wherever a
/// ray ends.
fn means(gpu: &Gpu, scene: &Scene, whole: bool, frames: u32) -> [f64; 2] {
    // Small maps: direct light is not what is asked about.
    let shadow = ShadowOptions { sun_size: 64, cascades: 1, local_size: 64 };
    let method = Method::Gather(Options { slots: world::FEW_SLOTS, first_updates: 16, ..Options::PLAIN });
    let options = RendererOptions { method, shadow, ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, [64, 48], options).expect("the size fits");
    let gpu_scene = uploaded(gpu, scene);
    if whole {
        // Without chances nothing can be drawn by lot.
        let list: Vec<LightGpu> = scene.lights.iter().map(LightGpu::new).collect();
        gpu.queue.write_buffer(&gpu_scene.light_buffer, 0, bytemuck::cast_slice(&list));
    }
    let light = go_on(gpu, &mut renderer, &gpu_scene, &scene.cameras[0], frames);
    let half = light.len() / 2;
    [mean(&light[..half]), mean(&light[half..])]
}

#[test]
fn a_hall_with_300_lamps_has_the_light_of_all_of_them() {
    let Some(gpu) = common::gpu() else { return };
    let all = lights(300);
    let hall_of = |lights: &[LightKind]| hall(GREY, lights, 0.0, 1.0);
    let expected = means(&gpu, &hall_of(&all), true, 48);
    let found = means(&gpu, &hall_of(&all), false, 96);
    println!("{} lights: {found:?}, all looked at {expected:?}", all.len());
    for i in 0..2 {
        assert!((found[i] / expected[i] - 1.0).abs() < 0.025, "{found:?} {expected:?}");
    }
    // Negative control: half of the lamps, or all but the sun, are not all.
    let lamps = means(&gpu, &hall_of(&all[..151]), false, 24);
    let mut night = all.clone();
    night.remove(150);
    let night = means(&gpu, &hall_of(&night), false, 24);
    assert!((0..2).all(|i| lamps[i] < 0.95 * expected[i] && night[i] < 0.95 * expected[i]), "{lamps:?} {night:?}");
}

/// Frames after which a list's light has settled.
const FRAMES: u32 = 48;

/// A list of lights that grows, is another, shrinks and empties between two frames.
#[test]
fn lists_of_lights_may_change_between_frames() {
    let Some(gpu) = common::gpu() else { return };
    let all = lights(60);
    let scene = |lights: &[LightKind]| hall(GREY, lights, 0.01, 1.0);
    let method = || Method::Gather(Options { slots: world::FEW_SLOTS, ..Default::default() });
    let settled = |s: &Scene| {
        mean(&go_on(&gpu, &mut world::renderer(&gpu, [48, 32], method()), &uploaded(&gpu, s), &s.cameras[0], FRAMES))
    };
    let lists: [&[LightKind]; 5] = [&all[..4], &all, &all[20..50], &[], &all[..9]];
    let mut renderer: Renderer = world::renderer(&gpu, [48, 32], method());
    let mut gpu_scene = uploaded(&gpu, &scene(lists[0]));
    let mut before = 0.0;
    for list in lists {
        let now = scene(list);
        gpu_scene.set_lights(&gpu.device, &gpu.queue, &now);
        let light = go_on(&gpu, &mut renderer, &gpu_scene, &now.cameras[0], FRAMES);
        let (found, expected) = (mean(&light), settled(&now));
        println!("{} lights: {found:.5}, from cold {expected:.5}", list.len());
        assert!(light.iter().all(|v| v.is_finite()) && (found / expected - 1.0).abs() < 0.05, "{found} {expected}");
        // Negative control: it was another light before.
        assert!((found / before - 1.0).abs() > 0.1);
        before = found;
    }
}
