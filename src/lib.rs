//! bouncelight adds global illumination to rasterised scenes on GPUs without ray-tracing hardware.
//! Compute shaders trace one ray per 4×4-pixel cell into the scene's triangles, cache radiance in
//! world space, and denoise over frames and neighbours; a small U-Net can guide the denoiser.
//!
//! A renderer of your own embeds [`gi::World`] (triangles, transforms, lights, sky) and [`gi::View`]
//! (one camera's picture). With feature `render` there is a deferred rasteriser, too:
//!
//! ```text
//! Scene ─► SceneGpu ─► deform ─► shadow ─► gbuffer ─► lights ─► direct ─► gi.* (net.*) ─► composite ─► blended ─► taa ─► tonemap
//! ```
//!
//! - [`gi`]: the methods, cheapest first, and what other renderers embed.
//! - [`scene`]: what is drawn, without any wgpu type; [`gpu_scene`]: the same on the GPU.
//! - [`render`]: the rasteriser, a pass a file; `render::frame` tells the order.
//! - [`net`]: weights files and the networks' kernels.
//! - [`gpu`]: the choice of a device, readback, pass timing.
//!
//! The host owns the device: nothing here creates one, submits or waits unless its name says so.
//! Sister packages: `bouncelight-scene` reads files, `bouncelight-lab` has the path tracer, metrics and
//! exports, `bouncelight-app` is the program. Conventions (units, spaces, encodings) stand in
//! `docs/internals/overview.md`.

#[doc(hidden)]
pub mod accel;
pub mod gi;
pub mod gpu;
#[cfg(feature = "render")]
pub mod gpu_scene;
#[doc(hidden)]
pub mod layouts;
#[doc(hidden)]
pub mod lights;
pub mod net;
#[doc(hidden)]
pub mod numbers;
#[cfg(feature = "render")]
pub mod render;
pub mod scene;
#[doc(hidden)]
pub mod srgb;

pub use wgpu;
