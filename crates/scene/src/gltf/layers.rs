//! What lies over a surface or is seen through it: KHR_materials_sheen, KHR_materials_clearcoat,
//! KHR_materials_transmission with KHR_materials_volume.
//!
//! A [`Material`] is one opaque layer with coverage. So the light that fibres throw back becomes
//! part of the surface's colour, a coat becomes part of its own reflectance, and what is
//! transmitted goes straight on where the surface does not cover: nothing is refracted or scattered
//! on its way, and its colour counts by the mean over red, green and blue. Rasteriser and path
//! tracer draw the same surface. Textures count by their mean, with a warning.

use super::Loader;
use crate::texture::{self, Use};
use bouncelight::scene::{AlphaMode, DIELECTRIC_F0, Image, Material, TextureRef};
use serde_json::{Map, Value};

type Extensions = Map<String, Value>;

impl Loader<'_> {
    /// KHR_materials_clearcoat: a dielectric layer of index 1.5 over the surface. At normal
    /// incidence it reflects its share and lets the rest of the light to the surface below; one
    /// lobe of the mean roughness, weighted by reflectance, stands for both.
    pub(super) fn clearcoat(&mut self, place: &str, extensions: &Extensions, out: &mut Material) {
        let Some(coat) = extensions.get("KHR_materials_clearcoat") else { return };
        let weight = self.factor(place, coat, "clearcoat", 0);
        if weight == 0.0 {
            return;
        }
        let coat_roughness = self.factor(place, coat, "clearcoatRoughness", 1);
        let coat = weight * DIELECTRIC_F0;
        let metallic = self.metalness(out);
        let below = (1.0 - coat) * (mean(out.base_color) * metallic + out.f0 * (1.0 - metallic));
        let tint = |c: usize| coat + (1.0 - coat) * out.f0 * out.specular_tint[c];
        let f0 = [tint(0), tint(1), tint(2)];
        super::specular::set_reflectance(out, f0);
        // Of a metal the base colour is the reflectance.
        (0..3).for_each(|c| out.base_color[c] = (1.0 - coat) * out.base_color[c] + coat * metallic);
        out.roughness = (coat * coat_roughness + below * out.roughness) / (coat + below);
    }

    /// KHR_materials_sheen: fibres over the surface. What they throw back, in the mean over all
    /// directions, is scattered like the surface's own diffuse light, which gets what they leave;
    /// that cloth is brightest at its rims is lost.
    pub(super) fn sheen(&mut self, place: &str, extensions: &Extensions, out: &mut Material) {
        let Some(sheen) = extensions.get("KHR_materials_sheen") else { return };
        let channel = |c: usize| sheen["sheenColorFactor"].get(c).and_then(Value::as_f64).map_or(0.0, |v| v as f32);
        let mut color = [0, 1, 2].map(|c| channel(c).clamp(0.0, 1.0));
        if color == [0.0; 3] {
            return;
        }
        let roughness = self.factor(place, sheen, "sheenRoughness", 3);
        if let Some(mean) = self.mean_of(place, sheen, "sheenColorTexture", Use::Color) {
            (0..3).for_each(|c| color[c] *= mean[c]);
        }
        let added = color.map(|c| c * fibres(roughness));
        let left = 1.0 - added.iter().fold(0.0f32, |a, b| a.max(*b));
        out.f0 *= left;
        let base = out.base_color;
        match out.base_color_texture {
            None => (0..3).for_each(|c| out.base_color[c] = left * base[c] + added[c]),
            // A factor cannot add: the sum is a picture of its own.
            Some(old) => {
                let key = format!("sheen {} {base:?} {added:?}", old.image);
                let known = self.converted.get(&key).map(|k| k.0);
                let image = known.unwrap_or_else(|| {
                    let picture = summed(&self.scene.images[old.image], |c, v| left * base[c] * v + added[c]);
                    self.scene.images.push(picture);
                    let image = self.scene.images.len() - 1;
                    self.converted.insert(key, (image, image, [0.0; 4]));
                    image
                });
                out.base_color_texture = Some(TextureRef { image, ..old });
                out.base_color = [1.0, 1.0, 1.0, base[3]];
            }
        }
    }

    /// KHR_materials_transmission, and the colour that KHR_materials_volume gives to what passes.
    ///
    /// Of the light that a dielectric does not reflect, the share t goes on instead of being
    /// scattered, coloured by the base colour. The surface covers what does not: 1 − t (1 − F0) c.
    /// There it has the diffuse and the specular light of the whole, so both are divided by the
    /// coverage.
    pub(super) fn transmission(&mut self, place: &str, extensions: &Extensions, out: &mut Material) {
        let Some(through) = extensions.get("KHR_materials_transmission") else { return };
        let share = self.factor(place, through, "transmission", 0) * (1.0 - self.metalness(out));
        if share == 0.0 {
            return;
        }
        if let AlphaMode::Mask { .. } = out.alpha_mode {
            return self.warn(place, "is cut out by its alpha, so it is drawn without KHR_materials_transmission");
        }
        let mut color = mean(out.base_color);
        if let Some(base) = out.base_color_texture {
            let [r, g, b, alpha] = texture::mean(&self.scene.images[base.image]);
            color *= (r + g + b) / 3.0;
            if out.alpha_mode == AlphaMode::Opaque && alpha < 1.0 {
                self.warn(
                    place,
                    "is transmitting and has a base colour with alpha, which hides less of what is behind",
                );
            }
        }
        color *= extensions.get("KHR_materials_volume").map_or(1.0, absorbed);
        let covered = 1.0 - share * (1.0 - out.f0) * color;
        if out.alpha_mode == AlphaMode::Opaque {
            (out.alpha_mode, out.base_color[3]) = (AlphaMode::Blend, 1.0);
        }
        out.base_color[3] *= covered;
        (0..3).for_each(|c| out.base_color[c] *= (1.0 - share) / covered);
        out.f0 = (out.f0 / covered).min(1.0);
    }

    /// Mean of what is metal of a surface: many files leave the factor at 1 and say in the texture
    /// that nothing is.
    fn metalness(&self, material: &Material) -> f32 {
        let image = material.metallic_roughness_texture.map(|t| &self.scene.images[t.image]);
        material.metallic * image.map_or(1.0, |image| texture::mean(image)[2])
    }

    /// `NAMEFactor` in [0, 1], times the mean of channel `channel` of `NAMETexture`.
    fn factor(&mut self, place: &str, extension: &Value, name: &str, channel: usize) -> f32 {
        let factor = number(extension, &format!("{name}Factor")).unwrap_or(0.0);
        if factor.is_nan() || !(0.0..=1.0).contains(&factor) {
            self.warn(place, &format!("has a {name}Factor of {factor}, which was clamped"));
        }
        let factor = factor.clamp(0.0, 1.0);
        if factor == 0.0 {
            return factor;
        }
        let mean = self.mean_of(place, extension, &format!("{name}Texture"), Use::Data);
        factor * mean.map_or(1.0, |mean| mean[channel])
    }

    /// Mean of the texture called `slot`, with a warning that it is all that counts; `None` where
    /// there is none.
    fn mean_of(&mut self, place: &str, extension: &Value, slot: &str, kind: Use) -> Option<[f32; 4]> {
        let index = extension.get(slot)?.get("index")?;
        let known = index.as_u64().filter(|&i| (i as usize) < self.document.as_json().textures.len());
        let Some(index) = known else {
            self.warn(place, &format!("its {slot} does not exist"));
            return None;
        };
        let mean = texture::mean(&self.decode(place, index as usize, kind));
        let [r, g, b, a] = mean;
        self.warn(place, &format!("its {slot} is replaced by its mean, {r:.3}, {g:.3}, {b:.3}, {a:.3}"));
        Some(mean)
    }
}

fn number(extension: &Value, name: &str) -> Option<f32> {
    extension.get(name).and_then(Value::as_f64).map(|v| v as f32)
}

/// Share of light from a direction that fibres of a roughness throw back, in the mean over a
/// hemisphere by the cosine: the "Charlie" lobe of KHR_materials_sheen with the shadowing of
/// Estevez and Kulla (2017), integrated in steps of 0.1; the curve is off by 0.002 at most.
fn fibres(roughness: f32) -> f32 {
    0.0152 + roughness * (0.0171 + roughness * (0.6970 - 0.4283 * roughness))
}

/// A picture whose linear values went through `change`, colour by colour.
fn summed(image: &Image, change: impl Fn(usize, f32) -> f32) -> Image {
    let table = texture::srgb_table();
    let mut out = image.clone();
    for texel in out.rgba.chunks_exact_mut(4) {
        (0..3).for_each(|c| texel[c] = texture::to_srgb(change(c, table[usize::from(texel[c])])));
    }
    out
}

/// Share of light that is left on its way through a body once, by Beer's law; all where it is thin
/// or clear.
fn absorbed(volume: &Value) -> f32 {
    let thickness = number(volume, "thicknessFactor").unwrap_or(0.0);
    let distance = number(volume, "attenuationDistance").unwrap_or(f32::INFINITY);
    if !(thickness > 0.0 && distance > 0.0) {
        return 1.0;
    }
    let color = |c: usize| volume["attenuationColor"].get(c).and_then(Value::as_f64).map_or(1.0, |v| v as f32);
    let left = |c: usize| color(c).clamp(0.0, 1.0).powf(thickness / distance);
    let left = (left(0) + left(1) + left(2)) / 3.0;
    if left.is_finite() { left } else { 1.0 }
}

fn mean(color: [f32; 4]) -> f32 {
    (color[0] + color[1] + color[2]) / 3.0
}
