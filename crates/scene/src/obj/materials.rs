//! What a material library says, as the nearest of glTF's materials.

use super::mtl::{Entry, Map};
use crate::files::Folder;
use crate::texture::{self, Use};
use bouncelight::scene::{AlphaMode, Material, Sampler, Scene, TextureRef, Wrap};
use std::collections::HashMap;
use std::path::Path;

/// Textures of a file, each read once.
pub(super) struct Textures<'a> {
    pub(super) folder: &'a Folder,
    pub(super) path: &'a Path,
    known: HashMap<(String, Use), usize>,
}

impl<'a> Textures<'a> {
    pub(super) fn new(folder: &'a Folder, path: &'a Path) -> Self {
        Self { folder, path, known: HashMap::new() }
    }

    pub(super) fn material(&mut self, scene: &mut Scene, source: &Entry) -> Material {
        let share = |v: f32| v.clamp(0.0, 1.0);
        let exponent = source.shininess.filter(|n| *n >= 0.0);
        let roughness = exponent.map_or(1.0, |n| (2.0 / (n + 2.0)).powf(0.25));
        let color = source.diffuse.unwrap_or(if source.diffuse_map.is_some() { [1.0; 3] } else { [0.8; 3] });
        let alpha = share(source.dissolve.or(source.transparency.map(|t| 1.0 - t)).unwrap_or(1.0));
        let mut out = Material {
            name: source.name.clone(),
            base_color: [share(color[0]), share(color[1]), share(color[2]), alpha],
            metallic: share(source.metallic.unwrap_or(0.0)),
            roughness: share(source.roughness.unwrap_or(roughness)),
            emissive: source.emissive.unwrap_or_default().map(|v| v.clamp(0.0, BRIGHTEST)),
            alpha_mode: if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            double_sided: true,
            ..Material::default()
        };
        let place = format!("{}: material '{}'", self.path.display(), source.name);
        if let Some(map) = &source.diffuse_map {
            out.base_color_texture = Some(self.texture(scene, map, Use::Color));
        }
        if let Some(map) = &source.emissive_map {
            out.emissive_texture = Some(self.texture(scene, map, Use::Color));
        }
        if let Some(map) = &source.normal_map {
            out.normal_texture = Some(self.texture(scene, map, Use::Normal));
        }
        match &source.dissolve_map {
            Some(map) if source.diffuse_map.as_ref().is_some_and(|d| d.name == map.name) => {
                out.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
            }
            Some(map) => {
                let what = format!("{place}: map_d '{}' is left out; put alpha into map_Kd", map.name);
                scene.warnings.push(what);
            }
            None => {}
        }
        if let Some(map) = &source.bump_map {
            let what = format!("{place}: bump map '{}' is left out; `norm` gives a normal map", map.name);
            scene.warnings.push(what);
        }
        out
    }

    fn texture(&mut self, scene: &mut Scene, map: &Map, usage: Use) -> TextureRef {
        let image = self.image(scene, map, usage);
        let wrap = if map.clamp { Wrap::ClampToEdge } else { Wrap::Repeat };
        let ([su, sv], [ou, ov]) = (map.scale, map.offset);
        // The library counts v upwards: 1 − (s (1 − v) + o).
        let transform = [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]];
        TextureRef { image, sampler: Sampler { wrap: [wrap; 2], ..Sampler::default() }, uv_set: 0, transform }
    }

    fn image(&mut self, scene: &mut Scene, map: &Map, usage: Use) -> usize {
        if let Some(&known) = self.known.get(&(map.name.clone(), usage)) {
            return known;
        }
        let path = |name: &str| name.replace('\\', "/");
        let name = path(&map.name);
        let read = |name: &str| self.folder.read(name);
        // A name may hold what looks like a comment.
        let bytes =
            read(&name).or_else(|problem| map.alias.as_deref().map_or(Err(problem), |alias| read(&path(alias))));
        let decoded = bytes.and_then(|bytes| {
            texture::room(&scene.images, texture::MAX_TOTAL)?;
            texture::decode(&name, &bytes, usage)
        });
        let mut warn = |what: String| {
            scene.warnings.push(format!("{}: texture '{name}': {what}", self.path.display()));
        };
        let image = match decoded {
            Ok((image, told)) => {
                told.into_iter().for_each(warn);
                image
            }
            Err(problem) => {
                warn(format!("{problem}; a checkerboard replaces it"));
                texture::stand_in(&name, usage)
            }
        };
        scene.images.push(image);
        self.known.insert((map.name.clone(), usage), scene.images.len() - 1);
        scene.images.len() - 1
    }
}

/// Brightest radiance of a material; squares of it are finite.
const BRIGHTEST: f32 = 1e9;
