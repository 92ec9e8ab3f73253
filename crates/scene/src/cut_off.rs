//! Pictures whose end is missing, as a broken download leaves them: what is there is shown.

use image::{DynamicImage, RgbaImage};
use std::io::Cursor;

/// What the pixels are that are missing: grey, which is flat in a normal map.
const MISSING: [u8; 4] = [128, 128, 128, 255];

/// Whether a PNG or a JPEG lacks its end.
pub(super) fn is_cut_off(bytes: &[u8]) -> bool {
    let has = |bytes: &[u8], mark: &[u8]| bytes.windows(mark.len()).any(|w| w == mark);
    if bytes.starts_with(b"\x89PNG") {
        // Files may go on behind their end.
        return !has(&bytes[bytes.len().saturating_sub(64)..], b"IEND") && !has(bytes, b"IEND");
    }
    if bytes.starts_with(b"\xff\xd8") && !bytes.ends_with(b"\xff\xd9") {
        // A preview in the header has an end of its own; within a scan there is none.
        let scan = bytes.windows(2).rposition(|w| w == b"\xff\xda").unwrap_or(0);
        return !has(&bytes[scan..], b"\xff\xd9");
    }
    false
}

/// The rows that a PNG has, the rest grey; `None` where it has none, is no PNG or too large: a side
/// of more than `longest`, more than `most` bytes.
pub(super) fn png(bytes: &[u8], longest: u32, most: u64) -> Option<DynamicImage> {
    let limits = png::Limits { bytes: usize::try_from(most).ok()? };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::normalize_to_color8() | png::Transformations::ALPHA);
    let mut reader = decoder.read_info().ok()?;
    let (width, height) = reader.info().size();
    if width > longest || height > longest || u64::from(width) * u64::from(height) * 8 > most {
        return None;
    }
    let (color, _) = reader.output_color_type();
    let mut rgba = MISSING.repeat(width as usize * height as usize);
    let stride = 4 * width as usize;
    let mut rows = 0;
    let mut row = Vec::new();
    while let Ok(Some(read)) = reader.next_interlaced_row() {
        row.clear();
        match color {
            png::ColorType::Rgba => row.extend_from_slice(read.data()),
            png::ColorType::GrayscaleAlpha => {
                row.extend(read.data().chunks_exact(2).flat_map(|p| [p[0], p[0], p[0], p[1]]));
            }
            _ => return None,
        }
        match read.interlace() {
            png::InterlaceInfo::Null(_) => {
                let place = rgba.get_mut(rows * stride..(rows + 1) * stride)?;
                place.copy_from_slice(row.get(..stride)?);
            }
            png::InterlaceInfo::Adam7(info) => png::splat_interlaced_row(&mut rgba, stride, &row, info, 32),
        }
        rows += 1;
    }
    (rows > 0).then(|| RgbaImage::from_raw(width, height, rgba)).flatten().map(DynamicImage::ImageRgba8)
}
