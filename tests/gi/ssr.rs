//! Reflections of bounced light under a given diffuse light: even light, a mirror, darkness,
//! linearity.

use crate::build::{floor, look_at, material, quad, scene};
use crate::shot::{Write, texture_with};
use crate::{common, read_light};
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Layer, capture};
use bouncelight::render::ssr::{SsrInputs, SsrPass};
use bouncelight::render::{Renderer, RendererOptions, View};
use bouncelight::scene::{Camera, Environment, Scene};
use half::f16;

const SIZE: [u32; 2] = [128, 96];

/// Copies `source` into the target `indirect`, which takes no copies.
fn give(gpu: &Gpu, recorder: &mut Recorder<'_>, source: &wgpu::Texture, target: &wgpu::TextureView) {
    let write = Write::new(&gpu.device, source, wgpu::TextureFormat::Rgba16Float);
    let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
    let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
    recorder.render("given", &[Some(attachment)], None, |pass| write.draw(pass));
}

/// `indirect_specular` and the colour of the lobe (GlossCol) of each pixel, when `light` gives the
/// diffuse light.
fn shine(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    size: [u32; 2],
    light: impl Fn(usize) -> [f32; 3],
) -> (Vec<[f32; 3]>, Vec<f32>) {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let uploaded = SceneGpu::new(device, queue, scene).expect("the scene uploads");
    let options = RendererOptions { method: Method::Direct, ..Default::default() };
    let mut renderer = Renderer::new(device, queue, size, options).expect("the size is fine");
    let layers = CaptureOptions { layers: &[Layer::GlossCol], ..Default::default() };
    let frame = capture(gpu, &mut renderer, &uploaded, camera, layers).expect("draws");
    let color = frame.layer(Layer::GlossCol).expect("asked for").data.clone();
    let texels: Vec<f16> =
        (0..(size[0] * size[1]) as usize).flat_map(|i| light(i).into_iter().chain([1.0]).map(f16::from_f32)).collect();
    let given = texture_with(device, queue, size, wgpu::TextureFormat::Rgba16Float, bytemuck::cast_slice(&texels));
    let mut pass = SsrPass::new(device);
    let picture = pass.picture(device, renderer.frame(), renderer.targets());
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(&mut encoder);
    renderer.record(&mut recorder, queue, &uploaded, &View::new(camera, size, [0.0; 2])).expect("draws");
    give(gpu, &mut recorder, &given, &renderer.targets().indirect.view);
    let inputs = SsrInputs { picture: &picture, sky: &uploaded.environment_view };
    pass.record(&mut recorder, inputs, size);
    queue.submit([encoder.finish()]);
    (read_light(gpu, &renderer.targets().indirect_specular.texture), color)
}

/// A floor of roughness `roughness` that mirrors a glowing square standing on its far side.
fn mirror(roughness: f32, glow: [f32; 3]) -> (Scene, Camera) {
    let square = quad([-1.0, 1.0, -2.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let mut s = scene(vec![floor(8.0, 0.0), square], vec![]);
    s.materials = vec![material([1.0; 3]), material([0.0; 3])];
    (s.materials[0].metallic, s.materials[0].roughness) = (1.0, roughness);
    s.materials[1].emissive = glow;
    s.meshes[1].material = 1;
    s.environment = Environment::constant([0.0; 3]);
    (s, look_at([0.0, 1.5, 4.0], [0.0, 0.9, -2.0], 0.9))
}

#[test]
fn even_light_gives_exactly_the_split_sum() {
    let Some(gpu) = common::gpu() else { return };
    // A white room that everything lights evenly: each surface sends out what it receives.
    for roughness in [0.0, 0.15, 0.5, 0.8, 1.0] {
        for metallic in [0.0, 1.0] {
            let wall = quad([-8.0, 0.0, -4.0], [16.0, 0.0, 0.0], [0.0, 3.0, 0.0]);
            let mut s = scene(vec![floor(8.0, 0.0), wall], vec![]);
            // The wall sends on all that it receives; metal only as well as the split sum's fit has
            // it.
            s.materials.push(s.materials[0].clone());
            s.meshes[1].material = 1;
            (s.materials[0].metallic, s.materials[0].roughness) = (metallic, roughness);
            s.environment = Environment::constant([0.5; 3]);
            let camera = look_at([0.0, 1.5, 3.0], [0.3, 1.0, -4.0], 0.9);
            let (specular, share) = shine(&gpu, &s, &camera, SIZE, |_| [0.5; 3]);
            let off = |light: f32| {
                let pairs = specular.iter().flatten().zip(&share);
                pairs.map(|(l, c)| (l - light * c).abs()).fold(0.0, f32::max)
            };
            // Albedo and F0 have eight bits, and the share of a lobe and its diffuse rest add up to
            // 1 only so far.
            assert!(off(0.5) < 0.02, "roughness {roughness}, metallic {metallic}: {}", off(0.5));
            assert!(off(0.55) > 0.03 || metallic == 0.0, "a tenth more is noticed");
        }
    }
}

/// What a GGX metal of reflectance `f0` shows of even light at the cosine `c`, the light that
/// single scattering loses given back (Kulla and Conty 2017) or not: numerical integrals over
/// visible normals (Dupuy and Benyoub 2023), height-correlated Smith.
pub fn metal(f0: f64, roughness: f64, c: f64, again: bool) -> f64 {
    let single = |c: f64| {
        let (alpha, steps) = (roughness * roughness, 48);
        let a2 = alpha * alpha;
        let s = (1.0 - c * c).sqrt();
        let w = glam::DVec3::new(s * alpha, 0.0, c).normalize();
        let (mut kept, mut rim) = (0.0, 0.0);
        for i in 0..steps * steps {
            let (u, v) =
                ((f64::from(i % steps) + 0.5) / f64::from(steps), (f64::from(i / steps) + 0.5) / f64::from(steps));
            let z = (1.0 - v) * (1.0 + w.z) - w.z;
            let r = (1.0 - z * z).max(0.0).sqrt();
            let phi = std::f64::consts::TAU * u;
            let cap = glam::DVec3::new(r * phi.cos(), r * phi.sin(), z) + w;
            let h = glam::DVec3::new(cap.x * alpha, cap.y * alpha, cap.z).normalize();
            let v_h = s * h.x + c * h.z;
            let l = 2.0 * v_h * h.z - c;
            if l <= 0.0 {
                continue;
            }
            let g = |x: f64| (x * x * (1.0 - a2) + a2).sqrt();
            let part = l * (c + g(c)) / (l * g(c) + c * g(l)) / f64::from(steps * steps);
            kept += part;
            rim += part * (1.0 - v_h).max(0.0).powi(5);
        }
        (kept, rim)
    };
    let (kept, rim) = single(c);
    let once = f0 * (kept - rim) + rim;
    if !again {
        return once;
    }
    let mean = (0..32).map(|i| (f64::from(i) + 0.5) / 32.0).map(|x| 2.0 * x * single(x).0 / 32.0).sum::<f64>();
    let fresnel = f0 + (1.0 - f0) / 21.0;
    once * (1.0 + fresnel * mean / (1.0 - fresnel * (1.0 - mean)) * (1.0 - kept) / kept)
}

#[test]
fn rough_metals_keep_the_light_that_is_scattered_twice() {
    let Some(gpu) = common::gpu() else { return };
    let color = [1.0, 0.75, 0.35];
    for roughness in [0.3_f32, 0.5, 0.7, 1.0] {
        let mut s = scene(vec![floor(8.0, 0.0)], vec![]);
        (s.materials[0].metallic, s.materials[0].roughness, s.materials[0].base_color) =
            (1.0, roughness, [color[0], color[1], color[2], 1.0]);
        for (height, away) in [(3.0_f32, 1.0_f32), (1.0, 3.0)] {
            let camera = look_at([0.0, height, away], [0.0, 0.0, 0.0], 0.01);
            let (_, share) = shine(&gpu, &s, &camera, [5, 5], |_| [0.5; 3]);
            let c = f64::from(height / height.hypot(away));
            for i in 0..3 {
                let found = f64::from(share[3 * 12 + i]);
                let (expected, once) = (
                    metal(f64::from(color[i]), f64::from(roughness), c, true),
                    metal(f64::from(color[i]), f64::from(roughness), c, false),
                );
                assert!(
                    (found - expected).abs() < 0.015,
                    "roughness {roughness}, cosine {c:.2}: {found} of {expected}"
                );
                // Negative control: what is scattered once is clearly less.
                assert!(roughness < 0.7 || i > 0 || found > once + 0.1, "{found} must lie above {once}");
            }
        }
    }
}

#[test]
fn a_mirror_shows_what_stands_behind_it_at_the_right_place() {
    let Some(gpu) = common::gpu() else { return };
    let glow = [2.0, 0.0, 0.5];
    let (s, camera) = mirror(0.05, glow);
    let (specular, share) = shine(&gpu, &s, &camera, SIZE, |_| [0.0; 3]);
    // Where the picture of the mirrored square is: its corners below the floor, seen through the
    // same camera.
    let view = View::new(&camera, SIZE, [0.0; 2]).matrices();
    let matrix =
        glam::Mat4::from_cols_array_2d(&view.clip_from_view) * glam::Mat4::from_cols_array_2d(&view.view_from_world);
    let place = |p: glam::Vec3| {
        let q = matrix.project_point3(p);
        [(0.5 + 0.5 * q.x) * SIZE[0] as f32, (0.5 - 0.5 * q.y) * SIZE[1] as f32]
    };
    let ([x0, y0], [x1, y1]) = (place(glam::Vec3::new(-1.0, -1.0, -2.0)), place(glam::Vec3::new(1.0, -2.0, -2.0)));
    let (mut inside, mut outside) = (0, 0);
    for (i, texel) in specular.iter().enumerate() {
        let (x, y) = ((i as u32 % SIZE[0]) as f32 + 0.5, (i as u32 / SIZE[0]) as f32 + 0.5);
        let margin = 1.5;
        let is_in = x > x0 + margin && x < x1 - margin && y > y0 + margin && y < y1 - margin;
        let is_out = x < x0 - margin || x > x1 + margin || y < y0 - margin || y > y1 + margin;
        if is_in {
            inside += 1;
            for c in 0..3 {
                let expected = glow[c] * share[3 * i + c];
                assert!((texel[c] - expected).abs() < 0.03, "({x}, {y}): {texel:?}, expected {expected}");
            }
        } else if is_out && share[3 * i] > 0.0 && texel[0] > 0.2 {
            outside += 1;
        }
    }
    assert!(inside > 100, "{inside} pixels of the mirrored square");
    // Everything has a depth of 5 % of its distance, so the square's rims are a little wide.
    assert!(outside * 4 < inside, "{outside} of {inside} pixels glow that should not");
}

#[test]
fn reflections_are_linear_and_none_without_light() {
    let Some(gpu) = common::gpu() else { return };
    for roughness in [0.05, 0.5] {
        let run = |k: f32| {
            let (s, camera) = mirror(roughness, [2.0 * k, 0.5 * k, 0.25 * k]);
            shine(&gpu, &s, &camera, SIZE, |i| [k * (i % 7) as f32 / 8.0; 3]).0
        };
        let (one, two, none) = (run(1.0), run(2.0), run(0.0));
        assert!(none.iter().flatten().all(|x| *x == 0.0), "no light, no reflection");
        let brightest = one.iter().flatten().copied().fold(0.0, f32::max);
        let off = one.iter().flatten().zip(two.iter().flatten()).map(|(a, b)| (2.0 * a - b).abs()).fold(0.0, f32::max);
        assert!(brightest > 0.1 && off < 4e-3 * brightest, "twice the light, twice the reflection: {off}");
    }
}

#[test]
fn a_rough_floor_is_brighter_under_the_glow() {
    let Some(gpu) = common::gpu() else { return };
    let (s, camera) = mirror(0.5, [2.0; 3]);
    let (specular, _) = shine(&gpu, &s, &camera, SIZE, |_| [0.0; 3]);
    let at = |x: u32, y: u32| specular[(y * SIZE[0] + x) as usize][0];
    assert!(at(64, 70) > 10.0 * at(8, 90).max(1e-3), "{} {}", at(64, 70), at(8, 90));
}
