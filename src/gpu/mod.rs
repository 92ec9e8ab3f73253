//! The GPU as the rest of the house sees it: a chosen device, shader sources, bind groups,
//! readback, timing.

pub mod bind;
pub(crate) mod binding;
mod bound;
mod choose;
#[cfg(feature = "reference")]
pub(crate) mod count;
#[cfg(feature = "reference")]
mod instrument;
pub mod probe;
pub mod readback;
pub mod shaders;
pub(crate) mod shared;
pub(crate) mod tape;
pub mod timing;

pub(crate) use choose::is_software;
pub use choose::{Backend, Gpu, GpuError, GpuOptions, candidates, wanted_features};
