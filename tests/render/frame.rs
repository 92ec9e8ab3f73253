//! Whole frames with the shipped network: memory, steadiness, laws of light from scene to picture.

use crate::common;
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::format::Weights;
use bouncelight::render::capture::{CaptureOptions, CapturedFrame, Layer, capture};
use bouncelight::render::{Renderer, RendererOptions, View};
use bouncelight::scene::{LightKind, Scene};

fn neural() -> RendererOptions {
    let weights = Weights::shipped().expect("the shipped weights are sound");
    RendererOptions { method: Method::Neural(Box::new(weights.into())), ..Default::default() }
}

fn draw(gpu: &Gpu, scene: &Scene, size: [u32; 2]) -> CapturedFrame {
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits");
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, neural()).expect("the size fits");
    let options = CaptureOptions { layers: &[Layer::DiffInd, Layer::DiffDir, Layer::Depth], ..Default::default() };
    capture(gpu, &mut renderer, &uploaded, &scene.cameras[0], options).expect("the frame is drawn")
}

/// All lights and the sky times `factor`.
fn dimmed(scene: &Scene, factor: f32) -> Scene {
    let mut scene = scene.clone();
    scene.environment.radiance = scene.environment.radiance.map(|v| v * factor);
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Directional { irradiance, .. } => *irradiance *= factor,
            LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => *intensity *= factor,
        }
    }
    scene
}

#[test]
fn a_paper_room_with_the_network_stays_below_200_mb_and_steady_frames_allocate_nothing() {
    let Some(gpu) = common::own_gpu() else { return };
    let scene = bouncelight_lab::scenes::load("paper-room:2").expect("the room is made by code");
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene).expect("the scene fits");
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, [1024, 512], neural()).expect("the size fits");
    let frame = |renderer: &mut Renderer, seed: u32| {
        let view = View::new(&scene.cameras[0], renderer.size(), [0.0; 2]).with_seed(seed);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(&mut encoder);
        renderer.record(&mut recorder, &gpu.queue, &uploaded, &view).expect("the frame is drawn");
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
    };
    let held = || gpu.device.generate_allocator_report().map(|r| r.total_allocated_bytes);
    (0..3).for_each(|i| frame(&mut renderer, i));
    let (before, own) = (held(), renderer.bytes());
    (3..9).for_each(|i| frame(&mut renderer, i));
    assert_eq!(renderer.bytes(), own);
    assert_eq!(held(), before, "six more frames hold no more memory");

    let named: u64 = own.iter().map(|(_, b)| b).sum::<u64>() + uploaded.bytes();
    println!("{:.1} MB by name, {:?} bytes held by the device", named as f64 / 1e6, before);
    assert!(named < 200_000_000, "{named} bytes: {own:?}");
    // What the driver's allocator holds (staging included) bounds what was forgotten in the list.
    if let Some(all) = before {
        assert!(all < 200_000_000, "{all} bytes held, {named} accounted for");
        assert!(all as f64 > 0.9 * named as f64, "{all} bytes held, {named} accounted for");
    }
    // Negative control: a larger picture is seen by both.
    renderer.resize([1280, 640]).expect("the size fits");
    frame(&mut renderer, 0);
    assert_ne!(renderer.bytes(), own);
    assert!(before.is_none() || held() != before);
}

#[test]
fn light_scales_through_the_whole_frame_and_darkness_is_dark() {
    let Some(gpu) = common::gpu() else { return };
    let scene = bouncelight_lab::scenes::load("paper-room:3").expect("the room is made by code");
    let size = [128, 64];
    let once = draw(&gpu, &scene, size);
    let indirect = |frame: &CapturedFrame| frame.layer(Layer::DiffInd).expect("it was asked for").data.clone();
    let mean = |v: &[f32]| v.iter().map(|x| f64::from(*x)).sum::<f64>() / v.len() as f64;
    let base = indirect(&once);
    assert!(mean(&base) > 0.01, "the network adds light");
    for factor in [2.0f32, 0.125] {
        let scaled = indirect(&draw(&gpu, &dimmed(&scene, factor), size));
        let scale = f64::from(factor);
        let error: f64 = base.iter().zip(&scaled).map(|(a, b)| (f64::from(*a) * scale - f64::from(*b)).abs()).sum();
        let relative = error / (mean(&base) * scale * base.len() as f64);
        assert!(relative < 2e-3, "×{factor}: {relative}");
    }
    let dark = draw(&gpu, &dimmed(&scene, 0.0), size);
    assert!(dark.beauty.data.chunks_exact(4).all(|p| p[..3] == [0.0; 3]), "no light, no picture");
    // Negative control: the sky alone is not darkness.
    let mut sky = dimmed(&scene, 0.0);
    sky.environment = scene.environment.clone();
    assert!(mean(&indirect(&draw(&gpu, &sky, size))) > 1e-3);
}

#[test]
fn odd_sizes_and_every_bundled_scene_give_finite_pictures() {
    let Some(gpu) = common::gpu() else { return };
    let mut seen = 0;
    for name in bouncelight_scene::bundled::NAMES {
        let scene = bouncelight_lab::scenes::load(name).expect("bundled scenes load");
        for size in [[1, 1], [17, 13], [96, 48]] {
            // `capture` refuses pixels that are not finite.
            let frame = draw(&gpu, &scene, size);
            assert_eq!((frame.beauty.width, frame.beauty.height), (size[0] as usize, size[1] as usize));
            seen += 1;
        }
    }
    let empty =
        Scene { cameras: bouncelight_lab::scenes::load("cornell").expect("bundled").cameras, ..Default::default() };
    assert!(draw(&gpu, &empty, [17, 13]).beauty.data.chunks_exact(4).all(|p| p[..3] == [0.0; 3]));
    assert_eq!(seen, 9);
}

#[test]
fn files_made_by_others_draw_with_the_network() {
    let Some(gpu) = common::gpu() else { return };
    let Some(shared) = common::shared() else { return };
    let real = ["cornell_box_gltf/scene.gltf", "cornell_box_obj/cornell_box.obj", "pica_pica_mini_diorama/scene.gltf"];
    let rooms = ["paper_0002", "paper_0003", "paper_0004", "paper_0005", "sun_101", "point_201", "metal_301"];
    let files = real.iter().map(|f| shared.join("real").join(f));
    let files = files.chain(rooms.iter().map(|f| shared.join("reference/cycles").join(f).join("scene.glb")));
    let mut seen = 0;
    for file in files {
        let scene = bouncelight_lab::scenes::load(file.to_str().expect("a path in UTF-8")).expect("the file loads");
        let frame = draw(&gpu, &scene, [128, 64]);
        let lit = frame.beauty.data.chunks_exact(4).filter(|p| p[0] + p[1] + p[2] > 0.0).count();
        assert!(lit * 10 > frame.beauty.width * frame.beauty.height, "{} shows something", file.display());
        seen += 1;
    }
    assert_eq!(seen, 10);
}
