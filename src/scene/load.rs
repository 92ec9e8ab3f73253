//! One door for every kind of scene: a path, a bundled name, or `paper-room:INDEX`.

use std::path::Path;

use super::{LoadOptions, Scene, SceneError, bundled, gltf, obj, paper_room};

/// Loads what `spec` names: a `.gltf`, `.glb` or `.obj` path, `paper-room:INDEX` (see [`paper_room`]), or one of
/// [`bundled::NAMES`]. The result has at least one camera and one source of light; see [`super::defaults`].
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
    if let Some(index) = spec.strip_prefix("paper-room:") {
        return match index.parse::<u32>() {
            Ok(index) if index <= paper_room::MAX_INDEX => Ok(paper_room::scene(index)),
            _ => Err(SceneError::BadIndex { spec: spec.to_owned(), max: paper_room::MAX_INDEX }),
        };
    }
    if spec == "paper-room" {
        return Err(SceneError::BadIndex { spec: spec.to_owned(), max: paper_room::MAX_INDEX });
    }
    if let Some(scene) = bundled::scene(spec) {
        return Ok(scene);
    }
    let path = Path::new(spec);
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if path.is_dir() {
        return Err(SceneError::IsFolder { path: path.to_owned() });
    }
    match extension.as_str() {
        "gltf" | "glb" => gltf::load_with(path, options),
        "obj" => obj::load_with(path, options),
        _ if path.is_file() => Err(SceneError::UnsupportedExtension { path: path.to_owned(), extension }),
        _ if extension.is_empty() && !spec.contains(std::path::is_separator) => {
            Err(SceneError::UnknownName { name: spec.to_owned(), known: bundled::NAMES.join(", ") })
        }
        _ => Err(SceneError::NotFound { path: path.to_owned() }),
    }
}
