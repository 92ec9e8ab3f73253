//! Textures, normal maps and the display pass.

use crate::build::*;
use crate::common;
use bouncelight::gpu::timing::Recorder;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::Layer;
use bouncelight::render::tonemap::{TonemapOptions, TonemapPass};
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight::render::{Renderer, View};
use bouncelight::scene::{AlphaMode, ColorSpace, Image, Sampler, Scene, TextureRef};
use bouncelight::wgpu;

pub fn image(rgba: &[[u8; 4]], width: u32, color_space: ColorSpace) -> Image {
    let height = rgba.len() as u32 / width;
    Image { name: "image".into(), width, height, rgba: rgba.concat(), color_space }
}

pub fn reference(image: usize) -> TextureRef {
    let sampler = Sampler { mag_linear: false, min_linear: false, ..Default::default() };
    TextureRef { image, sampler, uv_set: 0, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] }
}

/// A square that fills the picture, seen from the front.
pub fn board() -> Scene {
    scene(vec![quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0])], vec![sun([0.0, 0.0, -1.0], 1.0, 0.0)])
}

pub fn camera() -> bouncelight::scene::Camera {
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
fn bumps_cast_no_shadow_on_their_own_plane() {
    let Some(gpu) = common::gpu() else { return };
    // A sun that grazes the board by 20°, and a map that turns its normals by 30° towards it: where
    // shadow maps are compared with the plane of such normals, it stands in its own light.
    let (sine, cosine) = 20f32.to_radians().sin_cos();
    let mut s = board();
    s.lights = vec![sun([cosine, 0.0, -sine], 1.0, 0.005)];
    s.meshes[0].tangents = vec![[1.0, 0.0, 0.0, 1.0]; 4];
    let range = |s: &Scene| {
        let f = render(&gpu, s, &camera(), [64, 64], 1);
        let light = f.layer(Layer::DiffDir).unwrap();
        // Within the rim, where the pixels around are known.
        let pixels = (4..60).flat_map(|y| (4..60).map(move |x| (x, y))).map(|(x, y)| light.at(x, y)[0]);
        pixels.fold((f32::INFINITY, 0f32), |(least, most), v| (least.min(v), most.max(v)))
    };
    let (flat, flat_most) = range(&s);
    assert!(flat > 0.99 * flat_most, "{flat} to {flat_most}");
    // (−0.5, 0, 0.866).
    s.images = vec![image(&[[64, 128, 238, 255]], 1, ColorSpace::Linear)];
    s.materials[0].normal_texture = Some(reference(0));
    let (least, most) = range(&s);
    let wanted = flat * (0.5 * cosine + 0.866 * sine) / sine;
    assert!(least > 0.99 * wanted && most < 1.01 * wanted, "{least} to {most}, {wanted} is right");
    // Control: what stands before it does cast one.
    s.meshes.push(quad([-0.3, -0.3, 0.2], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0]));
    s.instances.push(bouncelight::scene::Instance { mesh: 1, ..s.instances[0].clone() });
    let (least, _) = range(&s);
    assert!(least < 0.1 * wanted, "{least}");
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

/// Blackman-Harris over ±1.5 pixels, as Cycles filters.
fn filter(x: f32) -> f32 {
    let v = std::f32::consts::PI * (x / 1.5 + 1.0);
    0.35875 - 0.48829 * v.cos() + 0.14128 * (2.0 * v).cos() - 0.01168 * (3.0 * v).cos()
}

/// Many samples of a pixel show what the pixel's filter shows of a texture, and not a texture that
/// mip levels had filtered before.
#[test]
fn textures_are_filtered_once() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = board();
    // Columns of one texel on a board that fills the picture.
    let row: Vec<[u8; 4]> = (0..64).map(|i| if i % 2 == 0 { [0, 0, 0, 255] } else { [255; 4] }).collect();
    s.images = vec![image(&row, 64, ColorSpace::Linear)];
    s.materials[0].base_color_texture = Some(reference(0));
    // A third of a texel a pixel, and more than one: what mip levels blur.
    let mut white = 0.0_f32;
    for width in [192usize, 48] {
        let camera = look_at([0.0, 0.0, 2.0], [0.0; 3], 2.0 * 0.5_f32.atan());
        // Nearest texels where they are large: how drivers interpolate between them is theirs.
        let sampler = Sampler { mag_linear: false, ..Default::default() };
        s.materials[0].base_color_texture = Some(TextureRef { sampler, ..reference(0) });
        let f = render(&gpu, &s, &camera, [width as u32, width as u32], 64);
        let color = f.layer(Layer::DiffCol).unwrap();
        // The middle of a column has all of its colour where columns are as wide as the filter.
        white = color.data.iter().fold(white, |a, &b| a.max(b));
        let texels = 64.0 / width as f32;
        // The texture, and the mean of it under a filter of some width.
        let shown = |at: f32| f32::from(row[at.clamp(0.0, 63.0) as usize][0]) / 255.0;
        let expected = |pixel: usize, wide: f32| {
            let steps = (-300..=300).map(|i| i as f32 / 200.0);
            let (sum, mass) = steps.fold((0.0, 0.0), |(sum, mass), x| {
                let w = filter(x);
                (sum + w * shown((pixel as f32 + 0.5 + wide * x) * texels), mass + w)
            });
            sum / mass
        };
        let error = |wide: f32| {
            let of = |x: usize| (color.at(x, width / 2)[0] / white - expected(x, wide)).abs();
            (width / 4..3 * width / 4).map(of).sum::<f32>() / (width / 2) as f32
        };
        let (right, wide) = (error(1.0), error(1.4));
        println!("{width} pixels: {right:.4}, against a filter 1.4 times as wide {wide:.4}");
        assert!(right < 0.02 && wide > 2.0 * right, "{width}: {right} {wide}");
    }
}

/// Models whose faces each have one place of a small picture, as low-poly artists paint them: a pixel's
/// footprint is then a point, by whose size no filter may divide.
#[test]
fn palettes_have_their_colours() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = board();
    let (red, blue) = ([255, 0, 0, 255], [0, 0, 255, 0]);
    s.images = vec![image(&[[red; 128], [blue; 128]].concat(), 16, ColorSpace::Linear)];
    let texture = Some(TextureRef { sampler: Sampler::default(), ..reference(0) });
    let m = &mut s.materials[0];
    (m.base_color_texture, m.emissive_texture, m.metallic_roughness_texture) = (texture, texture, texture);
    m.emissive = [1.0; 3];
    // On a texel's middle, on a corner between four of one colour, and far outside, where it repeats. None
    // is beside the other colour: some drivers' anisotropic filter takes a texel around along.
    for (at, color) in [([0.28125, 0.28125], 0), ([0.5, 0.25], 0), ([0.59375, 0.71875], 2), ([-99.5, 40.75], 2)] {
        s.meshes[0].uv0 = vec![at; 4];
        let f = render(&gpu, &s, &camera(), [16, 16], 1);
        let layers = [Layer::DiffCol, Layer::Emit].map(|layer| f.layer(layer).unwrap());
        let seen = layers.map(|l| <[f32; 3]>::try_from(l.at(8, 8)).unwrap());
        assert!(layers.iter().all(|l| l.data.iter().all(|v| v.is_finite())), "{at:?}: {seen:?}");
        let emitted = seen[1];
        assert!((0..3).all(|i| (emitted[i] - f32::from(u8::from(i == color))).abs() < 1e-3), "{at:?}: {emitted:?}");
    }
    // As casters: the transparent colour throws no shadow, the other does.
    let mut s = scene(vec![floor(4.0, 0.0), floor(1.0, 1.0)], vec![sun([0.0, -1.0, 0.0], 1.0, 0.0)]);
    s.materials.push(s.materials[0].clone());
    s.images = vec![image(&[red, blue], 2, ColorSpace::Linear)];
    s.materials[1].base_color_texture = texture;
    s.materials[1].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
    s.meshes[1].material = 1;
    let mut lit = |at: [f32; 2]| {
        s.meshes[1].uv0 = vec![at; 4];
        let f = render(&gpu, &s, &look_at([0.0, 0.6, 3.0], [0.0; 3], 0.5), [32, 32], 1);
        f.layer(Layer::DiffDir).unwrap().at(16, 16)[0]
    };
    let (transparent, solid) = (lit([0.75, 0.5]), lit([0.25, 0.5]));
    assert!(transparent > 0.25 && solid < 1e-3, "{transparent} {solid}");
}

/// A plain to the horizon: of a square of four fragments those that it does not cover lie behind
/// the eye.
#[test]
fn a_plain_to_the_horizon_has_its_textures_mean_there_and_takes_no_minutes() {
    let Some(gpu) = common::gpu() else { return };
    let half = 2e3;
    let mut s =
        scene(vec![quad([-half, -0.3 * half, half], [2.0 * half, 0.6 * half, 0.0], [0.0, 0.0, -2.0 * half])], vec![]);
    let checker: Vec<[u8; 4]> =
        (0..64 * 64).map(|i| if (i % 64 / 32) ^ (i / 2048) == 0 { [0, 0, 0, 255] } else { [255; 4] }).collect();
    s.images = vec![image(&checker, 64, ColorSpace::Linear)];
    let transform = [[2.0 * half, 0.0, 0.0], [0.0, 2.0 * half, 0.0]];
    let texture = TextureRef { sampler: Sampler::default(), transform, ..reference(0) };
    s.materials[0].base_color_texture = Some(texture);
    let (done, waits) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for i in 0..12 {
            let camera = look_at([0.0, 1.5, 0.0], [0.1 * i as f32, 1.5 - 0.01 * i as f32, -3.0], 0.8);
            let f = render(&gpu, &s, &camera, [64, 48], 1);
            let (color, depth) = (f.layer(Layer::DiffCol).unwrap(), f.layer(Layer::Depth).unwrap());
            let far: Vec<f32> = (0..64 * 48)
                .map(|i| (i % 64, i / 64))
                .filter(|&(x, y)| (60.0..1e9).contains(&depth.at(x, y)[0]))
                .map(|(x, y)| color.at(x, y)[0])
                .collect();
            done.send(far).expect("the test waits");
        }
    });
    let mut all = Vec::new();
    for i in 0..12 {
        all.extend(
            waits.recv_timeout(std::time::Duration::from_secs(120)).unwrap_or_else(|e| panic!("picture {i}: {e}")),
        );
    }
    let mean = all.iter().sum::<f32>() / all.len() as f32;
    // What was drawn before places were bounded, too (0.389, as far as it came): a check that they
    // are not moved, not an independent answer.
    println!("{} pixels far away, {mean} in the mean", all.len());
    assert!(all.len() > 500 && (mean - 0.385).abs() < 0.03, "{mean} of {}", all.len());
}

/// Stripes that run away from the eye stay apart where a pixel's footprint is long and narrow.
#[test]
fn textures_stay_sharp_at_grazing_angles() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = scene(vec![quad([-4.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 0.0, -64.0])], vec![]);
    let row: Vec<[u8; 4]> = (0..64).map(|i| if i % 2 == 0 { [0, 0, 0, 255] } else { [255; 4] }).collect();
    s.images = vec![image(&row.repeat(64), 64, ColorSpace::Linear)];
    let camera = look_at([0.0, 0.25, 1.0], [0.0, 0.0, -4.0], 0.6);
    let mut contrast = |mag_linear: bool| {
        let sampler = Sampler { mag_linear, ..Default::default() };
        // Two thousand texels along the stripes.
        let transform = [[1.0, 0.0, 0.0], [0.0, 32.0, 0.0]];
        s.materials[0].base_color_texture = Some(TextureRef { sampler, transform, ..reference(0) });
        let f = render(&gpu, &s, &camera, [256, 256], 1);
        let color = f.layer(Layer::DiffCol).unwrap();
        // Five metres away stripes are ten pixels wide, and a pixel eight texels high.
        let row: Vec<f32> = (64..192).map(|x| color.at(x, 128)[0]).collect();
        let mean = row.iter().sum::<f32>() / row.len() as f32;
        row.iter().map(|v| (v - mean).abs()).sum::<f32>() / row.len() as f32 / mean
    };
    // Negative control: a sampler that WebGPU lets no device filter so.
    let (sharp, blurred) = (contrast(true), contrast(false));
    println!("contrast {sharp:.3}, with round footprints {blurred:.3}");
    assert!(sharp > 0.4 && blurred < 0.5 * sharp, "{sharp} {blurred}");
}

/// Bumps too small for a pixel shine as much and as widely as those that one sees.
#[test]
fn small_bumps_are_rough() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = board();
    // Slopes of both axes at four quantiles of the normal distribution, in fields of 4×4 texels.
    let slope = |i: usize| 0.12_f32 * [-1.15, -0.32, 0.32, 1.15][i];
    let texel = |i: usize| {
        let n = glam::Vec3::new(slope(i % 4), slope(i / 64 % 4), 1.0).normalize();
        let [x, y, z] = (n * 0.5 + 0.5).to_array().map(|v| (v * 255.0).round() as u8);
        [x, y, z, 255]
    };
    let bumps: Vec<_> = (0..64 * 64).map(texel).collect();
    s.images = vec![image(&bumps, 64, ColorSpace::Linear)];
    s.meshes[0].tangents = vec![[1.0, 0.0, 0.0, 1.0]; 4];
    s.materials[0].metallic = 1.0;
    s.materials[0].roughness = 0.4;
    let shine = |s: &Scene, pixels: u32, samples: u32| {
        let f = render(&gpu, s, &camera(), [pixels, pixels], samples);
        let (p, n) = (f.beauty, 16);
        // Means over 16×16 fields, whatever the size.
        let side = pixels as usize / n;
        let mean = |i: usize| {
            let (x, y) = (i % n * side, i / n * side);
            let of = |k: usize| p.at(x + k % side, y + k / side)[0];
            (0..side * side).map(of).sum::<f32>() / (side * side) as f32
        };
        (0..n * n).map(mean).collect::<Vec<_>>()
    };
    let error = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>() / b.iter().sum::<f32>();
    let smooth = shine(&s, 16, 1);
    // Interpolated near, texels would be less bumpy.
    let sampler = Sampler { mag_linear: false, ..Default::default() };
    s.materials[0].normal_texture = Some(TextureRef { sampler, ..reference(0) });
    let (near, far) = (shine(&s, 512, 1), shine(&s, 16, 1));
    let (bumpy, flat) = (error(&far, &near), error(&smooth, &near));
    println!("small bumps: {:.1} % off large ones, none at all {:.1} %", 100.0 * bumpy, 100.0 * flat);
    assert!(bumpy < 0.2 && flat > 0.3, "{bumpy} {flat}");
}
