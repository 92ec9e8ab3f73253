//! Scenes: the paper's stream, homes, glTF and OBJ with everything that can be wrong in them,
//! bundled scenes, round trips.
#![cfg(feature = "io")]

#[path = "common/build.rs"]
mod build;
mod common;

#[path = "scene/area.rs"]
mod area;
#[path = "scene/bad_input.rs"]
mod bad_input;
#[path = "scene/bumps.rs"]
mod bumps;
#[path = "scene/bundled.rs"]
mod bundled;
#[path = "scene/cameras.rs"]
mod cameras;
#[path = "scene/compressed.rs"]
mod compressed;
#[path = "scene/defaults.rs"]
mod defaults;
#[path = "scene/extensions.rs"]
mod extensions;
#[path = "scene/far.rs"]
mod far;
#[path = "scene/glb.rs"]
mod glb;
#[path = "scene/gltf_features.rs"]
mod gltf_features;
#[path = "scene/home.rs"]
mod home;
#[path = "scene/layers.rs"]
mod layers;
#[path = "scene/limits.rs"]
mod limits;
#[path = "scene/mended.rs"]
mod mended;
#[path = "scene/meshopt.rs"]
mod meshopt;
#[path = "scene/nothing.rs"]
mod nothing;
#[path = "scene/obj.rs"]
mod obj;
#[path = "scene/packed.rs"]
mod packed;
#[path = "scene/paper_room.rs"]
mod paper_room;
#[path = "scene/real_files.rs"]
mod real_files;
#[path = "scene/shared.rs"]
mod shared;
#[path = "scene/skies.rs"]
mod skies;
#[path = "scene/specular.rs"]
mod specular;
#[path = "scene/units.rs"]
mod units;
