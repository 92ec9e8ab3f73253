//! `export`: what another host needs to run the pass itself.

use super::args::{Global, MethodName, MethodParser, one_of, real_time, usage};
use super::scene_args::SceneArgs;
use super::stdout::say;
use anyhow::Result;
use bouncelight_lab::export::{self, ExportError, Target};
use std::path::PathBuf;

/// Flags of `export`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Method to export.
    #[arg(long, value_parser = MethodParser(|m| m.gathers()), default_value = "gather",
        value_name = "METHOD", help_heading = EXPORT)]
    method: MethodName,
    /// Weights of `neural` [default: the shipped `filter`].
    #[arg(long, value_name = "FILE", help_heading = EXPORT)]
    weights: Option<PathBuf>,
    /// Language of the shaders.
    #[arg(long, value_parser = one_of(Target::ALL.map(|t| (t.name(), t))), help_heading = EXPORT)]
    target: Target,
    /// Folder to write: a new one, or an earlier export, which is replaced.
    #[arg(short, long, visible_alias = "out", value_name = "DIR", help_heading = EXPORT)]
    output: PathBuf,
}

/// Heading of the help.
const EXPORT: &str = "Export";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight export interior --target glsl430 -o out/glsl
  bouncelight export scene.glb --target wgsl -o out/wgsl --size 1920x1080
  bouncelight export scene.glb --target spirv -o out/spirv --method neural";

pub fn run(global: &Global, args: Args) -> Result<()> {
    if args.weights.is_some() && !args.method.needs_weights() {
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
    let package = export::export((&gpu.device, &gpu.queue), &scene, &method, args.scene.size, args.target);
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
