//! A scripted session of the real program, and what its screenshots show.

use super::display::Display;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Runs a script against `args`; returns what the program said.
pub fn session(display: &Display, dir: &Path, script: serde_json::Value, args: &[&str]) -> Output {
    session_with(display, dir, script, args, &[])
}

/// As [`session`], with variables of the environment.
pub fn session_with(
    display: &Display,
    dir: &Path,
    script: serde_json::Value,
    args: &[&str],
    variables: &[(&str, &str)],
) -> Output {
    let file = dir.join("script.json");
    std::fs::write(&file, script.to_string()).expect("the folder is writable");
    Command::new(env!("CARGO_BIN_EXE_bouncelight"))
        .args(["view", "--script"])
        .arg(&file)
        .arg("--captures")
        .arg(dir)
        .args(args)
        .current_dir(dir)
        .env("DISPLAY", display.name())
        .env_remove("WAYLAND_DISPLAY")
        .env("NODEVICE_SELECT", "1")
        .env("HOME", dir)
        .env("XDG_CONFIG_HOME", dir.join("config"))
        .envs(compiled().map(|folder| ("MESA_SHADER_CACHE_DIR", folder)))
        .envs(variables.iter().copied())
        .output()
        .expect("the program starts")
}

/// Where Mesa keeps what it has compiled, which is nobody's settings: it would compile all shaders for
/// every folder that stands for a home.
fn compiled() -> Option<PathBuf> {
    let of = |name| std::env::var_os(name).map(PathBuf::from);
    of("MESA_SHADER_CACHE_DIR").or(of("XDG_CACHE_HOME")).or(of("HOME").map(|home| home.join(".cache")))
}

#[track_caller]
pub fn succeeds(out: &Output) {
    let text = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success() && !text.contains("panicked"), "{:?}: {text}", out.status);
}

/// Mean of a part of a screenshot, 0 to 255, by channel.
pub fn mean(path: &Path, x: std::ops::Range<u32>, y: std::ops::Range<u32>) -> [f64; 3] {
    let image = bouncelight_scene::image_io::read_png(path).expect("a screenshot was written");
    let mut sum = [0.0; 3];
    for row in y.clone() {
        for column in x.clone() {
            let at = (row * image.width + column) as usize * image.channels as usize;
            (0..3).for_each(|c| sum[c] += f64::from(image.pixels[at + c]) * 255.0);
        }
    }
    sum.map(|s| s / (x.len() * y.len()) as f64)
}

/// What the `print` steps of a session told, one value each.
pub fn printed(out: &Output) -> Vec<serde_json::Value> {
    let text = String::from_utf8_lossy(&out.stdout);
    text.lines().filter_map(|l| serde_json::from_str(l).ok()).collect()
}
