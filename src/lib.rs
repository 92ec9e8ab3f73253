//! bouncelight draws a scene with a deferred rasteriser on wgpu and adds global illumination with a
//! small U-Net that runs in compute shaders on the same GPU.
//!
//! ```text
//!  file or name        GPU, one command encoder a frame (render/frame.rs tells it in order)
//!  ───────────         ─────────────────────────────────────────────────────────────────────
//!  bouncelight_scene::load ──► gpu_scene     ──► shadow ──► gbuffer ──► direct ──► gi ──► composite ──► tonemap
//!                                                  │           │        ▲                     │
//!                                                  └───────────┴► pack ─┤                     ▼
//!  net::format ──► net::graph ──► net::plan ──► net::gpu ── U-Net ──────┘            image_io, viewer
//! ```
//!
//! Module map, in the direction of the data:
//! - [`scene`]: what is drawn, without any wgpu type.
//! - [`gpu_scene`]: the same on the GPU; [`lights`]: lights and surroundings as shaders read them.
//! - [`accel`]: triangles in trees, on the CPU and the GPU, and what rays hit of them.
//! - [`gpu`]: device choice, shader sources, readback, pass timing.
//! - [`render`]: the rasteriser, one file a pass.
//! - [`net`]: weights file, graph, plan, the slow CPU reference and the WGSL kernels' host side.
//! - [`gi`]: global-illumination methods, cheapest first; [`gi::World`] and [`gi::View`] are what
//!   other renderers embed.
//! - `reference` (feature `reference`): the path tracer that everything else is measured against.
//! - [`metrics`]: image metrics, no wgpu.
//! - `export` (feature `export`): the pass for hosts without wgpu.
//! - `viewer` (feature `viewer`): the window of `bouncelight view`.
//! - [`study`]: what is measured over methods and scenes.
//!
//! Conventions (units, spaces, encodings) stand in `docs/internals/overview.md`.

#[doc(hidden)]
pub mod accel;
pub mod gi;
pub mod gpu;
#[cfg(feature = "render")]
pub mod gpu_scene;
#[cfg(test)]
mod layouts;
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
