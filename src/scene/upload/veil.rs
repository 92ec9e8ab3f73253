//! Which blended materials are veils (panes, smoke, beams of light), and which are cut out of a
//! sheet (leaves).
//!
//! glTF has one word for both. A veil has to be blended with what is behind; where a cut-out is
//! drawn so, its triangles come in a wrong order and its rims get the light of what is behind.

use crate::scene::{AlphaMode, Material, Scene};

/// Coverage from which on a place is as good as opaque: one step of 8 bits below 1. `SOLID` of
/// `shaders/render/surface.wgsl`.
const SOLID: f32 = 0.995;

/// Of each material, whether it is blended and most of what it covers is covered in part only.
/// Colours of vertices are taken to be opaque.
pub(super) fn veils(scene: &Scene) -> Vec<bool> {
    scene.materials.iter().map(|material| is_veil(material, scene)).collect()
}

fn is_veil(material: &Material, scene: &Scene) -> bool {
    if material.alpha_mode != AlphaMode::Blend {
        return false;
    }
    let factor = material.base_color[3];
    let Some(image) = material.base_color_texture.and_then(|t| scene.images.get(t.image)) else {
        return factor < SOLID;
    };
    // Texels by their alpha.
    let mut counts = [0u64; 256];
    image.rgba.chunks_exact(4).for_each(|texel| counts[usize::from(texel[3])] += 1);
    let (mut solid, mut all) = (0.0, 0.0);
    for (alpha, count) in counts.into_iter().enumerate() {
        let coverage = factor * alpha as f32 / 255.0;
        all += f64::from(coverage) * count as f64;
        solid += if coverage >= SOLID { f64::from(coverage) * count as f64 } else { 0.0 };
    }
    solid < 0.5 * all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ColorSpace, Image, Sampler, TextureRef};

    fn scene(alphas: &[u8], factor: f32, alpha_mode: AlphaMode) -> Scene {
        let rgba = alphas.iter().flat_map(|a| [255, 255, 255, *a]).collect();
        let image =
            Image { name: "i".into(), width: alphas.len() as u32, height: 1, rgba, color_space: ColorSpace::Srgb };
        let texture = TextureRef {
            image: 0,
            sampler: Sampler::default(),
            uv_set: 0,
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        };
        let base_color = [1.0, 1.0, 1.0, factor];
        let base_color_texture = (!alphas.is_empty()).then_some(texture);
        let material = Material { base_color, base_color_texture, alpha_mode, ..Material::default() };
        Scene { materials: vec![material], images: vec![image], ..Scene::default() }
    }

    #[test]
    fn panes_are_veils_and_leaves_are_not() {
        let veil = |alphas: &[u8], factor| veils(&scene(alphas, factor, AlphaMode::Blend))[0];
        assert!(veil(&[], 0.3) && !veil(&[], 1.0));
        // A leaf with a soft rim, most of the picture empty.
        assert!(!veil(&[0, 0, 0, 0, 0, 60, 200, 255, 255, 255], 1.0));
        // The same at half its coverage; a beam that fades out.
        assert!(veil(&[0, 0, 0, 0, 0, 60, 200, 255, 255, 255], 0.5));
        assert!(veil(&[0, 10, 40, 80, 120, 160], 1.0));
        assert!(!veil(&[0, 0], 1.0), "what covers nothing needs no order");
        // Masks are cut-outs whatever they hold.
        assert!(!veils(&scene(&[100, 120], 0.5, AlphaMode::Mask { cutoff: 0.2 }))[0]);
    }
}
