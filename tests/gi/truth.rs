//! Every method against a path-traced picture: 64×32 points of four rooms, each with 4,096 paths
//! (`tests/fixtures/truth`).
//!
//! The fixtures are made by `cargo test --release --test gi -- --ignored make_the_truth`.

use crate::common;
use bouncelight::gi::Method;
use bouncelight::gi::inputs::{cells_of, sample_pixel};
use bouncelight::gpu::Gpu;
use bouncelight::gpu::timing::Recorder;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{Renderer, RendererOptions, View};
use bouncelight::scene::{LightKind, Scene};
use bouncelight_lab::reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use std::collections::HashMap;
use std::path::PathBuf;

const SIZE: [u32; 2] = [256, 128];
const PATHS: u32 = 4096;
const SEED: u32 = 20;

/// Frames of a still camera before `gather` is read.
const FRAMES: u32 = 32;

/// One of the paper's rooms, an interior with windows, the same at night, and the room with metal
/// in it.
fn rooms() -> [(&'static str, Scene); 4] {
    let room = || bouncelight_lab::scenes::load("paper-room:7").expect("made by code");
    let interior = || bouncelight_lab::scenes::load("interior").expect("bundled");
    let mut night = interior();
    night.environment.radiance = [0.0; 3];
    night.environment.image = None;
    night.lights.retain(|l| !matches!(l.kind, LightKind::Directional { .. }));
    let mut metal = room();
    for material in metal.materials.iter_mut().step_by(3) {
        (material.metallic, material.roughness) = (1.0, 0.3);
    }
    [("room", room()), ("interior", interior()), ("night", night), ("metal", metal)]
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(format!("tests/fixtures/truth/{name}.safetensors"))
}

/// Pixels at which light is compared, row by row.
fn points() -> Vec<[u32; 2]> {
    let [w, h] = cells_of(SIZE);
    (0..h).flat_map(|y| (0..w).map(move |x| sample_pixel([x, y], SIZE))).collect()
}

/// rgb of each point, E/π.
fn truth(name: &str) -> Vec<f32> {
    let bytes = std::fs::read(path(name)).expect("the fixture is in the repository");
    let file = SafeTensors::deserialize(&bytes).expect("a sound file");
    bytemuck::pod_collect_to_vec(file.tensor("light").expect("it is there").data())
}

#[test]
#[ignore = "makes the fixtures: four minutes on two cores"]
fn make_the_truth() {
    let Some(gpu) = common::gpu() else { return };
    let kernel = Kernel::new(&gpu.device);
    for (name, scene) in rooms() {
        let traced = ReferenceScene::new(&gpu.device, &gpu.queue, &scene).expect("it fits");
        let points: Vec<[f32; 2]> = points().iter().map(|p| p.map(|c| c as f32 + 0.5)).collect();
        let subject = Subject { camera: &scene.cameras[0], size: SIZE, points: Some(&points) };
        let options = TracerOptions { samples: PATHS, seed: SEED, layers: vec![Layer::Gi], ..TracerOptions::default() };
        let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &traced, subject, options).expect("it starts");
        while tracer.step().expect("it goes on") {}
        let picture = tracer.finish().expect("it ends");
        let light = picture.layer(Layer::Gi).expect("asked for").to_vec();
        let noise = picture.noise_of(Layer::Gi).map_or(f64::NAN, |n| n.pixel);
        println!("{name}: a point's noise is {:.2} % of the mean", 100.0 * noise);
        let [w, h] = cells_of(SIZE).map(|n| n as usize);
        let data = bytemuck::cast_slice(&light);
        let view = TensorView::new(Dtype::F32, vec![h, w, 3], data).expect("sizes agree");
        let words = [
            ("command", "cargo test --release --test gi -- --ignored make_the_truth".into()),
            ("device", gpu.sentence()),
            ("paths", PATHS.to_string()),
            ("seed", SEED.to_string()),
            ("noise", format!("{noise:.5}")),
        ];
        let words: HashMap<String, String> = words.into_iter().map(|(k, v)| (k.to_owned(), v)).collect();
        let bytes = safetensors::serialize([("light", view)], Some(words)).expect("serialises");
        std::fs::create_dir_all(path(name).parent().expect("a folder")).expect("writable");
        std::fs::write(path(name), bytes).expect("writable");
    }
}

/// rgb of each point as `method` answers after [`FRAMES`].
fn answer(gpu: &Gpu, method: &Method, scene: &Scene) -> Vec<f32> {
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits");
    uploaded.trace(&gpu.device, &gpu.queue, scene).expect("its rays fit");
    let options = RendererOptions { method: method.clone(), ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options).expect("the size fits");
    for i in 0..if method.has_history() { FRAMES } else { 1 } {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = View::new(&scene.cameras[0], SIZE, [0.0; 2]).with_seed(i);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view).expect("the frame is drawn");
        gpu.queue.submit([encoder.finish()]);
    }
    let texture = &renderer.targets().indirect.texture;
    let bytes = bouncelight::gpu::readback::texture(&gpu.device, &gpu.queue, texture).expect("readable");
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
    let at = |[x, y]: [u32; 2]| 4 * (y * SIZE[0] + x) as usize;
    points().into_iter().flat_map(|p| [0, 1, 2].map(|c| f32::from(halves[at(p) + c]))).collect()
}

/// Means over blocks of 4×4 points, in which the truth has 65,536 paths: its own noise is 0.4 % of
/// them in the room, 6 % at night.
fn blocks(light: &[f32]) -> Vec<f32> {
    let [w, h] = cells_of(SIZE).map(|n| n as usize);
    let mut sums = vec![0.0; 3 * (w / 4) * (h / 4)];
    for (i, value) in light.iter().enumerate() {
        let (x, y, c) = (i / 3 % w, i / 3 / w, i % 3);
        sums[3 * ((y / 4) * (w / 4) + x / 4) + c] += value / 16.0;
    }
    sums
}

/// Σ|Δ| / Σ truth of blocks. Where the truth has no diffuse light at all (metal, the sky) nothing
/// is compared.
fn error(found: &[f32], truth: &[f32]) -> f32 {
    let lit = |i: usize| truth[i / 3 * 3..][..3].iter().any(|v| *v > 0.0);
    let found: Vec<f32> = found.iter().enumerate().map(|(i, v)| if lit(i) { *v } else { 0.0 }).collect();
    let (found, truth) = (blocks(&found), blocks(truth));
    let apart: f32 = found.iter().zip(&truth).map(|(a, b)| (a - b).abs()).sum();
    apart / truth.iter().sum::<f32>()
}

/// Per cent that each method may be off in each room: a fifth more than was found. Those without a
/// row must be no farther off than the first.
const ALLOWED: [(&str, [f32; 4]); 4] = [
    ("ambient", [31.0, 246.0, 104.0, 40.0]),
    ("ssgi", [24.0, 192.0, 90.0, 43.5]),
    ("gather", [2.7, 12.3, 22.0, 18.2]),
    ("neural", [2.9, 11.5, 19.7, 18.1]),
];

#[test]
fn methods_are_as_near_to_the_truth_as_they_were() {
    let Some(gpu) = common::gpu() else { return };
    let methods = common::methods();
    let lit = || methods.iter().filter(|m| !matches!(m, Method::Direct));
    let known = ALLOWED.map(|(of, _)| lit().any(|m| m.name() == of));
    assert_eq!(known, [true; 4], "a row without a method");
    let mut missed = Vec::new();
    // All rooms take a minute on two cores: the first and the night in the ordinary run.
    for (k, (name, scene)) in rooms().into_iter().enumerate().step_by(if common::whole() { 1 } else { 2 }) {
        let truth = truth(name);
        for method in lit() {
            let of = method.name();
            let (_, allowed) = ALLOWED.into_iter().find(|(name, _)| *name == of).unwrap_or(ALLOWED[0]);
            let found = answer(&gpu, method, &scene);
            let off = 100.0 * error(&found, &truth);
            println!("{name}, {of}: {off:.2} %, allowed {} %", allowed[k]);
            if off > allowed[k] {
                missed.push(format!("{name}, {of}: {off} % > {} %", allowed[k]));
            }
            if of != "gather" {
                continue;
            }
            // Negative controls: light that is a fifth too much or too little, and normals on the
            // wrong side, are seen.
            let scaled = |k: f32| error(&found.iter().map(|v| k * v).collect::<Vec<_>>(), &truth);
            assert!(100.0 * scaled(1.2).max(scaled(0.8)) > allowed[k], "{name}: a fifth of the light goes unseen");
            if name == "room" {
                let mut turned = scene.clone();
                turned.meshes.iter_mut().flat_map(|m| &mut m.normals).for_each(|n| *n = n.map(|c| -c));
                assert!(
                    100.0 * error(&answer(&gpu, method, &turned), &truth) > 3.0 * allowed[k],
                    "{name}: turned normals"
                );
            }
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
