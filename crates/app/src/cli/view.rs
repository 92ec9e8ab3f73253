//! `bouncelight view`: the window.

use super::args::{Global, MethodName, MethodParser, parse_size};
use crate::viewer::{self, Options};
use anyhow::Result;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A .gltf, .glb or .obj file, `paper-room:INDEX`, `home:INDEX`, or a bundled scene; the
    /// bundled interior when absent.
    scene: Option<String>,
    /// Weights of `neural`; the shipped ones when absent.
    #[arg(long, value_name = "W")]
    weights: Option<PathBuf>,
    /// How indirect light is found at first.
    #[arg(long, value_parser = MethodParser(&MethodName::ALL))]
    method: Option<MethodName>,
    /// Load scene and weights again when their files change; in a checkout, shaders, too.
    #[arg(long)]
    watch: bool,
    /// Run the steps of this file instead of waiting for hands (docs/guide/viewer.md); reads and saves no
    /// settings.
    #[cfg(feature = "script")]
    #[arg(long, value_name = "JSON")]
    script: Option<PathBuf>,
    /// Settings to begin with instead of the saved ones, as `view.json` holds them; nothing is
    /// saved then.
    #[arg(long, value_name = "JSON")]
    settings: Option<PathBuf>,
    /// Width and height of the window, points.
    #[arg(long, value_parser = parse_size, allow_hyphen_values = true, value_name = "WxH")]
    size: Option<[u32; 2]>,
    /// Folder for captures; the current one when absent.
    #[arg(long, value_name = "FOLDER")]
    captures: Option<PathBuf>,
}

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
        textures: global.textures(),
        precision: global.precision(),
        tuned: Some(|device| super::tuned::of(device, true)),
    };
    Ok(viewer::run(options)?)
}
