//! What can go wrong while a scene is found, read or written. Every variant names the file and,
//! inside it, the place.

use std::path::{Path, PathBuf};

/// Why a scene could not be loaded or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// There is no such file.
    #[error("{}: no such file", path.display())]
    NotFound {
        /// The path as it was given.
        path: PathBuf,
    },
    /// The path is a folder.
    #[error("{}: is a folder; give the .gltf, .glb or .obj file inside it", path.display())]
    IsFolder {
        /// The path as it was given.
        path: PathBuf,
    },
    /// The operating system refused to read the file.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The path as it was given.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file's name ends in something that no loader reads.
    #[error("{}: {} is not a scene format; .gltf, .glb and .obj are", path.display(), describe_extension(extension))]
    UnsupportedExtension {
        /// The path as it was given.
        path: PathBuf,
        /// What follows the last dot, possibly nothing.
        extension: String,
    },
    /// The file has no bytes.
    #[error("{}: the file is empty (0 bytes); fetch or export it again", path.display())]
    Empty {
        /// The path as it was given.
        path: PathBuf,
    },
    /// The file's content is wrong.
    #[error("{}: {place}: {problem}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// Where in the file, such as `accessors[3]` or `line 7`.
        place: String,
        /// What is wrong there.
        problem: String,
    },
    /// A glTF file cannot be shown without an extension that is not implemented.
    #[error("{}: extensionsRequired: not supported: {extension}; export the file without", path.display())]
    RequiresExtension {
        /// The file.
        path: PathBuf,
        /// The names of all such extensions, comma separated.
        extension: String,
    },
    /// No triangle of it can be seen from anywhere.
    #[error("{}: there is nothing to draw: {reason}", path.display())]
    NothingToDraw {
        /// The file.
        path: PathBuf,
        /// Why not.
        reason: String,
    },
    /// Neither a file nor a bundled scene.
    #[error(
        "{name}: neither a file (.gltf, .glb, .obj) nor a bundled scene ({known}) nor paper-room:INDEX nor home:INDEX"
    )]
    UnknownName {
        /// What was asked for.
        name: String,
        /// The names that exist, comma separated.
        known: String,
    },
    /// The name of a stream of scenes is not followed by a colon and a usable number.
    #[error("{spec}: INDEX of {stream}:INDEX must be a whole number from 0 to {max}")]
    BadIndex {
        /// The whole specification.
        spec: String,
        /// Name of the stream.
        stream: &'static str,
        /// The largest index accepted.
        max: u32,
    },
    /// A scene file could not be written.
    #[error("{}: cannot be written: {problem}", path.display())]
    Write {
        /// Where it should have gone.
        path: PathBuf,
        /// Why it did not.
        problem: String,
    },
}

fn describe_extension(extension: &str) -> String {
    if extension.is_empty() { "a name without extension".to_owned() } else { format!("`.{extension}`") }
}

impl SceneError {
    /// A [`SceneError::Broken`] for `place` in `path`.
    pub(crate) fn broken(path: &Path, place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Broken { path: path.to_owned(), place: place.into(), problem: problem.into() }
    }
}

/// Reads a whole scene file; folders, missing and empty files become their own errors.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>, SceneError> {
    if path.is_dir() {
        return Err(SceneError::IsFolder { path: path.to_owned() });
    }
    match crate::image_io::read_regular(path) {
        Ok(bytes) if bytes.is_empty() => Err(SceneError::Empty { path: path.to_owned() }),
        Ok(bytes) => Ok(bytes),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Err(SceneError::NotFound { path: path.to_owned() }),
        Err(source) => Err(SceneError::Unreadable { path: path.to_owned(), source }),
    }
}
