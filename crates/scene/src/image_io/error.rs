//! What can go wrong with a picture file, in words that name the file and what to do.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a picture file could not be read or written.
#[derive(Debug, Error)]
pub enum ImageError {
    /// The file could not be opened or read.
    #[error("{path}: cannot be read: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A folder stands where a file is wanted.
    #[error("{path}: is a folder; name a picture file", path = path.display())]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// The folder of an output file does not exist.
    #[error("{path}: cannot be written because the folder {folder} does not exist; create it first",
        path = path.display(), folder = folder.display())]
    NoFolder {
        /// The output file.
        path: PathBuf,
        /// The missing folder.
        folder: PathBuf,
    },
    /// Writing failed (no permission, disk full, closed pipe, ...). Nothing was left behind.
    #[error("{path}: cannot be written: {source}", path = path.display())]
    Write {
        /// The output file, `-` for standard output.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file has no bytes.
    #[error("{path}: the file is empty (0 bytes)", path = path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The first bytes are not those of the format.
    #[error("{path}: not {expected} file (its first bytes say otherwise)", path = path.display())]
    NotThisFormat {
        /// The file.
        path: PathBuf,
        /// The format with its article, as in "a PNG".
        expected: &'static str,
    },
    /// The file is truncated or damaged.
    #[error("{path}: damaged or truncated {format} file: {message}", path = path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// PNG or EXR.
        format: &'static str,
        /// What the decoder met.
        message: String,
    },
    /// The file is sound but uses something that is not read here.
    #[error("{path}: {message}", path = path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What it uses and what to do about it.
        message: String,
    },
    /// The header claims more than is decoded; checked before any pixel memory is taken.
    #[error("{path}: {width}×{height} pixels in {channels} channels is more than is read here (at most \
        {max_pixels} pixels and {max_samples} samples)",
        path = path.display(), max_pixels = super::MAX_PIXELS, max_samples = super::MAX_SAMPLES)]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Claimed width, pixels.
        width: u64,
        /// Claimed height, pixels.
        height: u64,
        /// Claimed channels.
        channels: u64,
    },
    /// A layer that was asked for is not in the file.
    #[error("{path}: has no layer `{wanted}`; it has {found}", path = path.display())]
    NoLayer {
        /// The file.
        path: PathBuf,
        /// The layer.
        wanted: String,
        /// The layers that it has.
        found: String,
    },
    /// A pixel is NaN or infinite.
    #[error("{path}: layer `{layer}` channel {channel} holds {count} non-finite values, the first at x {x}, y {y}",
        path = path.display())]
    NonFinite {
        /// The file.
        path: PathBuf,
        /// The layer.
        layer: String,
        /// The channel.
        channel: String,
        /// Column of the first one.
        x: usize,
        /// Row of the first one.
        y: usize,
        /// How many in the layer.
        count: usize,
    },
    /// The caller's data do not fit together: wrong length, no pixel, a name twice.
    #[error("{path}: cannot be written: {message}", path = path.display())]
    Shape {
        /// The output file.
        path: PathBuf,
        /// What does not fit.
        message: String,
    },
}

impl ImageError {
    pub(super) fn broken(path: &Path, format: &'static str, message: impl ToString) -> Self {
        Self::Broken { path: path.into(), format, message: message.to_string() }
    }

    pub(super) fn shape(path: &Path, message: impl Into<String>) -> Self {
        Self::Shape { path: path.into(), message: message.into() }
    }
}
