//! Decoding of texture images, and what is shown in place of one that cannot be read.

use std::io::Cursor;

use super::{cut_off, ktx2};
use crate::image_io::radiance;
use bouncelight::scene::mips::Level;
use bouncelight::scene::{ColorSpace, Image};
use image::DynamicImage;
use std::borrow::Cow;

/// What a texture is used for; decides how its bytes are read and what stands in for it when it is
/// broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Use {
    /// Base colour and emission: sRGB.
    Color,
    /// Metallic-roughness and occlusion: linear.
    Data,
    /// Normal map: linear.
    Normal,
    /// Specular colour and glossiness: sRGB with linear alpha.
    Specular,
}

impl Use {
    fn color_space(self) -> ColorSpace {
        if matches!(self, Use::Color | Use::Specular) { ColorSpace::Srgb } else { ColorSpace::Linear }
    }
}

/// No side of a texture may be longer.
const MAX_SIDE: u32 = 16_384;

/// Larger ones are halved as they are read: WebGPU grants no more by default, and a picture of
/// 16,384² would keep a gigabyte.
const KEPT_SIDE: u32 = 8192;

/// Bytes of all decoded images of a scene together: thousands of small files can hold large
/// pictures.
pub(crate) const MAX_TOTAL: u64 = 4 << 30;

/// Whether a scene that has `images` may have another.
///
/// # Errors
/// A sentence without subject.
pub(crate) fn room(images: &[Image], most: u64) -> Result<(), String> {
    let taken: u64 = images.iter().map(|i| i.rgba.len() as u64).sum();
    if taken < most { Ok(()) } else { Err(format!("is left out: the scene's images already take {taken} bytes")) }
}

/// No texture may need more to be decoded, as the `image` crate has it: 16,384² pixels of four
/// bytes, and what a decoder keeps beside them.
const MAX_DECODED: u64 = (1 << 30) + (64 << 20);

/// Nor may the level of a KTX2 file that is kept: a few bytes can claim to be any of them.
const MAX_TRANSCODED: u64 = 512 << 20;

/// Decodes PNG, JPEG, WebP, BMP, TGA, HDR or KTX2 bytes (told apart by content, then by the name's
/// ending). What is larger than [`KEPT_SIDE`] is halved until it is not, and a sentence without
/// subject tells it.
///
/// # Errors
/// A sentence without subject, such as "the file is empty (0 bytes)".
pub(crate) fn decode(name: &str, bytes: &[u8], usage: Use) -> Result<(Image, Option<String>), String> {
    if bytes.is_empty() {
        return Err("the file is empty (0 bytes)".to_owned());
    }
    let color_space = usage.color_space();
    let kept = |[from_width, from_height]: [u32; 2], mut level: Level<'_>| {
        if usage == Use::Normal {
            mend_normals(level.rgba.to_mut());
        }
        while level.width.max(level.height) > KEPT_SIDE {
            level = level.halved(color_space);
        }
        let Level { width, height, rgba } = level;
        let told = (width != from_width || height != from_height).then(|| {
            format!(
                "is {from_width}x{from_height}; shown at {width}x{height}, as no side of more than {KEPT_SIDE} is kept"
            )
        });
        (Image { name: name.to_owned(), width, height, rgba: rgba.into_owned(), color_space }, told)
    };
    if ktx2::is_ktx2(bytes) {
        let (size, width, height, rgba) = ktx2::decode(bytes, MAX_SIDE, KEPT_SIDE, MAX_TRANSCODED)?;
        return Ok(kept(size, Level { width, height, rgba: Cow::Owned(rgba) }));
    }
    if bytes.starts_with(radiance::MAGIC) {
        let (width, height, rgb) = radiance::decode(bytes).map_err(|e| format!("cannot be decoded: {e}"))?;
        let rgba = rgb.chunks_exact(3).flat_map(|p| [byte(p[0]), byte(p[1]), byte(p[2]), 255]).collect();
        return Ok(kept([width, height], Level { width, height, rgba: Cow::Owned(rgba) }));
    }
    let mut reader = image::ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| format!("cannot be read: {e}"))?;
    if reader.format().is_none()
        && let Ok(format) = image::ImageFormat::from_path(name)
    {
        reader.set_format(format);
    }
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    limits.max_alloc = Some(MAX_DECODED);
    reader.limits(limits);
    let rows = |e: image::ImageError| {
        cut_off::png(bytes, MAX_SIDE, MAX_DECODED).ok_or_else(|| format!("cannot be decoded: {e}"))
    };
    let decoded = reader.decode().or_else(rows)?;
    let cut_off = cut_off::is_cut_off(bytes).then(|| "is cut off; what there is of it is shown".to_owned());
    let (width, height) = (decoded.width(), decoded.height());
    if width == 0 || height == 0 {
        return Err(format!("has no pixels ({width}x{height})"));
    }
    let level = if width.max(height) > KEPT_SIDE {
        halved(&decoded, color_space)
    } else {
        Level { width, height, rgba: Cow::Owned(decoded.into_rgba8().into_raw()) }
    };
    let (image, told) = kept([width, height], level);
    Ok((image, cut_off.or(told)))
}

/// Texels that point into the surface, which no normal map can mean, or nowhere. Maps of two channels
/// leave out blue, which follows from the others; what else there is, black for one, becomes flat.
fn mend_normals(rgba: &mut [u8]) {
    // The highest two bits of blue: both are set where a normal leans by less than 60 degrees, as
    // nearly all of any map do.
    const UPRIGHT: u64 = 0x00c0_0000_00c0_0000;
    for block in rgba.chunks_mut(64) {
        let all = block.as_chunks::<8>().0.iter().fold(UPRIGHT, |all, two| all & u64::from_le_bytes(*two));
        if all != UPRIGHT || block.len() < 64 {
            block.chunks_exact_mut(4).for_each(mend_normal);
        }
    }
}

fn mend_normal(p: &mut [u8]) {
    let nowhere = p[..3].iter().all(|c| c.abs_diff(128) <= 4);
    if p[2] >= 127 && !nowhere {
        return;
    }
    let [x, y] = [p[0], p[1]].map(|c| f32::from(c) / 127.5 - 1.0);
    let rest = 1.0 - x * x - y * y;
    if rest < -0.05 {
        (p[0], p[1], p[2]) = (128, 128, 255);
    } else {
        p[2] = (127.5 + 127.5 * rest.max(0.0).sqrt()).round() as u8;
    }
}

/// A value in [0, 1] in eight bits.
fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Half of a large picture, two rows at a time, so that it never lies in memory twice.
fn halved(image: &DynamicImage, space: ColorSpace) -> Level<'static> {
    let (width, height) = ((image.width() / 2).max(1), (image.height() / 2).max(1));
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for y in 0..height {
        let rows = image.crop_imm(0, 2 * y, image.width(), 2.min(image.height()));
        let (w, h) = (rows.width(), rows.height());
        let two = Level { width: w, height: h, rgba: Cow::Owned(rows.into_rgba8().into_raw()) };
        rgba.extend_from_slice(&two.halved(space).rgba);
    }
    Level { width, height, rgba: Cow::Owned(rgba) }
}

/// An 8×8 checker that nobody overlooks: magenta and black for colours, smooth and rough for data,
/// tilted to the left and to the right for normals.
pub(crate) fn stand_in(name: &str, usage: Use) -> Image {
    let tiles: [[u8; 4]; 2] = match usage {
        Use::Color => [[255, 0, 255, 255], [0, 0, 0, 255]],
        Use::Data => [[255, 40, 255, 255], [255, 255, 255, 255]],
        Use::Specular => [[60, 60, 60, 215], [60, 60, 60, 0]],
        Use::Normal => [[64, 128, 238, 255], [192, 128, 238, 255]],
    };
    let rgba = (0..64).flat_map(|i| tiles[(i % 8 + i / 8) % 2]).collect();
    Image { name: format!("{name} (stand-in)"), width: 8, height: 8, rgba, color_space: usage.color_space() }
}

/// Radiometric value of each byte under the sRGB transfer function.
pub(crate) fn srgb_table() -> [f32; 256] {
    std::array::from_fn(|byte| bouncelight::srgb::decode(byte as f32 / 255.0))
}

/// The nearest byte under the sRGB transfer function to a value in [0, 1].
pub(crate) fn to_srgb(v: f32) -> u8 {
    (bouncelight::srgb::encode(v) * 255.0 + 0.5) as u8
}

/// Mean of an image's colour (linear) and alpha.
pub(crate) fn mean(image: &Image) -> [f32; 4] {
    let linear: [f32; 256] = std::array::from_fn(|b| b as f32 / 255.0);
    let table = if image.color_space == ColorSpace::Srgb { srgb_table() } else { linear };
    let mut sum = [0.0f64; 4];
    for pixel in image.rgba.chunks_exact(4) {
        (0..3).for_each(|c| sum[c] += f64::from(table[usize::from(pixel[c])]));
        sum[3] += f64::from(linear[usize::from(pixel[3])]);
    }
    sum.map(|s| (s / (image.rgba.len() / 4).max(1) as f64) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_share_a_bound() {
        let images = [stand_in("a", Use::Color), stand_in("b", Use::Data)];
        assert!(room(&images, 513).is_ok());
        let told = room(&images, 512).unwrap_err();
        assert!(told.contains("512 bytes"), "{told}");
    }

    #[test]
    fn what_is_too_large_is_halved_and_told() {
        // 16,384 columns of black and white: half of the light.
        let mut picture = image::RgbImage::new(16_384, 3);
        picture.enumerate_pixels_mut().for_each(|(x, _, p)| p.0 = [255 * (x % 2) as u8; 3]);
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let (halved, told) = decode("wide.png", bytes.get_ref(), Use::Color).unwrap();
        assert_eq!((halved.width, halved.height), (8192, 1));
        assert!(told.unwrap().contains("is 16384x3; shown at 8192x1"));
        assert!(halved.rgba.chunks_exact(4).all(|p| p == [188, 188, 188, 255]));
        // Negative control: at the limit it stays as it is.
        let mut bytes = Cursor::new(Vec::new());
        image::RgbImage::new(8192, 1).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        let (kept, told) = decode("fits.png", bytes.get_ref(), Use::Color).unwrap();
        assert_eq!((kept.width, told), (8192, None));
    }

    #[test]
    fn srgb_bytes_survive_a_round_trip_and_means_are_of_light() {
        let table = srgb_table();
        assert!((0..=255u8).all(|b| to_srgb(table[usize::from(b)]) == b));
        // Magenta and black: half of the light, not of the bytes.
        let [r, g, b, a] = mean(&stand_in("a", Use::Color));
        assert_eq!([r, g, b, a], [0.5, 0.0, 0.5, 1.0]);
        let half = Image { rgba: [188; 4].to_vec(), width: 1, height: 1, ..stand_in("a", Use::Color) };
        assert!((mean(&half)[0] - 0.503).abs() < 1e-3, "188 is one half in sRGB: {}", mean(&half)[0]);
    }
}
