//! The rasteriser: G-buffers, lights, textures, what blends and what moves, whole frames and the tone curve.

mod blocks;
#[path = "../common/build.rs"]
mod build;
mod closed;
#[path = "../common/mod.rs"]
mod common;
mod culling;
mod deform;
#[path = "../common/figures.rs"]
mod figures;
mod frame;
mod gbuffer;
#[path = "../common/glb.rs"]
mod glb;
mod lights;
mod pictures;
mod previous_transforms;
mod render;
mod textures;
mod tonemap;
mod veils;
