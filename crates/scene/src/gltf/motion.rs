//! Animations, and variants of materials. Neither is worth refusing a file: what is broken
//! is left out with a warning.

use super::Loader;
use super::accessor::{Integers, Reader};
use crate::geometry;
use bouncelight::scene::Scene;
use bouncelight::scene::rig::{Animation, Channel, Interpolation, Property, Rig, RigDeform, RigNode, Skin};
use glam::Mat4;
use gltf::json::animation as json;
use gltf::json::validation::Checked;
use std::collections::HashMap;

/// Node of each instance, camera and light of the scene.
#[derive(Default)]
pub(super) struct Carried {
    instances: Vec<usize>,
    cameras: Vec<usize>,
    lights: Vec<usize>,
}

impl Carried {
    /// What has come to `scene` since is node `node`'s.
    pub(super) fn follow(&mut self, scene: &Scene, node: usize) {
        self.instances.resize(scene.instances.len(), node);
        self.cameras.resize(scene.cameras.len(), node);
        self.lights.resize(scene.lights.len(), node);
    }
}

impl<'a> Loader<'a> {
    /// Reads all animations of nodes; `nodes` are those of the scene, parents first: glTF node,
    /// position of its parent. `places`: where in that list each glTF node is.
    pub(super) fn animations(
        &mut self,
        nodes: &[(gltf::Node<'a>, Option<usize>)],
        places: &HashMap<usize, (usize, Mat4)>,
        Carried { instances, cameras, lights }: Carried,
        (skins, deforms): (Vec<Skin>, Vec<RigDeform>),
    ) {
        let document = self.document;
        let mut animations = Vec::new();
        for (i, animation) in document.as_json().animations.iter().enumerate() {
            let mut channels = Vec::new();
            for (c, channel) in animation.channels.iter().enumerate() {
                match self.channel(animation, channel, places) {
                    Ok(read) => channels.extend(read),
                    Err(problem) => {
                        self.warn(&format!("animations[{i}].channels[{c}]"), &format!("{problem} and is left out"))
                    }
                }
            }
            let end = channels.iter().filter_map(|c| c.times.last().copied()).fold(0.0, f32::max);
            let name = animation.name.clone().unwrap_or_else(|| format!("animations[{i}]"));
            if !channels.is_empty() {
                animations.push(Animation { name, end, channels });
            }
        }
        if animations.is_empty() {
            return;
        }
        let rest = |(node, parent): &(gltf::Node, Option<usize>)| {
            let (translation, rotation, scale) = node.transform().decomposed();
            RigNode { parent: *parent, translation, rotation, scale }
        };
        let mut nodes = nodes.iter().map(rest).collect();
        let instances = self.with_copies(&mut nodes, instances);
        let cameras = self.with_eyes(&mut nodes, cameras);
        self.scene.rig = Some(Rig { nodes, instances, cameras, lights, deforms, skins, animations, ..Rig::default() });
    }

    /// A channel; nothing for a node of another scene.
    fn channel(
        &self,
        animation: &json::Animation,
        channel: &json::Channel,
        places: &HashMap<usize, (usize, Mat4)>,
    ) -> Result<Option<Channel>, String> {
        let property = match channel.target.path {
            Checked::Valid(json::Property::Translation) => Property::Translation,
            Checked::Valid(json::Property::Rotation) => Property::Rotation,
            Checked::Valid(json::Property::Scale) => Property::Scale,
            Checked::Valid(json::Property::MorphTargetWeights) => Property::Weights,
            Checked::Invalid => return Err("moves nothing that is known".into()),
        };
        let target = channel.target.node.value();
        let Some(&(node, _)) = places.get(&target) else { return Ok(None) };
        let sampler = animation.samplers.get(channel.sampler.value()).ok_or("has no sampler")?;
        let interpolation = match sampler.interpolation {
            Checked::Valid(json::Interpolation::Step) => Interpolation::Step,
            Checked::Valid(json::Interpolation::Linear) => Interpolation::Linear,
            Checked::Valid(json::Interpolation::CubicSpline) => Interpolation::Cubic,
            Checked::Invalid => return Err("has an unknown interpolation".into()),
        };
        let accessor = |i: usize| self.document.accessors().nth(i).ok_or("refers to an accessor that is not there");
        let (input, output) = (accessor(sampler.input.value())?, accessor(sampler.output.value())?);
        let read = Reader { path: self.path, source: self.source };
        let told = |e: crate::SceneError| e.to_string();
        let times: Vec<f32> =
            read.floats::<1>(&input, Integers::AsFlagged, None).map_err(told)?.into_iter().map(|[t]| t).collect();
        let flag = Integers::AsFlagged;
        let (width, values) = match property {
            Property::Rotation => (4, read.floats::<4>(&output, flag, None).map(|v| v.as_flattened().to_vec())),
            Property::Weights => (self.targets_of(target), read.floats::<1>(&output, flag, None).map(|v| v.concat())),
            _ => (3, read.floats::<3>(&output, flag, None).map(|v| v.as_flattened().to_vec())),
        };
        let values = values.map_err(told)?;
        if width == 0 {
            return Err("moves the weights of a node without morph targets".into());
        }
        // Two keys at one time are a jump.
        let rising = times.windows(2).all(|w| w[0] <= w[1]);
        let finite = times.iter().chain(&values).all(|v| v.is_finite());
        if times.is_empty() || values.len() != width * interpolation.parts() * times.len() || !rising || !finite {
            return Err("has keys that do not increase, are not numbers or do not match their values".into());
        }
        Ok(Some(Channel { node, property, interpolation, times, values }))
    }

    /// Morph targets of the mesh of a glTF node.
    fn targets_of(&self, node: usize) -> usize {
        let json = self.document.as_json();
        let mesh = json.nodes.get(node).and_then(|n| json.meshes.get(n.mesh?.value()));
        mesh.and_then(|m| m.primitives.first()?.targets.as_ref()).map_or(0, Vec::len)
    }

    /// Names of the variants, and the materials that the primitives have in them
    /// (KHR_materials_variants).
    pub(super) fn variants(&mut self, json: &[u8]) {
        let Ok(file) = serde_json::from_slice::<File>(json) else { return };
        let Some(names) = file.extensions.and_then(|e| e.variants) else { return };
        self.scene.variants = names.variants.into_iter().map(|v| v.name).collect();
        let count = self.scene.variants.len();
        let read: Vec<(usize, Vec<usize>)> = self.meshes.iter().map(|(mesh, made)| (*mesh, made.clone())).collect();
        for (mesh, made) in read {
            // Primitives that were left out make the numbers disagree; then the file's materials
            // stay.
            let primitives = file.meshes.get(mesh).map(|m| m.primitives.as_slice()).unwrap_or_default();
            if primitives.len() != made.len() {
                if primitives.iter().any(|p| p.extensions.is_some()) {
                    self.warn(&format!("meshes[{mesh}]"), "has primitives that are left out, so its variants are, too");
                }
                continue;
            }
            for (primitive, out) in primitives.iter().zip(made) {
                let Some(Mappings { mappings }) = primitive.extensions.as_ref().and_then(|e| e.variants.as_ref())
                else {
                    continue;
                };
                let mut materials = vec![self.scene.meshes[out].material; count];
                for mapping in mappings {
                    let Some(material) = self.document.materials().nth(mapping.material) else { continue };
                    let material = self.material(&material);
                    for &variant in mapping.variants.iter().filter(|v| **v < count) {
                        materials[variant] = material;
                    }
                }
                let maps = materials.iter().filter_map(|&m| self.scene.materials[m].normal_texture);
                let map = maps.into_iter().next();
                let before = self.scene.meshes[out].indices.clone();
                let map = map.filter(|_| self.scene.meshes[out].tangents.is_empty());
                for at in [vec![out], self.copies_of(out)].concat() {
                    let mesh = &mut self.scene.meshes[at];
                    if let Some(map) = map {
                        geometry::make_tangents(mesh, map.uv_set, map.transform);
                    }
                    mesh.variants.clone_from(&materials);
                }
                if !self.scene.meshes[out].tangents.is_empty() && map.is_some() {
                    self.repeated(out, &before);
                }
            }
        }
    }
}

/// What of the file is about variants.
#[derive(serde::Deserialize)]
struct File {
    extensions: Option<Extensions<Names>>,
    #[serde(default)]
    meshes: Vec<MeshJson>,
}

#[derive(serde::Deserialize)]
struct Extensions<T> {
    #[serde(rename = "KHR_materials_variants")]
    variants: Option<T>,
}

#[derive(serde::Deserialize)]
struct Names {
    variants: Vec<Name>,
}

#[derive(serde::Deserialize)]
struct Name {
    name: String,
}

#[derive(serde::Deserialize)]
struct MeshJson {
    primitives: Vec<PrimitiveJson>,
}

#[derive(serde::Deserialize)]
struct PrimitiveJson {
    extensions: Option<Extensions<Mappings>>,
}

#[derive(serde::Deserialize)]
struct Mappings {
    mappings: Vec<Mapping>,
}

#[derive(serde::Deserialize)]
struct Mapping {
    material: usize,
    variants: Vec<usize>,
}
