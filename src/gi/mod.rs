//! Global-illumination methods, cheapest first. Each turns a G-buffer and the analytic lights'
//! direct light into one full-resolution texture: the diffuse light that direct lighting misses
//! (sky and all bounces), as E/π.
//!
//! | method | light | cannot show |
//! |---|---|---|
//! | [`ambient`] | constant light of sky and picture, times ambient occlusion ([`occlusion`]) | where light comes from; the picture's mean changes with the view |
//! | [`ssgi`] | one bounce by visibility bitmask ([`bitmask`]), `ambient`'s light where nothing blocks | what is off screen or hidden |
//! | [`gather`] | one ray a cell and frame into the scene's triangles, a world-space radiance cache at its hit, filters over frames and neighbours | light finer than a cell (4 pixels) |
//! | [`neural`] | `gather`, whose spatial filter a U-Net guides by cells' histories ([`memory`]) | the same |
//!
//! All scale exactly with the light (twice the light, twice the answer) and answer exactly 0 when
//! all light is off. `docs/internals/gather.md` explains the passes, `docs/guide/embedding.md` how
//! another renderer records them: a [`World`] holds its triangles, a [`View`] lights its picture.
//!
//! ```no_run
//! use bouncelight::gi::{GiError, Inputs, Method, View, World, WorldOptions};
//! use bouncelight::wgpu;
//!
//! fn first_frame(
//!     (device, queue): (&wgpu::Device, &wgpu::Queue),
//!     encoder: &mut wgpu::CommandEncoder,
//!     (inputs, light): (&Inputs<'_>, &wgpu::TextureView),
//! ) -> Result<(), GiError> {
//!     let mut world = World::new(device, WorldOptions::default());
//!     let mut view = View::new(device, queue, inputs.size, &Method::Gather(Default::default()))?;
//!     world.prepare(queue)?;
//!     view.record(encoder, &world, inputs, light)
//! }
//! ```
//!
//! # Layers
//! `interface` ← `stage` ← `screen`, `gather` ← `neural` ← `method` ← `world`: each imports only
//! what stands before it, and nothing here imports `render`.

#[doc(hidden)]
pub mod cpu;
pub mod gather;
#[doc(hidden)]
pub mod interface;
#[doc(hidden)]
pub mod method;
pub mod neural;
mod preludes;
#[doc(hidden)]
pub mod screen;
#[doc(hidden)]
pub mod stage;
pub(crate) mod world;

pub use interface::{
    AlbedoEncoding, CameraMatrices, Conventions, Depth, Forward, GiError, Inputs, Jitter, LightScale, Lights,
    MotionJitter, MotionSense, MotionUnits, NormalEncoding, NormalRange, NormalSpace, Outputs, Rays, technique,
};
pub use method::{Custom, Factory, Method, name};
pub use neural::{Neural, memory};
#[doc(hidden)]
pub use preludes::example_preludes;
pub use screen::ambient;
#[doc(hidden)]
pub use screen::{bitmask, occlusion, ssgi};
#[doc(hidden)]
pub use stage::{cells, exposure, exposure::ExposurePass, inputs};
pub use world::{
    BufferIndices, BufferMesh, BufferVertices, Complaint, ImageSource, Indices, Instance, MeshReadback, MeshSource,
    PreparedMesh, Surface, Vertices, View, World, WorldOptions,
};
