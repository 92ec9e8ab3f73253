//! Animations of nodes and variants of materials. Neither is worth refusing a file: what is broken
//! is left out with a warning.

use super::Loader;
use super::accessor::{Integers, Reader};
use crate::scene::geometry;
use crate::scene::rig::{Animation, Channel, Interpolation, Property, Rig, RigNode};
use gltf::json::animation as json;
use gltf::json::validation::Checked;
use std::collections::HashMap;

impl<'a> Loader<'a> {
    /// Reads all animations of nodes; `nodes` are those of the scene, parents first: glTF node, position of its parent.
    pub(super) fn animations(&mut self, nodes: &[(gltf::Node<'a>, Option<usize>)], instances: Vec<usize>) {
        let document = self.document;
        let place: HashMap<usize, usize> = nodes.iter().enumerate().map(|(i, (node, _))| (node.index(), i)).collect();
        let mut animations = Vec::new();
        for (i, animation) in document.as_json().animations.iter().enumerate() {
            let mut channels = Vec::new();
            for (c, channel) in animation.channels.iter().enumerate() {
                match self.channel(animation, channel, &place) {
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
        let carries = |node: &gltf::Node| node.camera().is_some() || node.light().is_some();
        if nodes.iter().any(|(node, _)| carries(node)) {
            self.warn("animations", "move objects only; lights and cameras stand in their rest pose");
        }
        let rest = |(node, parent): &(gltf::Node, Option<usize>)| {
            let (translation, rotation, scale) = node.transform().decomposed();
            RigNode { parent: *parent, translation, rotation, scale }
        };
        let mut nodes = nodes.iter().map(rest).collect();
        let instances = self.with_copies(&mut nodes, instances);
        self.scene.rig = Some(Rig { nodes, instances, animations });
    }

    /// A channel; nothing for a node of another scene.
    fn channel(
        &self,
        animation: &json::Animation,
        channel: &json::Channel,
        place: &HashMap<usize, usize>,
    ) -> Result<Option<Channel>, String> {
        let property = match channel.target.path {
            Checked::Valid(json::Property::Translation) => Property::Translation,
            Checked::Valid(json::Property::Rotation) => Property::Rotation,
            Checked::Valid(json::Property::Scale) => Property::Scale,
            Checked::Valid(json::Property::MorphTargetWeights) => return Err("moves morph targets".into()),
            Checked::Invalid => return Err("moves nothing that is known".into()),
        };
        let Some(&node) = place.get(&channel.target.node.value()) else { return Ok(None) };
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
        let told = |e: crate::scene::SceneError| e.to_string();
        let times: Vec<f32> =
            read.floats::<1>(&input, Integers::AsFlagged, None).map_err(told)?.into_iter().map(|[t]| t).collect();
        let fill = (property != Property::Rotation).then_some(0.0);
        let values = read.floats::<4>(&output, Integers::AsFlagged, fill).map_err(told)?;
        let each = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let rising = times.windows(2).all(|w| w[0] < w[1]);
        let finite = times.iter().chain(values.iter().flatten()).all(|v| v.is_finite());
        if times.is_empty() || values.len() != each * times.len() || !rising || !finite {
            return Err("has keys that do not rise, are no numbers or do not match their values".into());
        }
        Ok(Some(Channel { node, property, interpolation, times, values }))
    }

    /// Names of the variants, and the materials that the primitives have in them (KHR_materials_variants).
    pub(super) fn variants(&mut self, json: &[u8]) {
        let Ok(file) = serde_json::from_slice::<File>(json) else { return };
        let Some(names) = file.extensions.and_then(|e| e.variants) else { return };
        self.scene.variants = names.variants.into_iter().map(|v| v.name).collect();
        let count = self.scene.variants.len();
        let read: Vec<(usize, Vec<usize>)> = self.meshes.iter().map(|(mesh, made)| (*mesh, made.clone())).collect();
        for (mesh, made) in read {
            // Primitives that were left out make the numbers disagree; then the file's materials stay.
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
                let mesh = &mut self.scene.meshes[out];
                if let Some(map) = map.filter(|_| mesh.tangents.is_empty()) {
                    geometry::make_tangents(mesh, map.uv_set, map.transform);
                }
                mesh.variants = materials;
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
