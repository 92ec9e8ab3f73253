//! Reflectance of dielectrics: KHR_materials_ior with KHR_materials_specular, and
//! KHR_materials_pbrSpecularGlossiness.
//!
//! A [`Material`] has one coloured reflectance without texture. So the extensions' factors are kept
//! as they are, but textures of KHR_materials_specular count by their mean (with a warning), its
//! weight scales the reflectance at normal incidence only (at grazing angles every surface with any
//! is a mirror), and a specular-glossiness texture becomes base colour, metallic and roughness,
//! texel by texel.

use super::Loader;
use super::texture::plain;
use crate::texture::{self, Use};
use bouncelight::scene::{ColorSpace, DIELECTRIC_F0, Image, Material, TextureRef};

impl<'a> Loader<'a> {
    /// `f0` and its tint: `min(((ior − 1) / (ior + 1))² · specularColor, 1) · specular`, as
    /// KHR_materials_specular says. An index of 0 is infinite (KHR_materials_ior), which the
    /// formula gives by itself.
    pub(super) fn specular(&mut self, place: &str, material: &gltf::Material<'a>, out: &mut Material) {
        let plain_f0 = material.ior().map_or(DIELECTRIC_F0, |ior| ((ior - 1.0) / (ior + 1.0)).powi(2));
        let Some(specular) = material.specular() else {
            out.f0 = plain_f0;
            return;
        };
        let (mut weight, mut color) = (specular.specular_factor(), specular.specular_color_factor());
        if let Some(info) = specular.specular_texture().filter(|_| weight > 0.0) {
            let mean = texture::mean(&self.decode(place, info.texture().index(), Use::Data));
            self.warn(place, &format!("its specularTexture is replaced by its mean, {:.3}", mean[3]));
            weight *= mean[3];
        }
        if let Some(info) = specular.specular_color_texture().filter(|_| color != [0.0; 3]) {
            let mean = texture::mean(&self.decode(place, info.texture().index(), Use::Color));
            let [r, g, b, _] = mean;
            self.warn(place, &format!("its specularColorTexture is replaced by its mean, {r:.3}, {g:.3}, {b:.3}"));
            (0..3).for_each(|c| color[c] *= mean[c]);
        }
        set_reflectance(out, color.map(|c| (plain_f0 * c).min(1.0) * weight));
    }

    /// KHR_materials_pbrSpecularGlossiness, which wins over the metallic-roughness values beside
    /// it.
    pub(super) fn glossiness(
        &mut self,
        place: &str,
        glossy: &gltf::material::PbrSpecularGlossiness<'a>,
        out: &mut Material,
    ) {
        let (diffuse, specular, shine) =
            (glossy.diffuse_factor(), glossy.specular_factor(), glossy.glossiness_factor());
        let colors = glossy.diffuse_texture().map(|t| plain(&t));
        let slot = |name: &str| format!("{place}.{name}");
        let gloss = glossy.specular_glossiness_texture().map(|t| plain(&t));
        let gloss = gloss.and_then(|r| Some((r, self.placed(&slot("specularGlossinessTexture"), r)?)));
        let together = colors.zip(gloss).is_none_or(|(c, (g, _))| (c.uv_set, c.transform) == (g.uv_set, g.transform));
        if gloss.is_none() || !together {
            (out.base_color, out.metallic, out.roughness) = (diffuse, 0.0, 1.0 - shine);
            out.base_color_texture = colors.and_then(|r| self.texture(place, "diffuseTexture", r, Use::Color));
        }
        let Some((g, placed)) = gloss else { return set_reflectance(out, specular) };
        let colors = colors.filter(|_| together);
        // Materials that share textures and factors share what is made of them.
        let key = format!("{:?} {} {diffuse:?} {specular:?} {shine} {together}", colors.map(|c| c.texture), g.texture);
        let (base, surface, mean) = match self.converted.get(&key).copied() {
            Some(known) => known,
            None => {
                let picture = self.decode(&slot("specularGlossinessTexture"), g.texture, Use::Specular);
                let colors = colors.map(|c| self.decode(&slot("diffuseTexture"), c.texture, Use::Color));
                let metals = if together { specular } else { [0.0; 3] };
                let (base, surface) = converted(colors.as_ref(), &picture, diffuse, metals, shine);
                let surface = self.add(surface);
                let base = if together { self.add(base) } else { surface };
                let made = (base, surface, texture::mean(&picture));
                self.converted.insert(key, made);
                made
            }
        };
        (out.roughness, out.metallic) = (1.0, 1.0);
        out.metallic_roughness_texture = Some(TextureRef { image: surface, ..placed });
        if together {
            out.base_color = [1.0, 1.0, 1.0, diffuse[3]];
            out.base_color_texture = Some(TextureRef { image: base, ..placed });
        } else {
            // Two placements cannot be joined into one: then the reflectance is one colour,
            // roughness stays a picture.
            out.metallic = 0.0;
            set_reflectance(out, [0, 1, 2].map(|c| specular[c] * mean[c]));
            self.warn(place, "its two textures are placed differently, so its specular colour is replaced by its mean");
        }
    }

    fn add(&mut self, image: Image) -> usize {
        self.scene.images.push(image);
        self.scene.images.len() - 1
    }
}

/// Splits a coloured reflectance at normal incidence into its largest component and its colour.
pub(super) fn set_reflectance(out: &mut Material, f0: [f32; 3]) {
    let most = f0.iter().fold(0.0f32, |a, b| a.max(*b));
    out.f0 = most;
    out.specular_tint = if most > 0.0 && most.is_finite() { f0.map(|c| c / most) } else { [1.0; 3] };
}

/// Base colour (sRGB) and metallic-roughness images of a specular-glossiness texture and the
/// diffuse one beside it, at the larger of their sizes, all factors multiplied in but that of
/// alpha.
fn converted(
    colors: Option<&Image>,
    gloss: &Image,
    diffuse: [f32; 4],
    specular: [f32; 3],
    shine: f32,
) -> (Image, Image) {
    let (width, height) =
        colors.map_or((gloss.width, gloss.height), |c| (c.width.max(gloss.width), c.height.max(gloss.height)));
    let table = texture::srgb_table();
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let at = |image: &Image, x: u32, y: u32| -> [u8; 4] {
        let (x, y) = ((x * image.width) / width, (y * image.height) / height);
        let i = 4 * (y as usize * image.width as usize + x as usize);
        [image.rgba[i], image.rgba[i + 1], image.rgba[i + 2], image.rgba[i + 3]]
    };
    let count = 4 * width as usize * height as usize;
    let (mut base, mut surface) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let d = colors.map_or([255; 4], |c| at(c, x, y));
        let s = at(gloss, x, y);
        let linear = |bytes: [u8; 4], factor: &[f32]| [0, 1, 2].map(|c| table[usize::from(bytes[c])] * factor[c]);
        let (color, metallic) = metallic_of(linear(d, &diffuse), linear(s, &specular));
        base.extend(color.map(texture::to_srgb));
        base.push(d[3]);
        surface.extend([255, byte(1.0 - shine * f32::from(s[3]) / 255.0), byte(metallic), 255]);
    }
    let image = |name: String, rgba, color_space| Image { name, width, height, rgba, color_space };
    (
        image(format!("{} (base colour)", gloss.name), base, ColorSpace::Srgb),
        image(format!("{} (metallic-roughness)", gloss.name), surface, ColorSpace::Linear),
    )
}

/// The metallic-roughness surface that looks most like one of this diffuse and specular colour.
///
/// With the diffuse light D that the specular lobe leaves, the reflectance S, and a dielectric's f
/// = 0.04, base colour b and metallic m would have to fulfil b (1 − m) (1 − f) = D and f (1 − m) +
/// b m = S. For the mean of the colours that is a quadratic equation of 1 − m; b is then the one of
/// least squared error over both equations, colour by colour.
fn metallic_of(diffuse: [f32; 3], specular: [f32; 3]) -> ([f32; 3], f32) {
    const F: f32 = DIELECTRIC_F0;
    let specular = specular.map(|s| s.clamp(0.0, 1.0));
    let left = 1.0 - specular.iter().fold(0.0f32, |a, b| a.max(*b));
    let diffuse = diffuse.map(|d| d.clamp(0.0, 1.0) * left / (1.0 - F));
    let mean = |c: [f32; 3]| (c[0] + c[1] + c[2]) / 3.0;
    let (d, s) = (mean(diffuse), mean(specular));
    // f k² − (D + S) k + D = 0 with k = 1 − m; written so that D = 0 (pure metal) and D = S = 0
    // give what they should.
    let root = ((d + s).powi(2) - 4.0 * F * d).max(0.0).sqrt();
    let k = if s <= F { 1.0 } else { (2.0 * d / (d + s + root).max(1e-6)).clamp(0.0, 1.0) };
    let m = 1.0 - k;
    let scale = 1.0 / (k * k + m * m);
    let base = [0, 1, 2].map(|c| ((k * diffuse[c] + m * (specular[c] - F * k)) * scale).clamp(0.0, 1.0));
    (base, m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metals_and_dielectrics_are_told_apart() {
        let gold = [1.0, 0.77, 0.34];
        let (base, metallic) = metallic_of([0.0; 3], gold);
        assert!(metallic > 0.999 && base.iter().zip(gold).all(|(a, b)| (a - b).abs() < 1e-3), "{base:?} {metallic}");
        let (base, metallic) = metallic_of([0.5, 0.2, 0.1], [DIELECTRIC_F0; 3]);
        assert!(metallic < 1e-3 && (base[0] - 0.5).abs() < 1e-3 && (base[2] - 0.1).abs() < 1e-3, "{base:?} {metallic}");
        // There and back for what metallic-roughness can say exactly.
        for (b, m) in [(0.6, 0.3), (0.9, 0.8), (0.2, 0.5)] {
            let s = DIELECTRIC_F0 * (1.0 - m) + b * m;
            let d = b * (1.0 - m) * (1.0 - DIELECTRIC_F0) / (1.0 - s);
            let (base, metallic) = metallic_of([d; 3], [s; 3]);
            assert!((base[0] - b).abs() < 1e-3 && (metallic - m).abs() < 1e-3, "{b} {m}: {base:?} {metallic}");
        }
        // Black that reflects nothing, and less than any dielectric: no metal.
        assert_eq!(metallic_of([0.0; 3], [0.0; 3]).1, 0.0);
        assert_eq!(metallic_of([0.7; 3], [0.01; 3]).1, 0.0);
    }
}
