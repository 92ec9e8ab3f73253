//! Inputs and outputs of a frame's passes as pictures: `docs/images/passes`.
//!
//!     cargo run --release --example passes -- docs/images/passes
//!
//! Draws the bundled interior by `neural`: 40 frames of a still camera, then one after a step to
//! the side, whose buffers are read. Passes of cells show a block of 4×4 pixels a cell.

use bouncelight::gi::{Method, inputs::cells_of};
use bouncelight::gpu::bind::Bound;
use bouncelight::gpu::tape::{Dispatch, DispatchCapture};
use bouncelight::gpu::{Gpu, GpuOptions, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::format::Weights;
use bouncelight::render::capture::{CaptureOptions, Layer, capture_with};
use bouncelight::render::{Purpose, Renderer, RendererOptions, View, tonemap_curve::Tonemap};
use bouncelight::scene::{Camera, LightKind};
use glam::{Mat4, Vec3};
use std::path::{Path, PathBuf};

/// Pixels of one picture, and on a side of a cell.
const SIZE: [u32; 2] = [384, 192];
const CELL: usize = 4;
/// White columns between two pictures.
const GAP: usize = 4;
/// Frames of a still camera, and the step after them, metres.
const FRAMES: u32 = 40;
const STEP: f32 = 0.12;
const QUALITY: u8 = 82;

type Failure = Box<dyn std::error::Error>;
/// Colours of the picture's pixels, row by row.
type Image = Vec<[f32; 3]>;

fn main() -> Result<(), Failure> {
    let folder: PathBuf = std::env::args_os().nth(1).ok_or("usage: passes FOLDER")?.into();
    std::fs::create_dir_all(&folder)?;
    let gpu = Gpu::open(&GpuOptions::default())?;
    let scene = bouncelight_lab::scenes::load("interior")?;
    let to = scene.cameras.first().cloned().ok_or("the interior has a camera")?;
    let side = Mat4::from_cols_array_2d(&to.transform).x_axis.truncate();
    let from = Mat4::from_translation(-STEP * side) * Mat4::from_cols_array_2d(&to.transform);
    let from = Camera { transform: from.to_cols_array_2d(), ..to.clone() };

    // Shaders are named on the tape only where it began before they were compiled.
    let mut tape = DispatchCapture::start();
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene)?;
    uploaded.trace(&gpu.device, &gpu.queue, &scene)?;
    let method = Method::Neural(Box::new(Weights::shipped()?.into()));
    let options = RendererOptions { method, ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options)?;
    for frame in 0..=FRAMES {
        let last = frame == FRAMES;
        let purpose = if last { Purpose::Picture } else { Purpose::WarmUp { first: frame == 0 } };
        let view = View::new(if last { &to } else { &from }, SIZE, [0.0; 2]);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        tape.take();
        renderer.record_frame(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view, purpose)?;
        gpu.queue.submit([encoder.finish()]);
    }
    let frame = Frame { gpu: &gpu, dispatches: tape.take(), renderer: &renderer };
    let mut shown = frame.pictures(&uploaded, &to)?;
    let scale = frame.scale()?;
    let before = frame.means(scale)?;

    // A frame after the lights were switched off.
    let mut dark = scene.clone();
    for light in &mut dark.lights {
        match &mut light.kind {
            LightKind::Directional { irradiance, .. } => *irradiance = 0.0,
            LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. } => *intensity = 0.0,
        }
    }
    uploaded.set_lights(&gpu.device, &gpu.queue, &dark);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let view = View::new(&to, SIZE, [0.0; 2]);
    renderer.record_frame(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view, Purpose::Picture)?;
    gpu.queue.submit([encoder.finish()]);
    let frame = Frame { gpu: &gpu, dispatches: tape.take(), renderer: &renderer };
    shown.push(("gradient", before, frame.means(scale)?));
    uploaded.set_lights(&gpu.device, &gpu.queue, &scene);
    drop(tape);
    let smooth = smooth(&gpu, &uploaded, &to)?;
    for (name, left, right) in shown.into_iter().chain([smooth]) {
        write(&folder.join(format!("{name}.jpg")), &left, &right)?;
    }
    Ok(())
}

/// The frame whose buffers are read.
struct Frame<'a> {
    gpu: &'a Gpu,
    dispatches: Vec<Dispatch>,
    renderer: &'a Renderer,
}

impl Frame<'_> {
    /// What the pass called `label` has bound as `name`, words.
    fn words(&self, label: &str, name: &str) -> Result<Vec<u32>, Failure> {
        let wrong = || format!("{label} binds no {name}");
        let dispatch = self.dispatches.iter().rfind(|d| d.label == label).ok_or_else(wrong)?;
        let lines = dispatch.source.text.lines().filter(|l| l.starts_with("@group"));
        let line = lines.into_iter().find(|l| l.contains(&format!(" {name}:"))).ok_or_else(wrong)?;
        let number = |word: &str| line.split_once(word)?.1.split_once(')')?.0.parse().ok();
        let (group, binding): (u32, u32) = number("@group(").zip(number("@binding(")).ok_or_else(wrong)?;
        let bound = dispatch.groups.iter().find(|g| g.0 == group).and_then(|g| g.1.iter().find(|b| b.0 == binding));
        let Some((_, Bound::Buffer(buffer) | Bound::Part(buffer, ..) | Bound::Slot(buffer, _))) = bound else {
            return Err(wrong().into());
        };
        let bytes = readback::buffer(&self.gpu.device, &self.gpu.queue, buffer, 0, buffer.size())?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// The same as vectors.
    fn vectors(&self, label: &str, name: &str) -> Result<Vec<[f32; 4]>, Failure> {
        let words = self.words(label, name)?;
        Ok(words.chunks_exact(4).map(|v| [v[0], v[1], v[2], v[3]].map(f32::from_bits)).collect())
    }

    /// Mean light of cells after `gi.accumulate`.
    fn means(&self, scale: f32) -> Result<Image, Failure> {
        let histories = self.vectors("gi.accumulate", "history_next")?;
        Ok(of_cells(&|c| display([0, 1, 2].map(|i| 0.5 * scale * histories[5 * c][i]))))
    }

    /// The factor by which the picture is middle grey on the mean.
    fn scale(&self) -> Result<f32, Failure> {
        let hdr = self.texture(&self.renderer.targets().hdr.texture)?;
        Ok(0.18 / (hdr.iter().map(luminance).sum::<f32>() / hdr.len() as f32))
    }

    /// Name, input and output of each pass.
    fn pictures(&self, scene: &SceneGpu, camera: &Camera) -> Result<Vec<(&'static str, Image, Image)>, Failure> {
        let layers = layers(self.gpu, scene, camera)?;
        let [normal, albedo, direct, roughness] = &layers.pictures;
        let targets = self.renderer.targets();
        let hdr = self.texture(&targets.hdr.texture)?;
        let light = self.texture(&targets.indirect.texture)?;
        // Light is seen on a grey of a half.
        let scale = self.scale()?;
        let show = |v: [f32; 3], times: f32| display(v.map(|c| c * times * scale));
        let lit = |v: [f32; 3]| show(v, 0.5);
        let all = |image: &Image, f: &dyn Fn([f32; 3]) -> [f32; 3]| -> Image { image.iter().map(|v| f(*v)).collect() };
        let normals = all(normal, &|n| n.map(|c| 0.5 + 0.5 * c));

        let cell_pixels = self.words("gi.trace", "cell_pixels")?;
        let pixel = |cell: usize| {
            let packed = cell_pixels[cell];
            let [x, y] = [packed & 0x7fff, (packed >> 16) & 0x7fff].map(|n| n as usize);
            (packed != u32::MAX).then_some(y * SIZE[0] as usize + x)
        };
        let state = |cell: usize| match cell_pixels[cell] & 0x8000_8000 {
            _ if cell_pixels[cell] == u32::MAX => [0.0; 3],
            0x8000_0000 => [0.85, 0.2, 0.1],
            0x8000_8000 => [0.95, 0.75, 0.2],
            0x8000 => [0.2, 0.4, 0.9],
            _ => [0.55; 3],
        };
        let chosen = of_cells(&|c| pixel(c).map_or([0.0; 3], |p| normals[p]));

        let histories = self.vectors("gi.accumulate", "history_next")?;
        let before = self.vectors("gi.accumulate", "history_prev")?;
        let mean = |of: &[[f32; 4]], c: usize| lit([of[5 * c][0], of[5 * c][1], of[5 * c][2]]);
        let entries = self.vectors("gi.accumulate", "entry_light")?;
        let records = self.vectors("gi.accumulate", "records")?;
        let found = |c: usize| {
            let (light, slot) = (records[3 * c], records[3 * c][3].to_bits());
            let code = records[3 * c + 1][0].to_bits();
            let throughput = [0, 9, 18].map(|s| ((code >> s) & 511) as f32 * f32::exp2((code >> 27) as f32 - 24.0));
            let cached = entries.get(slot as usize).copied().unwrap_or_default();
            let glow = records[3 * c + 2];
            [0, 1, 2].map(|i| light[i] + glow[i] + throughput[i] * cached[i])
        };
        let blurred = self.vectors("gi.blur", "light_blurred")?;
        let filtered = self.vectors("gi.atrous", "cell_light")?;
        // Along the cell's normal.
        let along = |of: &[[f32; 4]], c: usize, shared: bool| {
            let n = pixel(c).map_or([0.0; 3], |p| normal[p]);
            lit([0, 1, 2].map(|i| {
                let v = of[3 * c + i];
                v[0] * n[0] + v[1] * n[1] + v[2] * n[2] + if shared { v[3] } else { 0.0 }
            }))
        };
        let guidance = self.vectors("gi.blur", "guidance")?;
        let trust = |c: usize| {
            let trust: f32 = guidance[3 * c + 2][0];
            [0.5 + 0.2 * trust; 3].map(|v| v.clamp(0.0, 1.0))
        };
        let specular = self.words("gi.specular_trace", "pixel_specular")?;
        let mirrored: Image = specular
            .chunks_exact(2)
            .map(|w| {
                let half = |w: u32, high: bool| half::f16::from_bits((w >> if high { 16 } else { 0 }) as u16).to_f32();
                show([half(w[0], false), half(w[0], true), half(w[1], false)], 1.0)
            })
            .collect();
        let length = |c: usize| [histories[5 * c][3] / (FRAMES + 1) as f32; 3];
        let rays = of_cells(&|c| lit(found(c)));
        let accumulated = self.means(scale)?;
        let blur = of_cells(&|c| along(&blurred, c, false));
        let atrous = of_cells(&|c| along(&filtered, c, true));
        let upsampled = all(&light, &lit);
        let picture = all(&hdr, &|v| show(v, 1.0));
        Ok(vec![
            ("gbuffer", normals.clone(), all(albedo, &|v| display_color(v))),
            ("direct", all(albedo, &|v| display_color(v)), all(direct, &lit)),
            ("downsample", normals, chosen.clone()),
            ("reproject", of_cells(&|c| mean(&before, c)), of_cells(&state)),
            ("trace", chosen, rays.clone()),
            ("cache_update", all(direct, &lit), self.entries(&entries, camera, &layers.depth, &lit)?),
            ("specular_trace", all(roughness, &|v| v), mirrored),
            ("accumulate", rays, accumulated.clone()),
            ("network", of_cells(&length), of_cells(&trust)),
            ("blur", accumulated, blur.clone()),
            ("atrous", blur, atrous.clone()),
            ("upsample", atrous, upsampled.clone()),
            ("composite", upsampled, picture.clone()),
            ("tonemap", all(&hdr, &|v| v.map(|c| (c * scale).clamp(0.0, 1.0))), picture),
        ])
    }

    /// A texture of four halves.
    fn texture(&self, texture: &wgpu::Texture) -> Result<Image, Failure> {
        let bytes = readback::texture(&self.gpu.device, &self.gpu.queue, texture)?;
        let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
        Ok(halves.chunks_exact(4).map(|p| [p[0], p[1], p[2]].map(half::f16::to_f32)).collect())
    }

    /// Entries of the cache in view: a square of their light where their last ray began.
    fn entries(
        &self,
        light: &[[f32; 4]],
        camera: &Camera,
        depth: &[f32],
        lit: &dyn Fn([f32; 3]) -> [f32; 3],
    ) -> Result<Image, Failure> {
        let slots = light.len() / 2;
        let places = self.vectors("gi.cache_update", "proposal_vertices")?;
        let rays = {
            let [w, h] = cells_of(SIZE).map(|n| n as usize);
            w * h + w.div_ceil(2) * h.div_ceil(2)
        };
        let [w, h] = SIZE.map(|n| n as f32);
        let from_world = Mat4::from_cols_array_2d(&camera.transform).inverse();
        let mut image = vec![[0.0; 3]; (w * h) as usize];
        for slot in (0..slots).filter(|s| light[*s][3] > 0.0) {
            let place = places[rays + 2 * slots + slot];
            let p = from_world.transform_point3(Vec3::new(place[0], place[1], place[2]));
            let at = 0.5 * h / (0.5 * camera.yfov).tan() / -p.z;
            let (x, y) = (0.5 * w + at * p.x, 0.5 * h - at * p.y);
            if p.z >= 0.0 || !(2.0..w - 2.0).contains(&x) || !(2.0..h - 2.0).contains(&y) {
                continue;
            }
            let (x, y) = (x as usize, y as usize);
            if -p.z > 1.03 * depth[y * SIZE[0] as usize + x] {
                continue;
            }
            for (dx, dy) in (0..4).flat_map(|dy| (0..4).map(move |dx| (dx, dy))) {
                image[(y + dy - 2) * SIZE[0] as usize + x + dx - 2] =
                    lit([light[slot][0], light[slot][1], light[slot][2]]);
            }
        }
        Ok(image)
    }
}

/// What the rasteriser draws.
struct Layers {
    /// Normal, albedo, direct light, roughness.
    pictures: [Image; 4],
    depth: Vec<f32>,
}

fn layers(gpu: &Gpu, scene: &SceneGpu, camera: &Camera) -> Result<Layers, Failure> {
    let options = RendererOptions { method: Method::Direct, ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options)?;
    let wanted = [Layer::Normal, Layer::DiffCol, Layer::DiffDir, Layer::Depth];
    let options = CaptureOptions { samples: 1, layers: &wanted, ..Default::default() };
    let frame =
        capture_with(gpu, &mut renderer, scene, camera, options, &mut || true)?.ok_or("nothing was captured")?;
    let image = |layer: Layer| -> Image {
        let picture = frame.layer(layer);
        picture.into_iter().flat_map(|p| p.data.chunks_exact(p.channels).map(|v| [v[0], v[1], v[2]])).collect()
    };
    let depth = frame.layer(Layer::Depth).ok_or("depth was asked for")?.data.clone();
    let bytes = readback::texture(&gpu.device, &gpu.queue, &renderer.targets().specular.texture)?;
    let roughness = bytes.chunks_exact(4).map(|p| [f32::from(p[3]) / 255.0; 3]).collect();
    Ok(Layers { pictures: [image(Layer::Normal), image(Layer::DiffCol), image(Layer::DiffDir), roughness], depth })
}

/// A part of the picture without and with temporal anti-aliasing, twice as large.
fn smooth(gpu: &Gpu, scene: &SceneGpu, camera: &Camera) -> Result<(&'static str, Image, Image), Failure> {
    let draw = |taa: bool, frames: u32| -> Result<Image, Failure> {
        let options = RendererOptions { method: Method::Ambient(Default::default()), taa, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options)?;
        let options = CaptureOptions { samples: 1, warmup: frames - 1, ..Default::default() };
        let frame =
            capture_with(gpu, &mut renderer, scene, camera, options, &mut || true)?.ok_or("nothing was captured")?;
        let shown: Image = frame.beauty.data.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        let scale = 0.18 / (shown.iter().map(luminance).sum::<f32>() / shown.len() as f32);
        let [w, h] = SIZE.map(|n| n as usize);
        let part = pixels().map(|(x, y)| shown[(h / 3 + y / 2) * w + w / 4 + x / 2]);
        Ok(part.map(|v| display(v.map(|c| c * scale))).collect())
    };
    Ok(("taa", draw(false, 1)?, draw(true, 32)?))
}

fn of_cells(cell: &dyn Fn(usize) -> [f32; 3]) -> Image {
    let across = cells_of(SIZE)[0] as usize;
    pixels().map(|(x, y)| cell(y / CELL * across + x / CELL)).collect()
}

fn pixels() -> impl Iterator<Item = (usize, usize)> {
    let [w, h] = SIZE.map(|n| n as usize);
    (0..h).flat_map(move |y| (0..w).map(move |x| (x, y)))
}

fn luminance(v: &[f32; 3]) -> f32 {
    0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]
}

fn display(v: [f32; 3]) -> [f32; 3] {
    Tonemap::Filmic.apply(v)
}

/// A reflectance.
fn display_color(v: [f32; 3]) -> [f32; 3] {
    Tonemap::None.apply(v)
}

fn write(path: &Path, left: &Image, right: &Image) -> Result<(), Failure> {
    let [w, h] = SIZE.map(|n| n as usize);
    let across = 2 * w + GAP;
    let mut rgb = vec![255; 3 * across * h];
    for (image, begin) in [(left, 0), (right, w + GAP)] {
        for ((x, y), colour) in pixels().zip(image) {
            let at = 3 * (y * across + begin + x);
            rgb[at..at + 3].copy_from_slice(&colour.map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8));
        }
    }
    let mut file = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut file, QUALITY).encode(
        &rgb,
        across as u32,
        h as u32,
        image::ExtendedColorType::Rgb8,
    )?;
    std::fs::write(path, file)?;
    println!("{}", path.display());
    Ok(())
}
