//! Methods that know nothing but the picture.

pub mod ambient;
pub mod bitmask;
pub mod occlusion;
pub mod ssgi;
