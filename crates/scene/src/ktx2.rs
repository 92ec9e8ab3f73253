//! KTX2 textures in Basis Universal's encodings (KHR_texture_basisu): ETC1S and UASTC, the latter
//! packed by Zstandard or not. The `basisu` crate decodes; this file keeps hostile sizes from it.

use basisu::{DecodeFlags, Error, TargetFormat, Transcoder};

/// First bytes of every KTX2 file.
const MAGIC: &[u8; 12] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Bytes of a block of 4×4 texels in UASTC, the largest of the encodings.
const BLOCK: u64 = 16;

/// Whether these are the bytes of a KTX2 file.
pub(super) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// A decoded level: the picture's size, the level's width and height, its RGBA.
pub(super) type Decoded = ([u32; 2], u32, u32, Vec<u8>);

/// The largest level with no side above `kept_side`, or the smallest that there is; mip levels are
/// made anew at upload.
///
/// # Errors
/// A sentence without subject. No side may exceed `most_side`, nor the decoded picture
/// `most_bytes`.
pub(super) fn decode(bytes: &[u8], most_side: u32, kept_side: u32, most_bytes: u64) -> Result<Decoded, String> {
    let cut_off = || format!("is a KTX2 file cut off after {} bytes", bytes.len());
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let (Some(format), Some(width), Some(height), Some(levels), Some(low), Some(high)) =
        (word(12), word(20), word(24), word(40), word(96), word(100))
    else {
        return Err(cut_off());
    };
    if format != 0 {
        return Err(format!("is a KTX2 file of Vulkan format {format}; only Basis Universal's encodings are read"));
    }
    if width == 0 || height == 0 {
        return Err(format!("has no pixels ({width}x{height})"));
    }
    let size = |level: u32| [width, height].map(|n| (n >> level).max(1));
    let levels = levels.clamp(1, 16);
    let level = (0..levels).find(|l| size(*l)[0].max(size(*l)[1]) <= kept_side).unwrap_or(levels - 1);
    let [w, h] = size(level);
    // In this order: the second product overflows where a side is too long.
    if width.max(height) > most_side || u64::from(w) * u64::from(h) * 4 > most_bytes {
        return Err(format!("is {width}x{height}; no side may exceed {most_side} and no picture {most_bytes} bytes"));
    }
    // What a level says that it unpacks to is taken at its word by the decoder.
    let unpacked = u64::from(high) << 32 | u64::from(low);
    let most = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4)) * BLOCK;
    if unpacked > most {
        return Err(format!(
            "says that its {width}x{height} texels unpack to {unpacked} bytes; no encoding has above {most}"
        ));
    }
    let texture = Transcoder::new(bytes).map_err(problem)?;
    if texture.layer_count() > 1 || texture.face_count() > 1 {
        return Err("is an array or a cube; a material's texture has one picture".to_owned());
    }
    let rgba = texture.transcode(level, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(problem)?;
    Ok(([width, height], w, h, rgba))
}

/// What the decoder says, which has no sentences of its own.
fn problem(error: Error) -> String {
    let what = match error {
        Error::InvalidData => "its data is broken".to_owned(),
        Error::Truncated => "its data ends too early".to_owned(),
        Error::Unsupported { source, .. } => format!("{source:?} does not become a picture of 8 bits"),
        Error::VideoRequiresState => "it is a video".to_owned(),
        other => format!("{other:?}"),
    };
    format!("cannot be decoded: {what}")
}
