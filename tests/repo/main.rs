//! What the repository promises of itself: shaders that compile, licences, public items. No adapter.

#[path = "../common/mod.rs"]
mod common;
mod docs;
mod layouts;
mod licences;
mod public_api;
mod shader_names;
mod shaders;
mod words;
