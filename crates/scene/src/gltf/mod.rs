//! glTF 2.0: `.gltf` with external or embedded buffers, and `.glb`.
//!
//! The `gltf` crate parses the JSON and types it; container, buffers and accessors are read here,
//! because the crate's readers panic or give up wholesale on the broken files that people have.
//! What cannot be used for a reason that leaves a picture (a missing texture, a line primitive, a
//! broken skin) becomes a warning; the rest is a [`SceneError`].

mod accessor;
mod area;
mod camera;
mod deform;
mod draco;
mod extensions;
mod far;
mod instancing;
mod layers;
mod light;
mod loosen;
mod material;
mod mesh;
mod meshopt;
mod motion;
mod pointer;
mod repair;
mod source;
mod specular;
mod texture;
mod units;
mod words;

use std::collections::HashMap;
use std::path::Path;

use glam::{DMat4, DVec3, Mat4};
use gltf::json::validation::{Error as Invalid, Validate};

use super::files::{self, LoadOptions};
use super::{SceneError, defaults, dome, error, validate};
use bouncelight::scene::{Environment, Instance, Scene};
use source::Source;

/// Loads the file's default scene (else its first, else every root node) and fills in what is
/// missing, as [`super::defaults`] says. What was mended or left out stands in [`Scene::warnings`].
///
/// # Errors
/// [`SceneError`] naming the file and the place in it, never a panic.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    load_with(path, LoadOptions::default())
}

/// As [`load`], with limits of one's own.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, options: LoadOptions) -> Result<Scene, SceneError> {
    let bytes = error::read_file(path)?;
    let (json, blob) = source::split(path, &bytes)?;
    // Some writers fill a chunk up with zeros.
    let json = files::without_mark(json);
    let json = &json[..json.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1)];
    let pointed = pointer::rewrite(json);
    let json = pointed.as_ref().map_or(json, |p| &p.0);
    let read = if options.strict {
        gltf::json::deserialize::from_slice(json).map(|root| (root, None))
    } else {
        loosen::read(json)
    };
    let (mut root, loosened) = read.map_err(|e| SceneError::broken(path, "JSON", e.to_string()))?;
    let json = loosened.as_ref().map_or(json, |l| &l.0);
    extensions::check_required(path, &root)?;
    let mut repaired = repair::repair(&mut root);
    if !options.strict {
        repaired.extend(words::repair(&mut root));
    }
    repaired.extend(loosened.iter().flat_map(|l| l.1.iter().cloned()));
    units::apply(&mut root, options.units);
    validate(path, &root)?;
    let document = gltf::Document::from_json_without_validation(root);
    let source = Source::open(path, &document, blob, options)?;
    let mut loader = Loader::new(path, &source, &document, options.strict);
    repaired.iter().chain(pointed.iter().flat_map(|p| &p.1)).for_each(|(place, what)| loader.warn(place, what));
    for extension in document.extensions_used().filter(|e| !extensions::is_known(e)) {
        loader.warn("extensionsUsed", &format!("{extension} is not supported; the file is shown without it"));
    }
    loader.walk()?;
    loader.variants(json);
    loader.settle_deforms();
    let mut scene = loader.scene;
    validate::validate(&mut scene, path)?;
    let sky = dome::take(&mut scene);
    defaults::complete(&mut scene);
    // It stands in for what was added, and leaves a sun that was.
    scene.environment = sky.unwrap_or(scene.environment);
    Ok(scene)
}

/// Runs the crate's own validation, which later code relies on not to panic, but forgives what this
/// loader can handle.
fn validate(path: &Path, root: &gltf::json::Root) -> Result<(), SceneError> {
    // The crate's validation looks at the accessor of POSITION before it asks whether there is one.
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(bad) = primitive.attributes.values().find(|a| a.value() >= root.accessors.len()) {
                let place = format!("meshes[{m}].primitives[{p}].attributes");
                let problem = format!("accessor {} does not exist; the file has {}", bad.value(), root.accessors.len());
                return Err(SceneError::broken(path, place, problem));
            }
        }
    }
    let mut first = None;
    root.validate(root, gltf::json::Path::new, &mut |place, error| {
        let place = place().to_string();
        let position = place.contains(".attributes[\"POSITION\"]");
        let forgiven = match error {
            // Bounds are computed from the vertices, and a primitive without any is a warning.
            Invalid::Missing | Invalid::Invalid if position => true,
            // The crate knows fewer extensions than this loader; its list was checked before.
            Invalid::Unsupported => place.starts_with("extensionsRequired"),
            // Zeros, says the specification, and what Draco packs has none.
            Invalid::Missing if place.starts_with("accessors[") && place.ends_with("].bufferView") => true,
            // A texture without image is legal (an extension may have one) and gets a stand-in.
            Invalid::Missing => place.starts_with("textures[") && place.ends_with("source"),
            // A dangling image index as well; textures are not worth refusing a file.
            Invalid::IndexOutOfBounds => {
                (place.starts_with("textures[") && place.ends_with("source"))
                    || place.starts_with("animations[")
                    || place.starts_with("skins[")
            }
            _ => place.starts_with("animations["),
        };
        if !forgiven && first.is_none() {
            let problem = match error {
                Invalid::IndexOutOfBounds => "refers to something that the file does not have",
                Invalid::Invalid => "has an invalid value",
                Invalid::Missing => "is missing",
                Invalid::Oversize => "is larger than this machine can address",
                Invalid::Unsupported => "is not supported",
            };
            first = Some(SceneError::broken(path, place, problem));
        }
    });
    first.map_or(Ok(()), Err)
}

/// State of one load.
pub(super) struct Loader<'a> {
    path: &'a Path,
    source: &'a Source<'a>,
    document: &'a gltf::Document,
    scene: Scene,
    /// Numbers that are none refuse the file.
    strict: bool,
    /// Sets of texture coordinates that the material which is read keeps.
    kept_sets: [u32; 2],
    /// Those sets of each glTF material.
    sets: HashMap<Option<usize>, [u32; 2]>,
    /// glTF mesh index → scene meshes of its primitives.
    meshes: HashMap<usize, Vec<usize>>,
    /// glTF material index (`None` is the default material) → scene material.
    materials: HashMap<Option<usize>, usize>,
    /// glTF image index and use → scene image.
    images: HashMap<(usize, super::texture::Use), usize>,
    /// Specular-glossiness textures with their factors → scene images of base colour and surface,
    /// mean of the texture.
    converted: HashMap<String, (usize, usize, [f32; 4])>,
    /// How each instance stands to its node.
    placed: Vec<instancing::Copy>,
    /// Skins and morph targets.
    deforming: deform::Deforming,
    /// Cameras that are drawn by a long lens.
    orthographic: Vec<camera::Orthographic>,
}

impl<'a> Loader<'a> {
    fn new(path: &'a Path, source: &'a Source<'a>, document: &'a gltf::Document, strict: bool) -> Self {
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let scene = Scene { name, ..Scene::default() };
        Self {
            path,
            source,
            document,
            scene,
            strict,
            kept_sets: [0, 1],
            sets: HashMap::new(),
            meshes: HashMap::new(),
            materials: HashMap::new(),
            images: HashMap::new(),
            converted: HashMap::new(),
            placed: Vec::new(),
            deforming: deform::Deforming::default(),
            orthographic: Vec::new(),
        }
    }

    fn broken(&self, place: impl Into<String>, problem: impl Into<String>) -> SceneError {
        SceneError::broken(self.path, place, problem)
    }

    /// Adds a warning "file: place: what", once.
    fn warn(&mut self, place: &str, what: &str) {
        let sentence = format!("{}: {place}: {what}", self.path.display());
        if !self.scene.warnings.contains(&sentence) {
            tracing::debug!("{sentence}");
            self.scene.warnings.push(sentence);
        }
    }

    /// Visits every node of the scene once, without recursion.
    fn walk(&mut self) -> Result<(), SceneError> {
        let document = self.document;
        let chosen = document.default_scene().or_else(|| document.scenes().next());
        let roots: Vec<gltf::Node> = match chosen {
            Some(scene) => {
                self.environment(&scene);
                scene.nodes().collect()
            }
            None => {
                let mut is_child = vec![false; document.nodes().len()];
                document.nodes().flat_map(|n| n.children()).for_each(|c| is_child[c.index()] = true);
                document.nodes().filter(|n| !is_child[n.index()]).collect()
            }
        };
        let mut seen = vec![false; document.nodes().len()];
        let origin = far::origin(&roots, document.nodes().len());
        if origin != DVec3::ZERO {
            self.warn("scene", &far::told(origin));
        }
        let root = DMat4::from_translation(-origin);
        let mut stack: Vec<(gltf::Node, DMat4, Option<usize>, bool)> =
            roots.into_iter().rev().map(|n| (n, root, None, true)).collect();
        // For animations: nodes in the order of this walk, and which of them each instance, camera
        // and light belongs to.
        let (mut walked, mut carried, mut places) = (Vec::new(), motion::Carried::default(), HashMap::new());
        while let Some((node, parent, above, visible)) = stack.pop() {
            if std::mem::replace(&mut seen[node.index()], true) {
                let place = format!("nodes[{}]", node.index());
                return Err(self.broken(place, "is reached twice; nodes must form trees, not cycles"));
            }
            let exact = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
            let world = exact.as_mat4();
            if !world.is_finite() {
                let place = format!("nodes[{}]", node.index());
                if self.strict {
                    return Err(self.broken(place, "has a transform that is not finite"));
                }
                self.warn(&place, "has a transform that is not finite and is left out with all below it");
                continue;
            }
            let visible = visible && self.is_visible(&node);
            self.node(&node, world, visible)?;
            carried.follow(&self.scene, walked.len());
            places.insert(node.index(), (walked.len(), world));
            let children: Vec<_> = node.children().map(|child| (child, exact, Some(walked.len()), visible)).collect();
            walked.push((node, above));
            stack.extend(children.into_iter().rev());
        }
        let deforms = self.resolve(&places);
        self.move_back();
        self.animations(&walked, &places, carried, deforms);
        if let Some(rig) = &mut self.scene.rig {
            rig.origin = origin.to_array();
        }
        Ok(())
    }

    /// What KHR_node_visibility says of a node itself.
    fn is_visible(&self, node: &gltf::Node) -> bool {
        let extensions = self.document.as_json().nodes[node.index()].extensions.as_ref();
        let visibility = extensions.and_then(|e| e.others.get("KHR_node_visibility"));
        visibility.and_then(|v| v.get("visible")?.as_bool()).unwrap_or(true)
    }

    /// Meshes and lights are those that are `visible`; a camera sees from wherever it is.
    fn node(&mut self, node: &gltf::Node<'a>, world: Mat4, visible: bool) -> Result<(), SceneError> {
        let place = format!("nodes[{}]", node.index());
        let name = node.name().map_or_else(|| place.clone(), str::to_owned);
        if let Some(mesh) = node.mesh().filter(|_| visible) {
            let copies = self.copies(node, &place)?;
            for mesh in self.mesh(&mesh)? {
                let mesh = self.own(node, &format!("{place} '{name}'"), mesh);
                for copy in &copies {
                    let transform = (world * copy.matrix()).to_cols_array_2d();
                    self.scene.instances.push(Instance { name: name.clone(), mesh, transform });
                    self.placed.push(*copy);
                }
            }
        }
        if let Some(camera) = node.camera() {
            self.camera(&camera, &name, world);
        }
        if let Some(light) = node.light().filter(|_| visible) {
            self.light(&light, &name, world);
        }
        if visible {
            self.area_light(node, &name, &place, world);
        }
        Ok(())
    }

    /// Reads the sky that [`super::export`] writes into the scene's extras; other files have none.
    fn environment(&mut self, scene: &gltf::Scene) {
        #[derive(serde::Deserialize)]
        struct Ours {
            environment: [f32; 3],
        }
        #[derive(serde::Deserialize)]
        struct Extras {
            bouncelight: Ours,
        }
        let extras = scene.extras().as_ref().and_then(|raw| serde_json::from_str::<Extras>(raw.get()).ok());
        if let Some(radiance) = extras.map(|e| e.bouncelight.environment)
            && radiance.iter().all(|r| r.is_finite() && *r >= 0.0)
        {
            self.scene.environment = Environment::constant(radiance);
        }
    }
}
