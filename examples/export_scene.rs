//! Writes any scene that bouncelight can load as one GLB, for Blender and other viewers.
//!
//!     cargo run --example export_scene -- interior interior.glb
//!
//! With `--bare` without its cameras and lights, to see what is made of such a file.

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut args: Vec<String> = std::env::args().skip(1).collect();
    let bare = args.iter().position(|a| a == "--bare").map(|i| args.remove(i)).is_some();
    let [spec, out] = &args[..] else {
        eprintln!("usage: export_scene [--bare] SCENE OUT.glb");
        return ExitCode::from(2);
    };
    let written = bouncelight_lab::scenes::load(spec).and_then(|mut scene| {
        if bare {
            bouncelight_scene::export::strip(&mut scene);
        }
        scene.warnings.iter().for_each(|w| eprintln!("warning: {w}"));
        bouncelight_scene::export::write_glb(&scene, Path::new(out))
    });
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::from(4)
        }
    }
}
