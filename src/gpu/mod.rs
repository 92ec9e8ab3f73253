//! The GPU as the rest of the house sees it: a chosen device, shader sources, bind groups,
//! readback, timing.

#[doc(hidden)]
pub mod bind;
#[doc(hidden)]
pub mod binding;
#[doc(hidden)]
pub mod bound;
mod choose;
#[doc(hidden)]
pub mod pipeline_cache;
#[doc(hidden)]
pub mod probe;
pub mod readback;
#[doc(hidden)]
pub mod shaders;
#[doc(hidden)]
pub mod tape;
pub mod timing;

pub(crate) use choose::is_software;
pub use choose::{Backend, Gpu, GpuError, GpuOptions, candidates, wanted_features};
