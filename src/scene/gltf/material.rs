//! Materials and the textures they use.

use gltf::json::extensions::texture::TextureTransform;
use gltf::texture::{MagFilter, MinFilter, WrappingMode};

use super::Loader;
use super::source::shorten;
use crate::scene::texture::{self, Use};
use crate::scene::{AlphaMode, DIELECTRIC_F0, Material, Sampler, TextureRef, Wrap};

/// The parts of glTF's three kinds of texture reference that they share.
struct Reference {
    texture: usize,
    uv_set: u32,
    transform: [[f32; 3]; 2],
}

const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

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

    fn build(&mut self, material: &gltf::Material<'a>) -> Material {
        let Some(index) = material.index() else {
            return Material { name: "glTF default".to_owned(), ..Material::default() };
        };
        let name = material.name().map_or_else(|| format!("materials[{index}]"), str::to_owned);
        let place = format!("materials[{index}] '{name}'");
        let pbr = material.pbr_metallic_roughness();
        let strength = material.emissive_strength().unwrap_or(1.0);
        let mut out = Material {
            name,
            base_color: pbr.base_color_factor(),
            metallic: pbr.metallic_factor(),
            roughness: pbr.roughness_factor(),
            f0: material.ior().map_or(DIELECTRIC_F0, |ior| ((ior - 1.0) / (ior + 1.0)).powi(2)),
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
        self.clean(&place, &mut out);

        let plain = |info: gltf::texture::Info| Reference {
            texture: info.texture().index(),
            uv_set: info.texture_transform().and_then(|t| t.tex_coord()).unwrap_or(info.tex_coord()),
            transform: info.texture_transform().map_or(IDENTITY, |t| affine(t.offset(), t.rotation(), t.scale())),
        };
        out.base_color_texture =
            pbr.base_color_texture().and_then(|t| self.texture(&place, "baseColorTexture", plain(t), Use::Color));
        out.metallic_roughness_texture = pbr
            .metallic_roughness_texture()
            .and_then(|t| self.texture(&place, "metallicRoughnessTexture", plain(t), Use::Data));
        out.emissive_texture =
            material.emissive_texture().and_then(|t| self.texture(&place, "emissiveTexture", plain(t), Use::Color));

        // For these two the crate types no KHR_texture_transform, so it is read from what it keeps as JSON.
        let json = &self.document.as_json().materials[index];
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
        if let AlphaMode::Mask { cutoff } = &mut material.alpha_mode {
            // A cutoff above 1 legally hides everything.
            fit(cutoff, 2.0);
        }
        if mended {
            self.warn(place, "has factors out of range, which were clamped");
        }
    }

    fn texture(&mut self, place: &str, slot: &str, reference: Reference, usage: Use) -> Option<TextureRef> {
        let place = format!("{place}.{slot}");
        if reference.uv_set > 1 {
            self.warn(
                &place,
                &format!("reads TEXCOORD_{}; only 0 and 1 are kept, so it is left out", reference.uv_set),
            );
            return None;
        }
        let texture = self.document.textures().nth(reference.texture)?;
        let sampler = texture.sampler();
        let wrap = |mode| match mode {
            WrappingMode::ClampToEdge => Wrap::ClampToEdge,
            WrappingMode::MirroredRepeat => Wrap::MirroredRepeat,
            WrappingMode::Repeat => Wrap::Repeat,
        };
        let nearest = [MinFilter::Nearest, MinFilter::NearestMipmapNearest, MinFilter::NearestMipmapLinear];
        Some(TextureRef {
            image: self.image(&place, reference.texture, usage),
            sampler: Sampler {
                mag_linear: sampler.mag_filter() != Some(MagFilter::Nearest),
                min_linear: !sampler.min_filter().is_some_and(|f| nearest.contains(&f)),
                wrap: [wrap(sampler.wrap_s()), wrap(sampler.wrap_t())],
            },
            uv_set: reference.uv_set as u8,
            transform: reference.transform,
        })
    }

    /// Index in the scene of a texture's image, decoded on first use; a broken one is named and replaced.
    fn image(&mut self, place: &str, texture: usize, usage: Use) -> usize {
        let root = self.document.as_json();
        let source = root.textures[texture].source.value();
        if let Some(&known) = self.images.get(&(source, usage)) {
            return known;
        }
        let (label, decoded) = match root.images.get(source) {
            None => (place.to_owned(), Err("its texture has no image".to_owned())),
            Some(image) => {
                let named = image.uri.as_deref().filter(|u| !u.starts_with("data:")).or(image.name.as_deref());
                let label = named.map_or_else(|| format!("images[{source}]"), shorten);
                let bytes = match (&image.uri, &image.buffer_view) {
                    (Some(uri), _) => self.source.fetch(uri),
                    (None, Some(view)) => match self.document.views().nth(view.value()) {
                        Some(view) => self.source.view(&view).map(Into::into).map_err(|e| e.to_string()),
                        None => Err("its buffer view does not exist".to_owned()),
                    },
                    (None, None) => Err("it has neither a URI nor a buffer view".to_owned()),
                };
                let decoded = bytes.and_then(|bytes| texture::decode(&label, &bytes, usage));
                (label, decoded)
            }
        };
        let image = decoded.unwrap_or_else(|problem| {
            self.warn(&format!("texture '{label}'"), &format!("{problem}; a checker stands in for it"));
            texture::stand_in(&label, usage)
        });
        let index = self.scene.images.len();
        self.scene.images.push(image);
        self.images.insert((source, usage), index);
        index
    }
}

fn special(texture: usize, uv_set: u32, others: Option<&serde_json::Map<String, serde_json::Value>>) -> Reference {
    let transform = others
        .and_then(|o| o.get("KHR_texture_transform"))
        .and_then(|value| serde_json::from_value::<TextureTransform>(value.clone()).ok());
    match transform {
        Some(t) => Reference {
            texture,
            uv_set: t.tex_coord.unwrap_or(uv_set),
            transform: affine(t.offset.0, t.rotation.0, t.scale.0),
        },
        None => Reference { texture, uv_set, transform: IDENTITY },
    }
}

/// KHR_texture_transform: scale, then rotation, then offset. A positive rotation turns coordinates counter-clockwise as
/// seen with v pointing down, which is how every viewer reads the extension.
fn affine(offset: [f32; 2], rotation: f32, scale: [f32; 2]) -> [[f32; 3]; 2] {
    let (sin, cos) = rotation.sin_cos();
    let rows = [[cos * scale[0], sin * scale[1], offset[0]], [-sin * scale[0], cos * scale[1], offset[1]]];
    if rows.iter().flatten().all(|v| v.is_finite()) { rows } else { IDENTITY }
}
