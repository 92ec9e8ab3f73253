//! Scenes: the paper's stream, homes, glTF and OBJ with everything that can be wrong in them,
//! bundled scenes, round trips; picture files.

mod area;
mod bad_input;
#[path = "../common/build.rs"]
mod build;
mod bumps;
mod bundled;
mod cameras;
#[path = "../common/mod.rs"]
mod common;
mod compressed;
mod defaults;
mod extensions;
mod far;
#[path = "../common/glb.rs"]
mod glb;
mod gltf_features;
mod home;
mod images;
mod layers;
mod limits;
mod mended;
mod meshopt;
mod nothing;
mod obj;
#[path = "../common/packed.rs"]
mod packed;
mod paper_room;
mod real_files;
#[path = "../common/shared.rs"]
mod shared;
mod skies;
mod specular;
mod units;
