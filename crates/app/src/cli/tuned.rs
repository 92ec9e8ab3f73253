//! The tuner on the command line: `weights tune`, and where its cache lies.

use super::args::Global;
use super::stdout::say;
use anyhow::{Context, Result};
use bouncelight::gi::{Method, Neural};
use bouncelight::gpu::Gpu;
use bouncelight::net::gpu::Tuned;
use bouncelight::net::tune::{self, Cache, MAX_TEXT};
use bouncelight_scene::image_io;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The cache's place: `$BOUNCELIGHT_TUNED`, else `bouncelight/tuned.json` in the user's cache
/// folder; none where there is no such folder or the variable is empty.
pub fn path() -> Option<PathBuf> {
    let of = |name| std::env::var_os(name);
    if let Some(named) = of("BOUNCELIGHT_TUNED") {
        return Some(PathBuf::from(named)).filter(|p| !p.as_os_str().is_empty());
    }
    let absolute = |p: &PathBuf| p.is_absolute();
    let folder = of("XDG_CACHE_HOME").map(PathBuf::from).filter(absolute);
    let folder = folder.or_else(|| of("LOCALAPPDATA").map(PathBuf::from).filter(absolute));
    let folder = folder.or_else(|| of("HOME").map(|home| PathBuf::from(home).join(".cache")).filter(absolute));
    folder.map(|f| f.join("bouncelight").join("tuned.json"))
}

/// The cache in `path`; an empty one where there is none, and, with a warning, where there is
/// something else.
pub fn load(path: &Path, quiet: bool) -> Cache {
    let read = || -> Result<Option<Cache>> {
        let file = match std::fs::File::open(path) {
            Ok(file) => file,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(e.into()),
        };
        let mut text = String::new();
        file.take(MAX_TEXT as u64 + 1).read_to_string(&mut text)?;
        Ok(Some(Cache::parse(&text)?))
    };
    match read() {
        Ok(found) => found.unwrap_or_default(),
        Err(e) => {
            if !quiet {
                eprintln!("warning: {} is ignored: {e:#}; `bouncelight weights tune` makes it anew", path.display());
            }
            Cache::default()
        }
    }
}

/// What the user's cache knows of a device.
pub fn of(device: &wgpu::Device, quiet: bool) -> Arc<Tuned> {
    let cache = path().map(|path| load(&path, quiet)).unwrap_or_default();
    Arc::new(cache.tuned(&device.adapter_info()))
}

/// The method with what the user's cache knows of its network on this device; others as they are.
pub fn tuned(mut method: Method, gpu: &Gpu, quiet: bool) -> Method {
    if let Method::Neural(neural) | Method::Generator(neural) = &mut method {
        neural.tuned = of(&gpu.device, quiet);
    }
    method
}

/// `weights tune`.
pub fn run(global: &Global, file: &Path, size: [u32; 2], cache: Option<PathBuf>, again: bool) -> Result<()> {
    let weights = bouncelight_lab::network::shipped::find(file)?;
    // As a frame runs it.
    let options = Neural::from(weights.clone()).stored(global.precision()).network;
    let path = cache.or_else(path).context("there is no cache folder here; name a file with --cache")?;
    let mut cache = load(&path, global.quiet);
    let gpu = global.open_gpu()?;
    let cells = size.map(|edge| edge.div_ceil(weights.cell));
    let told = |round: usize, rounds: usize| {
        if !global.quiet {
            eprintln!("tuning: round {round} of {}", rounds - 1);
        }
        true
    };
    let reports = tune::tune((&gpu.device, &gpu.queue), &weights, cells, options, &mut cache, again, told)?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    image_io::write_whole(&path, cache.text().as_bytes())?;
    say!("{:<54}{:<22}{:>9}  {:<22}{:>9}", "layer", "guess", "ms", "fastest", "ms");
    for r in &reports {
        let [guess, best] = [r.guess.0, r.best.0].map(|p| p.to_string());
        say!("{:<54}{guess:<22}{:>9.3}  {best:<22}{:>9.3}", r.layer.to_string(), r.guess.1, r.best.1);
    }
    say!("{} layers tuned, remembered in {}", reports.len(), path.display());
    Ok(())
}
