//! The rasteriser: one pass, one file; [`frame`] has their order.
//!
//! ```no_run
//! use bouncelight::{gpu::Gpu, gpu_scene::SceneGpu, scene::Camera};
//! use bouncelight::gi::Method;
//! use bouncelight::render::{RenderError, Renderer, RendererOptions, capture::{CaptureOptions, capture}};
//!
//! fn picture(gpu: &Gpu, scene: &SceneGpu, camera: &Camera) -> Result<Vec<f32>, RenderError> {
//!     let options = RendererOptions { method: Method::Gather(Default::default()), ..Default::default() };
//!     let mut renderer = Renderer::new(&gpu.device, &gpu.queue, [1024, 512], options)?;
//!     let frames = CaptureOptions { samples: 8, warmup: Method::SETTLED - 1, ..Default::default() };
//!     Ok(capture(gpu, &mut renderer, scene, camera, frames)?.beauty.data)
//! }
//! ```

#[doc(hidden)]
pub mod blended;
pub mod capture;
#[doc(hidden)]
pub mod composite;
#[doc(hidden)]
pub mod cull;
mod decode;
#[doc(hidden)]
pub mod deform;
#[doc(hidden)]
pub mod direct;
pub mod exposure;
pub mod frame;
#[doc(hidden)]
pub mod gbuffer;
mod generator;
mod gi_inputs;
#[doc(hidden)]
pub mod light_choice;
#[doc(hidden)]
pub mod lights;
mod passes;
#[doc(hidden)]
pub mod pipelines;
#[doc(hidden)]
pub mod previous_transforms;
#[doc(hidden)]
pub mod sampling;
#[doc(hidden)]
pub mod shadow;
mod shadow_kept;
mod shadow_local;
mod shadow_maps;
mod shadow_sun;
mod shadow_view;
#[doc(hidden)]
pub mod ssr;
#[doc(hidden)]
pub mod taa;
pub mod targets;
#[doc(hidden)]
pub mod tonemap;
pub mod tonemap_curve;
pub mod view;

pub use blended::Blending;
pub use composite::Backdrop;
pub use cull::DrawnCount;
pub use exposure::Exposure;
pub use frame::Purpose;
pub use frame::{Renderer, RendererOptions};
#[doc(hidden)]
pub use generator::preludes as example_preludes;
pub use light_choice::LightOptions;
pub use targets::Targets;
pub use view::View;

use thiserror::Error;

/// Why the rasteriser cannot do what it was asked.
#[derive(Debug, Error)]
pub enum RenderError {
    /// A picture that the device cannot hold.
    #[error("a picture of {width}×{height} pixels: {reason}")]
    Size {
        /// Width asked for, pixels.
        width: u32,
        /// Height asked for, pixels.
        height: u32,
        /// Which limit it breaks.
        reason: String,
    },
    /// Reading a result back failed.
    #[error(transparent)]
    Readback(#[from] crate::gpu::readback::ReadbackError),
    /// The GI method failed.
    #[error(transparent)]
    Gi(#[from] crate::gi::GiError),
    /// A picture with pixels that are not numbers.
    #[error("layer {layer} has {count} pixels that are not finite, the first at {x},{y}")]
    NotFinite {
        /// The layer's name.
        layer: String,
        /// How many pixels.
        count: usize,
        /// Column of the first.
        x: usize,
        /// Row of the first.
        y: usize,
    },
    /// Capture without a sample.
    #[error("a capture needs at least one sample")]
    NoSamples,
}
