//! The rasteriser against analytic answers.

use crate::build::*;
use crate::common;
use bouncelight::render::capture::{Layer, Picture};
use bouncelight::scene::{Light, LightKind};
use glam::Vec3;
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
    // The shadow is the quad moved by 3 m along x under the sun; under the lamp at (0, 6, 0) it is
    // twice as large.
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
        is_emissive_proxy: false,
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

/// The same scene in units `k` times as small.
fn in_units(s: &bouncelight::scene::Scene, k: f32) -> bouncelight::scene::Scene {
    let mut s = s.clone();
    let moved = |p: &mut [f32; 3]| p.iter_mut().for_each(|v| *v *= k);
    s.meshes.iter_mut().for_each(|m| m.positions.iter_mut().for_each(moved));
    for light in &mut s.lights {
        if let LightKind::Point { position, intensity, radius, .. }
        | LightKind::Spot { position, intensity, radius, .. } = &mut light.kind
        {
            moved(position);
            (*intensity, *radius) = (*intensity * k * k, *radius * k);
        }
    }
    s
}

/// Shadows, near plane, first camera, temporal anti-aliasing: nothing knows how long a metre is.
#[test]
fn a_scene_looks_the_same_whatever_its_unit() {
    use bouncelight::gpu_scene::SceneGpu;
    use bouncelight::render::{Renderer, RendererOptions, capture};
    use bouncelight::scene::Camera;
    use bouncelight_scene::defaults;
    let Some(gpu) = common::gpu() else { return };
    let lamp = spot([-3.0, 5.0, 4.0], [0.4, -1.0, -0.5], 0.3, 0.6, 0.1);
    let s = corner(vec![sun([0.3, -1.0, -0.4], 1.0, 0.02), point([3.0, 3.0, 2.0], 20.0, 0.0), lamp]);
    let size = [128, 80];
    let picture = |k: f32, framing: bool, taa: bool, lights: f32| {
        let mut scaled = in_units(&s, k * lights);
        let camera = if framing {
            defaults::complete(&mut scaled);
            scaled.cameras[0].clone()
        } else {
            Camera::look_at([0.5 * k, 4.0 * k, 10.0 * k], [0.0, 1.0 * k, 0.0], 0.8)
        };
        let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scaled).unwrap();
        let options = RendererOptions { taa, ..direct_only() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, options).unwrap();
        let options = capture::CaptureOptions { warmup: if taa { 6 } else { 0 }, ..Default::default() };
        capture::capture(&gpu, &mut renderer, &uploaded, &camera, options).unwrap().beauty
    };
    let differ = |a: &Picture, b: &Picture| {
        let off = a.data.chunks(4).zip(b.data.chunks(4)).filter(|(a, b)| (a[0] - b[0]).abs() > 1.0 / 255.0).count();
        off as f32 / (a.data.len() / 4) as f32
    };
    for (framing, taa) in [(false, false), (true, true)] {
        let metres = picture(1.0, framing, taa, 1.0);
        show(if framing { "units_framing" } else { "units" }, &metres, 1.0);
        for k in [1e-3, 1e3] {
            let other = picture(k, framing, taa, 1.0);
            let off = differ(&metres, &other);
            println!("x{k}, framing {framing}, taa {taa}: {:.3} % of the pixels differ", 100.0 * off);
            assert!(off < 0.003, "x{k}, framing {framing}, taa {taa}: {off}");
        }
    }
    // Negative control: a scene that is a tenth larger before the same camera.
    let off = differ(&picture(1.0, false, false, 1.0), &picture(1.0, false, false, 1.1));
    assert!(off > 0.03, "{off}");
}

#[test]
fn a_backdrop_is_shown_blurred_or_hidden_and_lights_the_scene_in_any_case() {
    use bouncelight::gi::Method;
    use bouncelight::gpu_scene::SceneGpu;
    use bouncelight::render::capture::{CaptureOptions, capture};
    use bouncelight::render::{Backdrop, Renderer, RendererOptions};
    use bouncelight::scene::{Environment, environment::EnvironmentImage};
    let Some(gpu) = common::gpu() else { return };
    let mut s = scene(vec![floor(1.0, 0.0)], vec![]);
    // Black and white stripes, a degree wide.
    let pixels: Vec<f32> = (0..360 * 180).flat_map(|i| [if i % 2 == 0 { 2.0 } else { 0.0 }; 3]).collect();
    let image = EnvironmentImage { name: "stripes".into(), width: 360, height: 180, rgb: pixels };
    s.environment = Environment::from_image(image).expect("a picture");
    let camera = look_at([0.0, 1.0, 4.0], [0.0, 1.0, 0.0], 0.8);
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &s).expect("it uploads");
    let mut drawn = |backdrop: Backdrop| {
        let options = RendererOptions { method: Method::Ambient(Default::default()), backdrop, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, [64, 64], options).expect("it builds");
        let options = CaptureOptions { samples: 16, ..Default::default() };
        capture(&gpu, &mut renderer, &uploaded, &camera, options).expect("it draws").beauty
    };
    let [shown, blurred, hidden, _] = Backdrop::ALL.map(&mut drawn);
    let row = |p: &Picture| -> Vec<f32> { (0..64).map(|x| p.at(x, 8)[1]).collect() };
    let spread = |v: Vec<f32>| {
        let mean = v.iter().sum::<f32>() / v.len() as f32;
        (mean, (v.iter().map(|x| (x - mean).powi(2)).sum::<f32>() / v.len() as f32).sqrt())
    };
    let [(a, as_is), (b, soft), (c, none)] = [&shown, &blurred, &hidden].map(|p| spread(row(p)));
    assert!((a - 1.0).abs() < 0.1 && (b - 1.0).abs() < 0.1, "{a} {b}");
    assert!(soft < 0.25 * as_is, "{soft} of {as_is}");
    assert!((c - 0.05).abs() < 1e-3 && none < 1e-3, "{c} ± {none}");
    // The floor knows nothing of it.
    for p in [&blurred, &hidden] {
        assert_eq!(p.at(32, 50), shown.at(32, 50));
    }
}

/// A wall that the sun grazes at 15° is as bright at its foot as above, whatever of the floor a
/// shadow map shows beside it; right below a board that keeps the sun off it is dark.
#[test]
fn a_grazed_wall_has_no_dark_line_at_its_foot_and_no_bright_one_below_a_board() {
    let Some(gpu) = common::gpu() else { return };
    let travels = Vec3::new(-0.86, -0.44, -0.26).normalize();
    let board = quad([-8.0, 0.8, 0.0], [16.0, 0.0, 0.0], [0.0, 0.0, 0.1]);
    let wall = quad([-8.0, 0.0, 0.0], [16.0, 0.0, 0.0], [0.0, 0.8, 0.0]);
    let s = scene(vec![floor(8.0, 0.0), wall, board], vec![sun(travels.into(), 1.0, 0.004)]);
    let frame = render(&gpu, &s, &look_at([0.0, 0.4, 1.6], [0.0, 0.4, 0.0], 0.6), [96, 96], 1);
    let (light, place) = (frame.layer(Layer::DiffDir).unwrap(), frame.layer(Layer::Position).unwrap());
    // The wall's rows between two heights, least and greatest over what the angle gives.
    let between = |low: f32, high: f32| {
        let rows = place.data.chunks_exact(3).zip(light.data.chunks_exact(3));
        let on = rows.filter(|(p, _)| p[2].abs() < 1e-3 && p[1] > low && p[1] < high);
        let over: Vec<f32> = on.map(|(_, e)| e[0] * PI / -travels.z).collect();
        assert!(over.len() > 90, "{}", over.len());
        (over.iter().copied().fold(f32::MAX, f32::min), over.iter().copied().fold(0.0, f32::max))
    };
    let (foot, above, below) = (between(0.0, 0.06), between(0.2, 0.5), between(0.72, 0.799));
    println!("foot {foot:?}, above {above:?}, below the board {below:?}");
    // The board's shadow ends 0.17 m below it.
    assert!(above.0 > 0.99 && above.1 < 1.01);
    assert!(foot.0 > 0.97 && foot.1 < 1.01, "{foot:?}");
    assert!(below.1 < 0.02, "{below:?}");
}
