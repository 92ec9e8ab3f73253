//! Materials and their images as the path tracer reads them.

use super::{Limits, PackError};
use bouncelight::scene::mips::Level;
use bouncelight::scene::{AlphaMode, ColorSpace, Image, Material, Scene, TextureRef, Wrap};
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// A use of an image; laid out as `ImageUse` in `shaders/reference/types.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ImageUse {
    /// First row of the coordinate transform.
    pub row0: [f32; 3],
    /// Index of the first texel; `u32::MAX` for no image.
    pub texel: u32,
    /// Second row.
    pub row1: [f32; 3],
    /// Wrapping, coordinate set, transfer function and filter, see the shader.
    pub bits: u32,
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Unused.
    pub pad: [u32; 2],
}

/// A material; laid out as `RefMaterial` in `shaders/reference/types.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct RefMaterial {
    /// Linear base colour and alpha.
    pub base_color: [f32; 4],
    /// Emitted radiance, W/(m²·sr).
    pub emissive: [f32; 3],
    /// 1 unlit, 2 double-sided.
    pub flags: u32,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// 0 opaque, the mask's cutoff, or 2 for stochastic coverage.
    pub alpha_cutoff: f32,
    /// Colour of `f0`.
    pub specular_tint: [f32; 3],
    /// Reflectance of the dielectric at normal incidence.
    pub f0: f32,
    /// Base colour.
    pub base_use: ImageUse,
    /// Roughness (green) and metallic (blue).
    pub rough_use: ImageUse,
    /// Normal map.
    pub normal_use: ImageUse,
    /// Emission.
    pub emissive_use: ImageUse,
}

/// The scene's materials, and the texels of all images that they use (RGBA, 8 bits each, red
/// lowest).
pub(super) fn pack(scene: &Scene, limits: &Limits) -> Result<(Vec<RefMaterial>, Vec<u32>), PackError> {
    let mut first = vec![None; scene.images.len()];
    for use_ in scene.materials.iter().flat_map(uses).flatten() {
        let image = scene.images.get(use_.image).ok_or_else(|| PackError::Image {
            image: use_.image,
            name: String::new(),
            reason: format!("is used by a material, but the scene has {}", scene.images.len()),
        })?;
        let pixels = u64::from(image.width) * u64::from(image.height);
        if pixels == 0 || image.rgba.len() as u64 != 4 * pixels {
            let reason = format!("{} bytes for {}×{} pixels", image.rgba.len(), image.width, image.height);
            return Err(PackError::Image { image: use_.image, name: image.name.clone(), reason });
        }
        first[use_.image] = Some(0);
    }
    let levels = fitting(scene, &first, limits.texels(scene))?;
    let mut texels = Vec::new();
    for (level, at) in levels.iter().zip(&mut first) {
        if let Some(at) = at {
            *at = texels.len() as u64;
            texels.extend(level.rgba.chunks_exact(4).map(|p| u32::from_le_bytes([p[0], p[1], p[2], p[3]])));
        }
    }
    let image_use = |r: Option<TextureRef>| {
        let Some(r) = r else { return ImageUse { texel: u32::MAX, ..ImageUse::zeroed() } };
        let image = &scene.images[r.image];
        let wrap = |w| match w {
            Wrap::Repeat => 0,
            Wrap::MirroredRepeat => 1,
            Wrap::ClampToEdge => 2,
        };
        let bits = wrap(r.sampler.wrap[0])
            | wrap(r.sampler.wrap[1]) << 2
            | u32::from(r.uv_set.min(1)) << 4
            | u32::from(image.color_space == ColorSpace::Srgb) << 5
            | u32::from(!r.sampler.mag_linear) << 6;
        let [row0, row1] = r.transform;
        let texel = first[r.image].unwrap_or_default() as u32;
        let level = &levels[r.image];
        ImageUse { row0, texel, row1, bits, size: [level.width, level.height], pad: [0; 2] }
    };
    let items = scene.materials.iter().map(|m| {
        let [base_use, rough_use, normal_use, emissive_use] = uses(m).map(image_use);
        RefMaterial {
            base_color: m.base_color,
            emissive: m.emissive,
            flags: u32::from(m.unlit) | u32::from(m.double_sided) << 1,
            metallic: m.metallic,
            roughness: m.roughness,
            normal_scale: m.normal_scale,
            alpha_cutoff: match m.alpha_mode {
                AlphaMode::Opaque => 0.0,
                AlphaMode::Mask { cutoff } => cutoff.min(1.0),
                AlphaMode::Blend => 2.0,
            },
            specular_tint: m.specular_tint,
            f0: m.f0,
            base_use,
            rough_use,
            normal_use,
            emissive_use,
        }
    });
    Ok((items.collect(), texels))
}

/// The images, those that some material uses halved, the largest first, until all have no more than
/// `limit` texels.
fn fitting<'a>(scene: &'a Scene, used: &[Option<u64>], limit: u64) -> Result<Vec<Level<'a>>, PackError> {
    let level = |i: &'a Image| Level { width: i.width, height: i.height, rgba: Cow::Borrowed(i.rgba.as_slice()) };
    let mut levels: Vec<_> = scene.images.iter().map(level).collect();
    let texels = |l: &Level<'_>| u64::from(l.width) * u64::from(l.height);
    loop {
        let all = || levels.iter().enumerate().filter(|(i, _)| used[*i].is_some());
        let total: u64 = all().map(|(_, l)| texels(l)).sum();
        let Some((largest, most)) = all().map(|(i, l)| (i, texels(l))).max_by_key(|(_, n)| *n) else { break };
        if total <= limit {
            break;
        }
        if most <= 1 {
            return Err(PackError::Image {
                image: largest,
                name: scene.images[largest].name.clone(),
                reason: format!("is one of so many that the device holds no texel of each ({limit} in all)"),
            });
        }
        levels[largest] = levels[largest].halved(scene.images[largest].color_space);
    }
    let smaller = levels.iter().zip(&scene.images).filter(|(l, i)| l.width != i.width || l.height != i.height).count();
    if smaller > 0 {
        tracing::warn!(
            "{smaller} of {} images are traced at a lower resolution: the device binds {} MB of texels at once",
            scene.images.len(),
            limit * 4 / 1_000_000
        );
    }
    Ok(levels)
}

/// In the order of [`RefMaterial`].
fn uses(m: &Material) -> [Option<TextureRef>; 4] {
    [m.base_color_texture, m.metallic_roughness_texture, m.normal_texture, m.emissive_texture]
}
