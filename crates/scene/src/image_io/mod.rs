//! PNG and multi-layer EXR, written whole or not at all.
//!
//! Pixels are f32, rows from the top. An EXR is a list of [`Layer`]s under Blender's pass names:
//! the root layer (empty name) with R, G, B, A is the beauty, then `DiffDir.R`, `Normal.X`,
//! `Depth.Z`, ... Whatever is read was checked for size before memory was taken ([`MAX_PIXELS`],
//! [`MAX_SAMPLES`]).

mod error;
mod exr;
mod png;
pub(crate) mod radiance;
mod whole;

pub use error::ImageError;
pub(crate) use exr::{Windows, read_with_windows};
pub use exr::{read_exr, write_exr};
pub use png::{decode_png, read_png, read_png_with_metadata, write_apng, write_png};
pub use whole::{check_writable, write_whole};

use std::path::{Path, PathBuf};
use whole::read_all;
pub(crate) use whole::{MAX_BYTES, read_regular};

/// Most pixels that a file may claim: 16384 × 8192.
pub const MAX_PIXELS: u64 = 1 << 27;

/// Most samples (pixels × channels) that a file may claim: 2 GiB as f32.
pub const MAX_SAMPLES: u64 = 1 << 29;

/// Keys and texts that travel with a picture: adapter, driver, version, weights hash, command line,
/// ...
pub type Metadata = Vec<(String, String)>;

/// Interleaved pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Values per pixel.
    pub channels: u32,
    /// `channels · width · height` values, rows from the top.
    pub pixels: Vec<f32>,
}

impl Image {
    /// The first three channels of each pixel, `3 · width · height` values; one channel is
    /// repeated.
    pub fn to_rgb(&self) -> Vec<f32> {
        let channels = self.channels as usize;
        let pick = |p: &[f32]| [p[0], p[1.min(channels - 1)], p[2.min(channels - 1)]];
        match channels {
            0 => Vec::new(),
            3 => self.pixels.clone(),
            // Two channels are grey and alpha or a vector in the plane; neither has a blue.
            2 => self.pixels.chunks_exact(2).flat_map(|p| [p[0], p[1], 0.0]).collect(),
            _ => self.pixels.chunks_exact(channels).flat_map(pick).collect(),
        }
    }
}

/// One pass of a picture: named channels of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Pass name as in Blender (`DiffDir`, `Normal`, ...); empty for the root, which is the beauty.
    pub name: String,
    /// Channel name (`R`, `X`, `Z`, ...) and `width · height` values, rows from the top.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl Layer {
    /// Splits interleaved `pixels` into one channel for each character of `channels`, as in
    /// `Layer::new("Normal", "XYZ", ..)`. Values beyond the last whole pixel are left out.
    pub fn new(name: &str, channels: &str, pixels: &[f32]) -> Self {
        let count = channels.chars().count().max(1);
        let split = |i| pixels.chunks_exact(count).map(|p| p[i]).collect();
        Self {
            name: name.into(),
            channels: channels.chars().enumerate().map(|(i, c)| (c.to_string(), split(i))).collect(),
        }
    }

    /// Values of the channel called `name`.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_slice())
    }

    /// Values per pixel in the order of `channels`, interleaved.
    pub fn interleaved(&self) -> Vec<f32> {
        let pixels = self.channels.iter().map(|(_, v)| v.len()).min().unwrap_or(0);
        (0..pixels).flat_map(|i| self.channels.iter().map(move |(_, v)| v[i])).collect()
    }
}

/// A file's layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Layers {
    /// The file, for messages.
    pub path: PathBuf,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Layers in the file's order; channels are sorted R G B A or X Y Z W where they have these
    /// names.
    pub layers: Vec<Layer>,
    /// Text attributes, sorted by key.
    pub metadata: Metadata,
}

impl Layers {
    /// The layer called `name`; `DiffDir` also finds `ViewLayer.DiffDir`, and the beauty (`""` or
    /// `Combined`) is found as root, `Combined` or `ViewLayer.Combined`. The first one counts where
    /// several view layers have it.
    ///
    /// # Errors
    /// [`ImageError::NoLayer`], which lists what there is.
    pub fn layer(&self, name: &str) -> Result<&Layer, ImageError> {
        let last = |l: &&Layer, n: &str| l.name.rsplit('.').next() == Some(n);
        let exact = self.layers.iter().find(|l| l.name == name);
        let found = if name.is_empty() || name == "Combined" {
            exact
                .or_else(|| self.layers.iter().find(|l| last(l, "Combined")))
                .or_else(|| self.layers.iter().find(|l| l.name.is_empty() && l.channel("R").is_some()))
        } else {
            exact.or_else(|| self.layers.iter().find(|l| last(l, name)))
        };
        found.ok_or_else(|| ImageError::NoLayer {
            path: self.path.clone(),
            wanted: if name.is_empty() { "Combined".into() } else { name.into() },
            found: self.names(),
        })
    }

    /// The layer called `name` (see [`Self::layer`]) as interleaved pixels.
    ///
    /// # Errors
    /// [`ImageError::NoLayer`].
    pub fn image(&self, name: &str) -> Result<Image, ImageError> {
        let layer = self.layer(name)?;
        Ok(Image {
            width: self.width,
            height: self.height,
            channels: layer.channels.len() as u32,
            pixels: layer.interleaved(),
        })
    }

    /// Checks that the layer called `name` holds numbers only. Reading does not check by itself: a
    /// background depth is rightly infinite in many files.
    ///
    /// # Errors
    /// [`ImageError::NonFinite`] with the first place and the count; [`ImageError::NoLayer`].
    pub fn check_finite(&self, name: &str) -> Result<(), ImageError> {
        let layer = self.layer(name)?;
        let bad = |v: &&f32| !v.is_finite();
        let count = layer.channels.iter().map(|(_, v)| v.iter().filter(bad).count()).sum();
        for (channel, values) in &layer.channels {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let width = self.width as usize;
                return Err(ImageError::NonFinite {
                    path: self.path.clone(),
                    layer: layer.name.clone(),
                    channel: channel.clone(),
                    x: i % width,
                    y: i / width,
                    count,
                });
            }
        }
        Ok(())
    }

    /// The layer that is a picture of light, as three values a pixel: the beauty, else the only one
    /// with red, green and blue or with a luminance, in letters of any case.
    ///
    /// # Errors
    /// [`ImageError::NoLayer`].
    pub(crate) fn light(&self) -> Result<Vec<f32>, ImageError> {
        let channel = |l: &'_ Layer, name: &str| l.channels.iter().position(|(n, _)| n.eq_ignore_ascii_case(name));
        let light = |l: &Layer| match ["R", "G", "B"].map(|name| channel(l, name)) {
            [Some(r), Some(g), Some(b)] => Some([r, g, b]),
            _ => channel(l, "Y").filter(|_| channel(l, "X").is_none()).map(|y| [y; 3]),
        };
        let beauty = self.layer("").ok().and_then(|l| Some((l, light(l)?)));
        let mut others = self.layers.iter().filter_map(|l| Some((l, light(l)?)));
        let root = || self.layers.iter().find(|l| l.name.is_empty()).and_then(|l| Some((l, light(l)?)));
        let only = match (others.next(), others.next()) {
            (only, None) => only,
            _ => None,
        };
        let (layer, [r, g, b]) = beauty.or_else(root).or(only).ok_or_else(|| ImageError::NoLayer {
            path: self.path.clone(),
            wanted: "Combined".into(),
            found: self.names(),
        })?;
        let [r, g, b] = [r, g, b].map(|i| &layer.channels[i].1);
        Ok(r.iter().zip(g).zip(b).flat_map(|((r, g), b)| [*r, *g, *b]).collect())
    }

    fn names(&self) -> String {
        let names: Vec<String> = self
            .layers
            .iter()
            .map(|l| {
                let channels: Vec<&str> = l.channels.iter().map(|(n, _)| n.as_str()).collect();
                let name = if l.name.is_empty() { "(root)" } else { &l.name };
                format!("{name} [{}]", channels.join(" "))
            })
            .collect();
        names.join(", ")
    }
}

/// A picture file by its content.
#[derive(Debug, Clone, PartialEq)]
pub enum Decoded {
    /// PNG: display-encoded values in [0, 1].
    Display(Image),
    /// EXR: linear layers.
    Linear(Layers),
}

/// Reads a PNG or EXR, told apart by the first bytes and not by the name.
///
/// # Errors
/// As [`read_png`] and [`read_exr`]; [`ImageError::NotThisFormat`] for anything else.
pub fn read(path: &Path) -> Result<Decoded, ImageError> {
    use std::io::Read;
    let mut start = [0; 4];
    let head = std::fs::File::open(path).and_then(|mut f| f.read(&mut start));
    match head {
        Ok(4) if start == *b"\x89PNG" => read_png(path).map(Decoded::Display),
        Ok(4) if start == exr::MAGIC => read_exr(path).map(Decoded::Linear),
        // Folders, missing and empty files get their own words.
        _ => {
            read_all(path).and_then(|_| Err(ImageError::NotThisFormat { path: path.into(), expected: "a PNG or EXR" }))
        }
    }
}

/// Refuses sizes that nothing honest has, before memory is taken for them.
fn check_size(path: &Path, width: u64, height: u64, channels: u64) -> Result<(), ImageError> {
    let pixels = width.saturating_mul(height);
    if width == 0 || height == 0 {
        return Err(ImageError::broken(path, "picture", "it has no pixels"));
    }
    if pixels > MAX_PIXELS || pixels.saturating_mul(channels) > MAX_SAMPLES {
        return Err(ImageError::TooLarge { path: path.into(), width, height, channels });
    }
    Ok(())
}
