//! What `cargo xtask demo` runs: the bundled interior in out/demo.png (above raster | gather, below
//! neural | reference), then the timing table.
//!
//! It is also the shortest tour of the library: load a scene, open a device, draw with three methods, write a picture.

use bouncelight::{
    gi::Method,
    gpu::{Gpu, GpuOptions},
    image_io,
    net::format::Weights,
    render::{
        Renderer, RendererOptions,
        capture::{CaptureOptions, capture},
        tonemap_curve::Tonemap,
    },
    scene::{self, upload::SceneGpu},
    study::bench::{BenchOptions, measure},
};
use std::path::Path;

/// Size of each of the four pictures.
const SIZE: [u32; 2] = [640, 320];
/// Size of the frames that are timed.
const TIMED_SIZE: [u32; 2] = [1024, 512];
/// White columns and rows between the pictures.
const GAP: usize = 4;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let gpu = Gpu::open(&GpuOptions::default())?;
    println!("{}", gpu.sentence());
    let scene = scene::load("interior")?;
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene)?;
    uploaded.trace(&gpu.device, &gpu.queue, &scene)?;
    let neural = || Weights::shipped().map(|w| Method::Neural(Box::new(w.into())));

    let mut pictures = Vec::new();
    for method in [Method::Direct, Method::Gather(Default::default()), neural()?] {
        let warmup = if method.has_history() { Method::SETTLED - 1 } else { 0 };
        let options = RendererOptions { method, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options)?;
        let options = CaptureOptions { samples: 8, warmup, ..Default::default() };
        let frame = capture(&gpu, &mut renderer, &uploaded, &scene.cameras[0], options)?;
        let rgb: Vec<f32> = frame.beauty.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        pictures.push(Tonemap::Filmic.apply_to_bytes(&rgb));
    }
    // Cycles' picture of the same scene at the same size; docs/accuracy.md says how it was made.
    let reference = image_io::read_png(&root.join("assets/reference/interior.png"))?;
    assert_eq!([reference.width, reference.height], SIZE, "the reference picture has the demo's size");
    pictures.push(reference.to_rgb().iter().map(|v| (v * 255.0).round() as u8).collect());

    let row = SIZE[0] as usize * 3;
    let gap = [255; GAP * 3];
    let beside = |[left, right]: [&Vec<u8>; 2]| -> Vec<u8> {
        left.chunks(row).zip(right.chunks(row)).flat_map(|(l, r)| [l, &gap, r].concat()).collect()
    };
    let between = vec![255; GAP * (2 * row + gap.len())];
    let sheet = [beside([&pictures[0], &pictures[1]]), between, beside([&pictures[2], &pictures[3]])].concat();
    let out = root.join("out/demo.png");
    std::fs::create_dir_all(root.join("out"))?;
    image_io::write_png(
        &out,
        SIZE[0] * 2 + GAP as u32,
        SIZE[1] * 2 + GAP as u32,
        &sheet,
        &[("Adapter".into(), gpu.sentence())],
    )?;
    println!("raster | gather above, neural | reference below: {}\n", out.display());

    println!("interior at {}x{}, one frame:", TIMED_SIZE[0], TIMED_SIZE[1]);
    for method in [Method::Direct, Method::Ambient, Method::Gather(Default::default()), neural()?] {
        let options = RendererOptions { method, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, TIMED_SIZE, options)?;
        let options = BenchOptions { frames: 5, warmup: 2 };
        let m = measure(&gpu, &mut renderer, &uploaded, &scene.cameras[0], options)?;
        let gpu_ms = m.gpu_ms.map_or("no timestamps".into(), |t| format!("{:.2} ms GPU", t.median));
        let mib = m.total_bytes() as f64 / (1 << 20) as f64;
        println!("  {:<8} {gpu_ms:>14} {:>9.2} ms wall clock {mib:>7.1} MiB of GPU memory", m.method, m.wall_ms.median);
    }
    Ok(())
}
