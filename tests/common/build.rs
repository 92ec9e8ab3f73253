//! Small scenes made by hand, and a GPU harness around the renderer.

#![allow(dead_code, reason = "each test binary uses a part")]

use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, CapturedFrame, Layer, Picture, capture};
use bouncelight::render::{Blending, Renderer, RendererOptions};
use bouncelight::scene::{Camera, Environment, Instance, Light, LightKind, Material, Mesh, Scene};

pub const IDENTITY: [[f32; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// A white dielectric.
pub fn material(color: [f32; 3]) -> Material {
    Material {
        name: "test".into(),
        base_color: [color[0], color[1], color[2], 1.0],
        metallic: 0.0,
        roughness: 0.5,
        double_sided: true,
        ..Default::default()
    }
}

/// A parallelogram from `corner` along `u` and `v`; its normal is u × v.
pub fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3]) -> Mesh {
    let (c, u, v) = (glam::Vec3::from(corner), glam::Vec3::from(u), glam::Vec3::from(v));
    let n = u.cross(v).normalize().to_array();
    Mesh {
        name: "quad".into(),
        positions: [c, c + u, c + u + v, c + v].map(|p| p.to_array()).to_vec(),
        normals: vec![n; 4],
        uv0: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Default::default()
    }
}

/// A horizontal square that faces up.
pub fn floor(half: f32, y: f32) -> Mesh {
    quad([-half, y, half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, -2.0 * half])
}

/// A scene of meshes with one material, each placed once.
pub fn scene(meshes: Vec<Mesh>, lights: Vec<Light>) -> Scene {
    let instances =
        (0..meshes.len()).map(|mesh| Instance { name: format!("i{mesh}"), mesh, transform: IDENTITY }).collect();
    Scene { name: "test".into(), meshes, instances, materials: vec![material([1.0; 3])], lights, ..Default::default() }
}

pub fn sun(direction: [f32; 3], irradiance: f32, angle: f32) -> Light {
    let direction = glam::Vec3::from(direction).normalize().to_array();
    let kind = LightKind::Directional { direction, irradiance, angle };
    Light { name: "sun".into(), color: [1.0; 3], kind, is_emissive_proxy: false }
}

pub fn point(position: [f32; 3], intensity: f32, radius: f32) -> Light {
    let kind = LightKind::Point { position, intensity, radius, range: None };
    Light { name: "point".into(), color: [1.0; 3], kind, is_emissive_proxy: false }
}

pub fn spot(position: [f32; 3], direction: [f32; 3], inner_angle: f32, outer_angle: f32, radius: f32) -> Light {
    let direction = glam::Vec3::from(direction).normalize().to_array();
    let kind = LightKind::Spot { position, direction, intensity: 60.0, radius, range: None, inner_angle, outer_angle };
    Light { name: "spot".into(), color: [1.0; 3], kind, is_emissive_proxy: false }
}

/// A camera at `eye` that looks at `target`.
pub fn look_at(eye: [f32; 3], target: [f32; 3], yfov: f32) -> Camera {
    let (e, t) = (glam::Vec3::from(eye), glam::Vec3::from(target));
    let up = if (t - e).normalize().y.abs() > 0.99 { glam::Vec3::NEG_Z } else { glam::Vec3::Y };
    let back = (e - t).normalize();
    let right = up.cross(back).normalize();
    let transform =
        glam::Mat4::from_cols(right.extend(0.0), back.cross(right).extend(0.0), back.extend(0.0), e.extend(1.0));
    Camera {
        name: "test".into(),
        transform: transform.to_cols_array_2d(),
        yfov,
        aspect: None,
        near: 0.1,
        far: f32::INFINITY,
    }
}

pub fn corner(lights: Vec<Light>) -> Scene {
    let wall = quad([-8.0, 0.0, -4.0], [16.0, 0.0, 0.0], [0.0, 8.0, 0.0]);
    let mut s = scene(vec![floor(20.0, 0.0), wall, quad([-1.0, 2.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0])], lights);
    s.materials[0].base_color = [0.8, 0.5, 0.2, 1.0];
    s
}

/// Analytic lights alone; what blends is in the layers, by lot.
pub fn direct_only() -> RendererOptions {
    let blending = Blending::Stochastic;
    RendererOptions { method: bouncelight::gi::Method::Direct, blending, ..Default::default() }
}

/// Captures all layers of `scene`.
pub fn render(gpu: &Gpu, scene: &Scene, camera: &Camera, size: [u32; 2], samples: u32) -> CapturedFrame {
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the test's scene uploads");
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, direct_only()).expect("the test's size is fine");
    let options = CaptureOptions { samples, layers: &Layer::ALL, ..Default::default() };
    capture(gpu, &mut renderer, &uploaded, camera, options).expect("capture works")
}

pub fn environment(radiance: f32) -> Environment {
    Environment::constant([radiance; 3])
}

/// Mean of channel 0 over the centre's `n`² pixels.
pub fn center(p: &Picture, n: usize) -> f32 {
    let (x0, y0) = ((p.width - n) / 2, (p.height - n) / 2);
    let sum: f32 = (0..n * n).map(|i| p.at(x0 + i % n, y0 + i / n)[0]).sum();
    sum / (n * n) as f32
}

/// Writes `p` as PNG into the folder that `BOUNCELIGHT_PICTURES` names, for looking at; nothing
/// without it.
pub fn show(name: &str, p: &Picture, scale: f32) {
    let Some(folder) = std::env::var_os("BOUNCELIGHT_PICTURES") else { return };
    let encode = |v: f32| {
        let v = (v * scale).clamp(0.0, 1.0);
        let s = if v <= 0.0031308 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (s * 255.0).round() as u8
    };
    let rgb: Vec<u8> = p
        .data
        .chunks_exact(p.channels)
        .flat_map(|v| if p.channels >= 3 { [v[0], v[1], v[2]] } else { [v[0]; 3] }.map(encode))
        .collect();
    let file = std::fs::File::create(std::path::Path::new(&folder).join(format!("{name}.png"))).unwrap();
    let mut encoder = png::Encoder::new(file, p.width as u32, p.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&rgb).unwrap();
}

/// A floor with two low walls and nothing above: only the sky lights it, evenly.
pub fn open_walls() -> Scene {
    let mut scene = scene(
        vec![
            floor(60.0, 0.0),
            quad([-3.0, 0.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.6, 0.0]),
            quad([1.5, 0.0, 0.5], [1.5, 0.0, -1.0], [0.0, 0.5, 0.0]),
        ],
        Vec::new(),
    );
    scene.materials[0].base_color = [0.3, 0.3, 0.3, 1.0];
    scene.materials[0].roughness = 1.0;
    scene.environment = environment(1.0);
    scene.cameras = vec![look_at([0.0, 2.5, 5.0], [0.0, 0.0, -1.0], 0.9)];
    scene
}
