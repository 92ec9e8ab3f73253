//! What glows lights each place exactly once in `gather`: seen through holes, mirrored, and with
//! lights that stand in for it.

use crate::build::{look_at, material, quad};
use crate::common;
use crate::gather::uploaded;
use crate::world::{self, difference, mean};
use bouncelight::gi::{Method, gather::Options};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::Renderer;
use bouncelight::render::capture::{CaptureOptions, CapturedFrame, Layer, capture};
use bouncelight::scene::{AlphaMode, Camera, Light, LightKind, Material, Mesh, Scene};
use bouncelight_scene::defaults;

const PLAIN: Method = Method::Gather(Options { slots: world::FEW_SLOTS, ..Options::PLAIN });

fn matte(albedo: f32) -> Material {
    Material { f0: 0.0, roughness: 1.0, double_sided: false, ..material([albedo; 3]) }
}

/// Meshes with a material each.
fn of_parts(parts: Vec<(Mesh, Material)>, camera: Camera) -> Scene {
    let (mut meshes, mut materials) = (Vec::new(), Vec::new());
    for (i, (mut mesh, material)) in parts.into_iter().enumerate() {
        mesh.material = i;
        meshes.push(mesh);
        materials.push(material);
    }
    let mut scene = crate::build::scene(meshes, Vec::new());
    scene.materials = materials;
    scene.cameras = vec![camera];
    scene
}

fn renderer(gpu: &Gpu, size: [u32; 2]) -> Renderer {
    world::renderer(gpu, size, PLAIN)
}

/// The last of some frames of a scene that `renderer` has not drawn before.
fn frame(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene, uploaded: &SceneGpu, frames: u32) -> CapturedFrame {
    let layers = &[Layer::DiffDir, Layer::DiffInd, Layer::Position];
    let options = CaptureOptions { layers, warmup: frames - 1, ..Default::default() };
    capture(gpu, renderer, uploaded, &scene.cameras[0], options).expect("the frame is drawn")
}

fn layer(frame: &CapturedFrame, layer: Layer) -> &[f32] {
    &frame.layer(layer).expect("it was asked for").data
}

/// A wide sheet close above a floor, so that light samples and rays that happen to meet it share
/// the work.
#[test]
fn a_sheet_with_holes_sends_what_its_coverage_says() {
    let Some(gpu) = common::gpu() else { return };
    let (half, height, glow) = (1.5f32, 0.9f32, 2.0f32);
    let build = |coverage: f32| {
        let (base_color, alpha_mode) = ([0.0, 0.0, 0.0, coverage], AlphaMode::Blend);
        let sheet = Material { emissive: [glow; 3], base_color, alpha_mode, ..matte(0.0) };
        let floor = quad([-4.0, 0.0, -4.0], [0.0, 0.0, 8.0], [8.0, 0.0, 0.0]);
        let down = quad([-half, height, -half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, 2.0 * half]);
        of_parts(vec![(floor, matte(0.02)), (down, sheet)], look_at([0.0, 0.8, 2.6], [0.0, 0.0, -0.2], 0.8))
    };
    // Mean over what is in view of the light, over that by arithmetic for a sheet without holes.
    let mut renderer = renderer(&gpu, [96, 72]);
    let mut share = |coverage: f32| {
        let scene = build(coverage);
        let frame = frame(&gpu, &mut renderer, &scene, &uploaded(&gpu, &scene), 100);
        let (mut found, mut expected) = (0.0, 0.0);
        for (e, p) in layer(&frame, Layer::DiffInd).chunks_exact(3).zip(layer(&frame, Layer::Position).chunks_exact(3))
        {
            // The background is said to be at the origin.
            if p[1].abs() > 1e-3 || *p == [0.0; 3] {
                continue;
            }
            found += f64::from(e[0]);
            // E/π, by the midpoints of 60 × 60 squares.
            let side = 2.0 * half / 60.0;
            for k in 0..3600 {
                let [x, z] = [k / 60, k % 60].map(|i| side * (i as f32 + 0.5) - half);
                let d2 = (x - p[0]).powi(2) + height * height + (z - p[2]).powi(2);
                expected += f64::from(side * side * glow * height * height / (d2 * d2)) / std::f64::consts::PI;
            }
        }
        found / expected
    };
    let (whole, holes, few) = (share(1.0), share(128.0 / 255.0), share(26.0 / 255.0));
    println!("a sheet's light: whole {whole:.4}, half {holes:.4}, a tenth {few:.4}");
    assert!((whole - 1.0).abs() < 0.015, "{whole}");
    assert!((holes / (128.0 / 255.0) - 1.0).abs() < 0.02, "{holes}");
    assert!((few / (26.0 / 255.0) - 1.0).abs() < 0.04, "{few}");
}

/// A closed room of 4 m with six glowing panels, of which four have lights that stand in for them.
fn six_panels() -> Scene {
    let wall = |c: [f32; 3], u: [f32; 3], v: [f32; 3]| (quad(c, u, v), matte(0.5));
    let (x, y, z) = ([4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]);
    let mut parts = vec![
        wall([-2.0, 0.0, -2.0], z, x),
        wall([-2.0, 4.0, -2.0], x, z),
        wall([-2.0, 0.0, -2.0], x, y),
        wall([-2.0, 0.0, 2.0], y, x),
        wall([-2.0, 0.0, -2.0], y, z),
        wall([2.0, 0.0, -2.0], z, y),
    ];
    for i in 0..6 {
        let at = [-1.6 + 1.2 * (i % 3) as f32, 3.6, -1.4 + 1.8 * (i / 3) as f32];
        let panel = quad(at, [0.5, 0.0, 0.0], [0.0, 0.0, 0.4 + 0.02 * i as f32]);
        parts.push((panel, Material { emissive: [3.0, 2.0, 1.0], ..matte(0.3) }));
    }
    let mut scene = of_parts(parts, look_at([1.7, 1.5, 1.7], [-0.8, 0.8, -1.0], 1.2));
    defaults::complete(&mut scene);
    assert_eq!(scene.lights.iter().filter(|l| l.is_emissive_proxy).count(), 4);
    scene
}

#[test]
fn six_panels_light_a_room_once_each() {
    use bouncelight_lab::reference::{Kernel, Layer as Traced, ReferenceScene, Subject, Tracer, TracerOptions};
    let Some(gpu) = common::gpu() else { return };
    let scene = six_panels();
    let sum = |f: &CapturedFrame| mean(layer(f, Layer::DiffDir)) + mean(layer(f, Layer::DiffInd));
    let mut renderer = renderer(&gpu, [32, 24]);
    let gathered = frame(&gpu, &mut renderer, &scene, &uploaded(&gpu, &scene), 600);
    let packed = ReferenceScene::new(&gpu.device, &gpu.queue, &scene).expect("it fits");
    let kernel = Kernel::new(&gpu.device);
    let subject = Subject { camera: &scene.cameras[0], size: [32, 24], points: None };
    let options = TracerOptions { samples: 256, layers: vec![Traced::DiffDir, Traced::DiffInd], ..Default::default() };
    let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options).expect("it fits");
    while tracer.step().expect("it traces") {}
    let traced = tracer.finish().expect("it traces");
    let truth: f64 = traced.layers.iter().map(|(_, data)| mean(data)).sum();
    println!("six panels: {:.4}, traced {truth:.4}", sum(&gathered));
    assert!((sum(&gathered) / truth - 1.0).abs() < 0.02, "{} {truth}", sum(&gathered));
    assert!(layer(&gathered, Layer::DiffDir).iter().all(|v| *v == 0.0), "no lamp is left");
    // Negative control: lamps that are lamps shine beside the panels.
    let mut both = scene.clone();
    both.lights.iter_mut().for_each(|l| l.is_emissive_proxy = false);
    assert!(sum(&frame(&gpu, &mut renderer, &both, &uploaded(&gpu, &both), 60)) > 1.3 * truth);
    // Where there are no rays, the lamps stand in.
    let plain = SceneGpu::new(&gpu.device, &gpu.queue, &scene).expect("it fits");
    assert!(mean(layer(&frame(&gpu, &mut renderer, &scene, &plain, 1), Layer::DiffDir)) > 0.2 * truth);
}

/// A closed room of 8×3×4 m, whose ceiling or floor has a picture of 64×64 texels.
fn pictured(ceiling: bool, texel: impl Fn(usize, usize) -> [u8; 3]) -> Scene {
    use bouncelight::scene::{ColorSpace, Image, Sampler, TextureRef};
    let (x, y, z) = ([8.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]);
    let walls = [
        quad([-4.0, 3.0, -2.0], x, z),
        quad([-4.0, 0.0, 2.0], x, [0.0, 0.0, -4.0]),
        quad([-4.0, 0.0, -2.0], x, y),
        quad([-4.0, 0.0, 2.0], y, x),
        quad([-4.0, 0.0, -2.0], y, z),
        quad([4.0, 0.0, -2.0], z, y),
    ];
    let mut parts: Vec<_> =
        walls.into_iter().map(|wall| (wall, Material { double_sided: true, ..matte(0.7) })).collect();
    let sampler = Sampler { mag_linear: false, min_linear: false, ..Sampler::default() };
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let texture = Some(TextureRef { image: 0, sampler, uv_set: 0, transform });
    if ceiling {
        (parts[0].1.emissive, parts[0].1.emissive_texture) = ([10.0; 3], texture);
    } else {
        (parts[1].1.base_color, parts[1].1.base_color_texture) = ([1.0; 4], texture);
    }
    let mut scene = of_parts(parts, look_at([0.0, 1.5, 1.95], [0.0, 1.5, 0.0], 1.2));
    let rgba = (0..64 * 64).flat_map(|i| texel(i % 64, i / 64).into_iter().chain([255])).collect();
    let (name, color_space) = (String::new(), ColorSpace::Linear);
    scene.images = vec![Image { name, width: 64, height: 64, rgba, color_space }];
    scene
}

/// Red, green and blue of what the back wall gets at its left, in its middle and at its right.
fn thirds(light: &[f32]) -> [[f64; 3]; 3] {
    [7..20, 41..55, 76..89].map(|columns| {
        let all = (14..34).flat_map(|y| columns.clone().map(move |x| 96 * y + x));
        std::array::from_fn(|c| mean(&all.clone().map(|i| light[3 * i + c]).collect::<Vec<_>>()))
    })
}

/// The largest share by which any of them differs, of the mean of its place in the truth.
fn apart(found: [[f64; 3]; 3], truth: [[f64; 3]; 3]) -> f64 {
    let place = |(f, t): (&[f64; 3], &[f64; 3])| {
        let all = t.iter().sum::<f64>() / 3.0;
        f.iter().zip(t).map(|(f, t)| (f - t).abs() / all).fold(0.0, f64::max)
    };
    found.iter().zip(&truth).map(place).fold(0.0, f64::max)
}

/// By the path tracer, which reads pictures where paths meet them.
fn traced(gpu: &Gpu, scene: &Scene) -> [[f64; 3]; 3] {
    use bouncelight_lab::reference::{Kernel, Layer as Traced, ReferenceScene, Subject, Tracer, TracerOptions};
    let packed = ReferenceScene::new(&gpu.device, &gpu.queue, scene).expect("it fits");
    let kernel = Kernel::new(&gpu.device);
    let subject = Subject { camera: &scene.cameras[0], size: [96, 48], points: None };
    let options = TracerOptions { samples: 128, layers: vec![Traced::Gi], ..Default::default() };
    let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options).expect("it fits");
    while tracer.step().expect("it traces") {}
    thirds(tracer.finish().expect("it traces").layer(Traced::Gi).expect("asked for"))
}

fn gathered(gpu: &Gpu, scene: &Scene) -> [[f64; 3]; 3] {
    let method = Method::Gather(Options::default());
    let mut renderer = world::renderer(gpu, [96, 48], method);
    let found = thirds(layer(&frame(gpu, &mut renderer, scene, &uploaded(gpu, scene), 32), Layer::DiffInd));
    println!("found {found:.3?}");
    found
}

/// The scene, its picture one colour.
fn blurred(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let rgba = &mut scene.images[0].rgba;
    let mean: Vec<u8> =
        (0..4).map(|c| (rgba.iter().skip(c).step_by(4).map(|v| u64::from(*v)).sum::<u64>() / 4096) as u8).collect();
    rgba.chunks_exact_mut(4).for_each(|p| p.copy_from_slice(&mean));
    scene
}

#[test]
fn a_window_in_a_picture_glows_where_it_is() {
    let Some(gpu) = common::gpu() else { return };
    let scene = pictured(true, |x, _| [if x < 8 { 255 } else { 0 }; 3]);
    // The same of two quads, of which one glows.
    let mut cut = scene.clone();
    let glow = Material { emissive_texture: None, ..cut.materials[0].clone() };
    cut.materials[0] = Material { emissive: [0.0; 3], ..glow.clone() };
    cut.materials.push(glow);
    cut.meshes[0] = quad([-3.0, 3.0, -2.0], [7.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
    cut.meshes.push(Mesh { material: 6, ..quad([-4.0, 3.0, -2.0], [1.0, 0.0, 0.0], [0.0, 0.0, 4.0]) });
    let place = bouncelight::scene::Instance { mesh: 6, ..cut.instances[0].clone() };
    cut.instances.push(place);
    let truth = traced(&gpu, &cut);
    println!("truth {truth:.3?}");
    let reference = apart(traced(&gpu, &scene), truth);
    let found = apart(gathered(&gpu, &scene), truth);
    println!("a window: reference {reference:.3}, gather {found:.3}");
    assert!(reference < 0.05 && found < 0.1, "{reference} {found}");
    // Negative control: a ceiling that glows all over.
    assert!(apart(gathered(&gpu, &blurred(&scene)), truth) > 0.4);
    // So does the lamp that stands in for it where there are no rays.
    let lamp = |s: &Scene| match defaults::proxy_lights(s)[..] {
        [Light { kind: LightKind::Spot { position: [x, _, z], intensity, radius, .. }, .. }] => {
            [x, z, intensity, radius]
        }
        _ => panic!("one lamp"),
    };
    let far = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(far(lamp(&scene), lamp(&cut)) < 0.1, "{:?} {:?}", lamp(&scene), lamp(&cut));
    assert!(far(lamp(&blurred(&scene)), lamp(&cut)) > 3.0);
}

#[test]
fn a_floor_of_two_colours_bounces_both() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = pictured(false, |x, _| if x < 32 { [184, 2, 2] } else { [2, 2, 184] });
    scene.lights = vec![crate::build::point([0.0, 2.7, 0.0], 30.0, 0.02)];
    let truth = traced(&gpu, &scene);
    let found = apart(gathered(&gpu, &scene), truth);
    println!("a floor: {found:.3} of {truth:.3?}");
    assert!(found < 0.1, "{found}");
    // Negative control: a purple floor.
    assert!(apart(gathered(&gpu, &blurred(&scene)), truth) > 0.15);
}

/// A glowing wedge as `turn` changes its corners, as geometry or by its instance's transform.
fn wedge(turn: [f32; 3], by_instance: bool, reversed: bool) -> Scene {
    let floor = quad([-4.0, 0.0, -4.0], [0.0, 0.0, 8.0], [8.0, 0.0, 0.0]);
    let mut panel = quad([0.3, 0.4, -0.8], [0.2, 1.3, 0.1], [0.3, 0.1, 1.7]);
    let glow = Material { emissive: [4.0, 2.0, 1.0], ..matte(0.4) };
    if !by_instance {
        panel.positions.iter_mut().for_each(|p| (0..3).for_each(|k| p[k] *= turn[k]));
        panel.normals.iter_mut().for_each(|n| (0..3).for_each(|k| n[k] *= turn[k]));
        if reversed {
            panel.indices.chunks_exact_mut(3).for_each(|t| t.swap(1, 2));
        }
    }
    let mut scene = of_parts(vec![(floor, matte(0.5)), (panel, glow)], look_at([0.0, 3.0, 3.0], [0.0; 3], 1.0));
    if by_instance {
        (0..3).for_each(|k| scene.instances[1].transform[k][k] = turn[k]);
    }
    scene
}

#[test]
fn a_mirrored_instance_lights_as_its_mirrored_geometry() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = renderer(&gpu, [32, 24]);
    let mut light =
        |scene: &Scene| layer(&frame(&gpu, &mut renderer, scene, &uploaded(&gpu, scene), 60), Layer::DiffInd).to_vec();
    for turn in [[-1.0, 1.0, 1.0], [-1.0, 1.0, -0.7], [1.0, 1.0, -1.3]] {
        let mirrored = turn.iter().product::<f32>() < 0.0;
        let (instance, geometry) = (light(&wedge(turn, true, false)), light(&wedge(turn, false, mirrored)));
        println!("{turn:?}: {:.4} apart", difference(&instance, &geometry));
        assert!(mean(&geometry) > 0.01 && difference(&instance, &geometry) < 0.02);
        // Negative control: the other side glows where the corners' order is not what it should be.
        assert!(difference(&light(&wedge(turn, false, !mirrored)), &geometry) > 0.2);
    }
}

#[test]
fn triangles_that_cannot_be_are_not_there() {
    let Some(gpu) = common::gpu() else { return };
    let good = wedge([1.0; 3], true, false);
    let mut bad = good.clone();
    // Of the floor and of the panel: triangles with NaN, with infinity, far out, and without area.
    for mesh in &mut bad.meshes {
        let odd = |v: f32| [[v, 1.0, 0.0], [1.0, v, 0.0], [0.0, 1.0, v]];
        for corners in [odd(f32::NAN), odd(f32::INFINITY), odd(1e30), [[0.5; 3]; 3]] {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(corners);
            mesh.normals.extend([[0.0, 1.0, 0.0]; 3]);
            if !mesh.uv0.is_empty() {
                mesh.uv0.extend([[0.0; 2]; 3]);
            }
            mesh.indices.extend([first, first + 1, first + 2]);
        }
    }
    // The picture's part may clip what is far out in its own way, so both are drawn with the good
    // one's.
    let mut renderer = renderer(&gpu, [32, 24]);
    let mut light = |rays_of: &Scene| {
        let mut scene = uploaded(&gpu, &good);
        scene.trace(&gpu.device, &gpu.queue, rays_of).expect("the rest fits");
        let frame = frame(&gpu, &mut renderer, &good, &scene, 40);
        (layer(&frame, Layer::DiffInd).to_vec(), scene.rays.as_ref().expect("it was made").counts())
    };
    let ((clean, _), (light, counts)) = (light(&good), light(&bad));
    assert!(light.iter().all(|v| v.is_finite()) && mean(&clean) > 0.01);
    assert_eq!((counts.instances, counts.left_out, counts.emitters), (2, 0, 2), "{counts:?}");
    println!("{:.4} apart", difference(&light, &clean));
    assert!(difference(&light, &clean) < 0.02);
}
