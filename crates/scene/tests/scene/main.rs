//! Scenes: the paper's stream, homes, glTF and OBJ with everything that can be wrong in them,
//! bundled scenes, round trips; picture files.

mod area;
mod bad_input;
#[path = "../../../../tests/common/build.rs"]
mod build;
mod bumps;
mod bundled;
mod cameras;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod compressed;
mod defaults;
mod extensions;
mod far;
#[path = "../../../../tests/common/glb.rs"]
mod glb;
mod gltf_features;
mod images;
mod layers;
mod limits;
mod meshopt;
mod nothing;
mod obj;
#[path = "../../../../tests/common/packed.rs"]
mod packed;
mod real_files;
mod repaired;
#[path = "../../../../tests/common/shared.rs"]
mod shared;
mod skies;
mod specular;
mod units;
