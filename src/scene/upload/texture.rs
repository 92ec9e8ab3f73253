//! Images as textures with box-filtered mip levels.

use super::UploadError;
use crate::scene::mips::{Level, halved_normals, normals};
use crate::scene::{ColorSpace, Scene};
use std::borrow::Cow;

pub(super) struct Textures {
    /// One view an image.
    pub views: Vec<wgpu::TextureView>,
    /// 1×1 white: the neutral value of factors.
    pub white: wgpu::TextureView,
    /// 1×1 normal map that leaves the normal as it is.
    pub flat: wgpu::TextureView,
    pub bytes: u64,
}

pub(super) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    scene: &Scene,
    warnings: &mut Vec<String>,
) -> Result<Textures, UploadError> {
    let limit = device.limits().max_texture_dimension_2d;
    let mut bytes = 0;
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
        views.push(texture(device, queue, &image.name, level, kind, &mut bytes));
    }
    let mut pixel = |name, rgba: [u8; 4]| {
        let level = Level { width: 1, height: 1, rgba: Cow::Owned(rgba.to_vec()) };
        texture(device, queue, name, level, Kind::Colors(ColorSpace::Linear), &mut bytes)
    };
    let white = pixel("white", [255; 4]);
    // 127.5 would be exact; materials without a map skip the normal map altogether.
    let flat = pixel("flat normal", [128, 128, 255, 255]);
    Ok(Textures { views, white, flat, bytes })
}

/// What the texels of an image are.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Colors(ColorSpace),
    /// Directions; alpha of smaller levels holds how much they differ ([`normals`]).
    Normals,
}

/// Whether materials take normals from this image, and nothing else: another use may want its alpha.
fn is_normal_map(scene: &Scene, image: usize) -> bool {
    let of = |r: Option<crate::scene::TextureRef>| r.is_some_and(|r| r.image == image);
    let others = |m: &crate::scene::Material| {
        [m.base_color_texture, m.metallic_roughness_texture, m.occlusion_texture, m.emissive_texture].map(of)
    };
    let mut materials = scene.materials.iter();
    materials.clone().any(|m| of(m.normal_texture)) && !materials.any(|m| others(m).contains(&true))
}

fn texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    name: &str,
    mut level: Level<'_>,
    kind: Kind,
    bytes: &mut u64,
) -> wgpu::TextureView {
    if kind == Kind::Normals {
        level = normals(&level);
    }
    let mip_level_count = level.width.max(level.height).ilog2() + 1;
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(name),
        size: wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
        mip_level_count,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: match kind {
            Kind::Colors(ColorSpace::Srgb) => wgpu::TextureFormat::Rgba8UnormSrgb,
            Kind::Colors(ColorSpace::Linear) | Kind::Normals => wgpu::TextureFormat::Rgba8Unorm,
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
        *bytes += level.rgba.len() as u64;
        queue.write_texture(
            wgpu::TexelCopyTextureInfo { mip_level, ..texture.as_image_copy() },
            &level.rgba,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * level.width), rows_per_image: None },
            wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 },
        );
    }
    texture.create_view(&Default::default())
}
