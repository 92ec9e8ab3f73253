//! Panoramas as surroundings, from Radiance HDR and EXR files.

use crate::image_io::{ImageError, MAX_PIXELS, Windows, radiance, read_regular, read_with_windows};
use bouncelight::scene::Environment;
use bouncelight::scene::environment::{EnvironmentError, EnvironmentImage};
use std::path::Path;
use thiserror::Error;

/// Why a file cannot be the surroundings.
#[derive(Debug, Error)]
pub enum SkyError {
    /// The file is not an HDR or EXR picture, or cannot be read.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: String,
        /// What is wrong with it.
        reason: String,
    },
    /// It is one, but its numbers are no radiances.
    #[error(transparent)]
    Picture(#[from] EnvironmentError),
}

/// Reads a Radiance HDR or an EXR picture. Single texels that no light can have are mended,
/// which one sentence reports: overflown ones get the largest radiance that there is, negative
/// ones and such that are no numbers none.
///
/// # Errors
/// [`SkyError`]: not such a file, or more than a hundredth of its radiances is negative or not finite.
pub fn load(path: &Path) -> Result<(Environment, Option<String>), SkyError> {
    let shown = path.display().to_string();
    let file = |reason: String| SkyError::File { path: shown.clone(), reason };
    if path.is_dir() {
        return Err(file("is a folder; name an .hdr or .exr picture".into()));
    }
    let bytes = read_regular(path).map_err(|e| file(format!("cannot be read: {e}")))?;
    let (width, height, rgb) = if bytes.starts_with(radiance::MAGIC) {
        radiance::decode(&bytes).map_err(|e| file(format!("damaged or truncated HDR picture: {e}")))?
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        // The picture's own words start with the path, too.
        let told = |e: ImageError| file(e.to_string().trim_start_matches(&format!("{shown}: ")).into());
        let (layers, windows) = read_with_windows(path).map_err(told)?;
        let rgb = layers.light().map_err(told)?;
        shown_part([layers.width, layers.height], rgb, &windows).map_err(file)?
    } else {
        return Err(file("neither a Radiance HDR nor an EXR picture (its first bytes say otherwise)".into()));
    };
    let mut image = EnvironmentImage { name: shown, width, height, rgb };
    let repaired = image.repair();
    Ok((Environment::from_image(image)?, repaired))
}

/// What a picture shows of the pixels that it has: black beyond them, nothing beyond its border.
///
/// # Errors
/// That it is too large.
fn shown_part(size: [u32; 2], rgb: Vec<f32>, windows: &Windows) -> Result<(u32, u32, Vec<f32>), String> {
    let [width, height] = size.map(i64::from);
    let ([columns, rows], [left, top]) = (windows.shown, windows.first);
    if [left, top] == [0, 0] && [columns, rows] == size.map(u64::from) {
        return Ok((size[0], size[1], rgb));
    }
    // What is mostly empty is small: a few bytes can claim any window.
    let most = (64 * u64::from(size[0]) * u64::from(size[1])).clamp(1 << 22, MAX_PIXELS / 4);
    if columns == 0 || rows == 0 || columns.saturating_mul(rows) > most {
        return Err(format!("its display window has {columns}x{rows} pixels, its data window {width}x{height}"));
    }
    let mut out = vec![0.0; 3 * (columns * rows) as usize];
    // Columns of the display window that there are, and rows.
    let (from, to) = (left.clamp(0, columns as i64), (left + width).clamp(0, columns as i64));
    for y in top.clamp(0, rows as i64)..(top + height).clamp(0, rows as i64) {
        let line = &rgb[3 * ((y - top) * width + from - left) as usize..][..3 * (to - from) as usize];
        out[3 * (y * columns as i64 + from) as usize..][..line.len()].copy_from_slice(line);
    }
    Ok((columns as u32, rows as u32, out))
}
