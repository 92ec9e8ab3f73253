//! The pass for hosts without wgpu: a few frames are recorded as any host records them, on a tape
//! (`gpu::tape`), and what was dispatched with which resources is written down: shaders in the
//! host's language, buffers and textures with what they hold at first, and a [`Manifest`] that says
//! how to bind and dispatch them.
//!
//! ```text
//!  Scene ─► SceneGpu, Technique ─► record a few frames ─► tape ─► Package: bouncelight.json, shaders/, data/
//! ```

pub mod manifest;
mod package;
mod record;
mod shader;

pub use manifest::Manifest;
pub use package::{Package, check_folder};

use bouncelight::accel::AccelError;
use bouncelight::gi::{GiError, Method, name::MethodName};
use bouncelight::gpu::readback::ReadbackError;
use bouncelight::gpu_scene::UploadError;
use bouncelight::scene::Scene;
use std::path::PathBuf;
use thiserror::Error;

/// Name of the manifest's file.
pub const MANIFEST: &str = "bouncelight.json";

/// The language that shaders are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Target {
    /// WGSL without any optional feature, for WebGPU.
    Wgsl,
    /// OpenGL 4.3's compute shaders.
    Glsl430,
    /// SPIR-V 1.3, for Vulkan 1.1.
    Spirv,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Wgsl, Self::Glsl430, Self::Spirv];

    /// Its name on the command line and in the manifest.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Glsl430 => "glsl430",
            Self::Spirv => "spirv",
        }
    }

    fn extension(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Glsl430 => "comp",
            Self::Spirv => "spv",
        }
    }
}

/// Why nothing was exported.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The method cannot work with this scene, size or device.
    #[error(transparent)]
    Gi(#[from] GiError),
    /// The scene does not fit.
    #[error(transparent)]
    Upload(#[from] UploadError),
    /// Rays cannot have the scene.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// Another method would draw in this one's place.
    #[error("method `{method}` is not available: {why}")]
    Fallback {
        /// What was asked for.
        method: &'static str,
        /// What is missing.
        why: String,
    },
    /// Only methods whose frames come to repeat themselves can be written down.
    #[error("method `{0}` cannot be exported; {which} can", which = MethodName::which(MethodName::gathers))]
    Method(&'static str),
    /// A shader cannot be had in that language.
    #[error("shader `{shader}`: {message}")]
    Shader {
        /// Its name.
        shader: String,
        /// The compiler's words.
        message: String,
    },
    /// The recording has a gap: a mistake in this program.
    #[error("pass `{pass}` cannot be exported: {reason}")]
    Recording {
        /// The pass's label.
        pass: String,
        /// What is missing.
        reason: String,
    },
    /// A resource could not be read.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
    /// The folder holds something else.
    #[error("{}: {reason}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A file or folder cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// Which.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

/// Records `method` for pictures of `size` pixels of `scene`. Submits and waits.
///
/// A network runs in 32 bits, by kernels that every device has.
///
/// # Errors
/// [`ExportError`] when the method, the scene and the device do not fit together.
pub fn export(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    scene: &Scene,
    method: &Method,
    size: [u32; 2],
    target: Target,
) -> Result<Package, ExportError> {
    let recording = record::record((device, queue), scene, method, size, target)?;
    recording.package((device, queue), method.name(), target)
}
