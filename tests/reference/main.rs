//! The path tracer against closed forms, against numerical integrals made here, against laws that
//! hold for any scene, against Cycles; and the rasteriser's direct light against the path tracer.
//!
//! Every estimate comes with an error bar from the two halves of its samples (`stats.rs`); an
//! answer more than four standard errors away fails, and so does an error bar too wide to see 2 %.
//! Seeds are fixed.
#![cfg(all(feature = "reference", feature = "io"))]

#[path = "../common/mod.rs"]
mod common;

#[path = "../common/build.rs"]
mod build;

mod agreement;
mod bad_input;
mod cycles;
mod furnace;
mod harness;
mod light;
mod lobe;
mod raster;
mod scenes;
mod stats;
