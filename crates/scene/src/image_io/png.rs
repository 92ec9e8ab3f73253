//! PNG: 8-bit sRGB out, 8 or 16 bit in. Metadata are text chunks.

use super::{Image, ImageError, Metadata, check_size, read_all, write_whole};
use png::{BitDepth, ColorType, Encoder, Transformations};
use std::io::Cursor;
use std::path::Path;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Writes display-encoded sRGB bytes (`3 · width · height`, or `4 · width · height` with alpha, by which
/// colours are not multiplied; rows from the top) with `metadata` as tEXt chunks, or iTXt where a text is not Latin-1. `-` is standard output. The file appears whole
/// or not at all.
///
/// # Errors
/// No pixels, wrong length, a metadata key that PNG does not allow (1 to 79 Latin-1 characters), or
/// a failed write.
pub fn write_png(
    path: &Path,
    width: u32,
    height: u32,
    pixels: &[u8],
    metadata: &[(String, String)],
) -> Result<(), ImageError> {
    let (bytes, count) = (pixels.len() as u64, u64::from(width) * u64::from(height));
    if count == 0 || (bytes != 3 * count && bytes != 4 * count) {
        return Err(ImageError::shape(path, format!("{bytes} bytes are not {width}×{height} RGB or RGBA pixels")));
    }
    write_whole(path, &encode(path, width, height, pixels, metadata)?)
}

fn encode(path: &Path, w: u32, h: u32, pixels: &[u8], metadata: &[(String, String)]) -> Result<Vec<u8>, ImageError> {
    let failed = |e: png::EncodingError| ImageError::shape(path, e.to_string());
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, w, h);
    let opaque = pixels.len() as u64 == 3 * u64::from(w) * u64::from(h);
    encoder.set_color(if opaque { ColorType::Rgb } else { ColorType::Rgba });
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    for (key, text) in metadata {
        // PNG forbids NUL in text; Latin-1 fits tEXt, everything else needs iTXt.
        let text = text.replace('\0', " ");
        if text.chars().all(|c| u32::from(c) < 256) {
            encoder.add_text_chunk(key.clone(), text).map_err(failed)?;
        } else {
            encoder.add_itxt_chunk(key.clone(), text).map_err(failed)?;
        }
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// Writes frames of one size (display-encoded sRGB bytes, rows from the top) as an animated PNG
/// that repeats for ever. Programs that know no animation show the first. The file appears whole or
/// not at all.
///
/// # Errors
/// No frame, no pixels, a frame of wrong length, or a failed write.
pub fn write_apng(path: &Path, size: [u32; 2], frames: &[&[u8]], frame_ms: u16) -> Result<(), ImageError> {
    let failed = |e: png::EncodingError| ImageError::shape(path, e.to_string());
    let [width, height] = size;
    let bytes = 3 * u64::from(width) * u64::from(height);
    if let Some(wrong) = frames.iter().find(|f| f.len() as u64 != bytes) {
        return Err(ImageError::shape(path, format!("{} bytes are not {width}×{height} RGB pixels", wrong.len())));
    }
    let count = u32::try_from(frames.len()).unwrap_or(u32::MAX);
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_animated(count, 0).map_err(failed)?;
    encoder.set_frame_delay(frame_ms, 1000).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    for frame in frames {
        writer.write_image_data(frame).map_err(failed)?;
    }
    writer.finish().map_err(failed)?;
    write_whole(path, &file)
}

/// Reads a PNG of any kind as f32 in [0, 1], display-encoded as stored: 3 channels, or 4 where it
/// has transparency. Grey and palette pictures are widened to RGB; 8 bits divide by 255, 16 bits
/// by 65535.
///
/// # Errors
/// Missing, empty, truncated or foreign file; more than [`MAX_PIXELS`](super::MAX_PIXELS).
pub fn read_png(path: &Path) -> Result<Image, ImageError> {
    read_png_with_metadata(path).map(|(image, _)| image)
}

/// [`read_png`] and the file's text chunks in their order.
///
/// # Errors
/// As [`read_png`].
pub fn read_png_with_metadata(path: &Path) -> Result<(Image, Metadata), ImageError> {
    decode_png(path, &read_all(path)?)
}

/// [`read_png_with_metadata`] of a file that is in memory; errors name `path`.
///
/// # Errors
/// As [`read_png`].
pub fn decode_png(path: &Path, bytes: &[u8]) -> Result<(Image, Metadata), ImageError> {
    if !bytes.starts_with(SIGNATURE) {
        return Err(ImageError::NotThisFormat { path: path.into(), expected: "a PNG" });
    }
    let broken = |e: png::DecodingError| ImageError::broken(path, "PNG", e);
    // Size is checked from the header alone; the limit holds for what compressed text and profiles
    // unpack to.
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    let (width, height) = decoder.read_header_info().map_err(broken)?.size();
    check_size(path, u64::from(width), u64::from(height), 4)?;
    decoder.set_limits(png::Limits { bytes: super::MAX_PIXELS as usize * 8 });
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(broken)?;
    let size = reader.output_buffer_size().ok_or_else(|| ImageError::broken(path, "PNG", "impossible size"))?;
    let mut raw = vec![0; size];
    let info = reader.next_frame(&mut raw).map_err(broken)?;
    raw.truncate(info.buffer_size());
    // Text may also follow the pixels; a picture without its end is truncated.
    reader.finish().map_err(broken)?;

    let values: Vec<f32> = match info.bit_depth {
        BitDepth::Sixteen => {
            raw.chunks_exact(2).map(|b| f32::from(u16::from_be_bytes([b[0], b[1]])) / 65535.0).collect()
        }
        _ => raw.iter().map(|&b| f32::from(b) / 255.0).collect(),
    };
    let (channels, pixels) = match info.color_type {
        ColorType::Grayscale => (3, values.iter().flat_map(|&v| [v; 3]).collect()),
        ColorType::GrayscaleAlpha => (4, values.chunks_exact(2).flat_map(|p| [p[0], p[0], p[0], p[1]]).collect()),
        ColorType::Rgba => (4, values),
        _ => (3, values),
    };
    let info = reader.info();
    let mut metadata: Metadata =
        info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone())).collect();
    metadata.extend(info.utf8_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?))));
    Ok((Image { width, height, channels, pixels }, metadata))
}
