//! Images as textures with box-filtered mip levels, four bytes a texel or in blocks.

use super::UploadError;
use super::compress::{self, Compressor};
use crate::scene::mips::{Level, halved_normals, normals};
use crate::scene::{ColorSpace, Image, Scene};
use std::borrow::Cow;

/// How textures are stored on the device: whole, or compressed in blocks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum TextureMemory {
    /// As `Compressed` where the scene's textures would take more than [`TextureMemory::MOST`], else as
    /// `Full`.
    #[default]
    Auto,
    /// Uncompressed, four bytes a texel.
    Full,
    /// In BC7 blocks of 4×4 texels, one byte a texel, where the device can sample these and an image
    /// is a whole number of blocks. Normal maps stay uncompressed.
    Compressed,
}

impl TextureMemory {
    /// Bytes of a scene's textures above which `Auto` compresses: an eighth of a card of 4 GB.
    pub const MOST: u64 = 512 << 20;
}

/// Bytes of a scene's textures, mip levels included.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TextureBytes {
    /// Uncompressed, four bytes a texel.
    pub full: u64,
    /// As stored on the device.
    pub kept: u64,
}

pub(super) struct Textures {
    /// One view an image.
    pub views: Vec<wgpu::TextureView>,
    /// 1×1 white: the neutral value of factors.
    pub white: wgpu::TextureView,
    /// 1×1 normal map that leaves the normal as it is.
    pub flat: wgpu::TextureView,
    pub bytes: TextureBytes,
}

pub(super) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    scene: &Scene,
    memory: TextureMemory,
    warnings: &mut Vec<String>,
) -> Result<Textures, UploadError> {
    let limit = device.limits().max_texture_dimension_2d;
    let full = scene.images.iter().map(|i| full_bytes(i, limit)).sum();
    let compress = match memory {
        TextureMemory::Auto => full > TextureMemory::MOST,
        TextureMemory::Full => false,
        TextureMemory::Compressed => true,
    };
    let compressor = if compress && !scene.images.is_empty() { Compressor::new(device, queue) } else { None };
    let can = compressor.is_some();
    let mut maker = Maker { device, queue, compressor, kept: 0 };
    let mut views = Vec::with_capacity(scene.images.len());
    for (i, image) in scene.images.iter().enumerate() {
        let expected = u64::from(image.width) * u64::from(image.height) * 4;
        if expected == 0 || image.rgba.len() as u64 != expected {
            let reason = format!("{} bytes for {}×{} pixels", image.rgba.len(), image.width, image.height);
            return Err(UploadError::Image { image: image.name.clone(), reason });
        }
        let mut level = Level { width: image.width, height: image.height, rgba: Cow::Borrowed(&image.rgba) };
        while level.width > limit || level.height > limit {
            level = level.halved(image.color_space);
        }
        if level.width != image.width {
            warnings.push(format!(
                "image `{}` is {}×{}, more than the device's {limit}: shown at {}×{}",
                image.name, image.width, image.height, level.width, level.height
            ));
        }
        let kind = match image.color_space {
            ColorSpace::Linear if is_normal_map(scene, i) => Kind::Normals,
            space => Kind::Colors(space),
        };
        views.push(maker.texture(&image.name, level, kind));
    }
    let kept = maker.kept;
    if !views.is_empty() {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let how = match (compress, can) {
            (true, true) => "in blocks (BC7)",
            (true, false) => "whole, as the device has no blocks",
            _ => "whole",
        };
        tracing::info!(
            "{} textures: {:.1} MiB at four bytes a texel, {:.1} MiB {how}",
            views.len(),
            mib(full),
            mib(kept)
        );
    }
    maker.compressor = None;
    let mut pixel = |name, rgba: [u8; 4]| {
        let level = Level { width: 1, height: 1, rgba: Cow::Owned(rgba.to_vec()) };
        maker.texture(name, level, Kind::Colors(ColorSpace::Linear))
    };
    let white = pixel("white", [255; 4]);
    // 127.5 would be exact; materials without a map skip the normal map altogether.
    let flat = pixel("flat normal", [128, 128, 255, 255]);
    Ok(Textures { views, white, flat, bytes: TextureBytes { full, kept } })
}

/// Bytes of an image with its mip levels at four bytes a texel, its sides halved until none exceeds
/// `limit`.
fn full_bytes(image: &Image, limit: u32) -> u64 {
    let (mut width, mut height) = (image.width.max(1), image.height.max(1));
    while width > limit || height > limit {
        (width, height) = ((width / 2).max(1), (height / 2).max(1));
    }
    let levels = width.max(height).ilog2() + 1;
    (0..levels).map(|l| 4 * u64::from((width >> l).max(1)) * u64::from((height >> l).max(1))).sum()
}

/// What the texels of an image are.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Colors(ColorSpace),
    /// Directions; alpha of smaller levels holds how much they differ ([`normals`]).
    Normals,
}

/// Whether materials take normals from this image, and nothing else: another use may want its
/// alpha.
fn is_normal_map(scene: &Scene, image: usize) -> bool {
    let of = |r: Option<crate::scene::TextureRef>| r.is_some_and(|r| r.image == image);
    let others = |m: &crate::scene::Material| {
        [m.base_color_texture, m.metallic_roughness_texture, m.occlusion_texture, m.emissive_texture].map(of)
    };
    let mut materials = scene.materials.iter();
    materials.clone().any(|m| of(m.normal_texture)) && !materials.any(|m| others(m).contains(&true))
}

struct Maker<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    compressor: Option<Compressor>,
    /// Bytes of what was made.
    kept: u64,
}

impl Maker<'_> {
    fn texture(&mut self, name: &str, mut level: Level<'_>, kind: Kind) -> wgpu::TextureView {
        if kind == Kind::Normals {
            level = normals(&level);
        }
        let mip_level_count = level.width.max(level.height).ilog2() + 1;
        // Blocks bend normals by two degrees and more, which a shiny surface shows.
        let blocky = kind != Kind::Normals && compress::takes(level.width, level.height);
        let mut compressor = self.compressor.as_mut().filter(|_| blocky);
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size: wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
            mip_level_count,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: match (kind, &compressor) {
                (Kind::Colors(ColorSpace::Srgb), None) => wgpu::TextureFormat::Rgba8UnormSrgb,
                (Kind::Colors(ColorSpace::Linear) | Kind::Normals, None) => wgpu::TextureFormat::Rgba8Unorm,
                (Kind::Colors(ColorSpace::Srgb), Some(_)) => wgpu::TextureFormat::Bc7RgbaUnormSrgb,
                (Kind::Colors(ColorSpace::Linear) | Kind::Normals, Some(_)) => wgpu::TextureFormat::Bc7RgbaUnorm,
            },
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        for mip_level in 0..mip_level_count {
            if mip_level > 0 {
                level = match kind {
                    Kind::Colors(space) => level.halved(space),
                    Kind::Normals => halved_normals(&level),
                };
            }
            if let Some(compressor) = &mut compressor {
                self.kept += compress::bytes(level.width, level.height);
                compressor.write(&texture, mip_level, &level);
                continue;
            }
            self.kept += level.rgba.len() as u64;
            self.queue.write_texture(
                wgpu::TexelCopyTextureInfo { mip_level, ..texture.as_image_copy() },
                &level.rgba,
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * level.width), rows_per_image: None },
                wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
            );
        }
        texture.create_view(&Default::default())
    }
}
