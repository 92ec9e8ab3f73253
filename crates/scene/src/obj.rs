//! Wavefront OBJ with its MTL.
//!
//! OBJ has no physical material model, so the nearest of glTF's is taken: Kd and map_Kd are the
//! base colour, Ns the roughness of a Blinn-Phong lobe of that exponent, Ke emitted radiance, d
//! alpha; Pr and Pm (the PBR extension) win where a file has them. Surfaces are double-sided,
//! because OBJ says nothing about sides.

mod faces;
mod lines;
mod materials;
mod mtl;
mod polygon;

use std::collections::HashMap;
use std::path::Path;

use super::files::{self, Folder, LoadOptions};
use super::{SceneError, defaults, error, geometry, validate};
use bouncelight::scene::{Instance, Material, Scene};
use faces::Faces;
use lines::Statement;
use materials::Textures;

/// Warnings about single statements of a library; how many more there are is told in one.
const MOST_TOLD: usize = 20;

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
    let folder = &Folder::of(path, options);
    let mut reading = Reading {
        folder,
        faces: Faces::new(),
        names: Vec::new(),
        numbers: HashMap::new(),
        libraries: Vec::new(),
        warnings: Vec::new(),
        origin: None,
        lines: 0,
        curves: 0,
    };
    lines::statements(&text, |s| {
        reading.statement(&s).map_err(|problem| SceneError::broken(path, format!("line {}", s.line), problem))
    })?;
    drop(text);
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut scene = Scene { name, ..Scene::default() };
    reading.into_scene(&mut scene, path, options.units.matrix().to_cols_array_2d());
    validate::validate(&mut scene, path)?;
    defaults::complete(&mut scene);
    Ok(scene)
}

/// What has been read of a file.
struct Reading<'a> {
    folder: &'a Folder,
    faces: Faces,
    /// Names that `usemtl` gives, and what they may be instead.
    names: Vec<(String, Option<String>)>,
    numbers: HashMap<String, usize>,
    libraries: Vec<mtl::Entry>,
    warnings: Vec<String>,
    /// Where the scene has its origin: at the first vertex, where that is far from the file's.
    origin: Option<[f64; 3]>,
    lines: usize,
    curves: usize,
}

impl Reading<'_> {
    fn statement(&mut self, s: &Statement<'_>) -> Result<(), String> {
        match s.key {
            "v" => {
                let (n, count) = numbers::<f64, 8>(s.plain(), 3)?;
                let origin = self.origin.get_or_insert_with(|| origin([n[0], n[1], n[2]]));
                let color = [n[3], n[4], n[5]].map(|v| v as f32);
                let color = (count >= 6).then_some(color).filter(|c| c.iter().all(|v| v.is_finite()));
                self.faces.place([0, 1, 2].map(|c| (n[c] - origin[c]) as f32), color);
            }
            "vt" => {
                let (n, count) = numbers::<f32, 2>(s.plain(), 1)?;
                let v = if count > 1 && n[1].is_finite() { n[1] } else { 0.0 };
                self.faces.uv([n[0], v]);
            }
            "vn" => self.faces.normal(numbers::<f32, 3>(s.plain(), 3)?.0),
            "f" => self.faces.face(s.plain())?,
            "l" | "p" => self.lines += 1,
            "curv" | "curv2" | "surf" => self.curves += 1,
            "g" | "o" => self.faces.group(s.rest),
            _ => self.word(s)?,
        }
        Ok(())
    }

    /// Statements that files write in any case.
    fn word(&mut self, s: &Statement<'_>) -> Result<(), String> {
        let key = s.key.to_ascii_lowercase();
        match key.as_str() {
            "usemtl" | "mtllib" if s.rest.is_empty() => Err(format!("`{key}` names nothing")),
            "usemtl" => {
                let (name, alias) = s.names();
                let next = self.names.len();
                let number = *self.numbers.entry(name.to_owned()).or_insert(next);
                if number == next {
                    self.names.push((name.to_owned(), alias.map(str::to_owned)));
                }
                self.faces.material(number);
                Ok(())
            }
            "mtllib" => {
                self.libraries(s);
                Ok(())
            }
            "v" | "vt" | "vn" | "f" | "l" | "p" | "g" | "o" if key != s.key => {
                self.statement(&Statement { key: &key, ..*s })
            }
            _ => Ok(()),
        }
    }

    /// The libraries that a statement names: one whose name may hold spaces, or several.
    fn libraries(&mut self, s: &Statement<'_>) {
        let (whole, alias) = s.names();
        let problem = match self.library(whole) {
            Ok(()) => return,
            Err(problem) => problem,
        };
        let names = alias.unwrap_or(whole);
        if alias.is_some() && self.library(names).is_ok() {
            return;
        }
        let several = split_names(names);
        if several.len() < 2 {
            self.warnings.push(format!("material library '{names}': {problem}"));
            return;
        }
        for name in several {
            if let Err(problem) = self.library(name) {
                self.warnings.push(format!("material library '{name}': {problem}"));
            }
        }
    }

    fn library(&mut self, name: &str) -> Result<(), String> {
        let name = name.trim_matches('"');
        let bytes = self.folder.read(name).or_else(|problem| {
            // As Windows writes it.
            if name.contains('\\') { self.folder.read(&name.replace('\\', "/")) } else { Err(problem) }
        })?;
        let text = String::from_utf8_lossy(files::without_mark(&bytes));
        let mut told = 0;
        let entries = mtl::parse(&text, |line, problem| {
            told += 1;
            if told <= MOST_TOLD {
                self.warnings.push(format!("material library '{name}', line {line}: {problem}"));
            }
        });
        if told > MOST_TOLD {
            self.warnings.push(format!("material library '{name}': {} more such lines", told - MOST_TOLD));
        }
        self.libraries.extend(entries);
        Ok(())
    }

    fn into_scene(mut self, scene: &mut Scene, path: &Path, placed: [[f32; 4]; 4]) {
        self.faces.end();
        let mut warnings = std::mem::take(&mut self.warnings);
        if self.origin.is_some_and(|origin| origin != [0.0; 3])
            && self.faces.reach_back(self.origin.unwrap_or_default())
        {
            self.origin = None;
        }
        if let Some([x, y, z]) = self.origin.filter(|o| *o != [0.0; 3]) {
            warnings.push(format!(
                "everything is far from the file's origin, where numbers are coarse; places count from ({x}, {y}, {z}) \
                 fallback"
            ));
        }
        let told = [
            (self.lines, "lines and points are left out; only surfaces are drawn"),
            (self.curves, "free-form curves and surfaces are left out; only polygons are drawn"),
            (self.faces.thin, "faces with less than three corners are left out"),
            (self.faces.cutter.rough, "faces with very many corners are cut as if they were convex"),
        ];
        warnings.extend(told.iter().filter(|t| t.0 > 0).map(|(count, what)| format!("{count} {what}")));
        scene.warnings.extend(warnings.into_iter().map(|what| format!("{}: {what}", path.display())));

        let mut textures = Textures::new(self.folder, path);
        let mut known = HashMap::new();
        for (i, entry) in self.libraries.iter().enumerate() {
            if let Some(alias) = &entry.alias {
                known.entry(alias.as_str()).or_insert(i);
            }
        }
        for (i, entry) in self.libraries.iter().enumerate() {
            let built = textures.material(scene, entry);
            scene.materials.push(built);
            known.insert(entry.name.as_str(), i);
        }
        let of_name = |(name, alias): &(String, Option<String>)| {
            known.get(name.as_str()).or_else(|| known.get(alias.as_deref()?)).copied()
        };
        let of_names: Vec<Option<usize>> = self.names.iter().map(of_name).collect();
        let mut plain = None;
        for faces::Made { mut mesh, material } in std::mem::take(&mut self.faces.made) {
            let material = material.and_then(|number| of_names[number]).unwrap_or_else(|| {
                *plain.get_or_insert_with(|| {
                    scene.materials.push(Material {
                        name: "OBJ default".to_owned(),
                        base_color: [0.8, 0.8, 0.8, 1.0],
                        metallic: 0.0,
                        double_sided: true,
                        ..Material::default()
                    });
                    let what = format!("'{}' and maybe others have no known material and are grey", mesh.name);
                    scene.warnings.push(format!("{}: {what}", path.display()));
                    scene.materials.len() - 1
                })
            });
            mesh.material = material;
            if let Some(map) = scene.materials[material].normal_texture {
                geometry::make_tangents(&mut mesh, 0, map.transform);
            }
            scene.instances.push(Instance { name: mesh.name.clone(), mesh: scene.meshes.len(), transform: placed });
            scene.meshes.push(mesh);
        }
    }
}

/// Where a file whose first vertex is `first` has its origin: its own, or whole units beside that
/// vertex where it is so far away that 32-bit floats are coarse there, as in coordinates of maps.
fn origin(first: [f64; 3]) -> [f64; 3] {
    first.map(|v| if v.abs() > 1e5 { v.round() } else { 0.0 })
}

/// A number as files write it; NaN for what is none, or none of 32 bits.
trait Word: Copy {
    fn read(word: &str) -> Self;
    fn is_sound(self) -> bool;
}

impl Word for f32 {
    fn read(word: &str) -> Self {
        word.parse().unwrap_or(f32::NAN)
    }
    fn is_sound(self) -> bool {
        self.is_finite()
    }
}

impl Word for f64 {
    fn read(word: &str) -> Self {
        word.parse().unwrap_or(f64::NAN)
    }
    fn is_sound(self) -> bool {
        (self as f32).is_finite()
    }
}

/// Up to N numbers, NaN for those that are none behind the `needed`, and how many words there are of
/// those N.
fn numbers<T: Word, const N: usize>(words: &str, needed: usize) -> Result<([T; N], usize), String> {
    let mut out = [T::read(""); N];
    let mut count = 0;
    for (out, word) in out.iter_mut().zip(words.split_ascii_whitespace()) {
        *out = T::read(word);
        if count < needed && !out.is_sound() {
            return Err(format!("'{word}' is not a finite number"));
        }
        count += 1;
    }
    if count < needed { Err(format!("{count} numbers where {needed} are needed")) } else { Ok((out, count)) }
}

/// Several names of libraries in one statement. One ends where a word ends in `.mtl`, so that it may
/// hold spaces; where none does, each word is one.
fn split_names(names: &str) -> Vec<&str> {
    let is_end = |at: usize| names.as_bytes().get(at).is_none_or(u8::is_ascii_whitespace);
    let lower = names.to_ascii_lowercase();
    let ends: Vec<usize> = lower.match_indices(".mtl").map(|(at, m)| at + m.len()).filter(|at| is_end(*at)).collect();
    if ends.is_empty() {
        return names.split_ascii_whitespace().collect();
    }
    let starts = std::iter::once(0).chain(ends.iter().copied());
    starts.zip(&ends).map(|(from, to)| names[from..*to].trim_ascii()).collect()
}
