//! Textures that materials use: reference, sampler, image.

use gltf::json::extensions::texture::TextureTransform;
use gltf::texture::{MagFilter, MinFilter, WrappingMode};

use super::Loader;
use super::source::shorten;
use crate::texture::{self, Use};
use bouncelight::scene::{Image, Sampler, TextureRef, Wrap};

/// The parts of glTF's three kinds of texture reference that they share.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Reference {
    pub texture: usize,
    pub uv_set: u32,
    pub transform: [[f32; 3]; 2],
}

const IDENTITY: [[f32; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

impl Loader<'_> {
    pub(super) fn texture(&mut self, place: &str, slot: &str, reference: Reference, usage: Use) -> Option<TextureRef> {
        let place = format!("{place}.{slot}");
        let placed = self.placed(&place, reference)?;
        Some(TextureRef { image: self.image(&place, reference.texture, usage), ..placed })
    }

    /// Sampler and placement of a texture, without its image.
    pub(super) fn placed(&mut self, place: &str, reference: Reference) -> Option<TextureRef> {
        let Some(uv_set) = self.kept_sets.iter().position(|set| *set == reference.uv_set) else {
            let [a, b] = self.kept_sets;
            let what = format!("reads TEXCOORD_{}; of its material's, only {a} and {b} are kept", reference.uv_set);
            self.warn(place, &format!("{what}, so it is left out"));
            return None;
        };
        let texture = self.document.textures().nth(reference.texture)?;
        let sampler = texture.sampler();
        let wrap = |mode| match mode {
            WrappingMode::ClampToEdge => Wrap::ClampToEdge,
            WrappingMode::MirroredRepeat => Wrap::MirroredRepeat,
            WrappingMode::Repeat => Wrap::Repeat,
        };
        let nearest = [MinFilter::Nearest, MinFilter::NearestMipmapNearest, MinFilter::NearestMipmapLinear];
        Some(TextureRef {
            image: 0,
            sampler: Sampler {
                mag_linear: sampler.mag_filter() != Some(MagFilter::Nearest),
                min_linear: !sampler.min_filter().is_some_and(|f| nearest.contains(&f)),
                wrap: [wrap(sampler.wrap_s()), wrap(sampler.wrap_t())],
            },
            uv_set: uv_set as u8,
            transform: reference.transform,
        })
    }

    /// Index in the scene of a texture's image, decoded on first use; a broken one is named and
    /// replaced.
    fn image(&mut self, place: &str, texture: usize, usage: Use) -> usize {
        let source = self.document.as_json().textures[texture].source.value();
        if let Some(&known) = self.images.get(&(source, usage)) {
            return known;
        }
        let image = self.decode(place, texture, usage);
        let index = self.scene.images.len();
        self.scene.images.push(image);
        self.images.insert((source, usage), index);
        index
    }

    /// A texture's image; a broken one is named and replaced.
    pub(super) fn decode(&mut self, place: &str, texture: usize, usage: Use) -> Image {
        let root = self.document.as_json();
        let source = root.textures[texture].source.value();
        let (label, decoded) = match root.images.get(source) {
            None => (place.to_owned(), Err("its texture has no image".to_owned())),
            Some(image) => {
                let named = image
                    .uri
                    .as_deref()
                    .filter(|u| !u.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:")))
                    .or(image.name.as_deref());
                let label = named.map_or_else(|| format!("images[{source}]"), shorten);
                let bytes = match (&image.uri, &image.buffer_view) {
                    (Some(uri), _) => self.source.fetch(uri),
                    (None, Some(view)) => match self.document.views().nth(view.value()) {
                        Some(view) => self.source.view(&view).map(Into::into).map_err(|e| e.to_string()),
                        None => Err("its buffer view does not exist".to_owned()),
                    },
                    (None, None) => Err("it has neither a URI nor a buffer view".to_owned()),
                };
                let decoded = bytes.and_then(|bytes| {
                    texture::room(&self.scene.images, texture::MAX_TOTAL)?;
                    texture::decode(&label, &bytes, usage)
                });
                (label, decoded)
            }
        };
        let place = format!("texture '{label}'");
        match decoded {
            Ok((image, told)) => {
                told.into_iter().for_each(|told| self.warn(&place, &told));
                image
            }
            Err(problem) => {
                self.warn(&place, &format!("{problem}; a checkerboard replaces it"));
                texture::stand_in(&label, usage)
            }
        }
    }
}

/// A reference that the crate types in full.
pub(super) fn plain(info: &gltf::texture::Info) -> Reference {
    Reference {
        texture: info.texture().index(),
        uv_set: info.texture_transform().and_then(|t| t.tex_coord()).unwrap_or(info.tex_coord()),
        transform: info.texture_transform().map_or(IDENTITY, |t| affine(t.offset(), t.rotation(), t.scale())),
    }
}

/// A reference whose KHR_texture_transform the crate keeps as JSON.
pub(super) fn special(
    texture: usize,
    uv_set: u32,
    others: Option<&serde_json::Map<String, serde_json::Value>>,
) -> Reference {
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

/// KHR_texture_transform: scale, then rotation, then offset. A positive rotation turns coordinates
/// counter-clockwise as seen with v pointing down, which is how every viewer reads the extension.
fn affine(offset: [f32; 2], rotation: f32, scale: [f32; 2]) -> [[f32; 3]; 2] {
    let (sin, cos) = rotation.sin_cos();
    let rows = [[cos * scale[0], sin * scale[1], offset[0]], [-sin * scale[0], cos * scale[1], offset[1]]];
    if rows.iter().flatten().all(|v| v.is_finite()) { rows } else { IDENTITY }
}
