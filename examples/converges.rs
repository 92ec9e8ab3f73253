//! Is `gather` right, noise and filters aside? Each cell of a small picture with some thousand
//! rays, one a frame, and nothing blurred or forgotten, against as many paths from the same points
//! by the path tracer.
//!
//!     cargo run --release --example converges -- SCENE|FOLDER… [--gather plain,…] [--frames N] [--paths N] [--size WxH]
//!                                                [--no-caustics] [--csv FILE] [--shaders FOLDER]
//!
//! Both speak of one point a cell: that of the pixel which stands for it. Printed are all of the
//! light over that of the paths (what is to be 1), the mean difference of single points, and the
//! paths' own noise in both. With --csv a line a point: scene, x and y of the pixel, then light of
//! cells and of paths, red, green and blue each. Scenes are as in `bouncelight chart`.

use bouncelight::gi::cells::NO_PIXEL;
use bouncelight::gi::gather::{Options, PAST};
use bouncelight::gi::{Method, inputs::cells_of};
use bouncelight::gpu::{Gpu, GpuOptions, readback, shaders, timing::Recorder};
use bouncelight::reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions, job};
use bouncelight::render::{Renderer, RendererOptions, View};
use bouncelight::scene::{LoadOptions, Scene, upload::SceneGpu};
use bouncelight::study::chart::scenes::sources;
use std::error::Error;
use std::fmt::Write;

/// What is asked.
struct Asked {
    gather: Options,
    frames: u32,
    paths: u32,
    size: [u32; 2],
    csv: Option<String>,
}

/// Reflectance of a channel from which on its light is compared.
const LEAST_COLOUR: f32 = 0.01;

/// Squared length of the mean normal of what paths see through a point from which on it is one
/// surface.
const ONE_SURFACE: f32 = 0.999;

/// One cell that shows a surface: its pixel, and E/π of it.
struct Cell {
    pixel: [u32; 2],
    light: [f32; 3],
}

/// What cells' rays have found in the later half of so many frames of a still camera; in the
/// earlier one the light between surfaces comes round.
fn gathered(gpu: &Gpu, scene: &Scene, asked: &Asked) -> Result<Vec<Cell>, Box<dyn Error>> {
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene)?;
    uploaded.trace(&gpu.device, &gpu.queue, scene)?;
    let options = RendererOptions { method: Method::Gather(asked.gather), ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, asked.size, options)?;
    let camera = scene.cameras.first().ok_or("the scene has no camera")?;
    let [w, h] = cells_of(asked.size).map(u64::from);
    let read = |buffer: &wgpu::Buffer, bytes: u64| readback::buffer(&gpu.device, &gpu.queue, buffer, 0, w * h * bytes);
    let mut earlier: Vec<f32> = Vec::new();
    for frame in 0..asked.frames {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        // No jitter, and the same lots in every frame: the same pixels stand for their cells.
        let view = View::new(camera, asked.size, [0.0; 2]);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view)?;
        gpu.queue.submit([encoder.finish()]);
        if frame % 16 == 15 {
            gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        }
        if frame + 1 == asked.frames / 2 {
            let memory = renderer.memory().ok_or("rays cannot be asked here")?;
            earlier = bytemuck::pod_collect_to_vec(&read(memory.pasts, PAST)?);
        }
    }
    let memory = renderer.memory().ok_or("rays cannot be asked here")?;
    let pixels: Vec<u32> = bytemuck::pod_collect_to_vec(&read(memory.pixels, 4)?);
    let pasts: Vec<f32> = bytemuck::pod_collect_to_vec(&read(memory.pasts, PAST)?);
    let pitch = PAST as usize / 4;
    let cells = pixels.iter().zip(pasts.chunks_exact(pitch).zip(earlier.chunks_exact(pitch)));
    Ok(cells
        .filter(|(packed, _)| **packed != NO_PIXEL)
        .map(|(packed, (all, half))| {
            // Light, and frames in it.
            let later = |c: usize| (all[c] * all[3] - half[c] * half[3]) / (all[3] - half[3]);
            Cell { pixel: [packed & 0xffff, packed >> 16 & 0x7fff], light: [later(0), later(1), later(2)] }
        })
        .collect())
}

/// rgb of each cell by paths, and the noise of a point and of their mean.
fn traced(
    gpu: &Gpu,
    kernel: &Kernel,
    scene: &Scene,
    asked: &Asked,
    cells: &[Cell],
) -> Result<(Vec<f32>, [f64; 2]), Box<dyn Error>> {
    let packed = ReferenceScene::new(&gpu.device, &gpu.queue, scene)?;
    let points: Vec<[f32; 2]> = cells.iter().map(|c| c.pixel.map(|p| p as f32 + 0.5)).collect();
    let subject = Subject { camera: &scene.cameras[0], size: asked.size, points: Some(&points) };
    let flags = if asked.gather.caustics { 0 } else { job::NO_CAUSTICS };
    let layers = vec![Layer::Gi, Layer::DiffCol, Layer::Normal];
    let options = TracerOptions { samples: asked.paths, seed: 20, flags, layers, ..Default::default() };
    let mut tracer = Tracer::new(&gpu.device, &gpu.queue, kernel, &packed, subject, options)?;
    while tracer.step()? {}
    let traced = tracer.finish()?;
    let mut light = traced.layer(Layer::Gi).ok_or("it was asked for")?.to_vec();
    let colour = traced.layer(Layer::DiffCol).ok_or("it was asked for")?;
    let normals = traced.layer(Layer::Normal).ok_or("it was asked for")?;
    // A surface without a colour, metal or black, tells nothing of the light on it; and where paths
    // see several surfaces through one point, by lot, a cell shows one of them.
    for ((light, colour), n) in light.chunks_exact_mut(3).zip(colour.chunks_exact(3)).zip(normals.chunks_exact(3)) {
        let several = n.iter().map(|c| c * c).sum::<f32>() < ONE_SURFACE;
        for (light, &colour) in light.iter_mut().zip(colour) {
            if several || colour < LEAST_COLOUR {
                *light = f32::NAN;
            }
        }
    }
    let noise = traced.noise_of(Layer::Gi).map_or([f64::NAN; 2], |n| [n.pixel, n.picture]);
    Ok((light, noise))
}

fn asked() -> Result<(Asked, Vec<String>), Box<dyn Error>> {
    let mut asked = Asked { gather: Options::PLAIN, frames: 512, paths: 1024, size: [256, 128], csv: None };
    let (mut words, mut scenes, mut caustics) = (std::env::args().skip(1), Vec::new(), true);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--gather" => asked.gather = value()?.parse()?,
            "--frames" => asked.frames = value()?.parse()?,
            "--paths" => asked.paths = value()?.parse()?,
            "--size" => {
                let text = value()?;
                let (w, h) = text.split_once('x').ok_or("--size is WIDTHxHEIGHT")?;
                asked.size = [w.parse()?, h.parse()?];
            }
            "--no-caustics" => caustics = false,
            // What is tried out without building anew.
            "--shaders" => shaders::read_from(Some(value()?.into())),
            "--csv" => asked.csv = Some(value()?),
            _ => scenes.push(word),
        }
    }
    asked.gather.caustics &= caustics;
    Ok((asked, scenes))
}

fn main() -> Result<(), Box<dyn Error>> {
    let (asked, words) = asked()?;
    let gpu = Gpu::open(&GpuOptions::default())?;
    let kernel = Kernel::new(&gpu.device);
    let mut lines = String::new();
    for source in sources(&words)? {
        let scene = source.load(LoadOptions::default())?;
        let start = std::time::Instant::now();
        let cells = gathered(&gpu, &scene, &asked)?;
        let (drawn, start) = (start.elapsed(), std::time::Instant::now());
        let (truth, noise) = traced(&gpu, &kernel, &scene, &asked, &cells)?;
        let (mut ours, mut all, mut apart, mut points) = (0.0, 0.0, 0.0, 0);
        for (cell, truth) in cells.iter().zip(truth.chunks_exact(3)) {
            let _ = write!(lines, "{},{},{}", source.name, cell.pixel[0], cell.pixel[1]);
            for value in cell.light.iter().chain(truth) {
                let _ = write!(lines, ",{value:.6e}");
            }
            lines.push('\n');
            points += usize::from(truth.iter().any(|v| v.is_finite()));
            for (ours_at, truth_at) in cell.light.iter().zip(truth).filter(|(_, truth)| truth.is_finite()) {
                ours += f64::from(*ours_at);
                all += f64::from(*truth_at);
                apart += f64::from((ours_at - truth_at).abs());
            }
        }
        println!(
            "{}: {points} points, all of the light {:+.2} % (± {:.2}), a point {:.2} % off (± {:.2}); {:.0} s and {:.0} s",
            source.name,
            100.0 * (ours / all - 1.0),
            100.0 * noise[1],
            100.0 * apart / all,
            100.0 * noise[0],
            drawn.as_secs_f64(),
            start.elapsed().as_secs_f64(),
        );
    }
    if let Some(path) = &asked.csv {
        std::fs::write(path, lines)?;
    }
    Ok(())
}
