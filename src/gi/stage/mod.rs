//! What passes share: the G-buffer as shaders read it, cells, the mean light of a picture, groups kept by view, weights by which
//! cells light pixels.

pub mod cells;
pub mod exposure;
pub mod inputs;
mod view_cache;
pub mod weights;

pub(crate) use view_cache::ViewCache;
