//! A picture of the surroundings with a sun in it: rasteriser and rays have it as a light, and all
//! of its light counts once.

use crate::build::{look_at, material, quad};
use crate::common;
use crate::gather::uploaded;
use crate::world::{self, mean};
use bouncelight::gi::{Method, gather::Options};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, CapturedFrame, Layer, capture};
use bouncelight::scene::environment::EnvironmentImage;
use bouncelight::scene::{Environment, Material, Scene};
use glam::Vec3;

const SIZE: [u32; 2] = [128, 64];
const TOWARDS: Vec3 = Vec3::new(0.5, 0.6, 0.62);

/// A blue sky with a sun of about 2.5 degrees, which gives a few times as much light.
fn sky() -> EnvironmentImage {
    let [width, height] = SIZE;
    let mut image = EnvironmentImage { name: "sky".into(), width, height, rgb: Vec::new() };
    for y in 0..height {
        for x in 0..width {
            let phi = std::f32::consts::TAU * ((x as f32 + 0.5) / width as f32 - 0.5);
            let theta = std::f32::consts::PI * (y as f32 + 0.5) / height as f32;
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let sun = if d.angle_between(TOWARDS) < 0.025 { 1500.0 } else { 0.0 };
            image.rgb.extend([0.2, 0.3 + 0.1 * d.y, 0.5].map(|v| v + sun));
        }
    }
    image
}

/// A floor before a wall, under `sky`; they fill the picture.
fn scene(sky: EnvironmentImage) -> Scene {
    let floor = quad([-8.0, 0.0, -8.0], [0.0, 0.0, 16.0], [16.0, 0.0, 0.0]);
    let wall = quad([-1.0, 0.0, -1.0], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    let mut scene = crate::build::scene(vec![floor, wall], Vec::new());
    scene.materials = vec![Material { f0: 0.0, roughness: 1.0, ..material([0.5; 3]) }];
    scene.cameras = vec![look_at([0.3, 2.6, 1.8], [0.3, 0.3, -0.3], 0.8)];
    scene.environment = Environment::from_image(sky).expect("it is whole");
    scene
}

fn frame(gpu: &Gpu, options: Options, scene: &Scene, uploaded: &SceneGpu, frames: u32) -> CapturedFrame {
    let capturing =
        CaptureOptions { layers: &[Layer::DiffDir, Layer::DiffInd], warmup: frames - 1, ..Default::default() };
    let mut renderer = world::renderer(gpu, [48, 36], Method::Gather(options));
    capture(gpu, &mut renderer, uploaded, &scene.cameras[0], capturing).expect("the frame is drawn")
}

fn all_light(frame: &CapturedFrame) -> Vec<f32> {
    let layer = |l| &frame.layer(l).expect("it was asked for").data;
    layer(Layer::DiffDir).iter().zip(layer(Layer::DiffInd)).map(|(a, b)| a + b).collect()
}

#[test]
fn a_sky_without_its_sun_and_the_sun_are_the_sky() {
    use bouncelight_lab::reference::{Kernel, Layer as Traced, ReferenceScene, Subject, Tracer, TracerOptions};
    let Some(gpu) = common::gpu() else { return };
    let kernel = Kernel::new(&gpu.device);
    let traced = |scene: &Scene| {
        let packed = ReferenceScene::new(&gpu.device, &gpu.queue, scene).expect("it fits");
        let subject = Subject { camera: &scene.cameras[0], size: [48, 36], points: None };
        let layers = vec![Traced::DiffDir, Traced::DiffInd];
        let options = TracerOptions { samples: 256, layers, ..Default::default() };
        let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options).expect("it fits");
        while tracer.step().expect("it traces") {}
        tracer.finish().expect("it traces").layers.iter().map(|(_, data)| mean(data)).sum::<f64>()
    };
    let whole = scene(sky());
    let split = sky().sun().expect("it has a sun");
    let mut apart = scene(split.rest);
    let rest = traced(&apart);
    apart.lights.push(split.light);
    let (truth, both) = (traced(&whole), traced(&apart));
    let gpu_scene = uploaded(&gpu, &whole);
    assert_eq!((gpu_scene.lights.len(), whole.lights.len()), (1, 0));
    let gathered = mean(&all_light(&frame(&gpu, Options::PLAIN, &whole, &gpu_scene, 150)));
    println!("the whole sky {truth:.4}, rest and sun {both:.4}, rest alone {rest:.4}; gathered {gathered:.4}");
    assert!((both / truth - 1.0).abs() < 0.02, "{both} {truth}");
    assert!((gathered / truth - 1.0).abs() < 0.03, "{gathered} {truth}");
    // Negative control: the sun matters.
    assert!(rest < 0.7 * truth);
}

/// The view at the sun shows it, though it is a light.
#[test]
fn the_sun_is_seen_in_the_sky() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = scene(sky());
    scene.cameras[0] = look_at([0.0, 1.0, 3.0], (Vec3::new(0.0, 1.0, 3.0) + TOWARDS).to_array(), 0.3);
    let seen = |scene: &Scene| {
        let gpu_scene = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("it fits");
        let mut renderer = world::renderer(&gpu, [48, 48], Method::Direct);
        let options = CaptureOptions { samples: 16, ..Default::default() };
        let frame = capture(&gpu, &mut renderer, &gpu_scene, &scene.cameras[0], options).expect("the frame is drawn");
        mean(&frame.beauty.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect::<Vec<_>>())
    };
    let image = sky();
    let eye = &scene.cameras[0].transform;
    let (mut expected, side) = (0.0, 480);
    for k in 0..side * side {
        let at = |i: i32| (2.0 * (i as f32 + 0.5) / side as f32 - 1.0) * (0.15f32).tan();
        let (x, y) = (at(k % side), at(k / side));
        let d = Vec3::from_slice(&eye[0]) * x + Vec3::from_slice(&eye[1]) * y - Vec3::from_slice(&eye[2]);
        expected += image.radiance(d.normalize().to_array()).iter().map(|v| f64::from(*v) / 3.0).sum::<f64>();
    }
    expected /= f64::from(side * side);
    let found = seen(&scene);
    println!("{found:.3} are seen, {expected:.3} are there");
    assert!((found / expected - 1.0).abs() < 0.03, "{found} {expected}");
    // Negative control: what is left without the sun is far less.
    scene.environment = Environment::from_image(image.sun().expect("it has one").rest).expect("it is whole");
    assert!(seen(&scene) < 0.5 * expected);
}

#[test]
fn a_cold_frame_is_quieter_without_a_sun_in_the_sky() {
    let Some(gpu) = common::gpu() else { return };
    let scene = scene(sky());
    let split = uploaded(&gpu, &scene);
    // The same sky with the sun left in it.
    let mut rest = scene.clone();
    rest.environment = Environment::from_image(sky().sun().expect("it has one").rest).expect("it is whole");
    let mut left = uploaded(&gpu, &rest);
    let [width, height] = SIZE;
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("sky"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let texels: Vec<[f32; 4]> = sky().rgb.chunks_exact(3).map(|p| [p[0], p[1], p[2], 0.0]).collect();
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width), rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, size);
    left.environment_view = texture.create_view(&Default::default());

    let plain = Options { blur: false, ..Options::default() };
    let variance = |gpu_scene: &SceneGpu| {
        let cold = all_light(&frame(&gpu, plain, &scene, gpu_scene, 1));
        let truth = all_light(&frame(&gpu, Options::PLAIN, &scene, &split, 200));
        cold.iter().zip(&truth).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / cold.len() as f64
    };
    let (with, without) = (variance(&split), variance(&left));
    println!("variance of a cold frame: {with:.5} with the sun as a light, {without:.5} with it in the sky");
    assert!(without > 20.0 * with, "{without} {with}");
}
