//! Files that change: scene, weights and, in a checkout, shaders are looked at twice a second.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Time between two looks.
pub const EVERY: Duration = Duration::from_millis(500);

/// What has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changed {
    Scene,
    Weights,
    Shaders,
}

/// Files and how they were when last looked at.
#[derive(Debug, Default)]
pub struct Watch {
    seen: BTreeMap<PathBuf, Option<SystemTime>>,
}

impl Watch {
    /// Whether any of `files` has changed since the last look; a file seen for the first time has
    /// not.
    fn changed(&mut self, files: &[PathBuf]) -> bool {
        let mut any = false;
        for file in files {
            let now = std::fs::metadata(file).and_then(|m| m.modified()).ok();
            // A file that is being replaced is gone for a moment; that is no change yet.
            if now.is_none() {
                continue;
            }
            if let Some(before) = self.seen.insert(file.clone(), now) {
                any |= before != now;
            }
        }
        any
    }

    /// What has changed of a scene with what it refers to, of weights, and of the shaders under
    /// `shaders`.
    pub fn look(&mut self, spec: Option<&str>, weights: Option<&Path>, shaders: Option<&Path>) -> Vec<Changed> {
        let mut changed = Vec::new();
        if let Some(spec) = spec.filter(|s| Path::new(s).is_file())
            && self.changed(&with_company(Path::new(spec)))
        {
            changed.push(Changed::Scene);
        }
        if let Some(weights) = weights
            && self.changed(&[weights.to_owned()])
        {
            changed.push(Changed::Weights);
        }
        if let Some(shaders) = shaders
            && self.changed(&below(shaders))
        {
            changed.push(Changed::Shaders);
        }
        changed
    }
}

/// The scene's file and the buffers, materials and images beside it.
fn with_company(scene: &Path) -> Vec<PathBuf> {
    let mut files = vec![scene.to_owned()];
    let folder = scene.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let is_company = |p: &PathBuf| {
        let extension = p.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        ["bin", "mtl", "png", "jpg", "jpeg", "webp", "ktx2"].contains(&extension.as_str())
    };
    if scene.extension().is_some_and(|e| !e.eq_ignore_ascii_case("glb")) {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        files.extend(entries.map(|e| e.path()).filter(is_company).take(256));
    }
    files
}

/// Every `.wgsl` file in a folder and its folders.
fn below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files.extend(below(&path));
        } else if path.extension().is_some_and(|e| e == "wgsl") {
            files.push(path);
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_file_is_told_once() {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("a.obj");
        let material = dir.path().join("a.mtl");
        std::fs::write(&scene, "v 0 0 0").unwrap();
        std::fs::write(&material, "newmtl m").unwrap();
        let spec = scene.to_str().unwrap();
        let mut watch = Watch::default();
        assert!(watch.look(Some(spec), None, None).is_empty(), "the first look knows nothing yet");
        let later = SystemTime::now() + Duration::from_secs(5);
        std::fs::File::options().write(true).open(&material).unwrap().set_modified(later).unwrap();
        assert_eq!(watch.look(Some(spec), None, Some(dir.path())), [Changed::Scene]);
        assert!(watch.look(Some(spec), None, None).is_empty());
        // Names of bundled scenes are no files.
        assert!(watch.look(Some("interior"), None, None).is_empty());
    }
}
