//! `export`: what another host needs to run the pass itself.

use super::args::{Global, MethodName, MethodParser, real_time, usage};
use super::scene_args::SceneArgs;
use super::stdout::say;
use anyhow::Result;
use bouncelight_lab::export::{self, ExportError, Target};
use clap::ValueEnum;
use std::path::PathBuf;

/// Flags of `export`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// How indirect light is found.
    #[arg(long, value_parser = MethodParser(&[MethodName::Gather, MethodName::Neural]), default_value = "gather", value_name = "METHOD")]
    method: MethodName,
    /// A network's weights; the shipped ones without.
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Language of the shaders.
    #[arg(long, value_enum)]
    target: TargetName,
    /// Folder to write; a new one, or an earlier export, which is replaced.
    #[arg(short, long, visible_alias = "out", value_name = "FOLDER")]
    output: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
#[allow(missing_docs, reason = "the variants are their own words on the command line")]
enum TargetName {
    Wgsl,
    Glsl430,
    Spirv,
}

impl TargetName {
    fn target(self) -> Target {
        match self {
            Self::Wgsl => Target::Wgsl,
            Self::Glsl430 => Target::Glsl430,
            Self::Spirv => Target::Spirv,
        }
    }
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    if args.weights.is_some() && args.method != MethodName::Neural {
        return Err(usage("--weights is for --method neural".into()));
    }
    let refused = |e: ExportError| match e {
        ExportError::Folder { .. } => usage(format!("--output: {e}")),
        other => other.into(),
    };
    export::check_folder(&args.output).map_err(refused)?;
    let method = real_time(args.method, global, args.weights.as_ref())?;
    let scene = args.scene.load(global)?;
    let gpu = global.open_gpu()?;
    let package = export::export((&gpu.device, &gpu.queue), &scene, &method, args.scene.size, args.target.target());
    let package = package.map_err(refused)?;
    package.write(&args.output).map_err(refused)?;
    let (m, bytes) = (&package.manifest, package.files.iter().map(|f| f.1.len()).sum::<usize>());
    say!(
        "{}: {} shaders, {} buffers, {} textures, {} frames and {} that repeat, {:.1} MB of files",
        args.output.display(),
        m.shaders.len(),
        m.buffers.len(),
        m.textures.len(),
        m.steady.from,
        m.steady.period,
        bytes as f64 * 1e-6
    );
    Ok(())
}
