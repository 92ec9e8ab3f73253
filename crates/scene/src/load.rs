//! One door for every kind of file and the bundled scenes.

use std::path::Path;

use super::{LoadOptions, SceneError, bundled, gltf, obj, units};
use bouncelight::scene::Scene;

/// Loads what `spec` names: a `.gltf`, `.glb` or `.obj` path, or one of [`bundled::NAMES`]. The result
/// has at least one camera and one source of light; see [`super::defaults`].
///
/// # Errors
/// [`SceneError`], which names the file and the place in it.
pub fn load(spec: &str) -> Result<Scene, SceneError> {
    load_with(spec, LoadOptions::default())
}

/// As [`load`], with limits of one's own on what the file may name.
///
/// # Errors
/// As [`load`].
pub fn load_with(spec: &str, options: LoadOptions) -> Result<Scene, SceneError> {
    if let Some(scene) = bundled::scene(spec) {
        return Ok(scene);
    }
    let path = Path::new(spec);
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if path.is_dir() {
        return Err(SceneError::IsFolder { path: path.to_owned() });
    }
    let told = |mut scene| {
        units::tell(&mut scene, options.units);
        scene
    };
    match extension.as_str() {
        "gltf" | "glb" => gltf::load_with(path, options).map(told),
        "obj" => obj::load_with(path, options).map(told),
        _ if path.is_file() => Err(SceneError::UnsupportedExtension { path: path.to_owned(), extension }),
        _ if extension.is_empty() && !spec.contains(std::path::is_separator) => {
            Err(SceneError::UnknownName { name: spec.to_owned(), known: bundled::NAMES.join(", ") })
        }
        _ => Err(SceneError::NotFound { path: path.to_owned() }),
    }
}
