//! The rasteriser against analytic answers.

#[path = "common/build.rs"]
mod build;
mod common;

use bouncelight::gpu::timing::Recorder;
use bouncelight::render::capture::{CaptureOptions, Layer, Picture, capture};
use bouncelight::render::{RenderError, Renderer, RendererOptions, View};
use bouncelight::scene::upload::{SceneGpu, UploadError};
use bouncelight::scene::{AlphaMode, Environment, Light, LightKind, Scene};
use build::*;
use glam::{Mat4, Vec3};
use std::f32::consts::PI;

/// Looks straight down at the origin from 10 m.
fn above() -> bouncelight::scene::Camera {
    look_at([0.0, 10.0, 0.0], [0.0; 3], 0.8)
}

#[test]
fn a_plane_under_the_sun_has_the_cosine_of_its_angle() {
    let Some(gpu) = common::gpu() else { return };
    for degrees in [0.0f32, 30.0, 60.0, 80.0] {
        let a = degrees.to_radians();
        let s = scene(vec![floor(20.0, 0.0)], vec![sun([a.sin(), -a.cos(), 0.0], 3.0, 0.00918)]);
        let frame = render(&gpu, &s, &above(), [64, 48], 1);
        let light = center(frame.layer(Layer::DiffDir).unwrap(), 16);
        let expected = a.cos() * 3.0 / PI;
        assert!((light / expected - 1.0).abs() < 0.005, "{degrees}°: {light} against {expected}");
    }
}

#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    let Some(gpu) = common::gpu() else { return };
    for height in [1.0f32, 2.0, 4.0] {
        let s = scene(vec![floor(20.0, 0.0)], vec![point([0.0, height, 0.0], 50.0, 0.05)]);
        let frame = render(&gpu, &s, &above(), [65, 65], 1);
        let light = frame.layer(Layer::DiffDir).unwrap().at(32, 32)[0];
        let expected = 50.0 / (height * height) / PI;
        assert!((light / expected - 1.0).abs() < 0.01, "{height} m: {light} against {expected}");
    }
}

fn spot(position: [f32; 3], direction: [f32; 3], inner_angle: f32, outer_angle: f32, radius: f32) -> Light {
    let direction = Vec3::from(direction).normalize().to_array();
    let kind = LightKind::Spot { position, direction, intensity: 60.0, radius, range: None, inner_angle, outer_angle };
    Light { name: "spot".into(), color: [1.0; 3], kind }
}

#[test]
fn a_spot_light_has_the_recommended_ramp() {
    let Some(gpu) = common::gpu() else { return };
    for (inner, outer) in [(0.2f32, 0.5f32), (0.8, 1.3)] {
        let s = scene(vec![floor(20.0, 0.0)], vec![spot([0.0, 5.0, 0.0], [0.0, -1.0, 0.0], inner, outer, 0.01)]);
        let frame = render(&gpu, &s, &above(), [128, 96], 1);
        let (light, place) = (frame.layer(Layer::DiffDir).unwrap(), frame.layer(Layer::Position).unwrap());
        let mut ramped = 0;
        for (l, p) in light.data.chunks_exact(3).zip(place.data.chunks_exact(3)) {
            let to = Vec3::new(0.0, 5.0, 0.0) - Vec3::from_slice(p);
            let cosine = to.y / to.length();
            let ramp = ((cosine - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0).powi(2);
            let expected = 60.0 * ramp * cosine / to.length_squared() / PI;
            assert!((l[0] - expected).abs() < 0.01 * expected + 1e-4, "{} against {expected}", l[0]);
            ramped += usize::from(ramp > 0.0 && ramp < 1.0);
        }
        assert!(ramped > 500, "only {ramped} pixels on the ramp");
    }
}

/// A wall and a floating quad over a floor, with what light is asked for.
fn corner(lights: Vec<Light>) -> Scene {
    let wall = quad([-8.0, 0.0, -4.0], [16.0, 0.0, 0.0], [0.0, 8.0, 0.0]);
    let mut s = scene(vec![floor(20.0, 0.0), wall, quad([-1.0, 2.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0])], lights);
    s.materials[0].base_color = [0.8, 0.5, 0.2, 1.0];
    s
}

#[test]
fn light_is_linear_and_off_means_none() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 4.0, 10.0], [0.0, 1.0, 0.0], 0.8);
    let (a, b) = (sun([0.3, -1.0, -0.2], 1.0, 0.02), point([3.0, 4.0, 2.0], 20.0, 0.2));
    let picture = |lights: Vec<Light>| render(&gpu, &corner(lights), &camera, [96, 64], 1).beauty;
    let double = |l: &Light| Light { color: l.color.map(|c| 2.0 * c), ..l.clone() };
    let (one, other) = (picture(vec![a.clone()]), picture(vec![b.clone()]));
    let (twice, both) = (picture(vec![double(&a)]), picture(vec![a.clone(), b.clone()]));
    let mut lit = 0;
    for i in 0..one.data.len() {
        if i % 4 == 3 {
            continue;
        }
        let close = |x: f32, y: f32| (x - y).abs() <= 2e-3 * y.abs() + 1e-5;
        assert!(close(twice.data[i], 2.0 * one.data[i]), "f(2L): {} {}", twice.data[i], one.data[i]);
        assert!(close(both.data[i], one.data[i] + other.data[i]), "f(La+Lb) at {i}");
        lit += usize::from(one.data[i] > 0.0);
    }
    assert!(lit > 3000, "{lit}");
    for lights in [vec![], vec![Light { color: [0.0; 3], ..a }]] {
        assert!(picture(lights).data.chunks_exact(4).all(|p| p[..3] == [0.0; 3]));
    }
}

/// DiffDir and position of each pixel on the floor.
fn on_floor(frame: &bouncelight::render::capture::CapturedFrame) -> Vec<(Vec3, f32)> {
    let (light, place) = (frame.layer(Layer::DiffDir).unwrap(), frame.layer(Layer::Position).unwrap());
    let depth = frame.layer(Layer::Depth).unwrap();
    (0..depth.data.len())
        .filter(|&i| depth.data[i] < 1e9 && place.data[3 * i + 1].abs() < 1e-2)
        .map(|i| (Vec3::from_slice(&place.data[3 * i..]), light.data[3 * i]))
        .collect()
}

#[test]
fn a_quads_shadow_falls_where_it_should() {
    let Some(gpu) = common::gpu() else { return };
    let casters = vec![floor(50.0, 0.0), quad([-1.0, 3.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0])];
    let camera = look_at([3.0, 2.0, 8.0], [3.0, 0.0, 0.0], 0.9);
    // The shadow is the quad moved by 3 m along x under the sun; under the lamp at (0, 6, 0) it is twice as large.
    let lamp = spot([0.0, 6.0, 0.0], [0.3, -1.0, 0.0], 0.7, 0.9, 0.01);
    for (light, at, half) in [
        (sun([1.0, -1.0, 0.0], 1.0, 0.005), 3.0, 1.0),
        (point([0.0, 6.0, 0.0], 40.0, 0.01), 0.0, 2.0),
        (lamp, 0.0, 2.0),
    ] {
        let frame = render(&gpu, &scene(casters.clone(), vec![light]), &camera, [256, 192], 1);
        let (mut inside, mut outside) = (0, 0);
        for (p, l) in on_floor(&frame) {
            let d = ((p.x - at).abs() - half).max(p.z.abs() - half);
            if d < -0.1 {
                inside += 1;
                assert_eq!(l, 0.0, "light inside the shadow at {p}");
            } else if d > 0.1 && p.x.abs() < 3.0 && p.z.abs() < 3.0 {
                outside += 1;
                assert!(l > 0.01, "shadow where there is none at {p}: {l}");
            }
        }
        assert!(inside > 300 && outside > 500, "{inside} {outside}");
    }
}

/// Where the visibility under a half-plane's edge crosses `share`, metres.
fn crossing(samples: &[(Vec3, f32)], full: impl Fn(Vec3) -> f32, share: f32) -> f32 {
    let bin = 0.02;
    let mut bins = vec![(0.0f32, 0.0f32); 400];
    for &(p, l) in samples.iter().filter(|(p, _)| p.z.abs() < 0.7) {
        let i = (p.x / bin + 200.0) as usize;
        if let Some(b) = bins.get_mut(i) {
            *b = (b.0 + l / full(p), b.1 + 1.0);
        }
    }
    let known: Vec<(f32, f32)> =
        (0..400).filter(|&i| bins[i].1 > 0.0).map(|i| ((i as f32 - 199.5) * bin, bins[i].0 / bins[i].1)).collect();
    let i = known.iter().position(|b| b.1 > share).expect("the floor is lit somewhere");
    let ((x0, v0), (x1, v1)) = (known[i - 1], known[i]);
    x0 + (x1 - x0) * (share - v0) / (v1 - v0)
}

#[test]
fn penumbras_grow_with_the_lights_size() {
    let Some(gpu) = common::gpu() else { return };
    let roof = quad([-20.0, 4.0, 20.0], [20.0, 0.0, 0.0], [0.0, 0.0, -40.0]);
    let casters = vec![floor(20.0, 0.0), roof];
    let camera = look_at([0.0, 3.0, 3.0], [0.0, 0.0, 0.0], 1.0);
    // A disc of radius r in the plane of the roof: 80 % of the transition is 1.374 r wide.
    let sun_at = |angle: f32| (sun([0.0, -1.0, 0.0], 1.0, angle), 4.0 * (0.5 * angle).tan());
    let lamp = |radius: f32| (point([0.0, 8.0, 0.0], 100.0, radius), radius);
    for (light, r) in [sun_at(0.05), sun_at(0.15), sun_at(0.3), lamp(0.1), lamp(0.3), lamp(0.5)] {
        let kind = light.kind;
        let full = |p: Vec3| match kind {
            LightKind::Directional { .. } => 1.0 / PI,
            _ => 100.0 * 8.0 / (p - Vec3::Y * 8.0).length().powi(3) / PI,
        };
        let frame = render(&gpu, &scene(casters.clone(), vec![light]), &camera, [256, 256], 8);
        let samples = on_floor(&frame);
        let width = crossing(&samples, full, 0.9) - crossing(&samples, full, 0.1);
        println!("{kind:?}: {width} m, expected {} m", 1.374 * r);
        assert!((width / (1.374 * r) - 1.0).abs() < 0.2, "{kind:?}: {width} against {}", 1.374 * r);
        let middle = crossing(&samples, full, 0.5);
        assert!(middle.abs() < 0.15 * r + 0.03, "{kind:?}: the edge lies at {middle}");
    }
}

#[test]
fn lit_planes_have_no_acne() {
    let Some(gpu) = common::gpu() else { return };
    // The far floor makes the sun's maps cover 100 m, as a paper room does.
    let lights = [
        (sun([0.2, -1.0, 0.1], 1.0, 0.00918), "sun"),
        (sun([0.2, -1.0, 0.1], 1.0, 0.2), "wide sun"),
        (point([3.0, 30.0, 2.0], 900.0, 0.5), "point"),
        (spot([3.0, 30.0, 2.0], [-0.1, -1.0, -0.07], 0.5, 0.8, 0.3), "spot"),
    ];
    for (light, name) in lights {
        for degrees in [0.0f32, 20.0, 45.0, 60.0, 75.0, 82.0] {
            let a = degrees.to_radians();
            let (u, v) = (Vec3::new(a.cos(), a.sin(), 0.0) * 10.0, Vec3::Z * -10.0);
            let n = u.cross(v).normalize();
            let plane = quad((-(u + v) / 2.0).to_array(), u.to_array(), v.to_array());
            let s = scene(vec![floor(50.0, -20.0), plane], vec![light.clone()]);
            let camera = look_at((n * 12.0 + Vec3::Z * 6.0).to_array(), [0.0; 3], 0.5);
            let frame = render(&gpu, &s, &camera, [160, 120], 1);
            let (lit, place) = (frame.layer(Layer::DiffDir).unwrap(), frame.layer(Layer::Position).unwrap());
            let (mut good, mut all) = (0, 0);
            for (l, p) in lit.data.chunks_exact(3).zip(place.data.chunks_exact(3)) {
                let p = Vec3::from_slice(p);
                if p.y < -19.0 || p == Vec3::ZERO {
                    continue;
                }
                let expected = match light.kind {
                    LightKind::Directional { direction, irradiance, .. } => irradiance * -n.dot(direction.into()),
                    LightKind::Point { position, intensity, .. } | LightKind::Spot { position, intensity, .. } => {
                        let to = Vec3::from(position) - p;
                        intensity * n.dot(to) / to.length().powi(3)
                    }
                } / PI;
                if expected > 0.0 {
                    all += 1;
                    good += usize::from(l[0] > 0.999 * expected - 2e-4 * expected.max(0.01) - 1e-6);
                }
            }
            assert!(all > 5000, "{name} {degrees}°: {all} pixels");
            assert!(good as f32 > 0.999 * all as f32, "{name} {degrees}°: {good} of {all} are lit");
        }
    }
}

#[test]
fn the_background_is_the_environment() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = scene(vec![floor(1.0, -5.0)], vec![sun([0.0, -1.0, 0.0], 1.0, 0.0)]);
    s.environment = Environment { radiance: [0.0508761, 0.25, 3.0] };
    let frame = render(&gpu, &s, &look_at([0.0, 0.0, 5.0], [0.0; 3], 0.6), [33, 21], 3);
    let expected = s.environment.radiance.map(|v| half::f16::from_f32(v).to_f32());
    for (i, v) in frame.beauty.at(16, 2).iter().take(3).enumerate() {
        assert!((v / expected[i] - 1.0).abs() < 1e-6, "{v} {}", expected[i]);
    }
    assert_eq!(frame.layer(Layer::Depth).unwrap().at(16, 2), [1e10]);
    assert_eq!(frame.layer(Layer::DiffCol).unwrap().at(16, 2), [0.0; 3]);
}

#[test]
fn odd_sizes_and_an_empty_scene_work() {
    let Some(gpu) = common::gpu() else { return };
    let empty = Scene { environment: environment(0.5), ..Default::default() };
    let camera = look_at([0.0, 4.0, 10.0], [0.0, 1.0, 0.0], 0.8);
    let full = corner(vec![sun([0.3, -1.0, -0.2], 1.0, 0.02)]);
    for size in [[1, 1], [17, 13], [300, 2]] {
        let frame = render(&gpu, &full, &camera, size, 2);
        assert_eq!([frame.beauty.width as u32, frame.beauty.height as u32], size);
        assert!(frame.beauty.data.iter().any(|v| *v > 0.0 && *v < 1.0));
        let frame = render(&gpu, &empty, &camera, size, 1);
        assert!(frame.beauty.data.chunks_exact(4).all(|p| p == [0.5, 0.5, 0.5, 1.0]));
    }
    let new = |size| Renderer::new(&gpu.device, &gpu.queue, size, RendererOptions::default());
    for size in [[0, 5], [5, 0], [100_000, 1]] {
        assert!(matches!(new(size), Err(RenderError::Size { .. })), "{size:?}");
    }
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &empty).unwrap();
    let options = CaptureOptions { samples: 0, ..Default::default() };
    let none = capture(&gpu, &mut new([4, 4]).unwrap(), &uploaded, &camera, options);
    assert!(matches!(none, Err(RenderError::NoSamples)));
}

#[test]
fn resizing_and_changing_scenes_gives_what_a_new_renderer_gives() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 4.0, 10.0], [0.0, 1.0, 0.0], 0.8);
    let upload = |s: &Scene| SceneGpu::new(&gpu.device, &gpu.queue, s).unwrap();
    let first = upload(&corner(vec![point([3.0, 4.0, 2.0], 20.0, 0.2), sun([0.0, -1.0, 0.3], 1.0, 0.01)]));
    let second = upload(&corner(vec![sun([0.3, -1.0, -0.2], 1.0, 0.02)]));
    let new = |size| Renderer::new(&gpu.device, &gpu.queue, size, RendererOptions::default()).unwrap();
    let mut used = new([64, 48]);
    let shoot = |r: &mut Renderer, s| capture(&gpu, r, s, &camera, CaptureOptions::default()).unwrap().beauty;
    shoot(&mut used, &first);
    used.resize([80, 30]).unwrap();
    assert_eq!(shoot(&mut used, &second), shoot(&mut new([80, 30]), &second));
    assert!(used.resize([0, 1]).is_err());
    assert_eq!(shoot(&mut used, &second), shoot(&mut new([80, 30]), &second));
}

#[test]
fn normals_survive_the_gbuffer() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 0.0, 5.0], [0.0; 3], 0.5);
    for i in 0..40 {
        let (a, b) = (i as f32 * 2.399, 0.035 * i as f32);
        let n = Vec3::new(b.sin() * a.cos(), b.sin() * a.sin(), b.cos());
        let (u, v) = n.any_orthonormal_pair();
        let (u, v) = if u.cross(v).dot(n) > 0.0 { (u, v) } else { (v, u) };
        let s = scene(vec![quad((-u - v).to_array(), (2.0 * u).to_array(), (2.0 * v).to_array())], vec![]);
        let frame = render(&gpu, &s, &camera, [9, 9], 1);
        let got = Vec3::from_slice(frame.layer(Layer::Normal).unwrap().at(4, 4));
        let wrong = got.angle_between(n).to_degrees();
        assert!(wrong < 0.1, "{n}: {got}, {wrong}° off");
        let depth = frame.layer(Layer::Depth).unwrap().at(4, 4)[0];
        assert!((depth / 5.0 - 1.0).abs() < 1e-4, "{depth}");
        assert!(Vec3::from_slice(frame.layer(Layer::Position).unwrap().at(4, 4)).length() < 1e-3);
    }
}

#[test]
fn motion_points_to_the_previous_frame() {
    let Some(gpu) = common::gpu() else { return };
    let s = corner(vec![]);
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &s).unwrap();
    let size = [64, 40];
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, RendererOptions::default()).unwrap();
    let before = View::new(&look_at([0.3, 4.0, 9.0], [0.2, 1.0, 0.0], 0.8), size, [0.0; 2]);
    let view = View::new(&look_at([0.0, 4.0, 10.0], [0.0, 1.0, 0.0], 0.8), size, [0.3, -0.2]).after(&before);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view).expect("the frame is drawn");
    gpu.queue.submit([encoder.finish()]);
    let read = |t| bouncelight::gpu::readback::texture(&gpu.device, &gpu.queue, t).unwrap();
    let motion = read(&renderer.targets().motion.texture);
    let depth = read(&renderer.targets().depth.texture);
    let (x, y) = (20usize, 30usize);
    let i = y * 64 + x;
    let z = view.near / f32::from_ne_bytes(depth[4 * i..4 * i + 4].try_into().unwrap());
    let ndc = |p: f32, n: f32, j: f32| 2.0 * (p + 0.5 + j) / n - 1.0;
    let on_plane =
        Vec3::new(ndc(20.0, 64.0, 0.3) * view.tan_half[0], -ndc(30.0, 40.0, -0.2) * view.tan_half[1], -1.0) * z;
    let world = Mat4::from_cols_array_2d(&view.world_from_view).transform_point3(on_plane);
    assert!(world.y.abs() < 1e-3, "the pixel lies on the floor: {world}");
    let uv = |m: &[[f32; 4]; 4]| {
        let p = Mat4::from_cols_array_2d(m).project_point3(world);
        [0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y]
    };
    let (old, new) = (uv(&before.clip_from_world_unjittered), uv(&view.clip_from_world_unjittered));
    for axis in 0..2 {
        let o = 4 * i + 2 * axis;
        let got = half::f16::from_ne_bytes([motion[o], motion[o + 1]]).to_f32();
        assert!((got - (old[axis] - new[axis])).abs() < 1e-4, "axis {axis}: {got} {}", old[axis] - new[axis]);
    }
}

#[test]
fn materials_are_what_they_say() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 0.0, 5.0], [0.0; 3], 0.5);
    let front = || quad([-5.0, -5.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0]);
    let look = |s: &Scene, samples| {
        let f = render(&gpu, s, &camera, [16, 16], samples);
        (center(&f.beauty, 8), f)
    };
    let mut s = scene(vec![front()], vec![sun([0.0, 0.0, -1.0], PI, 0.0)]);
    s.environment = environment(0.0);
    let lit = look(&s, 1).0;
    assert!(lit > 0.9 && lit < 1.2, "{lit}");
    s.materials[0].double_sided = false;
    assert_eq!(look(&s, 1).0, lit);
    let mut back = s.clone();
    back.instances[0].transform[0][0] = -1.0;
    let (mirrored, f) = look(&back, 1);
    assert_eq!(mirrored, lit, "a mirrored front face stays a front face");
    assert!(f.layer(Layer::Normal).unwrap().at(8, 8)[2] > 0.999);
    back.instances[0].transform[2][2] = -1.0;
    assert_eq!(look(&back, 1).0, 0.0, "turned round it is culled");
    back.materials[0].double_sided = true;
    let (seen, f) = look(&back, 1);
    assert!((seen - lit).abs() < 1e-3 && f.layer(Layer::Normal).unwrap().at(8, 8)[2] > 0.999);

    let mut unlit = s.clone();
    unlit.materials[0].unlit = true;
    unlit.materials[0].base_color = [0.25, 0.5, 0.75, 1.0];
    let (_, f) = look(&unlit, 1);
    assert_eq!(f.beauty.at(8, 8)[..3], [0.25, 0.5, 0.75]);

    let mut glass = s.clone();
    glass.materials[0].base_color[3] = 0.3;
    glass.materials[0].alpha_mode = AlphaMode::Blend;
    let share = look(&glass, 64).0 / lit;
    assert!((share - 0.3).abs() < 0.03, "blending covers {share}");
    glass.materials[0].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    assert_eq!(look(&glass, 1).0, 0.0);
    glass.materials[0].base_color[3] = 0.6;
    assert_eq!(look(&glass, 1).0, lit);
}

#[test]
fn layers_add_up_to_the_picture() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = corner(vec![sun([0.3, -1.0, -0.4], 1.0, 0.02), point([3.0, 4.0, 2.0], 20.0, 0.2)]);
    s.materials[0].emissive = [0.1, 0.0, 0.02];
    let f = render(&gpu, &s, &look_at([0.0, 4.0, 10.0], [0.0, 1.0, 0.0], 0.5), [96, 64], 4);
    let get = |l| &f.layer(l).unwrap().data;
    for i in 0..96 * 64 * 3 {
        let sum = get(Layer::DiffCol)[i] * (get(Layer::DiffDir)[i] + get(Layer::DiffInd)[i])
            + get(Layer::GlossCol)[i] * (get(Layer::GlossDir)[i] + get(Layer::GlossInd)[i])
            + get(Layer::Emit)[i];
        let whole = f.beauty.data[i / 3 * 4 + i % 3];
        assert!((sum - whole).abs() < 2e-3 * whole + 1e-4, "{sum} {whole}");
    }
}

#[test]
fn many_lights_and_wrong_scenes() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 4.0, 10.0], [0.0, 1.0, 0.0], 0.8);
    let mut lights: Vec<Light> = (0..20).map(|i| point([i as f32 - 10.0, 3.0, 2.0], 1.0, 0.1)).collect();
    lights.extend((0..6).map(|i| sun([0.1 * i as f32, -1.0, 0.0], 0.1, 0.01)));
    lights.extend((0..6).map(|i| spot([i as f32, 5.0, 3.0], [0.0, -1.0, 0.0], 0.3, 0.5, 0.1)));
    let f = render(&gpu, &corner(lights), &camera, [32, 32], 1);
    assert!(f.beauty.data.iter().all(|v| v.is_finite()));
    let mut s = corner(vec![]);
    s.instances[0].mesh = 9;
    let upload = |s: &Scene| SceneGpu::new(&gpu.device, &gpu.queue, s).err();
    assert!(matches!(upload(&s), Some(UploadError::MissingMesh { mesh: 9, .. })));
    s.instances[0].mesh = 0;
    s.meshes[1].indices[2] = 77;
    assert!(matches!(upload(&s), Some(UploadError::Mesh { .. })));
}

/// Largest value of channel 0.
fn largest(p: &Picture) -> f32 {
    p.data.iter().step_by(p.channels).copied().fold(0.0, f32::max)
}

#[test]
fn all_lights_in_one_picture() {
    let Some(gpu) = common::gpu() else { return };
    let mut meshes = vec![floor(50.0, 0.0)];
    for i in 0..5 {
        let x = -12.0 + 6.0 * i as f32;
        meshes.push(quad([x, 0.0, -4.0], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]));
        meshes.push(quad([x, 3.0 * i as f32 + 0.5, 6.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]));
    }
    let spot = Light {
        name: "spot".into(),
        color: [0.3, 0.3, 1.0],
        kind: LightKind::Spot {
            position: [-10.0, 8.0, 10.0],
            direction: [0.6, -0.8, 0.0],
            intensity: 60.0,
            radius: 0.2,
            range: None,
            inner_angle: 0.4,
            outer_angle: 0.5,
        },
    };
    let mut p = point([8.0, 5.0, 3.0], 60.0, 0.3);
    p.color = [1.0, 0.5, 0.2];
    let mut s = scene(meshes, vec![sun([0.5, -1.0, -0.4], 1.0, 0.03), p, spot]);
    s.environment = environment(0.2);
    let frame = render(&gpu, &s, &look_at([0.0, 12.0, 25.0], [0.0, 2.0, 0.0], 0.7), [640, 400], 1);
    assert!(largest(&frame.beauty) > 0.3);
    show("shadows", &frame.beauty, 1.5);
}
