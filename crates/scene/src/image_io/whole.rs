//! Files are written whole or not at all: into a temporary file in the same folder, which then
//! takes the name.

use super::ImageError;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Writes `bytes` to `path`, replacing what was there only when every byte has arrived; `-` is
/// standard output.
///
/// Devices and pipes cannot be replaced and are written directly; a symbolic link keeps pointing
/// where it does.
///
/// # Errors
/// Every error names the path; the old file, if any, is then untouched.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let fail = |source| ImageError::Write { path: path.into(), source };
    if path.as_os_str() == "-" {
        let mut out = std::io::stdout().lock();
        return out.write_all(bytes).and_then(|()| out.flush()).map_err(fail);
    }
    // Following links first: the rename would replace the link itself.
    let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    match target.metadata() {
        Ok(meta) if meta.is_dir() => return Err(ImageError::IsFolder { path: path.into() }),
        Ok(meta) if !meta.is_file() => {
            let mut device = std::fs::OpenOptions::new().write(true).open(&target).map_err(fail)?;
            return device.write_all(bytes).and_then(|()| device.flush()).map_err(fail);
        }
        _ => {}
    }
    let folder = match target.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
        _ => PathBuf::from("."),
    };
    if !folder.is_dir() {
        return Err(ImageError::NoFolder { path: path.into(), folder });
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bouncelight-").suffix(".part");
    #[cfg(unix)]
    {
        // tempfile's own default is 0600; a picture should get what the user's umask gives.
        use std::os::unix::fs::PermissionsExt;
        let mode = target.metadata().map_or(0o666, |m| m.permissions().mode() & 0o777);
        builder.permissions(std::fs::Permissions::from_mode(mode));
    }
    let mut file = builder.tempfile_in(&folder).map_err(fail)?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(fail)?;
    file.persist(&target).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Whether a file could be written to `path`, found out without touching it, so that long work can
/// fail before it starts.
///
/// # Errors
/// The path is a folder, or its folder does not exist.
pub fn check_writable(path: &Path) -> Result<(), ImageError> {
    if path.is_dir() {
        return Err(ImageError::IsFolder { path: path.into() });
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if path.as_os_str() != "-" && !folder.is_dir() {
        return Err(ImageError::NoFolder { path: path.into(), folder: folder.into() });
    }
    Ok(())
}

/// Largest file that is read, bytes: what a GLB can hold.
pub(crate) const MAX_BYTES: u64 = u32::MAX as u64;

/// Reads a regular file of at most [`MAX_BYTES`].
///
/// # Errors
/// The system's, or one of kind `InvalidInput` with a sentence.
pub(crate) fn read_regular(path: &Path) -> std::io::Result<Vec<u8>> {
    let refused = |text: String| std::io::Error::new(std::io::ErrorKind::InvalidInput, text);
    // Asked before it is opened: opening a pipe waits for a writer.
    let about = std::fs::metadata(path)?;
    if !about.is_file() {
        return Err(refused("is a folder, device or pipe, not a regular file".to_owned()));
    }
    if about.len() > MAX_BYTES {
        return Err(refused(format!("has {} bytes; at most {MAX_BYTES} are read", about.len())));
    }
    let mut bytes = Vec::with_capacity(about.len() as usize);
    // Files that grow while they are read, and some that have no honest size.
    std::fs::File::open(path)?.take(MAX_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(refused(format!("has more than {MAX_BYTES} bytes")));
    }
    Ok(bytes)
}

/// The bytes of `path`.
///
/// # Errors
/// Missing or unreadable file, folder, zero bytes.
pub(super) fn read_all(path: &Path) -> Result<Vec<u8>, ImageError> {
    if path.is_dir() {
        return Err(ImageError::IsFolder { path: path.into() });
    }
    let bytes = read_regular(path).map_err(|source| ImageError::Read { path: path.into(), source })?;
    if bytes.is_empty() {
        return Err(ImageError::Empty { path: path.into() });
    }
    Ok(bytes)
}
