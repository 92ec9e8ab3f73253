//! Materials.

use super::Loader;
use super::texture::{plain, special};
use crate::texture::Use;
use bouncelight::scene::{AlphaMode, Material};
use serde_json::Value;
use std::collections::BTreeSet;

impl<'a> Loader<'a> {
    /// Index in the scene of a glTF material, made on first use.
    pub(super) fn material(&mut self, material: &gltf::Material<'a>) -> usize {
        if let Some(&known) = self.materials.get(&material.index()) {
            return known;
        }
        let built = self.build(material);
        let index = self.scene.materials.len();
        self.scene.materials.push(built);
        self.materials.insert(material.index(), index);
        index
    }

    /// The two sets of texture coordinates that a mesh keeps for a material: 0 and 1, or else the
    /// first two that it reads.
    pub(super) fn sets_of(&mut self, material: &gltf::Material<'a>) -> [u32; 2] {
        if let Some(&known) = self.sets.get(&material.index()) {
            return known;
        }
        let json = material.index().and_then(|i| serde_json::to_value(&self.document.as_json().materials[i]).ok());
        let mut read = BTreeSet::new();
        json.iter().for_each(|json| find_sets(json, &mut read));
        let mut sets = read.into_iter();
        let kept = match (sets.next(), sets.next()) {
            (Some(first), Some(second)) if second > 1 => [first, second],
            (Some(only), None) if only > 1 => [only, 0],
            _ => [0, 1],
        };
        self.sets.insert(material.index(), kept);
        kept
    }

    fn build(&mut self, material: &gltf::Material<'a>) -> Material {
        let Some(index) = material.index() else {
            return Material { name: "glTF default".to_owned(), ..Material::default() };
        };
        self.kept_sets = self.sets_of(material);
        let name = material.name().map_or_else(|| format!("materials[{index}]"), str::to_owned);
        let place = format!("materials[{index}] '{name}'");
        let pbr = material.pbr_metallic_roughness();
        let strength = material.emissive_strength().unwrap_or(1.0);
        let mut out = Material {
            name,
            base_color: pbr.base_color_factor(),
            metallic: pbr.metallic_factor(),
            roughness: pbr.roughness_factor(),
            emissive: material.emissive_factor().map(|e| e * strength),
            double_sided: material.double_sided(),
            unlit: material.unlit(),
            alpha_mode: match material.alpha_mode() {
                gltf::material::AlphaMode::Opaque => AlphaMode::Opaque,
                gltf::material::AlphaMode::Mask => AlphaMode::Mask { cutoff: material.alpha_cutoff().unwrap_or(0.5) },
                gltf::material::AlphaMode::Blend => AlphaMode::Blend,
            },
            ..Material::default()
        };
        match material.pbr_specular_glossiness() {
            Some(glossy) => self.glossiness(&place, &glossy, &mut out),
            None => {
                out.base_color_texture = pbr
                    .base_color_texture()
                    .and_then(|t| self.texture(&place, "baseColorTexture", plain(&t), Use::Color));
                out.metallic_roughness_texture = pbr
                    .metallic_roughness_texture()
                    .and_then(|t| self.texture(&place, "metallicRoughnessTexture", plain(&t), Use::Data));
                self.specular(&place, material, &mut out);
            }
        }
        self.clean(&place, &mut out);
        let json = &self.document.as_json().materials[index];
        if let Some(extensions) = json.extensions.as_ref().map(|e| &e.others) {
            self.sheen(&place, extensions, &mut out);
            self.clearcoat(&place, extensions, &mut out);
            self.transmission(&place, extensions, &mut out);
        }
        out.emissive_texture =
            material.emissive_texture().and_then(|t| self.texture(&place, "emissiveTexture", plain(&t), Use::Color));

        // For these two the crate types no KHR_texture_transform, so it is read from what it keeps
        // as JSON.
        if let Some(normal) = material.normal_texture() {
            let others = json.normal_texture.as_ref().and_then(|t| t.extensions.as_ref()).map(|e| &e.others);
            let reference = special(normal.texture().index(), normal.tex_coord(), others);
            out.normal_scale = if normal.scale().is_finite() { normal.scale() } else { 1.0 };
            out.normal_texture = self.texture(&place, "normalTexture", reference, Use::Normal);
        }
        if let Some(occlusion) = material.occlusion_texture() {
            let others = json.occlusion_texture.as_ref().and_then(|t| t.extensions.as_ref()).map(|e| &e.others);
            let reference = special(occlusion.texture().index(), occlusion.tex_coord(), others);
            out.occlusion_strength = occlusion.strength().clamp(0.0, 1.0);
            out.occlusion_texture = self.texture(&place, "occlusionTexture", reference, Use::Data);
        }
        out
    }

    /// Brings factors into the ranges that the renderer relies on.
    fn clean(&mut self, place: &str, material: &mut Material) {
        let mut mended = false;
        let mut fit = |value: &mut f32, high: f32| {
            let good = if value.is_nan() { 0.0 } else { value.clamp(0.0, high) };
            mended |= good != *value;
            *value = good;
        };
        material.base_color.iter_mut().for_each(|v| fit(v, 1.0));
        material.emissive.iter_mut().for_each(|v| fit(v, 1e9));
        fit(&mut material.metallic, 1.0);
        fit(&mut material.roughness, 1.0);
        fit(&mut material.f0, 1.0);
        material.specular_tint.iter_mut().for_each(|v| fit(v, 1.0));
        if let AlphaMode::Mask { cutoff } = &mut material.alpha_mode {
            // A cutoff above 1 legally hides everything.
            fit(cutoff, 2.0);
        }
        if mended {
            self.warn(place, "has factors out of range, which were clamped");
        }
    }
}

/// Sets of texture coordinates that texture references in a material's JSON name.
fn find_sets(json: &Value, sets: &mut BTreeSet<u32>) {
    let Some(map) = json.as_object() else { return };
    if map.get("index").is_some_and(Value::is_u64) {
        let other = json.pointer("/extensions/KHR_texture_transform/texCoord");
        let set = other.or(map.get("texCoord")).and_then(Value::as_u64).unwrap_or(0);
        sets.insert(u32::try_from(set).unwrap_or(u32::MAX));
        return;
    }
    map.values().for_each(|value| find_sets(value, sets));
}
