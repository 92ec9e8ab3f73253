//! Textures in blocks of 4×4 (BC7): what they lose, and what they take.

use crate::build::*;
use crate::common;
use crate::textures::{board, camera, image, reference};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::Renderer;
use bouncelight::render::capture::Layer;
use bouncelight::scene::{ColorSpace, Sampler, TextureRef};
use bouncelight::wgpu;

/// Soft colours with edges, as photographs have them; bumps as a normal map; roughness and metal in
/// patches.
fn photograph(x: u32, y: u32) -> [u8; 4] {
    let (u, v) = (x as f32 / 64.0, y as f32 / 64.0);
    let grain = ((x * 7919 + y * 104_729) % 17) as f32 / 17.0 - 0.5;
    let stripe = if (u * 6.0).fract() < 0.5 { 0.35 } else { 0.0 };
    [0.5 + 0.3 * (5.0 * u).sin() + 0.06 * grain, 0.3 + stripe + 0.04 * grain, 0.2 + 0.5 * v + 0.06 * grain, 1.0]
        .map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8)
}

fn bump(x: u32, y: u32) -> [u8; 4] {
    let wave = |a: f32, b: f32| 0.4 * (0.35 * a).cos() + 0.15 * (0.9 * b + 0.2 * a).sin();
    let n = glam::Vec3::new(wave(x as f32, y as f32), wave(y as f32, x as f32), 1.0).normalize();
    let [x, y, z] = (n * 0.5 + 0.5).to_array().map(|v| (255.0 * v).round() as u8);
    [x, y, z, 0]
}

fn patches(x: u32, y: u32) -> [u8; 4] {
    let grain = ((x * 31 + y * 17) % 13) as u8;
    [0, 90 + 8 * ((x / 9 + y / 7) % 9) as u8 + grain, if (x / 16 + y / 16).is_multiple_of(2) { 255 } else { 0 }, 255]
}

fn picture(at: fn(u32, u32) -> [u8; 4]) -> Vec<[u8; 4]> {
    (0..64 * 64).map(|i| at(i % 64, i / 64)).collect()
}

/// What BC7 loses by kind of map, with the settings that the upload uses (the crate's encoder for
/// the CPU is the same).
#[test]
fn blocks_lose_little_of_any_kind_of_map() {
    use block_compression::{BC7Settings, CompressionVariant, decode, encode};
    let through = |texels: &[[u8; 4]], settings| {
        let variant = CompressionVariant::BC7(settings);
        let mut blocks = vec![0; variant.blocks_byte_size(64, 64)];
        encode::compress_rgba8(variant, &texels.concat(), &mut blocks, 64, 64, 256);
        let mut back = vec![0; 64 * 64 * 4];
        decode::decompress_blocks_as_rgba8(variant, 64, 64, &blocks, &mut back);
        back
    };
    let psnr = |texels: &[[u8; 4]], back: &[u8]| {
        let squares =
            texels.as_flattened().iter().zip(back).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum::<f64>();
        10.0 * (255.0f64.powi(2) * back.len() as f64 / squares.max(1e-9)).log10()
    };
    for (name, at, least) in [
        ("colour", photograph as fn(u32, u32) -> [u8; 4], 38.0),
        ("normals", bump, 35.0),
        ("roughness and metal", patches, 36.0),
    ] {
        let texels = picture(at);
        let back = through(&texels, BC7Settings::alpha_fast());
        let found = psnr(&texels, &back);
        eprintln!("{name}: {found:.1} dB");
        assert!(found > least, "{name}: {found}");
        // Negative control: blocks of another picture are far off.
        assert!(psnr(&texels, &through(&picture(|x, y| photograph(y, 63 - x)), BC7Settings::alpha_fast())) < 25.0);
        // Why normal maps stay whole.
        if name == "normals" {
            let normal = |t: &[u8]| glam::Vec3::new(t[0].into(), t[1].into(), t[2].into()) / 127.5 - 1.0;
            let angle = |i: usize| normal(&texels[i]).angle_between(normal(&back[4 * i..4 * i + 3])).to_degrees();
            let mean = (0..4096).map(angle).sum::<f32>() / 4096.0;
            eprintln!("normals: {mean:.2} degrees");
            assert!((1.0..4.0).contains(&mean), "{mean} degrees");
        }
    }
}

#[test]
fn textures_in_blocks_look_the_same_and_take_a_quarter() {
    use bouncelight::gpu_scene::TextureMemory;
    let Some(gpu) = common::gpu() else { return };
    if !gpu.device.features().contains(wgpu::Features::TEXTURE_COMPRESSION_BC) {
        return common::skip(common::Need::Adapter, "the device has no compressed textures");
    }
    let mut s = board();
    let smooth = |image: usize| TextureRef { sampler: Sampler::default(), ..reference(image) };
    s.images = vec![
        image(&picture(photograph), 64, ColorSpace::Srgb),
        image(&picture(bump), 64, ColorSpace::Linear),
        image(&picture(patches), 64, ColorSpace::Linear),
    ];
    s.meshes[0].tangents = vec![[1.0, 0.0, 0.0, 1.0]; 4];
    let material = &mut s.materials[0];
    (material.base_color, material.metallic, material.roughness) = ([1.0; 4], 1.0, 1.0);
    material.base_color_texture = Some(smooth(0));
    material.normal_texture = Some(smooth(1));
    material.metallic_roughness_texture = Some(smooth(2));
    let size = [96, 96];
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, direct_only()).unwrap();
    let mut look = |memory: TextureMemory| {
        let uploaded = SceneGpu::with_textures(&gpu.device, &gpu.queue, &s, memory).unwrap();
        let layers = [Layer::DiffCol, Layer::Normal];
        let options = bouncelight::render::capture::CaptureOptions { layers: &layers, ..Default::default() };
        let frame = bouncelight::render::capture::capture(&gpu, &mut renderer, &uploaded, &camera(), options).unwrap();
        (layers.map(|l| frame.layer(l).unwrap().data.clone()), uploaded.texture_bytes())
    };
    let (whole, bytes) = look(TextureMemory::Full);
    let (blocks, fewer) = look(TextureMemory::Compressed);
    // 5,461 texels with all levels; the two smallest levels are less than a block each.
    assert_eq!((bytes.full, bytes.kept), (3 * 4 * 5461, 3 * 4 * 5461));
    let blocks_of_one = 16 * (256 + 64 + 16 + 4 + 1 + 1 + 1);
    assert_eq!((fewer.full, fewer.kept), (bytes.full, 2 * blocks_of_one + 4 * 5461), "normals stay whole");
    assert_eq!(look(TextureMemory::Auto).1.kept, bytes.full, "so few stay whole");
    let apart = |i: usize| {
        let sum: f32 = whole[i].iter().zip(&blocks[i]).map(|(a, b)| (a - b).abs()).sum();
        sum / whole[i].len() as f32
    };
    assert!(apart(0) < 0.01 && apart(1) == 0.0, "colour {}, normals {}", apart(0), apart(1));
    // Negative control: they are not the same texels.
    assert!(apart(0) > 1e-5);
}
