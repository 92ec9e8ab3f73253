//! Contact shadows against rays, and what the way back to full resolution makes of them.

use crate::common;
use crate::screen::{EYE, FLOOR, TARGET, Trace, ball, corner, flat, rays_within, shot, under};
use crate::shot::{Random, Shot};
use crate::world::{lit, renderer, scene};
use bouncelight::gi::Method;
use bouncelight::gi::contact::{ContactPass, RADIUS};
use bouncelight::gi::inputs::InputGroup;
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::scene::{Camera, Material, shapes};
use glam::Vec3;

/// Contacts are a few pixels wide where a picture is as large as people look at.
const SIZE: [u32; 2] = [576, 384];

/// World-space centre and radius of the ball of [`ball`].
const BALL: [f32; 4] = [0.0, 1.2, -3.0, 1.2];

/// What the pass finds, read back.
struct Found {
    /// At half resolution.
    visibility: Vec<f32>,
    /// Texels a row.
    width: u32,
    /// Words of all tiles.
    nearby: Vec<u32>,
}

fn found(gpu: &Gpu, shot: &Shot, spheres: &[[f32; 4]]) -> Found {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 16 * spheres.len().max(4) as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(spheres));
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let mut inputs = InputGroup::new(&gpu.device);
    let mut pass = ContactPass::new(&gpu.device, &inputs);
    let bound = inputs.bind(&gpu.queue, &textures.inputs(shot)).expect("binds");
    assert!(pass.fit(shot.size, &buffer) && !pass.fit(shot.size, &buffer), "what is there is used again");
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    pass.record(&mut Recorder::new(&mut encoder), &bound);
    gpu.queue.submit([encoder.finish()]);
    let found = pass.found();
    let texture = found.visibility.texture();
    let bytes = readback::texture(&gpu.device, &gpu.queue, texture).expect("readable");
    let words = readback::buffer(&gpu.device, &gpu.queue, found.nearby, 0, found.nearby.size()).expect("readable");
    Found {
        visibility: bytemuck::pod_collect_to_vec(&bytes),
        width: texture.width(),
        nearby: bytemuck::pod_collect_to_vec(&words),
    }
}

/// Mean over the 2x2 texels around a pixel, one of each phase.
fn around(found: &[f32], width: u32, [x, y]: [u32; 2]) -> f32 {
    let [x, y] = [(x - 1) / 2, (y - 1) / 2];
    [[0, 0], [1, 0], [0, 1], [1, 1]].iter().map(|[i, j]| found[((y + j) * width + x + i) as usize]).sum::<f32>() / 4.0
}

#[test]
fn a_plane_keeps_its_light() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, _) = shot(flat);
    let found = found(&gpu, &shot, &[]).visibility;
    assert!(found.iter().all(|v| (0.97..=1.0).contains(v)), "{:?}", found.iter().copied().fold(1.0, f32::min));
}

/// At a wall's foot the pass must find a good part of what rays find within its radius, and nothing far from walls and balls. Of a
/// ball's shadow the picture shows little: what hangs over a place is no horizon. (Spheres are for that.)
#[test]
fn contacts_darken_and_corners_as_rays_say() {
    let Some(gpu) = common::gpu() else { return };
    for (name, trace, part) in [("corner", corner as Trace, 0.6), ("ball", ball, 1.0)] {
        let (shot, surfaces) = Shot::traced(SIZE, EYE, TARGET, trace);
        let Found { visibility, width, .. } = found(&gpu, &shot, &[]);
        let mut r = Random(3);
        let (mut near, mut far) = ([0.0; 3], [0.0; 2]);
        let pixels = (1..12).flat_map(|i| (1..SIZE[1] / 2 - 1).map(move |j| [48 * i, 2 * j]));
        for pixel in pixels.filter(|p| surfaces[(p[1] * SIZE[0] + p[0]) as usize] == FLOOR) {
            // The pass lets what is farther away than 0.7 of its radius fade, and sees nothing beyond it.
            let z = (under(&shot, trace, pixel).0 - EYE).dot((TARGET - EYE).normalize());
            let [open, _] = rays_within(&shot, trace, pixel, 0.85 * RADIUS * z, &mut r);
            let v = around(&visibility, width, pixel);
            if open < 0.9 {
                near = [near[0] + (v - open).abs(), near[1] + 1.0 - open, near[2] + 1.0];
            } else if open > 0.999 {
                far = [far[0] + 1.0 - v, far[1] + 1.0];
            }
        }
        let [error, blind] = [near[0] / near[2], near[1] / near[2]];
        let dimmed = far[0] / far[1];
        println!(
            "{name}: mean |Δ visibility| {error:.3} over {} pixels (1 everywhere: {blind:.3}), far away {dimmed:.4}",
            near[2]
        );
        assert!(near[2] > 5.0 && far[1] > 5.0, "{name}: {near:?} {far:?}");
        // Negative control in one: no contact shadows at all would be off by `blind`.
        assert!(error < part * blind, "{name}: {error} of {blind}");
        assert!(dimmed < 0.02, "{name}: {dimmed}");
    }
}

/// Each tile knows the spheres that reach a surface of it, seen or not, and hardly any others.
#[test]
fn tiles_know_the_spheres_near_them() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, _) = Shot::traced(SIZE, EYE, TARGET, flat);
    let tiles = SIZE.map(|n| n.div_ceil(16));
    let knows = |spheres: &[[f32; 4]], which: usize| -> Vec<bool> {
        let words = spheres.len().max(4).div_ceil(32);
        let all = found(&gpu, &shot, spheres).nearby;
        assert_eq!(all.len(), words * (tiles[0] * tiles[1]) as usize);
        all.chunks_exact(words).map(|w| w[which / 32] >> (which % 32) & 1 == 1).collect()
    };
    for ball in [BALL, [2.5, 0.4, -1.0, 0.4], [0.3, 1.5, 2.5, 2.0]] {
        let centre = Vec3::from_slice(&ball);
        let reached = |tile: u32| {
            let [x, y] = [tile % tiles[0], tile / tiles[0]].map(|n| 16 * n);
            let pixels = (0..16).flat_map(|j| (0..16).map(move |i| [x + i, y + j]));
            let shown = pixels.filter(|p| shot.buffers.depth[(p[1] * SIZE[0] + p[0]) as usize] > 0.0);
            shown.map(|p| under(&shot, flat, p).0.distance(centre)).any(|d| d < 2.0 * ball[3])
        };
        let truth: Vec<bool> = (0..tiles[0] * tiles[1]).map(reached).collect();
        let told = knows(&[ball], 0);
        assert!(truth.iter().zip(&told).all(|(t, k)| *k || !*t), "{ball:?}: a tile misses it");
        let [true_ones, ones] = [&truth, &told].map(|all| all.iter().filter(|b| **b).count());
        println!("{ball:?}: {true_ones} tiles, {ones} are told, of {}", told.len());
        assert!(true_ones > 5 && ones < 2 * true_ones + 20, "{ball:?}: {ones} of {true_ones}");
        // Each has its own bit; beyond the last word nobody looks.
        let mut many = vec![[0.0, -9.0, 0.0, 1.0]; 1024];
        many[1023] = ball;
        assert_eq!(knows(&many, 1023), told);
    }
    for away in
        [[0.0, -9.0, -3.0, 1.2], [0.0, 90.0, -300.0, 1.2], [0.0, 1.2, 30.0, 1.2], [0.0, 1.2, -3.0, 0.0], [f32::NAN; 4]]
    {
        assert!(knows(&[away], 0).iter().all(|k| !k), "{away:?}");
    }
}

/// A black ball on a floor under an even sky takes Lambert's form factor of a sphere from the floor's light; where its shadow is
/// not in the picture, too. A ring, which is not like a ball, has no sphere.
#[test]
fn a_ball_takes_its_form_factor_from_the_floor() {
    let Some(gpu) = common::gpu() else { return };
    let radius = 0.5;
    let mut renderer = renderer(&gpu, [256, 192], Method::Cache);
    let mut draw = |shape: Option<shapes::Shape>| {
        let camera = Camera::look_at([0.0, 2.0, 4.0], [0.0, 0.2, 0.0], 0.7);
        let mut scene = scene(&[([-6.0, -0.2, -6.0], [6.0, 0.0, 6.0], [0.5; 3])], &[], 1.0, camera);
        if let Some(shape) = shape {
            scene.materials.push(Material {
                base_color: [0.0, 0.0, 0.0, 1.0],
                metallic: 0.0,
                f0: 0.0,
                ..Default::default()
            });
            let mut mesh = shapes::flat(shape);
            mesh.material = 1;
            scene.meshes.push(mesh);
            let mut ball = scene.instances[0].clone();
            ball.mesh = 1;
            (0..3).for_each(|k| ball.transform[k][k] = radius);
            ball.transform[3] = [0.0, radius, 0.0, 1.0];
            scene.instances.push(ball);
        }
        lit(&gpu, &mut renderer, &scene)
    };
    let [(open, places), (ball, ball_places), (ring, ring_places)] =
        [None, Some(shapes::Shape::UvSphere), Some(shapes::Shape::Torus)].map(&mut draw);
    let (mut off, mut blind, mut count, mut ring_takes, mut ring_count) = (0.0, 0.0, 0, 0.0, 0);
    for i in 0..open.data.len() / 3 {
        let at = |p: &[f32]| Vec3::from_slice(&p[3 * i..3 * i + 3]);
        let place = at(&places.data);
        let v = Vec3::new(0.0, radius, 0.0) - place;
        if open.data[3 * i] <= 0.0 || place.y.abs() > 1e-3 || v.length() > 1.4 * radius {
            continue;
        }
        if at(&ball_places.data).distance(place) < 1e-3 {
            let truth = 1.0 - v.y * radius.powi(2) / v.length().powi(3);
            off += (ball.data[3 * i] / open.data[3 * i] - truth).abs();
            blind += 1.0 - truth;
            count += 1;
        }
        if at(&ring_places.data).distance(place) < 1e-3 {
            ring_takes += 1.0 - ring.data[3 * i] / open.data[3 * i];
            ring_count += 1;
        }
    }
    let [off, blind] = [off, blind].map(|sum| sum / count as f32);
    let ring_takes = ring_takes / ring_count as f32;
    println!("{count} pixels: {off:.3} off, {blind:.3} without any; a ring takes {ring_takes:.3}");
    assert!(count > 100 && ring_count > 100);
    assert!(off < 0.2 * blind, "{off} of {blind}");
    // Negative control: without a sphere little of the light is taken.
    assert!(ring_takes < 0.5 * blind, "{ring_takes}");
}
