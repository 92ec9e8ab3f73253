//! Reading files that a scene names, with limits.
//!
//! A scene file comes from anywhere, and what it names is read before anybody looks at it. So names must stay in the
//! scene file's folder unless the user allows more ([`LoadOptions::allow_outside`]), only regular files are read (a
//! device or pipe may never end), and sizes are known to fit before memory is taken.

use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// What a loader may do on behalf of a file.
#[derive(Debug, Clone, Copy, Default)]
pub struct LoadOptions {
    /// Buffers, textures and material libraries may lie outside the folder of the file that names them.
    pub allow_outside: bool,
}

/// Largest file that is read, bytes: what a GLB can hold.
pub(crate) const MAX_BYTES: u64 = u32::MAX as u64;

/// Reads a regular file of at most [`MAX_BYTES`].
///
/// # Errors
/// The system's, or one of kind `InvalidInput` with a sentence.
pub(crate) fn read_regular(path: &Path) -> std::io::Result<Vec<u8>> {
    let told = |text: String| std::io::Error::new(std::io::ErrorKind::InvalidInput, text);
    // Asked before it is opened: opening a pipe waits for a writer.
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        return Err(told("is no regular file but a folder, device or pipe".to_owned()));
    }
    if about.len() > MAX_BYTES {
        return Err(told(format!("has {} bytes; at most {MAX_BYTES} are read", about.len())));
    }
    let mut bytes = Vec::with_capacity(about.len() as usize);
    // Files that grow while they are read, and some that have no honest size.
    std::fs::File::open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(told(format!("has more than {MAX_BYTES} bytes")));
    }
    Ok(bytes)
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

    /// By its words first, so that nothing is learnt about what lies outside, then with links followed.
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
