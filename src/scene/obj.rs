//! Wavefront OBJ with its MTL, through `tobj`.
//!
//! OBJ has no physical material model, so the nearest of glTF's is taken: Kd and map_Kd are the
//! base colour, Ns the roughness of a Blinn-Phong lobe of that exponent, Ke emitted radiance, d
//! alpha; Pr and Pm (the PBR extension) win where a file has them. Surfaces are double-sided,
//! because OBJ says nothing about sides.

use std::cell::RefCell;
use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use super::files::{self, Folder, LoadOptions};
use super::texture::{self, Use};
use super::{
    AlphaMode, Instance, Material, Mesh, Sampler, Scene, SceneError, TextureRef, defaults, error, geometry, sound,
};

/// Loads an OBJ file, its material libraries and textures, and fills in what is missing, as
/// [`super::defaults`] says. A missing library, material or texture is a warning.
///
/// # Errors
/// [`SceneError`] naming the file and the line.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    load_with(path, LoadOptions::default())
}

/// As [`load`], with limits of one's own.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, options: LoadOptions) -> Result<Scene, SceneError> {
    let bytes = error::read_file(path)?;
    let text = String::from_utf8_lossy(files::without_mark(&bytes));
    check(path, &text)?;
    let folder = &Folder::of(path, options);
    let placed = options.units.matrix().to_cols_array_2d();
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut scene = Scene { name, ..Scene::default() };

    let warnings = RefCell::new(Vec::new());
    let warn = |what: String| warnings.borrow_mut().push(format!("{}: {what}", path.display()));
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..tobj::LoadOptions::default() };
    let read_library = |library: &Path| {
        let parsed = folder.read(&library.to_string_lossy()).and_then(|bytes| {
            let text = String::from_utf8_lossy(files::without_mark(&bytes)).into_owned();
            tobj::load_mtl_buf(&mut Cursor::new(text.as_bytes())).map_err(|e| e.to_string())
        });
        // An empty library instead of an error keeps the other libraries of the file.
        Ok(parsed.unwrap_or_else(|problem| {
            warn(format!("material library '{}': {problem}", library.display()));
            Default::default()
        }))
    };
    let (models, materials) = tobj::load_obj_buf(&mut Cursor::new(text.as_bytes()), &options, read_library)
        .map_err(|e| SceneError::broken(path, "OBJ", e.to_string()))?;
    let materials = materials.unwrap_or_default();
    scene.warnings = warnings.into_inner();

    let mut textures = Textures { folder, path, known: HashMap::new() };
    for material in &materials {
        let built = textures.material(&mut scene, material);
        scene.materials.push(built);
    }
    let mut plain = None;
    for model in models {
        if model.mesh.indices.is_empty() {
            continue;
        }
        let material = model.mesh.material_id.filter(|&id| id < scene.materials.len()).unwrap_or_else(|| {
            *plain.get_or_insert_with(|| {
                scene.materials.push(Material {
                    name: "OBJ default".to_owned(),
                    base_color: [0.8, 0.8, 0.8, 1.0],
                    metallic: 0.0,
                    double_sided: true,
                    ..Material::default()
                });
                let what = format!("'{}' and maybe others have no known material and are grey", model.name);
                scene.warnings.push(format!("{}: {what}", path.display()));
                scene.materials.len() - 1
            })
        });
        let mesh = mesh(model, material, scene.materials[material].normal_texture);
        scene.instances.push(Instance { name: mesh.name.clone(), mesh: scene.meshes.len(), transform: placed });
        scene.meshes.push(mesh);
    }
    sound::settle(&mut scene, path)?;
    defaults::complete(&mut scene);
    Ok(scene)
}

/// Finds what `tobj` would report without a line, or let through: numbers that are none, faces
/// without vertices.
fn check(path: &Path, text: &str) -> Result<(), SceneError> {
    let mut counts = [0i64; 3];
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("");
        let mut words = line.split_whitespace();
        let broken = |problem: String| Err(SceneError::broken(path, format!("line {}", i + 1), problem));
        let (kind, needed) = match words.next() {
            Some(word @ ("usemtl" | "mtllib")) if words.next().is_none() => {
                return broken(format!("`{word}` names nothing"));
            }
            Some("v") => (0, 3),
            Some("vt") => (1, 1),
            Some("vn") => (2, 3),
            Some("f") => {
                for word in words {
                    for (part, &count) in word.split('/').zip(&counts) {
                        let index = part.parse::<i64>().unwrap_or(if part.is_empty() { 1 } else { 0 });
                        let known = part.is_empty() || (index != 0 && index.abs() <= count);
                        if !known {
                            return broken(format!("face corner '{word}' refers to nothing among {count} so far"));
                        }
                    }
                }
                continue;
            }
            _ => continue,
        };
        let numbers: Vec<&str> = words.collect();
        if numbers.len() < needed {
            return broken(format!("{} numbers where {needed} are needed", numbers.len()));
        }
        if let Some(bad) = numbers.iter().take(needed).find(|n| !n.parse::<f32>().is_ok_and(f32::is_finite)) {
            return broken(format!("'{bad}' is not a finite number"));
        }
        counts[kind] += 1;
    }
    Ok(())
}

fn mesh(model: tobj::Model, material: usize, normal_map: Option<TextureRef>) -> Mesh {
    fn triples(values: &[f32]) -> Vec<[f32; 3]> {
        values.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect()
    }
    let source = model.mesh;
    let positions = triples(&source.positions);
    let count = positions.len();
    let fits = |n: usize| n == count;
    let mut mesh = Mesh {
        name: model.name,
        normals: triples(&source.normals),
        // OBJ counts v upwards.
        uv0: source.texcoords.chunks_exact(2).map(|uv| [uv[0], 1.0 - uv[1]]).collect(),
        colors: triples(&source.vertex_color).iter().map(|c| [c[0], c[1], c[2], 1.0]).collect(),
        indices: source.indices,
        positions,
        material,
        ..Mesh::default()
    };
    if !fits(mesh.uv0.len()) || mesh.uv0.iter().flatten().any(|v| !v.is_finite()) {
        mesh.uv0.clear();
    }
    if !fits(mesh.colors.len()) || mesh.colors.iter().flatten().any(|v| !v.is_finite()) {
        mesh.colors.clear();
    }
    if fits(mesh.normals.len()) {
        geometry::normalize_normals(&mut mesh.normals);
    } else {
        geometry::make_flat_normals(&mut mesh);
    }
    if let Some(map) = normal_map {
        geometry::make_tangents(&mut mesh, 0, map.transform);
    }
    mesh
}

struct Textures<'a> {
    folder: &'a Folder,
    path: &'a Path,
    known: HashMap<(String, Use), usize>,
}

impl Textures<'_> {
    fn material(&mut self, scene: &mut Scene, source: &tobj::Material) -> Material {
        let number = |key: &str| source.unknown_param.get(key).and_then(|v| v.trim().parse::<f32>().ok());
        let share = |v: f32| if v.is_finite() { v.clamp(0.0, 1.0) } else { 0.0 };
        let exponent = source.shininess.filter(|n| n.is_finite() && *n >= 0.0);
        let roughness = exponent.map_or(1.0, |n| (2.0 / (n + 2.0)).powf(0.25));
        let color = source.diffuse.unwrap_or(if source.diffuse_texture.is_some() { [1.0; 3] } else { [0.8; 3] });
        let alpha = share(source.dissolve.unwrap_or(1.0));
        let light = |v: f32| if v.is_finite() { v.max(0.0) } else { 0.0 };
        let mut out = Material {
            name: source.name.clone(),
            base_color: [share(color[0]), share(color[1]), share(color[2]), alpha],
            metallic: share(number("Pm").unwrap_or(0.0)),
            roughness: share(number("Pr").unwrap_or(roughness)),
            emissive: source.emissive.unwrap_or_default().map(light),
            alpha_mode: if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            double_sided: true,
            ..Material::default()
        };
        let place = format!("{}: material '{}'", self.path.display(), source.name);
        if let Some(name) = &source.diffuse_texture {
            out.base_color_texture = Some(self.texture(scene, name, Use::Color));
        }
        if let Some(name) = source.unknown_param.get("map_Ke") {
            out.emissive_texture = Some(self.texture(scene, name, Use::Color));
        }
        if let Some(name) = source.unknown_param.get("norm") {
            out.normal_texture = Some(self.texture(scene, name, Use::Normal));
        }
        match &source.dissolve_texture {
            Some(name) if source.diffuse_texture.as_ref() == Some(name) => {
                out.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
            }
            Some(name) => scene.warnings.push(format!("{place}: map_d '{name}' is left out; put alpha into map_Kd")),
            None => {}
        }
        if let Some(name) = &source.normal_texture {
            scene.warnings.push(format!("{place}: bump map '{name}' is left out; `norm` gives a normal map"));
        }
        out
    }

    fn texture(&mut self, scene: &mut Scene, statement: &str, usage: Use) -> TextureRef {
        // Options such as `-s 2 2 1` come before the name; names without options may contain
        // spaces.
        let statement = statement.trim();
        let name =
            if statement.starts_with('-') { statement.rsplit(' ').next().unwrap_or(statement) } else { statement };
        let name = name.replace('\\', "/");
        let key = (name.clone(), usage);
        let image = *self.known.entry(key).or_insert_with(|| {
            let decoded = self.folder.read(&name).and_then(|bytes| {
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
                    warn(format!("{problem}; a checker stands in for it"));
                    texture::stand_in(&name, usage)
                }
            };
            scene.images.push(image);
            scene.images.len() - 1
        });
        let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        TextureRef { image, sampler: Sampler::default(), uv_set: 0, transform }
    }
}
