//! The pass as Rust runs it, on the inputs that `test.py` has drawn: its yardstick.
//!
//!     cargo run --example moderngl_yardstick -- SCENE gather|neural FOLDER
//!
//! FOLDER holds `inputs.json` and for each frame K the textures' bytes as `K.NAME`; the light of
//! the last frame is written there as `rust.output` (`Rgba16Float`, rows from the top).

use bouncelight::gi::Neural;
use bouncelight::gi::{CameraMatrices, Conventions, Depth, Inputs, Lights, Method, Rays, method};
use bouncelight::gpu::{Gpu, GpuOptions, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::format::Weights;
use bouncelight::wgpu::{self, TextureFormat as F};
use std::error::Error;
use std::path::Path;

/// Name and format of each input.
const INPUTS: [(&str, F); 7] = [
    ("depth", F::R32Float),
    ("normal", F::Rg16Float),
    ("albedo", F::Rgba16Float),
    ("emissive", F::Rgba16Float),
    ("direct", F::Rgba16Float),
    ("motion", F::Rg16Float),
    ("specular", F::Rgba8Unorm),
];

/// `inputs.json`: matrices column-major, OpenGL's.
#[derive(serde::Deserialize)]
struct Drawn {
    size: [u32; 2],
    frames: Vec<Camera>,
}

#[derive(serde::Deserialize)]
struct Camera {
    view_from_world: [[f32; 4]; 4],
    clip_from_view: [[f32; 4]; 4],
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [scene, method, folder] = &args[..] else {
        return Err("usage: moderngl_yardstick SCENE gather|neural FOLDER".into());
    };
    let (scene, folder) = (bouncelight_lab::scenes::load(scene)?, Path::new(folder));
    let method = match method.as_str() {
        "neural" => Method::Neural(Box::new(Neural::from(Weights::shipped()?))),
        _ => Method::Gather(Default::default()),
    };
    let drawn: Drawn = serde_json::from_slice(&std::fs::read(folder.join("inputs.json"))?)?;
    let Gpu { device, queue, .. } = &Gpu::open(&GpuOptions::default())?;
    let mut uploaded = SceneGpu::new(device, queue, &scene)?;
    uploaded.trace(device, queue, &scene)?;
    let texture = |format, usage| {
        let [width, height] = drawn.size;
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    };
    let bound = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let textures = INPUTS.map(|(_, format)| texture(format, bound));
    let output = texture(F::Rgba16Float, wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC);
    let view = |t: &wgpu::Texture| t.create_view(&Default::default());
    let views = textures.each_ref().map(view);
    let [depth, normal, albedo, emissive, direct, motion, specular] = &views;
    let output_view = view(&output);
    let mut technique = method::build(device, queue, drawn.size, &method)?.ok_or("no light to add")?;
    for (k, camera) in drawn.frames.iter().enumerate() {
        for (texture, (name, format)) in textures.iter().zip(INPUTS) {
            let bytes = std::fs::read(folder.join(format!("{k}.{name}")))?;
            let row = drawn.size[0] * format.block_copy_size(None).unwrap_or(0);
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
            queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
        }
        let matrices =
            CameraMatrices { view_from_world: camera.view_from_world, clip_from_view: camera.clip_from_view };
        let inputs = Inputs {
            albedo: Some(albedo),
            emissive: Some(emissive),
            direct: Some(direct),
            motion: Some(motion),
            specular: Some(specular),
            conventions: Conventions { depth: Depth::ForwardGl, ..Default::default() },
            environment: uploaded.environment.radiance,
            lights: Some(Lights {
                buffer: &uploaded.light_buffer,
                count: uploaded.lights.len() as u32,
                has_emissive_proxies: false,
                version: uploaded.light_version,
            }),
            rays: uploaded.rays.as_ref().map(|scene| Rays { scene, environment: &uploaded.environment_view }),
            ..Inputs::new(drawn.size, depth, normal, matrices)
        };
        let mut encoder = device.create_command_encoder(&Default::default());
        technique.record(&mut Recorder::new(&mut encoder), queue, &inputs, (&output_view).into())?;
        if let Some(fallback) = technique.fallback() {
            return Err(format!("drawn by {}: {}", fallback.method, fallback.why).into());
        }
        queue.submit([encoder.finish()]);
    }
    std::fs::write(folder.join("rust.output"), readback::texture(device, queue, &output)?)?;
    Ok(())
}
