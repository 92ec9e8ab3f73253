//! `rsm` and `cache`: light from beyond the screen against arithmetic and against the laws it promises.

use crate::common;
use bouncelight::gi::{GiError, Method};
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::render::capture::{CaptureOptions, Layer, Picture, capture};
use bouncelight::render::shadow::ShadowOptions;
use bouncelight::render::{RenderError, Renderer, RendererOptions, View};
use bouncelight::scene::upload::SceneGpu;
use bouncelight::scene::{Camera, Environment, Instance, Light, LightKind, Material, Scene, shapes};

/// A Lambertian box from `low` to `high`.
pub(crate) type Block = ([f32; 3], [f32; 3], [f32; 3]);

/// Boxes under lights and a sky.
pub(crate) fn scene(blocks: &[Block], lights: &[LightKind], sky: f32, camera: Camera) -> Scene {
    let mut scene = Scene { cameras: vec![camera], ..Default::default() };
    scene.environment = Environment { radiance: [sky; 3], ..Default::default() };
    for (i, (low, high, color)) in blocks.iter().enumerate() {
        let [r, g, b] = *color;
        let base_color = [r, g, b, 1.0];
        scene.materials.push(Material { base_color, metallic: 0.0, f0: 0.0, ..Default::default() });
        let mut mesh = shapes::flat(shapes::Shape::Cube);
        mesh.material = i;
        scene.meshes.push(mesh);
        let half: [f32; 3] = std::array::from_fn(|k| 0.5 * (high[k] - low[k]));
        let middle: [f32; 3] = std::array::from_fn(|k| 0.5 * (high[k] + low[k]));
        let mut transform = [[0.0; 4]; 4];
        (0..3).for_each(|k| transform[k][k] = half[k]);
        transform[3] = [middle[0], middle[1], middle[2], 1.0];
        scene.instances.push(Instance { name: String::new(), mesh: i, transform });
    }
    let light = |kind: &LightKind| Light { name: String::new(), color: [1.0; 3], kind: *kind, stands_in: false };
    scene.lights = lights.iter().map(light).collect();
    scene
}

pub(crate) fn sun(direction: [f32; 3], irradiance: f32) -> LightKind {
    LightKind::Directional { direction, irradiance, angle: 0.0 }
}

pub(crate) fn renderer(gpu: &Gpu, size: [u32; 2], method: Method) -> Renderer {
    let shadow = ShadowOptions { sun_size: 256, cascades: 2, local_size: 256 };
    Renderer::new(&gpu.device, &gpu.queue, size, RendererOptions { method, shadow, ..Default::default() })
        .expect("the size fits")
}

/// Indirect light and positions of the picture.
pub(crate) fn lit(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene) -> (Picture, Picture) {
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits");
    let options = CaptureOptions { layers: &[Layer::DiffInd, Layer::Position], ..Default::default() };
    let frame = capture(gpu, renderer, &uploaded, &scene.cameras[0], options).expect("the frame is drawn");
    let layer = |l| frame.layer(l).expect("it was asked for").clone();
    (layer(Layer::DiffInd), layer(Layer::Position))
}

pub(crate) fn light(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene) -> Vec<f32> {
    lit(gpu, renderer, scene).0.data
}

pub(crate) fn mean(v: &[f32]) -> f64 {
    v.iter().map(|&x| f64::from(x)).sum::<f64>() / v.len().max(1) as f64
}

/// Mean of |a − b| over the mean of b.
pub(crate) fn difference(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / b.len() as f64 / mean(b).max(1e-12)
}

pub(crate) const GREY: [f32; 3] = [0.5; 3];

/// A floor, an open top and four walls; the one behind the camera has a colour of its own.
pub(crate) fn hall(behind: [f32; 3], lights: &[LightKind], sky: f32, yfov: f32) -> Scene {
    let blocks = [
        ([-6.0, -0.2, -6.0], [6.0, 0.0, 6.0], GREY),
        ([-6.2, 0.0, -6.0], [-6.0, 4.0, 6.0], GREY),
        ([6.0, 0.0, -6.0], [6.2, 4.0, 6.0], GREY),
        ([-6.0, 0.0, -6.2], [6.0, 4.0, -6.0], GREY),
        ([-6.0, 0.0, 6.0], [6.0, 4.0, 6.2], behind),
        ([-1.0, 0.0, -3.0], [1.0, 1.5, -1.0], GREY),
    ];
    scene(&blocks, lights, sky, Camera::look_at([0.0, 1.6, 3.0], [0.0, 0.6, -3.0], yfov))
}

/// Shines onto the wall behind the camera.
pub(crate) const BACKWARDS: [f32; 3] = [0.2, -0.7, 0.7];

#[test]
fn a_lit_panel_sends_what_its_form_factor_says() {
    let Some(gpu) = common::gpu() else { return };
    let build = |panel: f32| {
        let blocks = [([-5.0, -0.2, -5.0], [5.0, 0.0, 5.0], GREY), ([-4.2, 0.0, -2.0], [-4.0, 4.0, 2.0], [panel; 3])];
        scene(&blocks, &[sun([-1.0, 0.0, 0.0], 2.0)], 0.0, Camera::look_at([0.0, 6.0, 0.001], [0.0, 0.0, 0.0], 1.2))
    };
    let mut renderer = renderer(&gpu, [96, 96], Method::Rsm);
    let (light, places) = lit(&gpu, &mut renderer, &build(0.6));
    let (mut error, mut sum) = (0.0, 0.0);
    for (e, p) in light.data.chunks_exact(3).zip(places.data.chunks_exact(3)) {
        if p[1].abs() > 1e-3 || p[0] < -3.4 {
            continue;
        }
        // E/π of a panel of radiance 0.6 · 2/π, by the midpoints of 40 × 40 squares.
        let mut expected = 0.0;
        for k in 0..1600 {
            let (y, z) = (0.1 * ((k / 40) as f32 + 0.5), 0.1 * ((k % 40) as f32 + 0.5) - 2.0);
            let v = [p[0] + 4.0, y - p[1], z - p[2]];
            let d2 = v.iter().map(|x| x * x).sum::<f32>();
            expected += 0.01 * v[0] * v[1] / (d2 * d2);
        }
        expected *= 0.6 * 2.0 / std::f32::consts::PI.powi(2);
        error += f64::from((e[0] - expected).abs());
        sum += f64::from(expected);
    }
    println!("a panel's light on the floor: {:.2} % off", 100.0 * error / sum);
    assert!(error / sum < 0.04, "{}", error / sum);
    // Negative control: a black panel sends nothing.
    assert_eq!(mean(&lit(&gpu, &mut renderer, &build(0.0)).0.data), 0.0);
}

/// Small black cubes at the corners of a box take of a panel's light what Cauchy's mean projection and their number say.
#[test]
fn small_objects_take_light_by_their_mean_projection() {
    let Some(gpu) = common::gpu() else { return };
    let build = |cubes: usize| {
        let mut blocks = vec![([-5.0, -0.2, -5.0], [5.0, 0.0, 5.0], GREY), ([-4.2, 0.0, -2.0], [-4.0, 4.0, 2.0], GREY)];
        blocks.extend((0..cubes).map(|i| {
            let low: [f32; 3] = std::array::from_fn(|k| if i >> k & 1 == 0 { [-4.9, 0.01, -4.9][k] } else { 4.0 });
            (low, low.map(|x| x + 0.9), [0.0; 3])
        }));
        scene(&blocks, &[sun([-1.0, 0.0, 0.0], 2.0)], 0.0, Camera::look_at([0.0, 6.0, 0.001], [0.0, 0.0, 0.0], 1.2))
    };
    let clutter = |scene: &Scene| SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits").clutter;
    let box_volume = 9.8 * 9.8 * 4.89;
    let expected = 8.0 * 6.0 * 0.81 / 4.0 / box_volume;
    let extinction = clutter(&build(8)).extinction;
    assert!((extinction / expected - 1.0).abs() < 1e-3, "{extinction}, {expected}");
    // Seven say nothing about a mean, and walls are no small objects.
    assert_eq!(clutter(&build(7)).extinction, 0.0);
    assert_eq!(clutter(&hall(GREY, &[], 0.0, 1.0)).extinction, 0.0);
    // Packed as closely as can be, light still goes as far as their box is wide.
    let packed: Vec<Block> = (0..125)
        .map(|i| [i % 5, i / 5 % 5, i / 25].map(|x| x as f32))
        .map(|low| (low, low.map(|x| x + 1.0), GREY))
        .collect();
    let packed = clutter(&scene(&packed, &[], 0.0, Camera::look_at([9.0; 3], [0.0; 3], 1.0))).extinction;
    assert!((packed * 5.0 * 3f32.sqrt() - 1.0).abs() < 1e-3, "{packed}");

    let mut renderer = renderer(&gpu, [96, 96], Method::Rsm);
    let [(open, places), (taken, _)] = [7, 8].map(|cubes| lit(&gpu, &mut renderer, &build(cubes)));
    let (mut before, mut after, mut predicted) = (0.0, 0.0, 0.0);
    for (i, p) in places.data.chunks_exact(3).enumerate() {
        // The floor between panel and cubes.
        if p[1].abs() > 1e-3 || p[0] < -3.4 || p.iter().step_by(2).any(|x| x.abs() > 3.5) {
            continue;
        }
        let (mut all, mut rest) = (0.0, 0.0);
        for k in 0..400 {
            let (y, z) = (0.2 * ((k / 20) as f32 + 0.5), 0.2 * ((k % 20) as f32 + 0.5) - 2.0);
            let v = [p[0] + 4.0, y, z - p[2]];
            let d2 = v.iter().map(|x| x * x).sum::<f32>();
            all += v[0] * v[1] / (d2 * d2);
            rest += v[0] * v[1] / (d2 * d2) * (-extinction * d2.sqrt()).exp();
        }
        before += f64::from(open.data[3 * i]);
        after += f64::from(taken.data[3 * i]);
        predicted += f64::from(open.data[3 * i] * rest / all);
    }
    let (loss, expected) = (1.0 - after / before, 1.0 - predicted / before);
    println!("small cubes take {:.2} % of a panel's light, expected {:.2} %", 100.0 * loss, 100.0 * expected);
    // Negative control: it is much more than the tolerance.
    assert!(expected > 0.03 && (loss - expected).abs() < 0.15 * expected, "{loss}, {expected}");
}

/// Rings are thinner than a texel of the cube around the camera, which takes what it hits for as large as itself; close by it must
/// not be believed. In this room the brightest indirect light is 0.3 by Cycles; inside one ring it was 0.67.
#[test]
fn rings_do_not_light_themselves_in_spots() {
    let Some(gpu) = common::gpu() else { return };
    let room = bouncelight::scene::load("paper-room:5").expect("a room");
    let found = light(&gpu, &mut renderer(&gpu, [1024, 512], Method::Cache), &room);
    let most = found.iter().fold(0.0f32, |m, v| m.max(*v));
    assert!((0.1..0.32).contains(&most), "{most}");
}

#[test]
fn light_scales_and_no_light_gives_none() {
    let Some(gpu) = common::gpu() else { return };
    let build = |light: f32, sky: f32| hall(GREY, &[sun(BACKWARDS, light)], sky, 1.0);
    for method in [Method::Rsm, Method::Cache] {
        let (name, mut renderer) = (method.name(), renderer(&gpu, [48, 32], method));
        let [once, twice] = [1.0, 2.0].map(|k| light(&gpu, &mut renderer, &build(k, 0.1 * k)));
        let doubled: Vec<f32> = once.iter().map(|x| 2.0 * x).collect();
        assert!(mean(&once) > 1e-3 && difference(&twice, &doubled) < 2e-3, "{name}");
        assert!(light(&gpu, &mut renderer, &build(0.0, 0.0)).iter().all(|x| *x == 0.0), "{name}");
        // The sky is no light to `rsm`, and the negative control: `cache` sees it.
        let sky = mean(&light(&gpu, &mut renderer, &build(0.0, 0.1)));
        assert_eq!(sky > 1e-2, name == "cache", "{name}: {sky}");
        assert_eq!(sky == 0.0, name == "rsm", "{name}: {sky}");
    }
}

/// The middle of a picture is the same with a wide and with a narrow field of view.
#[test]
fn what_the_picture_shows_besides_does_not_matter() {
    let Some(gpu) = common::gpu() else { return };
    let build = |tangent: f32| hall([0.9, 0.1, 0.1], &[sun(BACKWARDS, 3.0)], 0.05, 2.0 * tangent.atan());
    let apart = |method: Method| {
        let mut renderer = renderer(&gpu, [128, 128], method);
        let wide = light(&gpu, &mut renderer, &build(1.0));
        renderer.resize([64, 64]).expect("the size fits");
        let narrow = light(&gpu, &mut renderer, &build(0.5));
        let middle = (0..64).flat_map(|y| &wide[3 * (128 * (y + 32) + 32)..][..3 * 64]).copied();
        difference(&middle.collect::<Vec<_>>(), &narrow)
    };
    for method in [Method::Rsm, Method::Cache] {
        let (name, apart) = (method.name(), apart(method));
        println!("{name}: wide against narrow {:.3} %", 100.0 * apart);
        assert!(apart < 0.02, "{name}: {apart}");
    }
    // Negative control: the mean of the picture changes with the picture.
    assert!(apart(Method::Ambient) > 0.02);
}

#[test]
fn a_red_wall_behind_the_camera_tints_the_floor() {
    let Some(gpu) = common::gpu() else { return };
    let redness = |behind, renderer: &mut Renderer| {
        let light = light(&gpu, renderer, &hall(behind, &[sun(BACKWARDS, 3.0)], 0.02, 1.0));
        let channel = |c: usize| light.iter().skip(c).step_by(3).map(|&x| f64::from(x)).sum::<f64>();
        channel(0) / channel(1)
    };
    for method in [Method::Rsm, Method::Cache] {
        let (name, mut renderer) = (method.name(), renderer(&gpu, [48, 32], method));
        let (red, grey) = (redness([0.9, 0.1, 0.1], &mut renderer), redness(GREY, &mut renderer));
        println!("{name}: red over green {red:.3} by a red wall, {grey:.3} by a grey one");
        assert!(red > 1.15 && (grey - 1.0).abs() < 0.01, "{red}, {grey}");
    }
}

#[test]
fn what_a_light_stands_in_for_does_not_shine_twice() {
    let Some(gpu) = common::gpu() else { return };
    let run = |glow: f32, stands_in: bool| {
        let mut scene = hall(GREY, &[sun(BACKWARDS, 2.0)], 0.0, 0.9);
        let wall = scene.meshes[scene.instances[4].mesh].material;
        scene.materials[wall].emissive = [glow; 3];
        scene.lights[0].stands_in = stands_in;
        let mut renderer = renderer(&gpu, [64, 48], Method::Cache);
        lit(&gpu, &mut renderer, &scene).0.data
    };
    let (dark, stood_in, glowing) = (run(0.0, true), run(3.0, true), run(3.0, false));
    assert!(mean(&dark) > 0.0 && difference(&stood_in, &dark) < 1e-3, "{} of {}", mean(&stood_in), mean(&dark));
    // Negative control: without a light that stands in for it the wall shines.
    assert!(mean(&glowing) > 1.5 * mean(&dark), "{} against {}", mean(&glowing), mean(&dark));
}

#[test]
fn light_that_moves_slowly_does_not_jump() {
    let Some(gpu) = common::gpu() else { return };
    // Second difference of neighbouring steps over the picture's mean: mean of all patches of 8 × 8 pixels, and the worst.
    let jump = |renderer: &mut Renderer, step: f32| {
        let frames: Vec<Vec<f32>> = (0..5)
            .map(|i| {
                let a = 0.4 + step * i as f32;
                let light = light(&gpu, renderer, &hall(GREY, &[sun([0.3, -a.cos(), a.sin()], 3.0)], 0.02, 1.0));
                let patch = |p: usize| (0..64).map(move |k| (8 * (p / 8) + k / 8) * 64 + 8 * (p % 8) + k % 8);
                (0..32).map(|p| patch(p).map(|i| light[3 * i]).sum::<f32>()).collect()
            })
            .collect();
        let mean = frames[1].iter().sum::<f32>() / 32.0;
        let second = |w: &[Vec<f32>], p: usize| (w[0][p] - 2.0 * w[1][p] + w[2][p]).abs() / mean;
        let all: Vec<f32> = frames.windows(3).flat_map(|w| (0..32).map(move |p| second(w, p))).collect();
        (all.iter().sum::<f32>() / all.len() as f32, all.iter().copied().fold(0.0, f32::max))
    };
    for method in [Method::Rsm, Method::Cache] {
        let (name, mut renderer) = (method.name(), renderer(&gpu, [64, 32], method));
        let (slow, fast) = (jump(&mut renderer, 0.002), jump(&mut renderer, 0.3));
        println!("{name}: second difference {slow:.4?} at 0.11°, {fast:.4?} at 17° a frame");
        // The worst patch is where a row of texels right beside it goes over the edge of a box.
        assert!(slow.0 < 0.01 && slow.1 < 0.15, "{name}: {slow:?}");
        // Negative control.
        assert!(fast.0 > 10.0 * slow.0, "{name}: {fast:?}");
    }
}

#[test]
fn a_closed_room_stays_dark_under_a_bright_sky() {
    let Some(gpu) = common::gpu() else { return };
    let build = |top: f32| {
        let mut blocks: Vec<Block> = vec![
            ([-3.2, -0.2, -3.2], [3.2, 0.0, 3.2], GREY),
            ([-3.2, 0.0, -3.2], [-3.0, 3.0, 3.2], GREY),
            ([3.0, 0.0, -3.2], [3.2, 3.0, 3.2], GREY),
            ([-3.2, 0.0, -3.2], [3.2, 3.0, -3.0], GREY),
            ([-3.2, 0.0, 3.0], [3.2, 3.0, 3.2], GREY),
        ];
        blocks.push(([-3.2, 3.0, -3.2], [top, 3.1, 3.2], GREY));
        scene(&blocks, &[], 1.0, Camera::look_at([1.0, 1.5, 2.0], [0.0, 1.0, -3.0], 1.0))
    };
    let mut renderer = renderer(&gpu, [48, 32], Method::Cache);
    let [closed, half] = [3.2, 0.0].map(|top| mean(&light(&gpu, &mut renderer, &build(top))));
    println!("E/π under a sky of 1: {closed:.5} closed, {half:.3} with half a roof");
    assert!(closed < 1e-4, "{closed}");
    assert!(half > 0.05, "negative control: {half}");
}

/// Nothing stands between an emitter and a point in these methods, so light goes through inner walls. This holds the
/// number that the documentation states.
#[test]
fn an_inner_wall_leaks_no_more_than_stated() {
    let Some(gpu) = common::gpu() else { return };
    let build = |x: f32| {
        let blocks = [
            ([-6.2, -0.2, -3.2], [6.2, 0.0, 3.2], GREY),
            ([-6.2, 0.0, -3.2], [-6.0, 3.0, 3.2], GREY),
            ([6.0, 0.0, -3.2], [6.2, 3.0, 3.2], GREY),
            ([-6.2, 0.0, -3.2], [6.2, 3.0, -3.0], GREY),
            ([-6.2, 0.0, 3.0], [6.2, 3.0, 3.2], GREY),
            ([-6.2, 3.0, -3.2], [6.2, 3.1, 3.2], GREY),
            ([-0.1, 0.0, -3.0], [0.1, 3.0, 3.0], GREY),
        ];
        let lamp = LightKind::Point { position: [-3.0, 2.0, 0.0], intensity: 10.0, radius: 0.05, range: None };
        scene(&blocks, &[lamp], 0.0, Camera::look_at([x, 1.5, 2.5], [x, 1.0, -3.0], 1.0))
    };
    for (method, stated) in [(Method::Rsm, 0.15), (Method::Cache, 0.15)] {
        let (name, mut renderer) = (method.name(), renderer(&gpu, [48, 32], method));
        let [bright, dark] = [-3.0, 3.0].map(|x| mean(&light(&gpu, &mut renderer, &build(x))));
        println!("{name}: {:.3} of the lit room's light in the dark one", dark / bright);
        assert!(bright > 0.1 && dark / bright < stated, "{bright}, {dark}");
    }
}

#[test]
fn many_lights_odd_sizes_and_empty_scenes() {
    let Some(gpu) = common::gpu() else { return };
    let point = |x: f32| LightKind::Point { position: [x, 2.0, 0.0], intensity: 5.0, radius: 0.05, range: None };
    let spot = |outer_angle: f32| LightKind::Spot {
        position: [0.0, 3.0, 2.0],
        direction: [0.0, -0.5, -1.0],
        intensity: 20.0,
        radius: 0.02,
        range: Some(30.0),
        inner_angle: 0.2,
        outer_angle,
    };
    let all = [sun(BACKWARDS, 1.0), sun([0.5, -1.0, 0.1], 1.0), point(3.0), point(-3.0), spot(0.6), spot(1.3)];
    for method in [Method::Rsm, Method::Cache] {
        let (name, mut renderer) = (method.name(), renderer(&gpu, [48, 32], method));
        let together = light(&gpu, &mut renderer, &hall(GREY, &all, 0.0, 1.0));
        let mut apart = vec![0.0; together.len()];
        for kind in all {
            let one = light(&gpu, &mut renderer, &hall(GREY, &[kind], 0.0, 1.0));
            assert!(mean(&one) > 1e-3, "{name}: {kind:?}");
            apart.iter_mut().zip(one).for_each(|(sum, x)| *sum += x);
        }
        // Maps are smaller when there are several lights, so the sum is not exact.
        let off = difference(&together, &apart);
        println!("{name}: six lights together {:.2} % from their sum", 100.0 * off);
        assert!(off < 0.05, "{name}: {off}");
        // Forty lights are more than the maps' budget.
        let crowd: Vec<LightKind> = (0..40).map(|i| point(0.2 * i as f32 - 4.0)).collect();
        assert!(mean(&light(&gpu, &mut renderer, &hall(GREY, &crowd, 0.0, 1.0))) > 0.0);
        let empty = scene(&[], &[sun(BACKWARDS, 1.0)], 1.0, Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], 1.0));
        assert!(light(&gpu, &mut renderer, &empty).iter().all(|x| *x == 0.0));
        for odd in [[1, 1], [17, 13]] {
            renderer.resize(odd).expect("the size fits");
            assert!(light(&gpu, &mut renderer, &hall(GREY, &all, 0.1, 1.0)).iter().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn steady_frames_allocate_nothing_and_a_missing_world_is_named() {
    let Some(gpu) = common::gpu() else { return };
    let build = hall(GREY, &[sun(BACKWARDS, 1.0)], 0.1, 1.0);
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &build).expect("the scene fits");
    let mut renderer = renderer(&gpu, [64, 32], Method::Cache);
    let frame = |renderer: &mut Renderer| {
        let view = View::new(&build.cameras[0], renderer.size(), [0.0; 2]);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let recorded = renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view);
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        recorded
    };
    let held = || gpu.device.generate_allocator_report().map(|r| r.total_allocated_bytes);
    (0..3).for_each(|_| frame(&mut renderer).expect("the frame is drawn"));
    let (own, before) = (renderer.bytes(), held());
    (0..5).for_each(|_| frame(&mut renderer).expect("the frame is drawn"));
    assert_eq!((renderer.bytes(), held()), (own.clone(), before));
    // Negative control, and after a resize it draws as before.
    renderer.resize([128, 64]).expect("the size fits");
    frame(&mut renderer).expect("the frame is drawn");
    assert_ne!(renderer.bytes(), own);

    let inputs = renderer.gi_inputs(&View::new(&build.cameras[0], [128, 64], [0.0; 2]), [0.1; 3]);
    let mut rung = bouncelight::gi::rung::build(&gpu.device, &gpu.queue, [128, 64], &Method::Rsm)
        .expect("it can be made")
        .expect("it is a method");
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let target = &renderer.targets().indirect.view;
    let error = rung.record(&mut Recorder::new(&mut encoder), &gpu.queue, &inputs, target).unwrap_err();
    assert!(matches!(error, GiError::World), "{error}");
    assert!(RenderError::from(error).to_string().contains("Inputs::world"));
}
