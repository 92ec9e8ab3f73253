//! Which extensions are understood, and what to do about a file that requires others.

use crate::SceneError;
use std::path::Path;

/// Extensions that this loader has.
const SUPPORTED: [&str; 22] = [
    super::area::NAME,
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

pub(super) fn is_known(extension: &str) -> bool {
    SUPPORTED.contains(&extension)
}

/// Refuses a file that requires what is not understood, with one sentence about all of it.
pub(super) fn check_required(path: &Path, root: &gltf::json::Root) -> Result<(), SceneError> {
    let missing: Vec<&str> = root.extensions_required.iter().map(String::as_str).filter(|e| !is_known(e)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(SceneError::RequiresExtension { path: path.to_owned(), extension: missing.join(", ") })
}
