//! Triangles in trees, for rays: built on the CPU, traversed in `shaders/accel/traverse.wgsl`.
//! [`Accel`] is one tree over triangles of the world, as the path tracer has it; [`SceneRays`] has
//! a tree for each mesh, or for several that are in one place, and one over instances, which may
//! move.
//!
//! An eight-wide tree with quantised child boxes, after Ylitie, Karras and Laine ("Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", HPG 2017), collapsed from a
//! binary one by obvhs (PLOC and reinsertion). Nodes and leaves are blocks of 64 bytes in one
//! texture; a leaf is a pair of triangles that share an edge. How fast it is stands in
//! `docs/internals/bvh.md`, what was tried in `docs/log/2026-11-rays.md`. [`Accel::closest`] is the
//! same walk on the CPU.

#[doc(hidden)]
pub mod alias;
mod build;
mod caster;
mod cpu;
mod cutout;
mod emitters;
mod gpu;
pub(crate) mod hash;
mod image;
mod pairs;
mod pieces;
mod refit;
mod scene;
mod split;
mod surfaces;
mod threads;
mod trees;
mod wide;

pub use caster::{HitGpu, RayBatch, RayCaster, RayGpu};
pub use cpu::{AccelHit, SceneBlocks};
pub use emitters::EmitterGpu;
pub use gpu::AccelGpu;
pub(crate) use image::Reductions;
pub(crate) use pieces::Pieces;
pub use scene::{RayCounts, SceneRays};
pub use surfaces::luminance;
pub(crate) use trees::{MeshPart, corners};

use thiserror::Error;

/// The most triangles a structure takes: building needs 250 to 500 bytes for each, so 2 to 4 GB
/// here.
pub const MAX_TRIANGLES: u64 = 1 << 23;

/// Coordinates farther from the origin than this (metres) are left out like non-finite ones: their
/// products overflow.
pub const MAX_COORDINATE: f32 = 1e12;

/// Levels that a tree of triangles has at most.
pub const STACK_SIZE: usize = 24;

/// Levels that a tree of instances has at most, where it can be helped. With those of a mesh's tree
/// they are `STACK_SIZE` in `traverse.wgsl`, the entries of the traversal's stack.
pub const TOP_LEVELS: usize = 8;

/// Why there is no acceleration structure.
#[derive(Debug, Error)]
pub enum AccelError {
    /// More triangles than can be built within reasonable memory.
    #[error(
        "the scene has {triangles} triangles, but rays take {MAX_TRIANGLES} at most: building trees of more \
        would take over 4 GB of memory"
    )]
    TooManyTriangles {
        /// Triangles of the scene.
        triangles: u64,
    },
    /// The device's textures are too small.
    #[error(
        "the scene's rays need {blocks} blocks of 64 bytes, but this device's textures hold {limit} (its \
        largest side is {side}); use a simpler scene"
    )]
    TooLarge {
        /// Blocks that are needed.
        blocks: u64,
        /// Blocks that fit.
        limit: u64,
        /// `max_texture_dimension_2d` of the device.
        side: u32,
    },
    /// The device's bindings are too small.
    #[error(
        "material data of {triangles} triangles for rays needs {bytes} bytes, but this device binds {limit} at once; \
        use a simpler scene"
    )]
    Binding {
        /// Triangles of all meshes.
        triangles: u64,
        /// Bytes that are needed.
        bytes: u64,
        /// `max_storage_buffer_binding_size` of the device, or the size of its largest buffer.
        limit: u64,
    },
    /// Whoever waited does not any more.
    #[error("building the BVHs was cancelled")]
    Stopped,
    /// The device has not enough memory.
    #[error("the device has no memory for the acceleration structure of {bytes} bytes: {message}")]
    OutOfMemory {
        /// Bytes of the blocks.
        bytes: u64,
        /// The driver's words.
        message: String,
    },
}

/// Triangles in an order and with boxes around them that let a ray find what it hits in logarithmic
/// time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Accel {
    blocks: Vec<wide::Block>,
    triangles: usize,
    /// Triangles left out because a coordinate was not finite or beyond [`MAX_COORDINATE`].
    pub dropped_not_finite: usize,
    /// Triangles left out because they have no area; no ray can hit them.
    pub dropped_degenerate: usize,
}

impl Accel {
    /// Fails when `triangles` is more than [`Accel::build`] takes. For callers that would first
    /// have to make them all.
    pub fn check_count(triangles: u64) -> Result<(), AccelError> {
        if triangles > MAX_TRIANGLES { Err(AccelError::TooManyTriangles { triangles }) } else { Ok(()) }
    }

    /// Builds the structure over `triangles` (three corners each, world space, metres). Hits name
    /// triangles by their index here.
    ///
    /// Triangles that no ray can hit are left out and counted: `dropped_not_finite`,
    /// `dropped_degenerate`. An empty scene is one that nothing hits.
    pub fn build(triangles: &[[[f32; 3]; 3]]) -> Result<Self, AccelError> {
        Self::check_count(triangles.len() as u64)?;
        Ok(build::build(triangles))
    }

    /// Blocks (nodes, leaves and places left free), at least 1.
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Leaves that hold a triangle or two; what fills its box badly stands in several.
    pub fn leaf_count(&self) -> usize {
        self.blocks.iter().filter(|b| wide::is_leaf(b)).count()
    }

    /// Triangles that can be hit.
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// Bytes of the blocks. On the GPU they are rounded up to whole texture rows of 128 KiB.
    pub fn bytes(&self) -> u64 {
        std::mem::size_of_val(&self.blocks[..]) as u64
    }

    /// Levels of the tree, at most [`STACK_SIZE`].
    pub fn depth(&self) -> usize {
        wide::depth(&self.blocks)
    }

    /// The blocks' words, sixteen each: for tests that damage them.
    #[doc(hidden)]
    pub fn words_mut(&mut self) -> &mut [u32] {
        bytemuck::cast_slice_mut(&mut self.blocks)
    }
}
