//! The path tracer against closed forms, against numerical integrals made here, against laws that
//! hold for any scene, against Cycles; and the rasteriser's direct light against the path tracer.
//!
//! Every estimate comes with an error bar from the two halves of its samples (`stats.rs`); an
//! answer more than four standard errors away fails, and so does an error bar too wide to see 2 %.
//! Seeds are fixed.

mod accel;
mod agreement;
mod bad_input;
#[path = "../../../../tests/common/build.rs"]
mod build;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod conformance;
mod cycles;
mod film;
mod furnace;
#[path = "../../../../tests/common/glb.rs"]
mod glb;
mod harness;
mod light;
mod lobe;
mod raster;
mod raster_cycles;
mod scenes;
mod stats;
#[path = "../../../../tests/common/trace.rs"]
mod trace;
mod tracer;
mod transport;
