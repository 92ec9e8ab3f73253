//! Global-illumination methods, cheapest first. Each turns the G-buffer and the analytic lights'
//! direct light into one full-resolution texture: the diffuse light that direct lighting misses
//! (sky and every bounce), as E/π.
//!
//! # What each method does, and what it cannot do
//!
//! [`ambient`] gives every surface one light from all around (the sky, and the mean of what the
//! picture's surfaces send on, times two constants fitted to the training scenes), dimmed by
//! ambient occlusion ([`occlusion`]). It cannot say where light is: no wall bleeds its colour, a
//! closed room gets the sky's light, and two views of one room disagree because each has its own
//! mean.
//!
//! [`ssgi`] gathers what the pixels around a pixel send on, by visibility bitmask ([`bitmask`]),
//! and `ambient`'s light through what nothing blocks. It cannot do anything off the screen or
//! hidden in it.
//!
//! [`gather`] sends one ray a cell and frame into the scene's triangles and reads a cache of light
//! in the world where it ends. It asks what stands between; what is left is noise, which frames and
//! neighbours average away.
//!
//! The neural method is `gather` and a U-Net, which is given what each cell remembers ([`memory`])
//! and says which cells' light is averaged. It does not know more of the world than `gather`, and is
//! not finer than a cell (4 pixels).
//!
//! All scale exactly with the light (twice the light, twice the answer) and answer exactly 0 when
//! all light is off. `docs/internals/gather.md` tells the same with a picture of the data flow and the table of
//! constants; `docs/guide/embedding.md` how another renderer records them: a [`World`] holds its
//! triangles, a [`View`] lights its picture.
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
pub use method::{Method, name};
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
