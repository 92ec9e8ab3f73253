//! Published generators: from a PyTorch state dict to a weights file to a picture, against PyTorch
//! and through the program.
#![cfg(feature = "cli")]

mod apply;
#[path = "../common/mod.rs"]
mod common;
mod convert;
mod state;
