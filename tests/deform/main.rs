//! What moves: skins, morph targets, lights and cameras of files; drawn, traced and played.
#![cfg(feature = "io")]

#[path = "../common/build.rs"]
mod build;
#[path = "../common/mod.rs"]
mod common;
mod figures;
mod files;
#[path = "../common/glb.rs"]
#[allow(dead_code, reason = "the scene tests use more of it")]
mod glb;
mod light;
mod motion;
#[path = "../common/program.rs"]
mod program;
mod rays;
