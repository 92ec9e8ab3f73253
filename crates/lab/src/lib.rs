//! What [`bouncelight`] is measured by and against.
//!
//! - [`mod@reference`]: the path tracer.
//! - [`metrics`]: image metrics.
//! - [`network`]: the CPU reference of networks, published generators.
//! - [`study`]: error against time, stability, the cheapest method that is good enough, this device.
//! - [`count`]: shaders that count what they do.
//! - [`scenes`]: scenes made by code in any number: the paper's rooms, homes.
//! - [`export`]: the pass for hosts without wgpu.

pub mod count;
pub mod export;
#[cfg(test)]
mod layouts;
pub mod metrics;
pub mod network;
pub mod reference;
pub mod scenes;
pub mod study;
