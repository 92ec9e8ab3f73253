//! What the repository promises of itself: shaders that compile, licences, public items. No adapter.

mod licences;
mod public_api;
mod shaders;
