//! Textures, normal maps and the display pass.

#[path = "common/build.rs"]
mod build;
mod common;

use bouncelight::gpu::timing::Recorder;
use bouncelight::render::capture::Layer;
use bouncelight::render::tonemap::{TonemapOptions, TonemapPass};
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight::render::{Renderer, View};
use bouncelight::scene::upload::SceneGpu;
use bouncelight::scene::{ColorSpace, Image, Sampler, Scene, TextureRef};
use bouncelight::wgpu;
use build::*;

fn image(rgba: &[[u8; 4]], width: u32, color_space: ColorSpace) -> Image {
    let height = rgba.len() as u32 / width;
    Image { name: "image".into(), width, height, rgba: rgba.concat(), color_space }
}

fn reference(image: usize) -> TextureRef {
    let sampler = Sampler { mag_linear: false, min_linear: false, ..Default::default() };
    TextureRef { image, sampler, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }
}

/// A square that fills the picture, seen from the front.
fn board() -> Scene {
    scene(vec![quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0])], vec![sun([0.0, 0.0, -1.0], 1.0, 0.0)])
}

fn camera() -> bouncelight::scene::Camera {
    look_at([0.0, 0.0, 2.0], [0.0; 3], 0.9)
}

#[test]
fn textures_lie_the_right_way_round() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = board();
    let (red, green, blue, grey) = ([255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [188, 188, 188, 255]);
    s.images = vec![image(&[red, green, blue, grey], 2, ColorSpace::Srgb)];
    s.materials[0].base_color_texture = Some(reference(0));
    let look = |s: &Scene| {
        let f = render(&gpu, s, &camera(), [16, 16], 1);
        let color = f.layer(Layer::DiffCol).unwrap();
        [(4, 4), (11, 4), (4, 11), (11, 11)].map(|(x, y)| <[f32; 3]>::try_from(color.at(x, y)).unwrap())
    };
    let [a, b, c, d] = look(&s);
    assert!(a[0] > 0.9 && a[1] == 0.0 && b[1] > 0.9 && c[2] > 0.9, "{a:?} {b:?} {c:?}");
    // 188 is half of white in linear light.
    assert!((d[0] / a[0] - 0.5).abs() < 0.02, "{d:?}");
    // KHR_texture_transform: half a picture to the right swaps the columns.
    s.materials[0].base_color_texture =
        Some(TextureRef { transform: [[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]], ..reference(0) });
    let [a, b, ..] = look(&s);
    assert!(a[1] > 0.9 && b[0] > 0.9, "{a:?} {b:?}");
}

#[test]
fn normal_maps_tilt_along_tangent_and_bitangent() {
    let Some(gpu) = common::gpu() else { return };
    for (texel, axis) in [([218, 128, 218, 255], 0), ([128, 218, 218, 255], 1)] {
        let mut s = board();
        s.images = vec![image(&[texel], 1, ColorSpace::Linear)];
        s.materials[0].normal_texture = Some(reference(0));
        s.meshes[0].tangents = vec![[1.0, 0.0, 0.0, 1.0]; 4];
        let f = render(&gpu, &s, &camera(), [8, 8], 1);
        let n = f.layer(Layer::Normal).unwrap().at(4, 4).to_vec();
        assert!((n[axis] - 0.707).abs() < 0.01 && (n[2] - 0.707).abs() < 0.01, "{n:?}");
        assert!(n[1 - axis].abs() < 0.01, "{n:?}");
    }
}

#[test]
fn the_display_pass_is_the_curve_on_the_cpu() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = board();
    s.environment.radiance = [2.0, 0.1, 0.02];
    s.materials[0].base_color = [0.9, 0.5, 0.1, 1.0];
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &s).unwrap();
    let size = [32, 16];
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, direct_only()).unwrap();
    let view = View::new(&camera(), size, [0.0; 2]);
    for format in [wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureFormat::Rgba8UnormSrgb] {
        let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("display"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let mut pass = TonemapPass::new(&gpu.device, format);
        for tonemap in [Tonemap::Filmic, Tonemap::Agx, Tonemap::Neutral, Tonemap::None] {
            let options = TonemapOptions { ev: 1.0, tonemap };
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut recorder = Recorder::new(&mut encoder);
            renderer.record(&mut recorder, &gpu.queue, &uploaded, &view).unwrap();
            let view = target.create_view(&Default::default());
            pass.record(&mut recorder, &gpu.queue, options, &renderer.targets().hdr.view, &view);
            gpu.queue.submit([encoder.finish()]);
            let read = |t: &wgpu::Texture| bouncelight::gpu::readback::texture(&gpu.device, &gpu.queue, t).unwrap();
            let (shown, hdr) = (read(&target), read(&renderer.targets().hdr.texture));
            let mut different = std::collections::HashSet::new();
            for (shown, hdr) in shown.chunks_exact(4).zip(hdr.chunks_exact(8)) {
                let half = |i: usize| half::f16::from_ne_bytes([hdr[2 * i], hdr[2 * i + 1]]).to_f32();
                let expected = tonemap.apply([0, 1, 2].map(|i| 2.0 * half(i)));
                for c in 0..3 {
                    let off = f32::from(shown[c]) - 255.0 * expected[c];
                    assert!(off.abs() < 1.6, "{tonemap:?} {format:?}: {shown:?} against {expected:?}");
                }
                different.insert(shown.to_vec());
            }
            assert!(different.len() > 1, "the picture has surface and background");
        }
    }
}
