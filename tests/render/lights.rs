//! Many lights: lists of tiles leave out nothing that is seen, and shadows go to the lamps that
//! matter.

use crate::build::*;
use crate::common;
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Picture, capture};
use bouncelight::render::{Blending, LightOptions, Renderer, RendererOptions};
use bouncelight::scene::{AlphaMode, Camera, Light, LightKind, Scene};
use glam::Vec3;

const SIZE: [u32; 2] = [160, 96];

fn random(seed: &mut u32) -> f32 {
    *seed = seed.wrapping_mul(0x0019_660d).wrapping_add(0x3c6e_f35f);
    (*seed >> 8) as f32 / (1 << 24) as f32
}

/// Slabs on a floor of `spread` times 200 m, and `count` lamps above it: bare ones, ones with a
/// range, spots.
fn yard(count: u32, spread: f32) -> Scene {
    let mut meshes = vec![floor(100.0 * spread, 0.0)];
    for k in 0..30 {
        let (x, z) = ((k % 6) as f32 * 5.0 - 12.5, (k / 6) as f32 * -6.0);
        meshes.push(quad([x, 0.0, z], [1.5, 0.0, 0.4], [0.0, 2.0, 0.0]));
    }
    let mut seed = 7;
    let lights = (0..count).map(|k| {
        let mut across = || 160.0 * random(&mut seed);
        let (x, z) = (across() - 80.0, across() - 130.0);
        // Every fourth stays near.
        let spread = if k % 4 == 0 { 1.0 } else { spread };
        let at = [x * spread, 1.0 + 3.0 * random(&mut seed), z * spread];
        let mut light = match k % 3 {
            0 => point(at, 0.5 + 2.0 * random(&mut seed), 0.05),
            1 => spot(at, [random(&mut seed) - 0.5, -1.0, random(&mut seed) - 0.5], 0.3, 0.3 + random(&mut seed), 0.05),
            _ => point(at, 4.0, 0.05),
        };
        match &mut light.kind {
            LightKind::Point { range, .. } if k % 3 == 2 => *range = Some(6.0),
            LightKind::Spot { intensity, .. } => *intensity = 3.0,
            _ => {}
        }
        light.color = [1.0, 0.4 + 0.6 * random(&mut seed), 0.3 + 0.7 * random(&mut seed)];
        light
    });
    scene(meshes, lights.collect())
}

fn camera() -> Camera {
    look_at([2.0, 2.2, 12.0], [0.0, 0.6, -4.0], 0.9)
}

fn shoot(gpu: &Gpu, scene: &Scene, lights: LightOptions, blending: Blending) -> Picture {
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).unwrap();
    let options = RendererOptions { lights, blending, ..direct_only() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options).unwrap();
    capture(gpu, &mut renderer, &uploaded, &camera(), CaptureOptions::default()).unwrap().beauty
}

/// Largest difference of what is shown, in steps of 8 bits, with an exposure that shows the mean as
/// middle grey.
fn steps(a: &Picture, b: &Picture) -> f32 {
    let rgb = |p: &Picture| -> Vec<f32> { p.data.chunks_exact(4).flat_map(|p| p[..3].to_vec()).collect() };
    let (a, b) = (rgb(a), rgb(b));
    let exposure = 0.18 * b.len() as f32 / b.iter().sum::<f32>();
    let shown = |v: f32| {
        let v = (v * exposure).clamp(0.0, 1.0);
        255.0 * if v <= 0.0031308 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
    };
    a.iter().zip(&b).map(|(a, b)| (shown(*a) - shown(*b)).abs()).fold(0.0, f32::max)
}

#[test]
fn lists_of_tiles_show_what_all_lights_show() {
    let Some(gpu) = common::gpu() else { return };
    let tiled = LightOptions::default();
    let one_by_one = LightOptions { tiled_from: u32::MAX, ..tiled };
    let mut pane = yard(200, 1.0);
    // The last slab is a pane before the others.
    let mut glass = pane.materials[0].clone();
    (glass.alpha_mode, glass.base_color[3]) = (AlphaMode::Blend, 0.4);
    pane.materials.push(glass);
    pane.meshes.push(quad([-2.0, 0.2, 6.0], [4.0, 0.0, 0.0], [0.0, 2.5, 0.0]));
    pane.meshes.last_mut().unwrap().material = 1;
    let instance = pane.instances[0].clone();
    pane.instances.push(bouncelight::scene::Instance { mesh: pane.meshes.len() - 1, ..instance });
    // As many as go beyond one batch of lists, too.
    for (name, s, blending) in [
        ("200", yard(200, 1.0), Blending::Stochastic),
        ("200 in a city", yard(200, 60.0), Blending::Stochastic),
        ("200 with a pane", pane, Blending::Sorted),
        ("1100", yard(1100, 1.0), Blending::Stochastic),
    ] {
        let cut = LightOptions { cut: 0.0, ..one_by_one };
        let [lists, all, uncut] = [tiled, one_by_one, cut].map(|o| shoot(&gpu, &s, o, blending));
        assert!(lists.data.iter().step_by(4).filter(|v| **v > 0.0).count() > 8000, "{name}");
        assert_eq!(steps(&lists, &all), 0.0, "{name}: lists leave something out");
        let off = steps(&lists, &uncut);
        println!("{name} lights: {off:.3} of 255 are cut");
        assert!(off < 1.0, "{name}: {off}");
        assert!(off > 0.0 || !name.contains("city"), "{name}: nothing is cut");
        if name == "200" {
            show("yard", &lists, 0.5 / lists.data.iter().fold(0.0f32, |a, b| a.max(*b)).min(1.0));
            // Negative control: a cut that shows.
            let most = shoot(&gpu, &s, LightOptions { cut: 2.0, ..tiled }, blending);
            assert!(steps(&most, &uncut) > 3.0, "{}", steps(&most, &uncut));
        }
    }
}

#[test]
fn whoever_stands_first_in_the_file_matters_no_more_than_others() {
    let Some(gpu) = common::gpu() else { return };
    // Forty lamps far off, and one that shines on a slab before the camera.
    let mut meshes = vec![floor(200.0, 0.0)];
    meshes.push(quad([-1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]));
    let far = |k: u32| point([4.0 * k as f32 - 80.0, 3.0, -150.0], 20.0, 0.05);
    let near = point([0.0, 3.0, -2.0], 5.0, 0.05);
    let mut lights: Vec<Light> = (0..40).map(far).collect();
    lights.push(near);
    let s = scene(meshes, lights);
    let mut reversed = s.clone();
    reversed.lights.reverse();
    let camera = look_at([0.0, 2.5, 6.0], [0.0, 0.3, 0.0], 0.8);
    let [last, first] = [&s, &reversed].map(|s| render(&gpu, s, &camera, SIZE, 1));
    assert!(steps(&last.beauty, &first.beauty) < 0.1, "{}", steps(&last.beauty, &first.beauty));
    // On the floor in the slab's shadow the near lamp's light is missing.
    let layer = last.layer(bouncelight::render::capture::Layer::DiffDir).unwrap();
    let place = last.layer(bouncelight::render::capture::Layer::Position).unwrap();
    let mut dark = 0;
    for (l, p) in layer.data.chunks_exact(3).zip(place.data.chunks_exact(3)) {
        let p = Vec3::from_slice(p);
        if p.y.abs() < 1e-2 && (0.3..1.5).contains(&p.z) && p.x.abs() < 0.8 {
            dark += 1;
            assert!(l[0] < 0.005, "{p}: {}", l[0]);
        }
    }
    assert!(dark > 100, "{dark}");
}
