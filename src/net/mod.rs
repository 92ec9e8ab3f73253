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

pub mod activation;
mod check;
pub mod convert;
pub mod cpu;
mod document;
pub mod dropout;
pub mod format;
pub mod gpu;
pub mod graph;
mod graph_error;
mod header;
pub mod op;
pub mod op_facts;
pub mod peak;
pub mod pictures;
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
pub use convert::published as arch;
