//! Networks, from file to GPU.
//!
//! - [`mod@format`]: the weights file: a safetensors file whose metadata holds the graph.
//!   `weights-format/` specifies it.
//! - [`convert`]: published generators' state dicts to weights files.
//! - [`graph`] and [`op`]: topology, shape inference, parameter and FLOP counts.
//! - [`pictures`]: four pictures as a network's input, and its output as a picture.
//! - [`plan`]: which dispatches run and where each tensor lives in one arena.
//! - [`cpu`]: the slow, obvious CPU reference; every kernel is tested against it and against
//!   PyTorch.
//! - [`gpu`]: the WGSL kernels' host side.
//!
//! Only [`gpu`] knows wgpu.

#[doc(hidden)]
pub mod activation;
mod check;
#[doc(hidden)]
pub mod convert;
#[doc(hidden)]
pub mod cpu;
mod document;
#[doc(hidden)]
pub mod dropout;
pub mod format;
#[doc(hidden)]
pub mod gpu;
#[doc(hidden)]
pub mod graph;
mod graph_error;
mod header;
#[doc(hidden)]
pub mod op;
#[doc(hidden)]
pub mod op_facts;
#[doc(hidden)]
pub mod peak;
#[doc(hidden)]
pub mod pictures;
#[doc(hidden)]
pub mod plan;
mod problem;
mod shape;
mod shipped;
mod spec;
mod stored;
mod tensor;
pub mod tune;
mod write;

/// The published generators as graphs.
#[doc(hidden)]
pub use convert::published as arch;
