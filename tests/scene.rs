//! Scenes: the paper's stream, glTF and OBJ with everything that can be wrong in them, bundled scenes, round trips.
#![cfg(feature = "io")]

#[path = "scene/paper_room.rs"]
mod paper_room;
#[path = "scene/real_files.rs"]
mod real_files;
#[path = "scene/shared.rs"]
mod shared;
