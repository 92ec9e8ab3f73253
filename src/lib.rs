//! bouncelight draws a scene with a deferred rasteriser on wgpu and adds global illumination with a
//! small U-Net that runs in compute shaders on the same GPU.
//!
//! ```text
//!  file or name        GPU, one command encoder a frame (render/frame.rs tells it in order)
//!  ───────────         ─────────────────────────────────────────────────────────────────────
//!  scene::load ──► gpu_scene     ──► shadow ──► gbuffer ──► direct ──► gi ──► composite ──► tonemap
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
//! Conventions (units, spaces, encodings) stand in `docs/architecture.md`.

pub mod accel;
#[cfg(feature = "export")]
pub mod export;
pub mod gi;
pub mod gpu;
pub mod gpu_scene;
#[cfg(feature = "io")]
pub mod image_io;
// With all shaders there are, the viewer's included.
#[cfg(all(test, feature = "viewer"))]
mod layouts;
pub mod lights;
pub mod metrics;
pub mod net;
mod numbers;
#[cfg(feature = "reference")]
pub mod reference;
pub mod render;
pub mod scene;
mod srgb;
pub mod study;

#[cfg(feature = "cli")]
pub mod cli;

#[cfg(feature = "viewer")]
pub mod viewer;

pub use wgpu;
