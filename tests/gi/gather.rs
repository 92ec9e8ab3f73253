//! `gather` against arithmetic, and against the laws it promises.

use crate::common;
use crate::world::{self, GREY, difference, hall, mean, scene, sun};
use bouncelight::gi::Method;
use bouncelight::gi::gather::Options;
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Layer, Picture, capture};
use bouncelight::render::{Renderer, View};
use bouncelight::scene::{Camera, LightKind, Scene};

const PLAIN: Method = Method::Gather(Options { slots: world::FEW_SLOTS, ..Options::PLAIN });

fn method() -> Method {
    Method::Gather(Options { slots: world::FEW_SLOTS, ..Default::default() })
}

pub(crate) fn uploaded(gpu: &Gpu, scene: &Scene) -> SceneGpu {
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits");
    uploaded.trace(&gpu.device, &gpu.queue, scene).expect("its rays fit");
    uploaded
}

/// Indirect light and positions after so many frames.
pub(crate) fn lit(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene, frames: u32) -> (Picture, Picture) {
    let layers = &[Layer::DiffInd, Layer::Position];
    let options = CaptureOptions { layers, warmup: frames - 1, ..Default::default() };
    let frame = capture(gpu, renderer, &uploaded(gpu, scene), &scene.cameras[0], options).expect("the frame is drawn");
    let layer = |l| frame.layer(l).expect("it was asked for").clone();
    (layer(Layer::DiffInd), layer(Layer::Position))
}

fn light(gpu: &Gpu, method: Method, size: [u32; 2], scene: &Scene, frames: u32) -> Vec<f32> {
    lit(gpu, &mut world::renderer(gpu, size, method), scene, frames).0.data
}

/// Draws frames one after the other; what the last one has.
pub(crate) fn go_on(gpu: &Gpu, renderer: &mut Renderer, uploaded: &SceneGpu, camera: &Camera, frames: u32) -> Vec<f32> {
    let size = renderer.size();
    for i in 0..frames {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = View::new(camera, size, [0.0; 2]).with_seed(i);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, uploaded, &view).expect("the frame is drawn");
        gpu.queue.submit([encoder.finish()]);
    }
    let texture = &renderer.targets().indirect.texture;
    let bytes = bouncelight::gpu::readback::texture(&gpu.device, &gpu.queue, texture).expect("reading back works");
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
    halves.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]].map(f32::from)).collect()
}

#[test]
fn a_lit_panel_sends_what_its_form_factor_says() {
    let Some(gpu) = common::gpu() else { return };
    let build = |panel: f32| {
        let blocks =
            [([-5.0, -0.2, -5.0], [5.0, 0.0, 5.0], [0.02; 3]), ([-4.2, 0.0, -2.0], [-4.0, 4.0, 2.0], [panel; 3])];
        scene(&blocks, &[sun([-1.0, 0.0, 0.0], 2.0)], 0.0, Camera::look_at([0.0, 6.0, 0.001], [0.0, 0.0, 0.0], 1.2))
    };
    let mut renderer = world::renderer(&gpu, [64, 64], PLAIN);
    let (light, places) = lit(&gpu, &mut renderer, &build(0.6), 400);
    let (mut error, mut sum, mut all) = (0.0, 0.0, 0.0);
    for (e, p) in light.data.chunks_exact(3).zip(places.data.chunks_exact(3)) {
        if p[1].abs() > 1e-3 || p[0] < -3.2 {
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
        all += f64::from(e[0] - expected);
        sum += f64::from(expected);
    }
    println!("a panel's light on the floor: {:.2} % off, {:+.2} % in all", 100.0 * error / sum, 100.0 * all / sum);
    assert!(error / sum < 0.1 && (all / sum).abs() < 0.015, "{} {}", error / sum, all / sum);
    // Negative control: a black panel sends nothing.
    assert_eq!(mean(&lit(&gpu, &mut renderer, &build(0.0), 2).0.data), 0.0);
}

/// Of even light 1 on a wall at z = -4 that is 2 m high, the share that a white metal's lobe on the
/// floor shows at p to an eye: GGX with height-correlated Smith, by the midpoints of 300 × 600
/// directions. Light that is scattered more than once cancels out.
fn share_of_wall(p: [f32; 3], eye: [f32; 3], roughness: f32) -> f64 {
    let to = glam::DVec3::from_array([0, 1, 2].map(|i| f64::from(eye[i] - p[i])));
    let (v, a2) = (to.normalize(), f64::from(roughness).powi(4));
    let (mut on, mut all) = (0.0, 0.0);
    for i in 0..300 {
        let theta = (f64::from(i) + 0.5) / 300.0 * std::f64::consts::FRAC_PI_2;
        for j in 0..600 {
            let phi = (f64::from(j) + 0.5) / 600.0 * std::f64::consts::TAU;
            let l = glam::DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let h = (v + l).normalize();
            let d = a2 / (h.y * h.y * (a2 - 1.0) + 1.0).powi(2);
            let masked = l.y * (v.y * v.y * (1.0 - a2) + a2).sqrt() + v.y * (l.y * l.y * (1.0 - a2) + a2).sqrt();
            let seen = d / masked * l.y * theta.sin();
            // Where the direction meets the wall's plane.
            let t = (-4.0 - f64::from(p[2])) / l.z;
            let (x, y) = (f64::from(p[0]) + t * l.x, t * l.y);
            all += seen;
            on += if t > 0.0 && y < 2.0 && x.abs() < 4.0 { seen } else { 0.0 };
        }
    }
    on / all
}

/// What was not seen before has eight rays a cell, what was lately two, the rest one: its light is
/// much nearer to the settled one (by √8 if rays were drawn by chance; they are far from each other).
#[test]
fn what_is_new_in_the_picture_has_more_rays() {
    let Some(gpu) = common::gpu() else { return };
    // A floor under half a sky.
    let blocks =
        [([-60.0, -0.2, -60.0], [60.0, 0.0, 60.0], GREY), ([-60.0, 0.0, -61.0], [60.0, 90.0, -60.0], [0.0; 3])];
    let look =
        |angle: f32| Camera::look_at([0.0, 9.0, -55.0], [6.0 * angle.sin(), 0.0, -55.0 + 6.0 * angle.cos()], 0.8);
    let floor = scene(&blocks, &[], 1.0, look(0.0));
    let uploaded = uploaded(&gpu, &floor);
    // Each frame shows its own rays; where all frames are even no cell is young.
    let alone = |progressive| {
        let method = Method::Gather(Options { cell_frames: 1.0, blur: false, progressive, ..Default::default() });
        world::renderer(&gpu, [96, 64], method)
    };
    let mut renderer = alone(true);
    let mut settled = world::renderer(&gpu, [96, 64], method());
    let mut from_settled = |renderer: &mut Renderer, camera: &Camera, frames: u32, columns: std::ops::Range<usize>| {
        let truth = go_on(&gpu, &mut settled, &uploaded, camera, 64);
        let found = go_on(&gpu, renderer, &uploaded, camera, frames);
        let kept = |light: &[f32]| -> Vec<f32> {
            let pixels = light.chunks_exact(3).enumerate();
            pixels.filter(|(i, _)| columns.contains(&(i % 96))).map(|(_, p)| p[1]).collect()
        };
        difference(&kept(&found), &kept(&truth))
    };
    let young = from_settled(&mut alone(false), &look(0.0), 4, 0..96);
    let mut off = |camera: &Camera, frames, columns| from_settled(&mut renderer, camera, frames, columns);
    let (first, later) = (off(&look(0.0), 1, 0..96), off(&look(0.0), 3, 0..96));
    println!("a frame's light is {:.1} % off where it is the first, {:.1} % later", 100.0 * first, 100.0 * later);
    assert!(first < 0.25 * later && later > 0.2);
    println!("and {:.1} % while cells are young", 100.0 * young);
    assert!(young < 0.8 * later, "{young} {later}");
    // After a turn by 20 degrees the same holds of what has come in from the side, and no more in
    // the frame after.
    let (new, old) = (off(&look(0.35), 1, 0..16), off(&look(0.35), 1, 0..16));
    println!("after a turn {:.1} % in what is new, {:.1} % a frame later", 100.0 * new, 100.0 * old);
    assert!(new < 0.3 * old);
}

/// What a lobe shows of a wall that is not in the picture.
#[test]
fn lobes_show_what_is_off_the_screen() {
    let Some(gpu) = common::gpu() else { return };
    let eye = [0.0, 2.0, 0.0];
    for (roughness, worst) in [(0.1, 0.1), (0.5, 0.08), (0.75, 0.12)] {
        let blocks =
            [([-4.0, -0.2, -4.0], [4.0, 0.0, 4.0], [1.0; 3]), ([-4.0, 0.0, -4.2], [4.0, 2.0, -4.0], [0.02; 3])];
        let mut room = scene(&blocks, &[], 0.0, Camera::look_at(eye, [0.0, 0.0, -1.5], 0.6));
        (room.materials[0].metallic, room.materials[0].roughness) = (1.0, roughness);
        room.materials[1].emissive = [1.0; 3];
        let mut shares = Vec::new();
        let mut off = |method: Method| {
            let mut renderer = world::renderer(&gpu, [96, 64], method);
            let layers = &[Layer::GlossInd, Layer::Position];
            let warmup = if renderer.settled().is_some() { 95 } else { 0 };
            let options = CaptureOptions { layers, warmup, ..Default::default() };
            let frame = capture(&gpu, &mut renderer, &uploaded(&gpu, &room), &room.cameras[0], options).expect("drawn");
            let layer = |l| &frame.layer(l).expect("it was asked for").data;
            let (mut error, mut bias, mut sum) = (0.0, 0.0, 0.0);
            let pixels = layer(Layer::GlossInd).chunks_exact(3).zip(layer(Layer::Position).chunks_exact(3));
            for (i, (found, p)) in pixels.step_by(37).enumerate() {
                if i == shares.len() {
                    shares.push(share_of_wall([p[0], p[1], p[2]], eye, roughness));
                }
                let expected = shares[i];
                error += (f64::from(found[0]) - expected).abs();
                bias += f64::from(found[0]) - expected;
                sum += expected;
            }
            (error / sum, bias / sum)
        };
        let (error, bias) = off(method());
        println!("roughness {roughness}: {:.1} % off, {:+.1} % in all", 100.0 * error, 100.0 * bias);
        assert!(error < worst && bias.abs() < 0.05, "roughness {roughness}: {error} {bias}");
        // Negative control: the screen alone knows nothing of the wall.
        assert!(off(Method::Ssgi(Default::default())).0 > 0.5);
    }
}

/// In a closed room whose walls all glow and send back ρ of what they get, there is glow / (1 − ρ)
/// everywhere.
#[test]
fn a_glowing_room_is_the_series_of_its_albedo() {
    let Some(gpu) = common::gpu() else { return };
    for albedo in [0.05, 0.5, 0.7f32] {
        // Six slabs about a room of 4 m.
        let slab = |axis: usize, side: f32| {
            let (mut low, mut high) = ([-2.2; 3], [2.2; 3]);
            (low[axis], high[axis]) = if side < 0.0 { (-2.2, -2.0) } else { (2.0, 2.2) };
            (low, high, [albedo; 3])
        };
        let blocks: Vec<_> = (0..3).flat_map(|a| [slab(a, -1.0), slab(a, 1.0)]).collect();
        let camera = Camera::look_at([-1.5, 0.3, 1.2], [1.0, -0.4, -1.0], 1.2);
        let mut room = scene(&blocks, &[], 0.0, camera);
        room.materials.iter_mut().for_each(|m| m.emissive = [0.5, 1.0, 0.25]);
        let light = light(&gpu, PLAIN, [32, 32], &room, 200);
        for (c, glow) in [0.5, 1.0, 0.25].into_iter().enumerate() {
            let channel: Vec<f32> = light.chunks_exact(3).map(|p| p[c]).collect();
            let expected = f64::from(glow / (1.0 - albedo));
            let off = mean(&channel) / expected - 1.0;
            println!("albedo {albedo}, channel {c}: {:+.2} %", 100.0 * off);
            assert!(off.abs() < 0.015, "{off}");
        }
    }
}

/// What a filter's network learns must not share noise with what it learns from.
#[test]
fn another_seed_is_other_noise_of_the_same_light() {
    let Some(gpu) = common::gpu() else { return };
    let room = hall(GREY, &[sun(world::BACKWARDS, 2.0)], 0.3, 1.0);
    let at = |seed, frames| {
        light(
            &gpu,
            Method::Gather(Options { seed, slots: world::FEW_SLOTS, ..Options::PLAIN }),
            [96, 64],
            &room,
            frames,
        )
    };
    let truth = at(3, 1024);
    let noise = |light: Vec<f32>| -> Vec<f64> {
        let off: Vec<f64> = light.iter().zip(&truth).map(|(a, b)| f64::from(a - b)).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        off.iter().map(|v| v - mean).collect()
    };
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let correlation = |a: &[f64], b: &[f64]| product(a, b) / (product(a, a) * product(b, b)).sqrt();
    let (own, mean_of_truth) = (at(0, 16), mean(&truth));
    let brighter = mean(&own) / mean_of_truth - 1.0;
    let own = noise(own);
    let (other, same) = (correlation(&own, &noise(at(1, 64))), correlation(&own, &noise(at(0, 64))));
    println!("noise of 16 frames goes with that of 64 by {other:.2}, of the same seed by {same:.2}; {brighter:+.3}");
    // What is left is of entries, whose places and rays are the same.
    assert!(other.abs() < 0.3, "{other}");
    assert!(brighter.abs() < 0.02, "{brighter}");
    // Negative control: sixteen of the same seed's 64 frames are the very same.
    assert!(same > 0.5, "{same}");
}

/// A lamp in one of two closed rooms under one roof leaves the other dark.
#[test]
fn no_light_goes_through_an_inner_wall() {
    let Some(gpu) = common::gpu() else { return };
    let rooms = |wall: bool, x: f32| {
        let mut blocks = vec![
            ([-4.2, -0.2, -2.2], [4.2, 0.0, 2.2], GREY),
            ([-4.2, 3.0, -2.2], [4.2, 3.2, 2.2], GREY),
            ([-4.2, 0.0, -2.2], [-4.0, 3.0, 2.2], GREY),
            ([4.0, 0.0, -2.2], [4.2, 3.0, 2.2], GREY),
            ([-4.0, 0.0, -2.2], [4.0, 3.0, -2.0], GREY),
            ([-4.0, 0.0, 2.0], [4.0, 3.0, 2.2], GREY),
        ];
        if wall {
            // Two centimetres thick, and no plane of any grid.
            blocks.push(([0.13, 0.0, -2.0], [0.15, 3.0, 2.0], GREY));
        }
        let lamp = LightKind::Point { position: [-2.0, 2.2, 0.3], intensity: 10.0, radius: 0.02, range: None };
        scene(&blocks, &[lamp], 0.0, Camera::look_at([x, 1.6, 1.6], [x - 1.0, 0.6, -1.0], 1.2))
    };
    let at = |wall, x| mean(&light(&gpu, method(), [96, 64], &rooms(wall, x), 32));
    let (dark, bright, open) = (at(true, 1.6), at(true, -2.0), at(false, 1.6));
    println!("behind the wall {:.4} %, without it {:.1} %", 100.0 * dark / bright, 100.0 * open / bright);
    assert!(dark / bright < 1e-3, "{}", dark / bright);
    // Negative control: without the wall it is bright there.
    assert!(open / bright > 0.1);
}

#[test]
fn twice_the_light_is_twice_the_answer_and_none_is_none() {
    let Some(gpu) = common::gpu() else { return };
    let build = |f: f32| hall(GREY, &[sun(world::BACKWARDS, 2.0 * f)], 0.3 * f, 1.0);
    let once = light(&gpu, method(), [64, 48], &build(1.0), 6);
    let twice = light(&gpu, method(), [64, 48], &build(2.0), 6);
    let half: Vec<f32> = twice.iter().map(|v| 0.5 * v).collect();
    assert!(mean(&once) > 0.01 && difference(&half, &once) < 1e-3, "{}", difference(&half, &once));
    assert!(light(&gpu, method(), [64, 48], &build(0.0), 3).iter().all(|v| *v == 0.0));
    // The same frames once more are the same to the last bit.
    assert_eq!(once, light(&gpu, method(), [64, 48], &build(1.0), 6));
}

/// A lamp that is switched: nine tenths of the change within six frames, less than 2 % of the old
/// light after thirty.
#[test]
fn light_follows_a_switch() {
    let Some(gpu) = common::gpu() else { return };
    let lamp = |w: f32| LightKind::Point { position: [1.5, 3.0, 0.5], intensity: w, radius: 0.05, range: None };
    let (on, off) = (hall(GREY, &[lamp(20.0)], 0.02, 1.0), hall(GREY, &[lamp(0.0)], 0.02, 1.0));
    let settled = |s: &Scene| mean(&light(&gpu, method(), [96, 64], s, 64));
    let (bright, dark) = (settled(&on), settled(&off));
    let mut renderer = world::renderer(&gpu, [96, 64], method());
    let mut uploaded = uploaded(&gpu, &on);
    let mut frames = |uploaded: &SceneGpu, n| mean(&go_on(&gpu, &mut renderer, uploaded, &on.cameras[0], n));
    let before = frames(&uploaded, 64);
    assert!((before / bright - 1.0).abs() < 0.03, "{before} {bright}");
    uploaded.set_lights(&gpu.device, &gpu.queue, &off);
    let (soon, late) = (frames(&uploaded, 6), frames(&uploaded, 24));
    let left = |v: f64| (v - dark) / (bright - dark);
    println!("left after 6 frames {:.1} %, after 30 {:.2} %", 100.0 * left(soon), 100.0 * left(late));
    assert!(left(soon) < 0.1 && left(late).abs() < 0.02);
    uploaded.set_lights(&gpu.device, &gpu.queue, &on);
    let (soon, late) = (frames(&uploaded, 6), frames(&uploaded, 24));
    println!("there after 6 frames {:.1} %, after 30 {:.1} %", 100.0 * left(soon), 100.0 * left(late));
    assert!(left(soon) > 0.9 && (left(late) - 1.0).abs() < 0.05);
}

/// A dark room at rest does not boil: from frame to frame less than 0.5 % of its light changes.
#[test]
fn a_room_at_rest_is_quiet() {
    let Some(gpu) = common::gpu() else { return };
    let room = hall(GREY, &[sun(world::BACKWARDS, 2.0)], 0.02, 1.0);
    let mut renderer = world::renderer(&gpu, [96, 64], method());
    let uploaded = uploaded(&gpu, &room);
    let camera = &room.cameras[0];
    let first = go_on(&gpu, &mut renderer, &uploaded, camera, 1);
    let second = go_on(&gpu, &mut renderer, &uploaded, camera, 1);
    let a = go_on(&gpu, &mut renderer, &uploaded, camera, 70);
    let b = go_on(&gpu, &mut renderer, &uploaded, camera, 1);
    println!(
        "from frame to frame {:.3} %, at first {:.1} %",
        100.0 * difference(&b, &a),
        100.0 * difference(&second, &first)
    );
    assert!(difference(&b, &a) < 0.005);
    // Negative control: the first frames do change.
    assert!(difference(&second, &first) > 0.01);
}

#[test]
fn what_is_missing_or_broken_is_said_or_left_out() {
    let Some(gpu) = common::gpu() else { return };
    let room = hall(GREY, &[sun(world::BACKWARDS, 2.0)], 0.1, 1.0);
    let mut renderer = world::renderer(&gpu, [32, 32], method());
    // Objects that are nowhere, flat, mirrored or broken; a list of lights that empties.
    let mut odd = room.clone();
    let count = odd.instances.len();
    for k in 0..4 {
        let mut copy = odd.instances[k].clone();
        match k {
            0 => copy.transform[0][0] = 0.0,
            1 => copy.transform[1][1] = f32::NAN,
            2 => copy.transform[0] = copy.transform[0].map(|v| -v),
            _ => copy.mesh = odd.meshes.len(),
        }
        odd.instances.push(copy);
    }
    let mut broken = odd.meshes[0].clone();
    broken.positions.iter_mut().for_each(|p| p[0] = f32::NAN);
    odd.meshes.push(broken);
    let mut uploaded = uploaded(&gpu, &odd);
    let counts = uploaded.rays.as_ref().expect("they were made").counts();
    assert_eq!((counts.instances, counts.left_out), (count + 1, 3), "{counts:?}");
    let first = go_on(&gpu, &mut renderer, &uploaded, &room.cameras[0], 3);
    assert!(first.iter().all(|v| v.is_finite()) && mean(&first) > 0.0);
    uploaded.set_lights(&gpu.device, &gpu.queue, &Scene { lights: vec![], ..room.clone() });
    let dark = go_on(&gpu, &mut renderer, &uploaded, &room.cameras[0], 40);
    assert!(dark.iter().all(|v| v.is_finite()) && mean(&dark) < mean(&first));

    // Nothing at all, then a triangle of no area.
    let mut nothing = Scene { cameras: room.cameras.clone(), ..Default::default() };
    nothing.environment = room.environment.clone();
    assert!(light(&gpu, method(), [17, 13], &nothing, 2).iter().all(|v| *v == 0.0));
    let mut flat = room.clone();
    flat.meshes.iter_mut().for_each(|m| m.positions.iter_mut().for_each(|p| *p = [1.0; 3]));
    assert!(light(&gpu, method(), [1, 1], &flat, 2).iter().all(|v| v.is_finite()));
}
