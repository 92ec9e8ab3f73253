//! `bouncelight apply`: a network on G-buffer pictures from elsewhere.

use super::args::{Global, PrecisionName, command_line, usage};
use super::progress::Progress;
use anyhow::Result;
use bouncelight::gpu::timing::Recorder;
use bouncelight::net::{
    format::Weights,
    gpu::{NetError, Network, Options, Setup},
    plan::PlanError,
};
use bouncelight_lab::network::{
    cpu::{self, Tensor},
    pictures, shipped,
};
use bouncelight_scene::image_io::{self, Image};
use std::io::Read;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    next_help_heading = "Options",
    override_usage = "\
bouncelight apply --direct <PNG> --depth <PNG> --normal <PNG> --diffuse <PNG>
                         --weights <FILE> --output <PNG> [OPTIONS]"
)]
pub struct Args {
    /// Direct light.
    #[arg(long, value_name = "PNG")]
    direct: PathBuf,
    /// Depth, of the same size.
    #[arg(long, value_name = "PNG")]
    depth: PathBuf,
    /// Normals, of the same size.
    #[arg(long, value_name = "PNG")]
    normal: PathBuf,
    /// Albedo, of the same size.
    #[arg(long, value_name = "PNG")]
    diffuse: PathBuf,
    /// Direct light and that of method gather, of the same size, for networks that want it.
    #[arg(long, value_name = "PNG")]
    gathered: Option<PathBuf>,
    /// Weights of a network on pictures, from `weights convert` or training; `generator`,
    /// `generator-gather`: those that come with the program.
    #[arg(long, value_name = "FILE")]
    weights: PathBuf,
    /// Picture to write; `-`: standard output.
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// Keep dropout on, with this seed, as published programs do [default: off].
    #[arg(long, value_name = "SEED")]
    dropout: Option<u32>,
}

/// Examples at the end of the help.
pub const EXAMPLES: &str = r"Examples:
  bouncelight apply --direct direct.png --depth depth.png --normal normal.png --diffuse albedo.png \
    --weights generator -o out.png
  bouncelight apply --direct direct.png --depth depth.png --normal normal.png --diffuse albedo.png \
    --weights net.safetensors -o out.png --dropout 1
  bouncelight apply --direct direct.png --depth depth.png --normal normal.png --diffuse albedo.png \
    --weights net.safetensors -o - --adapter cpu";

pub fn run(global: &Global, args: Args) -> Result<()> {
    let name = args.output.display().to_string();
    if name != "-" && !name.to_ascii_lowercase().ends_with(".png") {
        return Err(usage(format!("{name}: the picture's name must end in .png")));
    }
    image_io::check_writable(&args.output)?;
    let weights = shipped::find(&args.weights)?;
    pictures::check(&weights)?;
    let [depth, direct, diffuse, normal] = [&args.depth, &args.direct, &args.diffuse, &args.normal].map(|p| rgb(p));
    let (depth, direct, diffuse, normal) = (depth?, direct?, diffuse?, normal?);
    let gathered = args.gathered.as_deref().map(rgb).transpose()?;
    let size = [direct.width, direct.height];
    let others = [(&depth, &args.depth), (&diffuse, &args.diffuse), (&normal, &args.normal)];
    for (image, path) in others.into_iter().chain(gathered.iter().zip(&args.gathered)) {
        if [image.width, image.height] != size {
            let sizes = format!(
                "{}x{} pixels, {} has {}x{}",
                image.width,
                image.height,
                args.direct.display(),
                size[0],
                size[1]
            );
            return Err(usage(format!("{} has {sizes}; all pictures need one size", path.display())));
        }
    }
    let input = pictures::input(
        &weights,
        &pictures::Pictures {
            size,
            depth: &depth.pixels,
            direct: &direct.pixels,
            diffuse: &diffuse.pixels,
            normal: &normal.pixels,
            gathered: gathered.as_ref().map(|image| image.pixels.as_slice()),
        },
    )?;
    let output = network(global, &weights, &input, &args)?;
    let shown = pictures::picture(&output);
    let bytes: Vec<u8> = shown.iter().map(|v| (v * 255.0).round() as u8).collect();
    let metadata = [
        ("Software", format!("bouncelight {}", env!("CARGO_PKG_VERSION"))),
        ("Command", command_line()),
        ("Weights", weights.hash_text()),
    ];
    let metadata: image_io::Metadata = metadata.map(|(k, v)| (k.to_string(), v)).into();
    image_io::write_png(&args.output, output.shape.width, output.shape.height, &bytes, &metadata)?;
    Ok(())
}

/// Runs on the GPU, or on the slow CPU reference where there is none or the picture is too large
/// for it, saying so.
fn network(global: &Global, weights: &Weights, input: &Tensor, args: &Args) -> Result<Tensor> {
    let dropout = args.dropout;
    let slow = |reason: &dyn std::fmt::Display| {
        if global.precision == Some(PrecisionName::F16) {
            return Err(usage(format!(
                "{reason}; and without a GPU networks run in 32 bits only: leave --precision out"
            )));
        }
        if !global.quiet {
            eprintln!("warning: {reason}; running without a GPU, which takes minutes for a large network");
        }
        Ok(cpu::run_with(weights, input, dropout)?)
    };
    let gpu = match global.open_gpu() {
        Ok(gpu) => gpu,
        // Whoever names an adapter wants that one.
        Err(e) if global.adapter.is_some() => return Err(e),
        Err(e) => return slow(&e),
    };
    let options = Options { dropout, precision: global.precision().unwrap_or_default(), ..Default::default() };
    let size = [input.shape.width, input.shape.height];
    let tuned = super::tuned::of(&gpu.device, global.quiet);
    let setup = Setup { options, tuned };
    let network = match Network::new(&gpu.device, &gpu.queue, weights, size, setup) {
        Ok(network) => network,
        Err(e @ (NetError::Plan(PlanError::TooLarge { .. }) | NetError::Limit { .. })) => return slow(&e),
        Err(e) => return Err(e.into()),
    };
    pictures::upload(&gpu, &network, input);
    let plan = network.plan();
    if !global.quiet {
        let (gflop, mb) = (plan.flops() as f64 / 1e9, network.bytes() as f64 / 1e6);
        eprintln!("{} steps at {}x{}, {gflop:.1} GFLOP, {mb:.0} MB on the GPU", plan.steps.len(), size[0], size[1]);
    }
    // Step by step, so that a large network on a slow device shows how far it is. The first use of
    // a kernel may compile it.
    let mut progress = Progress::new(global, "steps", plan.steps.len() as u64);
    for step in 0..plan.steps.len() {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        network.record_step(step, &mut Recorder::new(&mut encoder));
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
        progress.step();
    }
    progress.finish();
    Ok(pictures::download(&gpu, &network)?)
}

/// A picture of 8 bits without transparency; an alpha channel that is 1 everywhere is left out.
fn rgb(path: &Path) -> Result<Image> {
    let image = image_io::read_png(path)?;
    if image.channels == 4 && image.pixels.chunks_exact(4).any(|p| p[3] < 1.0) {
        return Err(usage(format!("{} is transparent in places; save it without an alpha channel", path.display())));
    }
    if bit_depth(path)? == 16 {
        let why = "these networks know pictures of 8; convert it, with the scale that the network was trained on";
        return Err(usage(format!("{} has 16 bits a channel, and {why}", path.display())));
    }
    Ok(Image { channels: 3, pixels: image.to_rgb(), ..image })
}

/// Bits of a channel: byte 24 of a PNG that has been read already.
fn bit_depth(path: &Path) -> Result<u8> {
    let mut start = [0; 25];
    std::fs::File::open(path)?.read_exact(&mut start)?;
    Ok(start[24])
}
