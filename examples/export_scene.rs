//! Writes any scene that bouncelight can load as one GLB, for Blender and other viewers.
//!
//!     cargo run --example export_scene -- interior interior.glb

use std::path::Path;
use std::process::ExitCode;

use bouncelight::scene;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [spec, out] = &args[..] else {
        eprintln!("usage: export_scene SCENE OUT.glb");
        return ExitCode::from(2);
    };
    let written = scene::load(spec).and_then(|scene| {
        scene.warnings.iter().for_each(|w| eprintln!("warning: {w}"));
        scene::export::write_glb(&scene, Path::new(out))
    });
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::from(4)
        }
    }
}
