//! Global-illumination methods, cheapest first. Each turns the G-buffer and the analytic lights' direct light into
//! one full-resolution texture: the diffuse light that direct lighting misses (sky and every bounce), as E/π.
//!
//! # What each method does, and what it cannot do
//!
//! [`ambient`] gives every surface one light from all around (the sky, and the mean of what the picture's surfaces send
//! on, times two constants fitted to the training scenes), dimmed by ambient occlusion ([`occlusion`]).
//! It cannot say where light is: no wall bleeds its colour, a closed room gets the sky's light, and two views of one
//! room disagree because each has its own mean.
//!
//! [`ssgi`] gathers what the pixels around a pixel send on, by visibility bitmask ([`bitmask`]), and `ambient`'s light
//! through what nothing blocks. It cannot do anything off the screen or hidden in it.
//!
//! [`gather`] sends one ray a cell and frame into the scene's triangles and reads a cache of light in the world where it ends. It
//! asks what stands between; what is left is noise, which frames and neighbours average away.
//!
//! [`pass`] is the neural method: features of every 4×4 cell ([`pack`]), what `gather` says among them, go through a U-Net,
//! and its gain and rest are applied to `gather`'s answer at full resolution, guided by depth and normal
//! ([`reconstruct`]). It learns where that answer errs: noise that is left, light that the cache of light blurs. It knows
//! no more of the world than `gather` and the picture show, corrects nothing finer than a cell (4 pixels), and adds no
//! specular light beyond what `composite` derives from E.
//!
//! All scale exactly with the light (twice the light, twice the answer) and answer exactly 0 when all light is off.
//! `docs/gi.md` tells the same with pictures of the data flow and how to embed [`pass::NeuralGi`].

pub mod ambient;
mod below;
pub mod bitmask;
pub mod cells;
pub mod exposure;
pub mod features;
pub mod gather;
pub mod glossy;
pub mod inputs;
pub mod name;
pub mod occlusion;
pub mod pack;
pub mod pass;
pub mod reconstruct;
pub mod rung;
pub mod ssgi;
pub mod twin;
mod view_cache;

pub use exposure::ExposurePass;

use crate::gpu::readback::ReadbackError;
use thiserror::Error;

/// The camera's part of a method's inputs, column-major as in WGSL.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMatrices {
    /// View space (right-handed, looking down −Z) from world space.
    pub view_from_world: [[f32; 4]; 4],
    /// Clip space from view space: reversed Z (1 at the near plane, 0 at the background), jitter included.
    pub clip_from_view: [[f32; 4]; 4],
}

/// What a method reads. All textures have the same size; `render::gbuffer` says what their texels mean.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// Width and height of all textures, pixels.
    pub size: [u32; 2],
    /// Reversed-Z depth, `Depth32Float`; 0 where nothing was hit.
    pub depth: &'a wgpu::TextureView,
    /// World normal, octahedral, `Rg16Float`.
    pub normal: &'a wgpu::TextureView,
    /// Diffuse reflectance in [0, 1] (rgb), `Rgba8UnormSrgb`. Alpha is not read: whoever multiplies the light with albedo
    /// applies the textures' ambient occlusion, too.
    pub albedo: &'a wgpu::TextureView,
    /// Emitted radiance, `Rgba16Float`.
    pub emissive: &'a wgpu::TextureView,
    /// Direct diffuse light of the analytic lights as E/π, albedo not multiplied in, `Rgba16Float`.
    pub direct: &'a wgpu::TextureView,
    /// The camera that drew them.
    pub camera: CameraMatrices,
    /// Radiance of the constant environment, W/(m²·sr).
    pub environment: [f32; 3],
    /// The analytic lights, for methods that light more than the picture; `None` counts as no lights there.
    pub lights: Option<Lights<'a>>,
    /// The scene as rays meet it, for methods that ask it ([`Method::needs_rays`]).
    pub rays: Option<Rays<'a>>,
    /// Where each pixel's surface was in the frame before: texture coordinates then minus now, y down, free of jitter, `Rg16Float`;
    /// for methods that remember frames. `None` counts as everything at rest.
    pub motion: Option<&'a wgpu::TextureView>,
    /// `Rgba8Unorm(Srgb)`: F0 and perceptual roughness, for methods that find what lobes show ([`Rung::gloss`](rung::Rung::gloss)).
    pub specular: Option<&'a wgpu::TextureView>,
}

/// The scene as rays meet it.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    /// Its triangles.
    pub scene: &'a crate::accel::SceneRays,
    /// Lat-long picture of the surroundings, `Rgba32Float`; one texel for a constant sky.
    pub environment: &'a wgpu::TextureView,
}

impl std::fmt::Debug for Rays<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rays").field("scene", &self.scene.counts()).finish_non_exhaustive()
    }
}

/// The analytic lights on the GPU.
#[derive(Debug, Clone, Copy)]
pub struct Lights<'a> {
    /// [`crate::scene::upload::LightGpu`] for each.
    pub buffer: &'a wgpu::Buffer,
    /// How many.
    pub count: u32,
    /// Some of them stand for surfaces that glow, and their light is in [`Inputs::direct`].
    pub stand_in: bool,
    /// Another number whenever a light is another than before, so that what is remembered of their light is forgotten sooner.
    pub epoch: u64,
}

/// Which method fills the `indirect` texture of a frame.
#[derive(Debug, Clone, Default)]
pub enum Method {
    /// None: `indirect` is 0. Shows what direct light alone gives.
    Direct,
    /// Even light times occlusion, see [`ambient`].
    #[default]
    Ambient,
    /// One bounce in screen space, see [`ssgi`].
    Ssgi,
    /// Rays into the scene's triangles and a cache of light in the world, see [`gather`].
    Gather(gather::Options),
    /// A network, see [`pass`]; `weights.into()` runs it with defaults.
    Neural(Box<pass::Neural>),
}

impl Method {
    /// Frames of a still camera after which a picture counts as settled, for methods with a history.
    pub const SETTLED: u32 = 32;

    /// The method's name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Method::Direct => "direct",
            Method::Ambient => "ambient",
            Method::Ssgi => "ssgi",
            Method::Gather(_) => "gather",
            Method::Neural(_) => "neural",
        }
    }

    /// Whether the method asks rays ([`Inputs::rays`]).
    pub fn needs_rays(&self) -> bool {
        match self {
            Method::Gather(_) => true,
            Method::Neural(neural) => pass::needs_guess(&neural.weights),
            _ => false,
        }
    }

    /// Whether the method's answer settles over frames.
    pub fn has_history(&self) -> bool {
        self.needs_rays()
    }
}

/// Why a method could not be made or recorded.
#[derive(Debug, Error)]
pub enum GiError {
    /// A width or height of 0, or more pixels than the device's textures hold.
    #[error("a picture of {}x{} pixels cannot be lit: {reason}", size[0], size[1])]
    Size {
        /// Width and height, pixels.
        size: [u32; 2],
        /// What is wrong with it.
        reason: String,
    },
    /// The camera is not a finite reversed-Z perspective camera.
    #[error("the camera cannot be used: {0}")]
    Camera(&'static str),
    /// The method reads [`Inputs::rays`], which is not there.
    #[error("this method sends rays into the scene's triangles (`Inputs::rays`), which the host did not supply")]
    Rays,
    /// The device is too small for the method.
    #[error("this device {0}")]
    Device(String),
    /// A texture view has another format, size or usage than [`Inputs`] says.
    #[error("texture `{name}` has {found}, but needs {expected}")]
    Texture {
        /// Field of [`Inputs`], or `output`.
        name: &'static str,
        /// What is needed.
        expected: String,
        /// What it has.
        found: String,
    },
    /// The weights name an input feature that this program does not have, or in another shape or order.
    #[error("the weights' input feature `{name}` {reason}")]
    Feature {
        /// The feature's name in the weights file.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The weights' output is no light and no gain on a first guess.
    #[error("the weights' output is {0}; this program needs 3 channels of light, or 6 of gain and rest")]
    Output(String),
    /// The network could not be built.
    #[error("the network could not be built for {}x{} cells: {source}", cells[0], cells[1])]
    Network {
        /// Low resolution, cells.
        cells: [u32; 2],
        /// The network's own reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Reading back failed.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
}
