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
pub(super) fn veils(scene: &Scene) -> Vec<bool> {
    scene.materials.iter().enumerate().map(|(i, material)| is_veil(i, material, scene)).collect()
}

/// How often each alpha of 8 bits is there.
type Counts = [u64; 256];

fn is_veil(index: usize, material: &Material, scene: &Scene) -> bool {
    if material.alpha_mode != AlphaMode::Blend {
        return false;
    }
    let factor = material.base_color[3];
    let image = material.base_color_texture.and_then(|t| scene.images.get(t.image));
    let texels = image.map(|i| counted(i.rgba.chunks_exact(4).map(|texel| texel[3])));
    let vertices = of_vertices(index, scene);
    if texels.is_none() && vertices.is_none() {
        return factor < SOLID;
    }
    let whole = counted(std::iter::once(255));
    let (texels, vertices) = (texels.unwrap_or(whole), vertices.unwrap_or(whole));
    let there = |counts: Counts| counts.into_iter().enumerate().filter(|(_, count)| *count > 0);
    let (mut solid, mut all) = (0.0, 0.0);
    for (a, m) in there(texels) {
        for (b, n) in there(vertices) {
            let coverage = factor * (a as f32 / 255.0) * (b as f32 / 255.0);
            let covered = f64::from(coverage) * m as f64 * n as f64;
            all += covered;
            solid += if coverage >= SOLID { covered } else { 0.0 };
        }
    }
    solid < 0.5 * all
}

/// Alpha of the vertices of all meshes with that material; `None` where no vertex has a colour.
fn of_vertices(material: usize, scene: &Scene) -> Option<Counts> {
    let coloured = || scene.meshes.iter().filter(|m| m.material == material && !m.colors.is_empty());
    coloured().next()?;
    Some(counted(coloured().flat_map(|m| &m.colors).map(|c| (c[3].clamp(0.0, 1.0) * 255.0).round() as u8)))
}

fn counted(alphas: impl Iterator<Item = u8>) -> Counts {
    let mut counts = [0; 256];
    alphas.for_each(|alpha| counts[usize::from(alpha)] += 1);
    counts
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
        // Alpha of vertices counts as any other, alone and beside a picture's.
        let coloured = |alphas: &[u8], of_vertices: [f32; 4]| {
            let mut scene = scene(alphas, 1.0, AlphaMode::Blend);
            let colors = of_vertices.map(|a| [1.0, 1.0, 1.0, a]).to_vec();
            scene.meshes = vec![crate::scene::Mesh { colors, ..Default::default() }];
            veils(&scene)[0]
        };
        assert!(coloured(&[], [0.25; 4]) && coloured(&[255], [0.5; 4]) && coloured(&[], [0.0, 0.3, 0.6, 0.9]));
        assert!(!coloured(&[], [1.0; 4]) && !coloured(&[], [1.0, 1.0, 1.0, 0.0]));
        // Masks are cut-outs whatever they hold.
        assert!(!veils(&scene(&[100, 120], 0.5, AlphaMode::Mask { cutoff: 0.2 }))[0]);
    }
}
