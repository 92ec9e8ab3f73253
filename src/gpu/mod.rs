//! Device choice, readback and pass timing.
//!
//! Hosts that embed the passes bring their own device. Programs without one open it here:
//!
//! ```no_run
//! use bouncelight::gpu::{Backend, Gpu, GpuOptions};
//! let gpu = Gpu::open(&GpuOptions { backend: Backend::Vulkan, ..Default::default() })?;
//! eprintln!("{}", gpu.sentence());
//! # Ok::<_, bouncelight::gpu::GpuError>(())
//! ```

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
