//! `bouncelight demo`: the bundled interior by three methods beside Cycles' picture of it, and a
//! timing table.

use super::{args::Global, interrupt, progress::Progress, stdout::say};
use crate::cli::error::CliError;
use anyhow::Result;
use bouncelight::gi::Method;
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::format::Weights;
use bouncelight::render::{
    Renderer, RendererOptions,
    capture::{CaptureOptions, capture_with},
    tonemap_curve::Tonemap,
};
use bouncelight::scene;
use bouncelight_lab::study::bench::{BenchOptions, measure};
use bouncelight_scene::image_io;
use std::path::{Path, PathBuf};

/// Size of each of the four pictures.
const SIZE: [u32; 2] = [640, 320];
/// Size of the frames that are timed.
const TIMED_SIZE: [u32; 2] = [1024, 512];
/// Jittered frames averaged into a picture.
const SAMPLES: u32 = 8;
/// Frames timed a method, after the first ones.
const TIMED: BenchOptions = BenchOptions { frames: 5, warmup: 2 };
/// White columns and rows between the pictures.
const GAP: usize = 4;

/// Cycles' picture of the interior at [`SIZE`]; docs/results/accuracy.md says how it was made.
const REFERENCE: &[u8] = include_bytes!("../../assets/reference/interior.png");

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options")]
pub struct Args {
    /// Picture to write: direct | gather above, neural | Cycles below.
    #[arg(short, long, default_value = "out/demo.png", value_name = "PNG")]
    output: PathBuf,
    /// Print no timing table.
    #[arg(long)]
    no_times: bool,
}

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight demo
  bouncelight demo --no-times -o demo.png
  bouncelight demo --adapter cpu";

/// The methods shown, in the sheet's order, and those that are timed.
fn methods() -> Result<([Method; 3], [Method; 4])> {
    let neural = Method::Neural(Box::new(Weights::shipped()?.into()));
    let gather = Method::Gather(Default::default());
    Ok((
        [Method::Direct, gather.clone(), neural.clone()],
        [Method::Direct, Method::Ambient(Default::default()), gather, neural],
    ))
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    if let Some(folder) = args.output.parent() {
        std::fs::create_dir_all(folder)?;
    }
    image_io::check_writable(&args.output)?;
    interrupt::install()?;
    let (shown, timed) = methods()?;
    let frames = |m: &Method| SAMPLES + m.frames_to_settle() - 1;
    let mut progress = Progress::compiling(global, "frames", shown.iter().map(|m| u64::from(frames(m))).sum());
    let gpu = global.open_gpu()?;
    let scene = bouncelight_lab::scenes::load("interior")?;
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene)?;
    // Where rays cannot be had the method below draws.
    let _ = uploaded.trace(&gpu.device, &gpu.queue, &scene);

    let mut pictures = Vec::new();
    for method in shown {
        progress.compiles();
        let options = CaptureOptions { samples: SAMPLES, warmup: frames(&method) - SAMPLES, ..Default::default() };
        let options_of = RendererOptions { method, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options_of)?;
        let frame = capture_with(&gpu, &mut renderer, &uploaded, &scene.cameras[0], options, &mut || {
            progress.step();
            !interrupt::requested()
        })?;
        let frame = frame.ok_or(CliError::Interrupted)?;
        let rgb: Vec<f32> = frame.beauty.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        pictures.push(Tonemap::Filmic.apply_to_bytes(&rgb));
    }
    progress.finish();
    let reference = image_io::decode_png(Path::new("assets/reference/interior.png"), REFERENCE)?.0;
    pictures.push(reference.to_rgb().iter().map(|v| (v * 255.0).round() as u8).collect());
    let size = SIZE.map(|n| 2 * n + GAP as u32);
    image_io::write_png(&args.output, size[0], size[1], &sheet(&pictures), &[("Adapter".into(), gpu.sentence())])?;
    say!("raster | gather above, neural | Cycles' reference below: {}", args.output.display());
    if !args.no_times {
        times(&gpu, &uploaded, &scene, timed)?;
    }
    Ok(())
}

/// Four pictures of [`SIZE`], two beside each other in two rows.
fn sheet(pictures: &[Vec<u8>]) -> Vec<u8> {
    let row = SIZE[0] as usize * 3;
    let gap = [255; GAP * 3];
    let beside = |left: &[u8], right: &[u8]| -> Vec<u8> {
        left.chunks(row).zip(right.chunks(row)).flat_map(|(l, r)| [l, &gap, r].concat()).collect()
    };
    let between = vec![255; GAP * (2 * row + gap.len())];
    [beside(&pictures[0], &pictures[1]), between, beside(&pictures[2], &pictures[3])].concat()
}

/// Where a frame's time goes, a line a method.
fn times(gpu: &Gpu, uploaded: &SceneGpu, scene: &scene::Scene, methods: [Method; 4]) -> Result<()> {
    say!("\n{}", gpu.sentence());
    say!("interior at {}x{}, one frame:", TIMED_SIZE[0], TIMED_SIZE[1]);
    for method in methods {
        let options = RendererOptions { method, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, TIMED_SIZE, options)?;
        let m = measure(gpu, &mut renderer, uploaded, &scene.cameras[0], TIMED, false)?;
        interrupt::check()?;
        let gpu_ms = m.gpu_ms.map_or("no timestamps".into(), |t| format!("{:.2} ms GPU", t.median));
        let mib = m.total_bytes() as f64 / (1 << 20) as f64;
        say!("  {:<8} {gpu_ms:>14} {:>9.2} ms wall clock {mib:>7.1} MiB of GPU memory", m.method, m.wall_ms.median);
    }
    Ok(())
}
