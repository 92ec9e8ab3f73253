//! Networks, from file to GPU.
//!
//! - [`mod@format`]: the weights file: a safetensors file whose metadata holds the graph.
//!   `weights-format/` specifies it.
//! - [`graph`] and [`op`]: topology, shape inference, parameter and FLOP counts.
//! - [`plan`]: which dispatches run and where each tensor lives in one arena.
//! - [`gpu`]: the WGSL kernels' host side.
//!
//! Only [`gpu`] knows wgpu.
//!
//! ```
//! use bouncelight::net::format::Weights;
//! let weights = Weights::shipped()?;
//! println!("{}: {}", weights.name, weights.hash_text());
//! # Ok::<_, bouncelight::net::format::WeightsError>(())
//! ```

#[doc(hidden)]
pub mod activation;
mod check;
mod document;
#[doc(hidden)]
pub mod dropout;
pub mod format;
#[doc(hidden)]
pub mod gpu;
#[doc(hidden)]
pub mod graph;
mod graph_error;
#[doc(hidden)]
pub mod header;
#[doc(hidden)]
pub mod op;
#[doc(hidden)]
pub mod op_facts;
#[doc(hidden)]
pub mod plan;
#[doc(hidden)]
pub mod problem;
mod shape;
mod shipped;
mod spec;
mod stored;
mod tensor;
pub mod tune;
mod write;
