//! Reading files that a scene names, with limits.
//!
//! A scene file comes from anywhere, and what it names is read before anybody looks at it. So names
//! must stay in the scene file's folder unless the user allows more
//! ([`LoadOptions::allow_outside`]), only regular files are read (a device or pipe may never end),
//! and sizes are known to fit before memory is taken.

use super::units::Units;
use crate::image_io::read_regular;
use std::path::{Component, Path, PathBuf};

/// What a loader may do on behalf of a file.
#[derive(Debug, Clone, Copy, Default)]
pub struct LoadOptions {
    /// Buffers, textures and material libraries may lie outside the folder of the file that names
    /// them.
    pub allow_outside: bool,
    /// What a glTF file says wrongly refuses it, where it would be mended or left out with a warning.
    pub strict: bool,
    /// Its unit of length and its vertical.
    pub units: Units,
}

/// The folder of a scene file, from which the names in it count.
pub(crate) struct Folder {
    path: PathBuf,
    options: LoadOptions,
}

impl Folder {
    /// The folder of `file`.
    pub(crate) fn of(file: &Path, options: LoadOptions) -> Self {
        let path = match file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        Self { path, options }
    }

    /// Reads the file called `name` in the scene file.
    ///
    /// # Errors
    /// A sentence that begins with the name.
    pub(crate) fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        let path = self.path.join(name);
        if !self.options.allow_outside && !self.holds(&path) {
            return Err(format!("'{name}' lies outside the file's folder and is not read; --allow-outside permits it"));
        }
        read_regular(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::InvalidInput => format!("'{name}' {e}"),
            _ => format!("'{name}' cannot be read: {e}"),
        })
    }

    /// By its words first, so that nothing is learnt about what lies outside, then with links
    /// followed.
    fn holds(&self, path: &Path) -> bool {
        let absolute = |p: &Path| std::path::absolute(p).map(|p| flattened(&p)).unwrap_or_default();
        if !absolute(path).starts_with(absolute(&self.path)) {
            return false;
        }
        match (self.path.canonicalize(), path.canonicalize()) {
            (Ok(folder), Ok(file)) => file.starts_with(folder),
            // It does not exist, which reading it will say.
            _ => true,
        }
    }
}

/// A path without `.` and `..`, by its words.
fn flattened(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

/// A text without the byte order mark that some editors put before it.
pub(crate) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}
