//! Temporal anti-aliasing: off is off, a still picture converges to the filtered one, a slow pan
//! beats single frames, and what was never there, or is elsewhere now, leaves no ghost.

use crate::{build, common, read_light};
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Layer, capture};
use bouncelight::render::shadow::ShadowOptions;
use bouncelight::render::{Renderer, RendererOptions, View, sampling};
use bouncelight::scene::{self, Camera, Scene};
use glam::Mat4;

const SIZE: [u32; 2] = [96, 48];

type Rgb = Vec<[f32; 3]>;

struct Stage<'a> {
    gpu: &'a Gpu,
    uploaded: SceneGpu,
    renderer: Renderer,
}

impl<'a> Stage<'a> {
    fn new(gpu: &'a Gpu, scene: &Scene, method: Method, taa: bool) -> Self {
        let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits");
        // Small shadow maps: most of the time would go there.
        let shadow = ShadowOptions { sun_size: 512, ..Default::default() };
        let options = RendererOptions { method, taa, shadow, ..Default::default() };
        let renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options).expect("the size fits");
        Self { gpu, uploaded, renderer }
    }

    /// Frame number `i` through `camera`, jittered.
    fn frame(&mut self, camera: &Camera, i: u32) -> Rgb {
        let view = View::new(camera, self.renderer.size(), sampling::offset(i, 0)).with_seed(i);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(&mut encoder);
        self.renderer.record(&mut recorder, &self.gpu.queue, &self.uploaded, &view).expect("the frame is drawn");
        self.gpu.queue.submit([encoder.finish()]);
        read_light(self.gpu, &self.renderer.targets().hdr.texture)
    }

    /// The layers of direct light, normals and places through `camera`, as `options` say.
    fn layers(&mut self, camera: &Camera, options: CaptureOptions<'_>) -> [Rgb; 3] {
        let layers = [Layer::DiffDir, Layer::Normal, Layer::Position];
        let options = CaptureOptions { layers: &layers, ..options };
        let frame = capture(self.gpu, &mut self.renderer, &self.uploaded, camera, options).expect("drawn");
        layers.map(|l| {
            let data = &frame.layer(l).expect("asked for").data;
            data.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
        })
    }

    /// The mean of many samples: what the picture should be.
    fn truth(&mut self, camera: &Camera, samples: u32) -> Rgb {
        let options = CaptureOptions { samples, ..Default::default() };
        let frame = capture(self.gpu, &mut self.renderer, &self.uploaded, camera, options).expect("drawn");
        frame.beauty.data.chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect()
    }
}

fn largest(a: &Rgb, b: &Rgb) -> f32 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn mean(a: &Rgb, b: &Rgb) -> f32 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).sum::<f32>() / (3 * a.len()) as f32
}

/// The camera turned about the vertical by `angle`.
fn turned(camera: &Camera, angle: f32) -> Camera {
    let transform = Mat4::from_cols_array_2d(&camera.transform) * Mat4::from_rotation_y(angle);
    Camera { transform: transform.to_cols_array_2d(), ..camera.clone() }
}

fn room() -> (Scene, Camera) {
    let scene = bouncelight_lab::scenes::load("paper-room:60").expect("the room is made by code");
    let camera = scene.cameras[0].clone();
    (scene, camera)
}

#[test]
fn off_is_off_and_on_is_not() {
    let Some(gpu) = common::gpu() else { return };
    let (scene, camera) = room();
    let mut off = Stage::new(&gpu, &scene, Method::Direct, false);
    let mut on = Stage::new(&gpu, &scene, Method::Direct, true);
    let first = off.frame(&camera, 0);
    (1..4).for_each(|i| drop(off.frame(&camera, i)));
    assert_eq!(off.frame(&camera, 0), first, "off, a frame knows nothing of those before it, to the bit");
    let named = |s: &Stage<'_>| s.renderer.bytes().iter().filter(|(n, _)| n.starts_with("taa")).count();
    assert_eq!((named(&off), named(&on)), (0, 5));
    // Negative control: on, it does.
    let first = on.frame(&camera, 0);
    (1..4).for_each(|i| drop(on.frame(&camera, i)));
    assert_ne!(on.frame(&camera, 0), first);
    // A method's pattern may turn only with a history.
    let mut still = Stage::new(&gpu, &scene, Method::Ssgi(Default::default()), false);
    assert_eq!(still.frame(&camera, 0), still.frame(&camera, 0));
}

#[test]
fn a_frozen_frame_converges_to_the_filtered_picture() {
    let Some(gpu) = common::gpu() else { return };
    let (scene, camera) = room();
    let mut on = Stage::new(&gpu, &scene, Method::Ambient(Default::default()), true);
    let mut off = Stage::new(&gpu, &scene, Method::Ambient(Default::default()), false);
    let mut last = on.frame(&camera, 0);
    let mut changes = Vec::new();
    for i in 1..100 {
        let now = on.frame(&camera, i);
        changes.push(largest(&now, &last));
        last = now;
    }
    let most = |r: std::ops::Range<usize>| changes[r].iter().fold(0.0f32, |a, b| a.max(*b));
    println!(
        "largest change: {:.4} at first, {:.4} after 30 frames, {:.4} after 90",
        most(0..9),
        most(30..40),
        most(90..99)
    );
    assert!(most(90..99) < 0.05 * most(0..9) && most(90..99) < 0.02, "{changes:?}");
    let truth = off.truth(&camera, 100);
    let error = mean(&last, &truth);
    // Negative control: single frames neither come to rest nor near the truth.
    let (a, b) = (off.frame(&camera, 98), off.frame(&camera, 99));
    println!("mean error {error:.5}; of one frame {:.5}", mean(&b, &truth));
    assert!(error < 0.25 * mean(&b, &truth), "{error}");
    assert!(largest(&a, &b) > 10.0 * most(90..99));
}

#[test]
fn a_slow_pan_beats_single_frames() {
    let Some(gpu) = common::gpu() else { return };
    let (scene, camera) = room();
    let mut on = Stage::new(&gpu, &scene, Method::Direct, true);
    let mut off = Stage::new(&gpu, &scene, Method::Direct, false);
    let mut centred = Stage::new(&gpu, &scene, Method::Direct, false);
    // A third of a pixel a frame.
    let step = 0.33 * 2.0 * (camera.yfov * 0.5).tan() / SIZE[1] as f32;
    let (mut with, mut without, mut count) = (0.0, 0.0, 0);
    let (mut wobble, mut wobble_without) = (0.0, 0.0);
    let mut before: Option<[Rgb; 3]> = None;
    for i in 0..26 {
        let camera = turned(&camera, step * i as f32);
        let taa = on.frame(&camera, i);
        if i < 20 {
            continue;
        }
        let truth = off.truth(&camera, 12);
        let plain = centred.frame(&camera, 0);
        with += mean(&taa, &truth);
        without += mean(&plain, &truth);
        // Change from frame to frame, against the truth's own.
        if let Some([a, b, c]) = &before {
            let change = |now: &Rgb, old: &Rgb| -> Rgb {
                now.iter().zip(old).map(|(n, o)| std::array::from_fn(|c| n[c] - o[c])).collect()
            };
            let own = change(&truth, c);
            wobble += mean(&change(&taa, a), &own);
            wobble_without += mean(&change(&plain, b), &own);
        }
        before = Some([taa, plain, truth]);
        count += 1;
    }
    println!("error {:.5} against {:.5}; temporal {wobble:.5} against {wobble_without:.5}", with / 6.0, without / 6.0);
    assert!(count == 6 && with < 0.8 * without, "{with} {without}");
    assert!(wobble < 0.8 * wobble_without, "{wobble} {wobble_without}");
}

/// How far places lie from their pixels' centres along an axis at most, pixels.
fn off_centre(camera: &Camera, places: &Rgb) -> f32 {
    let clip_from_world = Mat4::from_cols_array_2d(&View::new(camera, SIZE, [0.0; 2]).clip_from_world_unjittered);
    let off = |(i, place): (usize, &[f32; 3])| {
        let ndc = clip_from_world.project_point3((*place).into());
        let at = [(0.5 + 0.5 * ndc.x) * SIZE[0] as f32, (0.5 - 0.5 * ndc.y) * SIZE[1] as f32];
        let centre = [i % SIZE[0] as usize, i / SIZE[0] as usize].map(|n| n as f32 + 0.5);
        (at[0] - centre[0]).abs().max((at[1] - centre[1]).abs())
    };
    // The picture's rim has no sample beyond it, and the background no place.
    let inner = |i: usize| {
        let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
        x > 1 && y > 1 && x + 2 < SIZE[0] && y + 2 < SIZE[1]
    };
    places.iter().enumerate().filter(|(i, p)| inner(*i) && **p != [0.0; 3]).map(off).fold(0.0, f32::max)
}

#[test]
fn layers_are_averaged_as_the_picture_is() {
    let Some(gpu) = common::gpu() else { return };
    let (scene, camera) = room();
    let mut on = Stage::new(&gpu, &scene, Method::Direct, true);
    let mut off = Stage::new(&gpu, &scene, Method::Direct, false);
    let truth = off.layers(&camera, CaptureOptions { samples: 100, ..Default::default() });
    let single = off.layers(&camera, CaptureOptions::default());
    let rest = on.layers(&camera, CaptureOptions { warmup: 99, ..Default::default() });
    for (i, name) in ["direct light", "normals"].iter().enumerate() {
        let (rest, single) = (mean(&rest[i], &truth[i]), mean(&single[i], &truth[i]));
        println!("{name} at rest {rest:.5} from the filtered layer; one frame {single:.5}");
        // The control is the single frame.
        assert!(rest < 0.25 * single, "{name}: {rest} {single}");
    }

    // A third of a pixel a frame, on from there.
    let step = 0.33 * 2.0 * (camera.yfov * 0.5).tan() / SIZE[1] as f32;
    let (mut with, mut without) = ([0.0; 2], [0.0; 2]);
    let mut widest = 0.0f32;
    for i in 1..21 {
        let camera = turned(&camera, step * i as f32);
        let moving = on.layers(&camera, CaptureOptions { number: i, ..Default::default() });
        // What is not averaged is of the sample nearest to the pixel's centre.
        let aside = off_centre(&camera, &moving[2]);
        assert!(aside < 0.51, "frame {i}: a place {aside} pixels off its pixel's centre");
        widest = sampling::offset(i, 0).iter().fold(widest, |a, x| a.max(x.abs()));
        if i > 14 {
            let truth = off.layers(&camera, CaptureOptions { samples: 12, ..Default::default() });
            let single = off.layers(&camera, CaptureOptions::default());
            for layer in 0..2 {
                with[layer] += mean(&moving[layer], &truth[layer]);
                without[layer] += mean(&single[layer], &truth[layer]);
            }
        }
    }
    println!("direct light and normals in a pan {with:?}; single frames {without:?}; samples up to {widest} off");
    assert!(with[0] < 0.8 * without[0] && with[1] < 0.8 * without[1], "{with:?} {without:?}");
    // Negative control: some pixels' own samples lie farther off.
    assert!(widest > 0.6, "{widest}");
}

#[test]
fn resize_cut_and_another_scene_leave_no_ghost() {
    let Some(gpu) = common::gpu() else { return };
    let (scene, camera) = room();
    let other = turned(&camera, 1.2);
    let mut on = Stage::new(&gpu, &scene, Method::Direct, true);
    // What a renderer shows that knows nothing else.
    let plain = Stage::new(&gpu, &scene, Method::Direct, true).frame(&other, 40);
    (0..6).for_each(|i| drop(on.frame(&camera, i)));
    on.renderer.reset_history();
    assert_eq!(on.frame(&other, 40), plain, "a cut");

    (0..6).for_each(|i| drop(on.frame(&camera, i)));
    on.renderer.resize([64, 48]).expect("the size fits");
    drop(on.frame(&camera, 0));
    on.renderer.resize(SIZE).expect("the size fits");
    assert_eq!(on.frame(&other, 40), plain, "a new size");

    let (first, second) = (bouncelight_lab::scenes::load("paper-room:61").expect("made"), scene);
    let mut on = Stage::new(&gpu, &first, Method::Direct, true);
    (0..6).for_each(|i| drop(on.frame(&first.cameras[0], i)));
    on.uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &second).expect("the scene fits");
    assert_eq!(on.frame(&other, 40), plain, "another scene");

    // A cut that nobody told of: distances and the neighbourhood's colours throw the old picture
    // out.
    let mut on = Stage::new(&gpu, &second, Method::Direct, true);
    (0..6).for_each(|i| drop(on.frame(&camera, i)));
    let old = on.frame(&camera, 12);
    let ghost = mean(&on.frame(&other, 40), &plain);
    let apart = mean(&old, &plain);
    println!("untold cut: {ghost:.5} from the plain frame; the pictures are {apart:.5} apart");
    assert!(ghost < 0.1 * apart, "{ghost} {apart}");
}

/// Upright stripes, half a metre wide and bright by turns, that glow by themselves.
fn fence() -> Scene {
    let mut s = build::scene(vec![build::quad([-9.0, -9.0, -1.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0])], vec![]);
    let mut fence = scene::Mesh { name: "fence".into(), ..Default::default() };
    for i in 0..6 {
        let stripe = build::quad([0.5 * i as f32 - 1.5, -1.0, 0.0], [0.5, 0.0, 0.0], [0.1, 2.0, 0.0]);
        let shade = if i % 2 == 0 { 1.0 } else { 0.2 };
        fence.indices.extend(stripe.indices.iter().map(|j| j + 4 * i));
        fence.positions.extend(stripe.positions);
        fence.normals.extend(stripe.normals);
        fence.colors.extend([[shade, shade, shade, 1.0]; 4]);
    }
    let mut instance = s.instances[0].clone();
    instance.mesh = 1;
    s.meshes.push(fence);
    s.instances.push(instance);
    s.materials[0].unlit = true;
    s.meshes[0].colors = vec![[0.5, 0.5, 0.5, 1.0]; 4];
    s
}

#[test]
fn a_moving_object_is_smoothed_and_leaves_no_ghost() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = fence();
    let camera = build::look_at([0.0, 0.0, 6.0], [0.0; 3], 0.7);
    let mut on = Stage::new(&gpu, &scene, Method::Direct, true);
    let mut off = Stage::new(&gpu, &scene, Method::Direct, false);
    let mut centred = Stage::new(&gpu, &scene, Method::Direct, false);
    // 2.7 pixels a frame; stripes of 5.5 pixels.
    let step = 2.7 * 2.0 * 6.0 * (camera.yfov * 0.5).tan() / SIZE[1] as f32;
    let (mut with, mut without, mut blurred) = (0.0, 0.0, 0.0);
    let mut kept: Vec<Rgb> = Vec::new();
    for i in 0..20 {
        scene.instances[1].transform[3][0] = step * (i as f32 - 10.0);
        for stage in [&mut on, &mut off, &mut centred] {
            stage.uploaded.set_placements(&gpu.queue, &scene);
        }
        let taa = on.frame(&camera, i);
        kept.push(off.frame(&camera, i));
        if i < 14 {
            continue;
        }
        let truth = off.truth(&camera, 16);
        with += mean(&taa, &truth) / 6.0;
        without += mean(&centred.frame(&camera, 0), &truth) / 6.0;
        // What a still camera makes of it that takes the scene for still as well.
        let all = |p: usize, c: usize| kept.iter().map(|k| k[p][c]).sum::<f32>() / kept.len() as f32;
        let all: Rgb = (0..truth.len()).map(|p| std::array::from_fn(|c| all(p, c))).collect();
        blurred += mean(&all, &truth) / 6.0;
    }
    println!("error {with:.5}; of single frames {without:.5}; of the mean over all {blurred:.5}");
    // With the camera's motion alone it was 2.9 times that of single frames.
    assert!(with < 0.75 * without, "{with} {without}");
    // Negative control: it does move.
    assert!(blurred > 5.0 * with, "{blurred} {with}");
    // Stopped, it comes to rest without a trace.
    (20..100).for_each(|i| drop(on.frame(&camera, i)));
    let rest = mean(&on.frame(&camera, 100), &off.truth(&camera, 64));
    println!("at rest {rest:.5}");
    assert!(rest < 0.4 * with, "{rest} {with}");
}
