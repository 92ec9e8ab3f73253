//! Light through a lid on a skinned hinge.

use crate::common;
use crate::figures::{Coded, bends, chest, strip};
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Layer, capture};
use bouncelight::render::{Renderer, RendererOptions, View};
use bouncelight::scene::{Camera, Environment, Light, LightKind, Scene};

const SIZE: [u32; 2] = [48, 48];

/// The chest under a sky and a sun, seen from within.
fn lit() -> Scene {
    let mut scene = chest().load().expect("it loads");
    let kind = LightKind::Directional { direction: [0.2, -0.9, 0.1], irradiance: 2.0, angle: 0.0 };
    scene.lights = vec![Light::from(kind)];
    scene.environment = Environment::constant([1.0; 3]);
    scene.default_light = false;
    scene.cameras = vec![Camera::look_at([0.8, 0.6, 0.8], [-0.5, 0.1, -0.5], 1.2)];
    scene
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64
}

/// Means of direct and indirect light (E/π) after so many frames.
fn draw(gpu: &Gpu, renderer: &mut Renderer, scene: &SceneGpu, camera: &Camera, frames: u32) -> [f64; 2] {
    for i in 0..frames {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = View::new(camera, SIZE, [0.0; 2]).with_seed(i);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, scene, &view).expect("the frame is drawn");
        gpu.queue.submit([encoder.finish()]);
    }
    let t = renderer.targets();
    [&t.direct_diffuse, &t.indirect].map(|t| {
        let bytes = readback::texture(&gpu.device, &gpu.queue, &t.texture).expect("readable");
        let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
        mean(&halves.chunks_exact(4).map(|p| p[0].to_f32()).collect::<Vec<_>>())
    })
}

#[test]
fn a_closing_lid_takes_sun_and_sky_away() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = lit();
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene).expect("it fits");
    uploaded.trace(&gpu.device, &gpu.queue, &scene).expect("its rays fit");
    let options = RendererOptions { method: Method::Gather(Default::default()), ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options).expect("the size fits");
    let mut found = Vec::new();
    // The file's bind pose is shut: what stands open does so by its skin alone.
    for time in [1.0, 0.0, 1.0] {
        scene.pose_parts(0, time);
        uploaded.set_placements(&gpu.queue, &scene);
        found.push(draw(&gpu, &mut renderer, &uploaded, &scene.cameras[0], 40));
    }
    println!("direct and indirect light: open {:?}, shut {:?}, open {:?}", found[0], found[1], found[2]);
    let [open, shut, again] = found[..] else { panic!("three") };
    assert!(open[0] > 0.1 && open[1] > 0.1, "the negative control: open it is light");
    // The memory of 40 frames lets a hundredth of the light linger.
    assert!(shut[0] < 1e-4 * open[0] && shut[1] < 0.02 * open[1]);
    assert!((again[0] / open[0] - 1.0).abs() < 0.01 && (again[1] / open[1] - 1.0).abs() < 0.05);
}

#[test]
fn the_path_tracer_sees_the_pose() {
    use bouncelight_lab::reference::{Kernel, Layer as Traced, ReferenceScene, Subject, Tracer, TracerOptions};
    let Some(gpu) = common::gpu() else { return };
    let kernel = Kernel::new(&gpu.device);
    let light = |time: f32| {
        let mut scene = lit();
        scene.pose(0, time);
        let packed = ReferenceScene::new(&gpu.device, &gpu.queue, &scene).expect("it packs");
        let subject = Subject { camera: &scene.cameras[0], size: [16, 16], points: None };
        let options = TracerOptions { samples: 16, layers: vec![Traced::Combined], ..Default::default() };
        let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options).expect("it begins");
        while tracer.step().expect("it goes on") {}
        mean(&tracer.finish().expect("it ends").layers.remove(0).1.chunks_exact(4).map(|p| p[0]).collect::<Vec<_>>())
    };
    let (open, shut) = (light(1.0), light(0.0));
    println!("traced: open {open}, shut {shut}");
    assert!(open > 0.1 && shut < 1e-6);
}

/// A picture of a pose is the same whether vertices were moved by the CPU when the file was read or
/// by the GPU.
#[test]
fn pictures_of_a_pose_are_one_picture() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = strip(10, Coded::Floats);
    bends(&mut scene, 0, 1.0);
    let mut scene = scene.load().expect("it loads");
    scene.materials.iter_mut().for_each(|m| m.double_sided = true);
    let draw = |scene: &Scene| {
        let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("it fits");
        let mut renderer =
            Renderer::new(&gpu.device, &gpu.queue, SIZE, crate::build::direct_only()).expect("the size fits");
        let options = CaptureOptions { layers: &[Layer::Position, Layer::Normal], ..Default::default() };
        let camera = crate::build::look_at([0.5, 1.2, 3.0], [0.0, 1.0, 0.0], 0.9);
        let frame = capture(&gpu, &mut renderer, &uploaded, &camera, options).expect("drawn");
        frame.layers.into_iter().flat_map(|l| l.1.data).collect::<Vec<f32>>()
    };
    let far = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > 4e-3).count();
    let rest = draw(&scene);
    scene.pose(0, 1.0);
    let on_gpu = draw(&scene);
    scene.deforms.clear();
    let on_cpu = draw(&scene);
    assert!(far(&on_gpu, &on_cpu) < 12, "{} numbers differ", far(&on_gpu, &on_cpu));
    let moved = far(&rest, &on_gpu);
    assert!(moved > 150, "the negative control: {moved} numbers differ at rest");
}
