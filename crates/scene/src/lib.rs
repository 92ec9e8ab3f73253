//! Scene files and pictures for [`bouncelight`]: what a file holds becomes a [`bouncelight::scene::Scene`].
//!
//! - [`load`] and [`load_with`]: one door for glTF, OBJ and the bundled scenes.
//! - [`gltf`] and [`obj`]: the readers; [`sky`]: panoramas; [`path`]: camera paths.
//! - [`defaults`]: the camera and the light that a scene gets which brings none; [`look`] finds them.
//! - [`edit`]: small changes as text; [`export`]: glTF out.
//! - [`image_io`]: PNG, OpenEXR and Radiance HDR.
//! - [`bundled`]: two scenes made by code; [`shapes`]: plain bodies.

pub mod bundled;
mod cut_off;
pub mod defaults;
mod dome;
pub mod edit;
mod error;
pub mod export;
mod files;
mod geometry;
pub mod gltf;
pub mod image_io;
mod ktx2;
mod load;
pub mod look;
pub mod obj;
pub mod path;
pub mod shapes;
pub mod sky;
mod texture;
pub mod triangles;
pub mod units;
pub mod validate;

pub use error::SceneError;
pub use files::LoadOptions;
pub use load::{load, load_with};
