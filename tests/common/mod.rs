//! Shared by the tests: what a machine may lack, and the one way to skip a test for it.

#![allow(dead_code, reason = "each test binary uses a part")]

use bouncelight::gpu::{Gpu, GpuOptions};
use std::fmt::Display;
use std::io::Write;
use std::path::PathBuf;

/// What a test may need and a machine may lack.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// A wgpu adapter of any kind.
    Adapter,
    /// An X server without a screen (Xvfb).
    Screen,
    /// OpenGL beside Vulkan.
    OpenGl,
    /// spirv-val, of Khronos' SPIRV-Tools.
    SpirvVal,
    /// python3 with numpy and jsonschema.
    Python,
    /// python3 with PyTorch and what else training imports.
    Torch,
    /// The folder of reference renders and other people's scenes.
    Shared,
    /// The paper's generator at full width.
    Generator,
    /// A driver and processor whose pictures are known to the bit.
    Driver,
}

impl Need {
    fn name(self) -> &'static str {
        match self {
            Self::Adapter => "adapter",
            Self::Screen => "screen",
            Self::OpenGl => "OpenGL",
            Self::SpirvVal => "spirv-val",
            Self::Python => "Python",
            Self::Torch => "PyTorch",
            Self::Shared => "shared folder",
            Self::Generator => "generator",
            Self::Driver => "known driver",
        }
    }

    /// The variable that makes lacking it a failure, if it is set.
    fn required_by(self) -> Option<&'static str> {
        let set = |name| std::env::var(name).is_ok_and(|v| v == "1").then_some(name);
        match self {
            Self::Adapter => set("REQUIRE_GPU").or(set("REQUIRE_ALL")),
            Self::Screen if cfg!(target_os = "linux") => set("REQUIRE_GPU").or(set("REQUIRE_ALL")),
            Self::OpenGl | Self::Python => set("REQUIRE_ALL"),
            // Continuous integration has none of these: PyTorch and the generator's weights are
            // gigabytes and 218 MB, the shared folder is not part of the repository.
            // `cargo xtask hosts` needs the network anyway, and installs spirv-val.
            Self::Screen | Self::SpirvVal | Self::Torch | Self::Shared | Self::Generator | Self::Driver => None,
        }
    }
}

/// All real-time methods with their defaults, a network's with the shipped weights; cheapest first.
pub fn methods() -> Vec<bouncelight::gi::Method> {
    let network = || bouncelight::net::format::Weights::shipped().map(bouncelight::gi::Neural::from);
    let method = |name: &bouncelight::gi::name::MethodName| name.method(network).expect("the shipped file is sound");
    bouncelight::gi::name::MethodName::LIGHT.iter().filter_map(method).collect()
}

/// Says that the running test is left out, past libtest's capture, and adds a line to the file that
/// `SKIP_LOG` names, which `cargo xtask test` counts.
///
/// # Panics
/// When `REQUIRE_GPU=1` or `REQUIRE_ALL=1` asks for what is lacking.
pub fn skip(need: Need, reason: impl Display) {
    if let Some(variable) = need.required_by() {
        panic!("{variable}=1, but no {}: {reason}", need.name());
    }
    let binary = std::env::current_exe().ok().and_then(|p| Some(p.file_stem()?.to_string_lossy().into_owned()));
    let (binary, thread) = (binary.unwrap_or_default(), std::thread::current());
    let test = format!("{}::{}", binary.rsplit_once('-').map_or("?", |b| b.0), thread.name().unwrap_or("?"));
    // In one piece, beside other tests' lines; losing one is no reason to fail.
    let _ = std::io::stderr().write_all(format!("SKIP: {test}: no {}: {reason}\n", need.name()).as_bytes());
    if let Some(path) = std::env::var_os("SKIP_LOG") {
        let file = std::fs::OpenOptions::new().append(true).create(true).open(path);
        let _ = file.and_then(|mut f| f.write_all(format!("{}\t{test}\n", need.name()).as_bytes()));
    }
}

/// Whether heavy tests run whole (`TESTS=all`), not at a tenth.
pub fn whole() -> bool {
    std::env::var("TESTS").is_ok_and(|v| v == "all")
}

/// A device whose validation errors fail the test, or `None` after a [`skip`]. All tests of a program
/// share it, and what is compiled on it.
pub fn gpu() -> Option<Gpu> {
    static GPU: std::sync::Mutex<Option<Gpu>> = std::sync::Mutex::new(None);
    let mut gpu = GPU.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if gpu.is_none() {
        *gpu = own_gpu();
    }
    gpu.clone()
}

/// As [`gpu`], a device of the test's own: for tests that measure what a device holds.
pub fn own_gpu() -> Option<Gpu> {
    match Gpu::open(&GpuOptions::default()) {
        Ok(gpu) => {
            gpu.device.on_uncaptured_error(std::sync::Arc::new(|e| panic!("wgpu: {e}")));
            Some(gpu)
        }
        Err(e) => {
            skip(Need::Adapter, e);
            None
        }
    }
}

/// The repository's folder, whichever package the test is of.
pub fn root() -> PathBuf {
    let package = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().find(|folder| folder.join("tests/common").is_dir()).unwrap_or(package).to_owned()
}

/// A path below the folder of reference renders and other people's scenes (`BOUNCELIGHT_SHARED`,
/// else `../shared`), or `None` after a [`skip`].
pub fn shared_path(relative: &str) -> Option<PathBuf> {
    let root = std::env::var_os("BOUNCELIGHT_SHARED").map_or_else(|| root().join("../shared"), PathBuf::from);
    let path = root.join(relative);
    if !path.exists() {
        skip(Need::Shared, format_args!("{} is not here", path.display()));
        return None;
    }
    Some(path)
}

/// That folder, if it holds reference renders; else `None` after a [`skip`].
pub fn shared() -> Option<PathBuf> {
    Some(shared_path("reference")?.parent().expect("a folder was added").to_owned())
}

/// Whether python3 imports `packages`; a [`skip`] otherwise.
pub fn python(need: Need, packages: &str) -> bool {
    match std::process::Command::new("python3").args(["-c", &format!("import {packages}")]).output() {
        Ok(out) if out.status.success() => return true,
        Ok(out) => skip(need, String::from_utf8_lossy(&out.stderr).lines().last().unwrap_or("python3 fails")),
        Err(e) => skip(need, format_args!("python3: {e}")),
    }
    false
}
