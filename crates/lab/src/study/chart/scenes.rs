//! Scenes by name, by file, or by folders of references that another program rendered.

use super::ChartError;
use crate::reference::{Layer, Noise};
use crate::study::{
    session::{Session, Settling},
    truth::Reference,
};
use bouncelight::gi::Method;
use bouncelight::render::capture;
use bouncelight::scene::{Environment, LightKind, Scene};
use bouncelight_scene::LoadOptions;
use bouncelight_scene::image_io::{self, Decoded};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Scenes that are charted unless others are named: two that ship, and three rooms that nothing is
/// judged by elsewhere.
pub const DEFAULT: [&str; 5] = ["interior", "cornell", "paper-room:2", "paper-room:3", "paper-room:5"];

/// A scene, and what it is judged by.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Name in the chart.
    pub name: String,
    /// What [`bouncelight_scene::load`] takes.
    spec: String,
    /// Radiance from everywhere, W/(m²·sr), where the file cannot say it.
    environment: Option<f32>,
    /// Radius of point and spot lights, metres.
    light_radius: Option<f32>,
    /// An EXR with Blender's passes; without one our own path tracer is asked.
    pub reference: Option<PathBuf>,
    /// Its samples a pixel, where the folder says them.
    pub samples: Option<u32>,
}

/// What a folder says of a scene beside its files.
#[derive(Deserialize)]
struct Meta {
    world: f32,
    #[serde(default)]
    light: String,
    /// x, y, z, watts, radius.
    #[serde(default)]
    point: Vec<Vec<f32>>,
    /// Samples a pixel of the reference.
    spp: Option<u32>,
}

/// The scenes that `words` name; a folder may hold many.
///
/// # Errors
/// A folder without references; a `meta.json` that cannot be read.
pub fn sources(words: &[String]) -> Result<Vec<Source>, ChartError> {
    let mut found = Vec::new();
    for word in words {
        let path = Path::new(word);
        if !path.is_dir() {
            let name = if path.is_file() { stem(path) } else { word.clone() };
            let spec = word.clone();
            found.push(Source::plain(name, spec, None));
            continue;
        }
        let before = found.len();
        if path.join("scene.glb").is_file() {
            found.push(of_folder(path)?);
        } else {
            let listed = std::fs::read_dir(path).map_err(|e| file(path, &e))?;
            let mut inside: Vec<PathBuf> = listed.flatten().map(|entry| entry.path()).collect();
            inside.sort();
            for path in inside {
                if path.join("scene.glb").is_file() {
                    found.push(of_folder(&path)?);
                } else if let Some(room) = room_of(&path) {
                    found.push(Source::plain(stem(&path), format!("paper-room:{room}"), Some(path)));
                }
            }
        }
        if found.len() == before {
            return Err(ChartError::NoReferences { path: path.into() });
        }
    }
    Ok(found)
}

fn of_folder(path: &Path) -> Result<Source, ChartError> {
    let meta = path.join("meta.json");
    let text = std::fs::read_to_string(&meta).map_err(|e| file(&meta, &e))?;
    let facts: Meta = serde_json::from_str(&text).map_err(|e| file(&meta, &e))?;
    // Older files do not say the radius; it is half a metre there.
    let radius = facts.point.first().and_then(|p| p.get(4).copied()).unwrap_or(0.5);
    Ok(Source {
        name: stem(path),
        spec: path.join("scene.glb").to_string_lossy().into_owned(),
        environment: Some(facts.world),
        light_radius: (facts.light == "point").then_some(radius),
        reference: Some(path.join("frame0000.exr")),
        samples: facts.spp,
    })
}

/// The number in `roomIIII_view0.exr`.
fn room_of(path: &Path) -> Option<u32> {
    path.file_name()?.to_str()?.strip_prefix("room")?.strip_suffix("_view0.exr")?.parse().ok()
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| path.display().to_string(), |s| s.to_string_lossy().into_owned())
}

fn file(path: &Path, error: &dyn std::fmt::Display) -> ChartError {
    ChartError::File { path: path.into(), reason: error.to_string() }
}

impl Source {
    /// A scene that says all of itself.
    fn plain(name: String, spec: String, reference: Option<PathBuf>) -> Self {
        Self { name, spec, environment: None, light_radius: None, reference, samples: None }
    }

    /// Where its reference comes from, in words.
    pub fn origin(&self) -> String {
        let Some(path) = &self.reference else { return "our path tracer, no limit of bounces".into() };
        let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
        parts[parts.len().saturating_sub(2)..].join("/")
    }

    /// Reads the scene.
    ///
    /// # Errors
    /// [`ChartError::Scene`].
    pub fn load(&self, options: LoadOptions) -> Result<Scene, ChartError> {
        let mut scene = crate::scenes::load_with(&self.spec, options)?;
        if let Some(radiance) = self.environment {
            bouncelight_scene::defaults::surround(&mut scene, Environment::constant([radiance; 3]));
        }
        if let Some(metres) = self.light_radius {
            for light in &mut scene.lights {
                if let LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } = &mut light.kind {
                    *radius = metres;
                }
            }
        }
        Ok(scene)
    }

    /// Size of the picture that it is judged by, where it brings one.
    ///
    /// # Errors
    /// A file that is no EXR.
    pub fn reference_size(&self) -> Result<Option<[u32; 2]>, ChartError> {
        let Some(path) = &self.reference else { return Ok(None) };
        match image_io::read(path)? {
            Decoded::Linear(layers) => Ok(Some([layers.width, layers.height])),
            Decoded::Display(_) => Err(file(path, &"a reference is an EXR with layers, this is a PNG")),
        }
    }
}

/// The picture in `path` as a reference. What a method has to add is its diffuse light without what
/// our rasteriser finds directly, since Blender counts the sky as direct light. Which surfaces
/// there are, and what they reflect, is told by our own layers, not by the file's: half floats,
/// filtered over pixels, show black walls as dark grey ones, where light is nowhere to be seen. Its
/// noise is not known.
///
/// # Errors
/// A file that cannot be read or lacks a layer; drawing direct light.
pub fn reference(path: &Path, session: &mut Session<'_>, samples: u32) -> Result<Reference, ChartError> {
    let Decoded::Linear(layers) = image_io::read(path)? else {
        return Err(file(path, &"a reference is an EXR with layers, this is a PNG"));
    };
    let read = |name: &str| -> Result<Vec<f32>, ChartError> {
        layers.check_finite(name)?;
        Ok(layers.image(name)?.to_rgb())
    };
    let (diff_dir, diff_ind) = (read("DiffDir")?, read("DiffInd")?);
    let camera = session.scene().cameras[0].clone();
    let direct = session.picture(&Method::Direct, &camera, Settling { frames: 1, samples })?;
    let drawn = |layer| direct.layer(layer).data.clone();
    let ours = drawn(capture::Layer::DiffDir);
    let gi = diff_dir.iter().zip(&diff_ind).zip(&ours).map(|((d, i), o)| d + i - o).collect();
    let combined = read("Combined")?.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 1.0]).collect();
    let unknown = Noise { mean: f64::NAN, pixel: f64::NAN, pixel_at_most: f64::NAN, picture: f64::NAN };
    Ok(Reference {
        size: [layers.width, layers.height],
        layers: vec![
            (Layer::Combined, combined),
            (Layer::DiffDir, diff_dir),
            (Layer::DiffInd, diff_ind),
            (Layer::DiffCol, drawn(capture::Layer::DiffCol)),
            (Layer::Gi, gi),
            (Layer::Normal, drawn(capture::Layer::Normal)),
            (Layer::Depth, drawn(capture::Layer::Depth)),
        ],
        noise: [unknown; 3],
        samples: [0; 2],
        seconds: 0.0,
        kept: true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_both_kinds_are_read_and_empty_ones_refused() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let word = || vec![folder.path().to_string_lossy().into_owned()];
        assert!(matches!(sources(&word()), Err(ChartError::NoReferences { .. })));
        std::fs::write(at("room0002_view0.exr"), "").unwrap();
        std::fs::write(at("room0002_view1.exr"), "").unwrap();
        std::fs::create_dir(at("flat")).unwrap();
        std::fs::write(at("flat/scene.glb"), "").unwrap();
        let refused = sources(&word()).unwrap_err().to_string();
        assert!(refused.contains("meta.json"), "{refused}");
        let meta = r#"{"world": 0.5, "light": "point", "point": [[1, 2, 3, 60, 0.05]], "spp": 9}"#;
        std::fs::write(at("flat/meta.json"), meta).unwrap();
        let found = sources(&word()).unwrap();
        let names: Vec<_> = found.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["flat", "room0002_view0"]);
        assert_eq!((found[0].environment, found[0].light_radius, found[0].samples), (Some(0.5), Some(0.05), Some(9)));
        assert_eq!((found[0].origin().as_str(), found[1].samples), ("flat/frame0000.exr", None));
        assert_eq!(found[1].spec, "paper-room:2");
        let named = sources(&["cornell".into()]).unwrap();
        assert_eq!((named[0].name.as_str(), named[0].reference.is_none()), ("cornell", true));
    }
}
