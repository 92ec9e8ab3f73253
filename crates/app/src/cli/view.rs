//! `bouncelight view`: the window.

use super::args::{Global, MethodName, MethodParser, parse_size};
use crate::viewer::{self, Options};
use anyhow::Result;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options")]
pub struct Args {
    /// A .gltf, .glb or .obj file, `interior`, `cornell`, `motion`, `home:INDEX` or `paper-room:INDEX`
    /// [default: interior].
    #[arg(help_heading = None)]
    scene: Option<String>,
    /// Method for indirect light to begin with [default: as `fit` found, else as saved].
    #[arg(long, value_parser = MethodParser(|_| true))]
    method: Option<MethodName>,
    /// Weights of a network: a file, or a shipped one's name [default: the method's shipped].
    #[arg(long, value_name = "FILE")]
    weights: Option<PathBuf>,
    /// Window size, points [default: as saved].
    #[arg(long, value_parser = parse_size, allow_hyphen_values = true, value_name = "WxH")]
    size: Option<[u32; 2]>,
    /// Folder for captures [default: the current one].
    #[arg(long, value_name = "DIR")]
    captures: Option<PathBuf>,
    /// Reload scene and weights, and in a checkout shaders, when their files change.
    #[arg(long)]
    watch: bool,
    /// Settings to begin with, as in view.json; the saved ones are neither read nor written.
    #[arg(long, value_name = "JSON")]
    settings: Option<PathBuf>,
    /// Run the steps of this file instead of waiting for input; no settings are read or saved.
    #[cfg(feature = "script")]
    #[arg(long, value_name = "JSON")]
    script: Option<PathBuf>,
}

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight view scene.glb
  bouncelight view interior --method neural --size 1280x800
  bouncelight view scene.glb --watch --captures shots";

pub fn run(global: &Global, args: Args) -> Result<()> {
    if args.watch {
        // The folder that is named, else where the sources of this very program lie.
        let named = std::env::var_os("BOUNCELIGHT_SHADERS").map(PathBuf::from);
        let shaders = named.unwrap_or_else(bouncelight::gpu::shaders::sources);
        bouncelight::gpu::shaders::read_from(Some(shaders).filter(|s| s.is_dir()));
    }
    let options = Options {
        scene: args.scene,
        load: global.load_options(),
        weights: args.weights,
        method: args.method,
        watch: args.watch,
        #[cfg(feature = "script")]
        script: args.script,
        settings: args.settings,
        size: args.size,
        captures: args.captures,
        gpu: global.gpu_options(),
        textures: global.textures,
        precision: global.precision(),
        tuned: Some(|device| super::tuned::of(device, true)),
    };
    Ok(viewer::run(options)?)
}
