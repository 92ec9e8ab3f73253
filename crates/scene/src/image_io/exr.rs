//! Multi-layer EXR under Blender's pass names, one part, ZIP blocks of 16 rows.
//!
//! Depth, position and motion are 32-bit floats because half floats would move surfaces by up to a
//! two-thousandth of their distance; every other layer is half (11 bits of precision, largest value
//! 65504).

use super::{ImageError, Layer, Layers, check_size, read_all, write_whole};
use ::exr::meta::MetaData;
use ::exr::meta::attribute::AttributeValue;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
    LayerAttributes, LineOrder, ReadChannels, ReadLayers, Text, Vec2, WritableImage, f16,
};
use std::io::Cursor;
use std::path::Path;

pub(super) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Pass names that are stored as full floats.
const FULL_FLOAT: [&str; 3] = ["Depth", "Position", "Motion"];

/// Writes `layers` (each channel `width · height` values, rows from the top) into one EXR with
/// `metadata` as text attributes. The root layer has the empty name. `-` is standard output. The
/// file appears whole or not at all.
///
/// # Errors
/// No pixels or layers, a channel of the wrong length or twice, or a failed write.
pub fn write_exr(
    path: &Path,
    width: u32,
    height: u32,
    layers: &[Layer],
    metadata: &[(String, String)],
) -> Result<(), ImageError> {
    let pixels = width as usize * height as usize;
    let mut names = std::collections::BTreeSet::new();
    for (name, values) in layers.iter().flat_map(|l| l.channels.iter().map(|(c, v)| (full_name(&l.name, c), v))) {
        if values.len() != pixels {
            let message = format!("channel {name} has {} values for {width}×{height} pixels", values.len());
            return Err(ImageError::shape(path, message));
        }
        if !names.insert(name.clone()) {
            return Err(ImageError::shape(path, format!("channel {name} appears twice")));
        }
    }
    if pixels == 0 || names.is_empty() {
        return Err(ImageError::shape(
            path,
            format!("there is nothing in it ({width}×{height}, {} channels)", names.len()),
        ));
    }
    let channels = layers.iter().flat_map(|layer| {
        let float = FULL_FLOAT.contains(&layer.name.rsplit('.').next().unwrap_or_default());
        layer.channels.iter().map(move |(channel, values)| {
            let samples = if float {
                FlatSamples::F32(values.clone())
            } else {
                FlatSamples::F16(values.iter().map(|&v| to_half(v)).collect())
            };
            AnyChannel::new(text(&full_name(&layer.name, channel)), samples)
        })
    });
    let size = Vec2(width as usize, height as usize);
    let attributes = LayerAttributes {
        software_name: Some(text(concat!("bouncelight ", env!("CARGO_PKG_VERSION")))),
        other: metadata.iter().map(|(k, v)| (text(k), AttributeValue::Text(text(v)))).collect(),
        ..LayerAttributes::default()
    };
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let layer = ::exr::prelude::Layer::new(size, attributes, encoding, AnyChannels::sort(channels.collect()));
    let image = Image::empty(ImageAttributes::new(IntegerBounds::from_dimensions(size))).with_layer(layer);
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).map_err(|e| ImageError::shape(path, e.to_string()))?;
    write_whole(path, bytes.get_ref())
}

/// Reads every layer of an EXR with any compression that the decoder has (none, RLE, ZIP, PIZ,
/// PXR24, B44, DWAA, DWAB). Parts are joined as `part.layer`; the picture is the data window.
/// Values are as stored, see [`Layers::check_finite`].
///
/// # Errors
/// Missing, empty, truncated or foreign file; too many pixels; deep data, subsampled channels,
/// parts of different sizes or an unknown compression.
pub fn read_exr(path: &Path) -> Result<Layers, ImageError> {
    read_with_windows(path).map(|(layers, _)| layers)
}

/// Bytes of pixels that a byte of a file can hold at most: those of a picture of one colour, packed as
/// well as any.
const MOST_PACKED: u64 = 1 << 16;

/// Bytes of pixels that are never asked about.
const MOST_BEFORE: u64 = 16 << 20;

/// Where the pixels that a file has lie in the picture that it shows.
pub(crate) struct Windows {
    /// Column and row of the first pixel, counted from the picture's.
    pub first: [i64; 2],
    /// Columns and rows of the picture.
    pub shown: [u64; 2],
}

/// As [`read_exr`], with what of the picture the layers are.
pub(crate) fn read_with_windows(path: &Path) -> Result<(Layers, Windows), ImageError> {
    let bytes = read_all(path)?;
    if !bytes.starts_with(&MAGIC) {
        return Err(ImageError::NotThisFormat { path: path.into(), expected: "an EXR" });
    }
    let failed = |e: ::exr::error::Error| match e {
        ::exr::error::Error::NotSupported(message) => unsupported(path, &message),
        e => ImageError::broken(path, "EXR", e),
    };
    let meta = MetaData::read_from_buffered(Cursor::new(&bytes), false).map_err(failed)?;
    let (width, height) = check_headers(path, &meta)?;
    // Memory is taken before pixels are decoded, and a few bytes can claim any size.
    let channels: u64 = meta.headers.iter().map(|h| h.channels.list.len() as u64).sum();
    let claimed = 4 * channels * u64::from(width) * u64::from(height);
    if claimed > MOST_BEFORE + MOST_PACKED * bytes.len() as u64 {
        let problem = format!("{} bytes cannot hold the {width}x{height} pixels that it claims", bytes.len());
        return Err(ImageError::broken(path, "EXR", problem));
    }

    let image = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(&bytes))
        .map_err(failed)?;

    let IntegerBounds { position: Vec2(x, y), size: Vec2(columns, rows) } = image.attributes.display_window;
    let Vec2(left, top) = image.layer_data.first().map_or(Vec2(x, y), |part| part.attributes.layer_position);
    let first = [i64::from(left) - i64::from(x), i64::from(top) - i64::from(y)];
    let windows = Windows { first, shown: [columns as u64, rows as u64] };

    let mut layers: Vec<Layer> = Vec::new();
    let mut metadata = std::collections::BTreeMap::new();
    let several = image.layer_data.len() > 1;
    for part in image.layer_data {
        let part_name = part.attributes.layer_name.as_ref().map(string).filter(|_| several);
        for channel in part.channel_data.list {
            let mut name = string(&channel.name);
            if let Some(part) = part_name.as_ref().filter(|p| !name.starts_with(&format!("{p}."))) {
                name = format!("{part}.{name}");
            }
            let (layer, channel_name) = name.rsplit_once('.').unwrap_or(("", &name));
            let values = channel.sample_data.values_as_f32().collect();
            match layers.iter_mut().find(|l| l.name == layer) {
                Some(l) => l.channels.push((channel_name.into(), values)),
                None => layers.push(Layer { name: layer.into(), channels: vec![(channel_name.into(), values)] }),
            }
        }
        for (key, value) in part.attributes.other.iter().chain(&image.attributes.other) {
            if let AttributeValue::Text(value) = value {
                metadata.insert(string(key), string(value));
            }
        }
    }
    for layer in &mut layers {
        layer.channels.sort_by_key(|(name, _)| "RGBAXYZW".find(name.as_str()).unwrap_or(8));
    }
    let metadata = metadata.into_iter().collect();
    Ok((Layers { path: path.into(), width, height, layers, metadata }, windows))
}

/// What is known before pixels are decoded: size, and whether all parts have the same one.
fn check_headers(path: &Path, meta: &MetaData) -> Result<(u32, u32), ImageError> {
    let first = meta.headers.first().ok_or_else(|| ImageError::broken(path, "EXR", "it has no parts"))?;
    let Vec2(width, height) = first.layer_size;
    let channels: u64 = meta.headers.iter().map(|h| h.channels.list.len() as u64).sum();
    check_size(path, width as u64, height as u64, channels)?;
    for header in &meta.headers {
        if header.deep {
            return Err(unsupported(path, "deep data"));
        }
        if header.layer_size != first.layer_size {
            return Err(unsupported(path, "parts of different sizes"));
        }
        if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
            return Err(unsupported(path, "subsampled channels (luminance and chroma)"));
        }
        if matches!(header.compression, Compression::HTJ2K32 | Compression::HTJ2K256) {
            return Err(unsupported(path, &header.compression.to_string()));
        }
    }
    // Below 2^27 each, by check_size.
    Ok((width as u32, height as u32))
}

fn unsupported(path: &Path, what: &str) -> ImageError {
    let message = format!("this EXR uses {what}, which is not read here; save it as a flat EXR with ZIP compression");
    ImageError::Unsupported { path: path.into(), message }
}

fn full_name(layer: &str, channel: &str) -> String {
    if layer.is_empty() { channel.into() } else { format!("{layer}.{channel}") }
}

/// Nearest half float; finite values stay finite.
fn to_half(value: f32) -> f16 {
    let limit = f16::MAX.to_f32();
    f16::from_f32(if value.is_finite() { value.clamp(-limit, limit) } else { value })
}

/// EXR texts are bytes; ours are UTF-8, as Blender's are.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn string(value: &Text) -> String {
    let bytes = value.as_slice();
    String::from_utf8(bytes.to_vec()).unwrap_or_else(|_| bytes.iter().map(|&b| char::from(b)).collect())
}
