//! Shared by the tests: an adapter or a visible skip, and the folder of reference renders.

#![allow(dead_code, reason = "each test binary uses a part")]

use bouncelight::gpu::{Gpu, GpuOptions};
use std::path::PathBuf;

/// A device whose validation errors fail the test, or `None` after a visible `SKIP`.
///
/// # Panics
/// When `REQUIRE_GPU=1` and there is no adapter.
pub fn gpu() -> Option<Gpu> {
    match Gpu::open(&GpuOptions::default()) {
        Ok(gpu) => {
            gpu.device.on_uncaptured_error(std::sync::Arc::new(|e| panic!("wgpu: {e}")));
            Some(gpu)
        }
        Err(e) if std::env::var("REQUIRE_GPU").is_ok_and(|v| v == "1") => panic!("REQUIRE_GPU=1, but: {e}"),
        Err(e) => {
            println!("SKIP: {e}");
            None
        }
    }
}

/// The folder of reference renders and third-party scenes (`BOUNCELIGHT_SHARED`, else `../shared`), or `None` after a visible `SKIP`.
pub fn shared() -> Option<PathBuf> {
    let path = std::env::var_os("BOUNCELIGHT_SHARED")
        .map(PathBuf::from)
        .unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"));
    if path.join("reference").is_dir() {
        return Some(path);
    }
    println!("SKIP: no reference folder at {}", path.display());
    None
}
