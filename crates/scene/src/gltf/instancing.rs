//! EXT_mesh_gpu_instancing: a node's mesh many times.

use super::Loader;
use super::accessor::{Integers, Reader};
use crate::SceneError;
use glam::{Mat4, Quat, Vec4};

/// How one of a node's copies stands to the node.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Copy {
    pub translation: [f32; 3],
    pub rotation: [f32; 4],
    pub scale: [f32; 3],
}

impl Copy {
    /// The node's own place.
    pub(super) const SELF: Self = Self { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] };

    pub(super) fn matrix(&self) -> Mat4 {
        let rotation = Quat::from_array(self.rotation);
        Mat4::from_scale_rotation_translation(self.scale.into(), rotation, self.translation.into())
    }
}

impl<'a> Loader<'a> {
    /// Where copies of a node's mesh stand; one at the node itself without the extension.
    pub(super) fn copies(&mut self, node: &gltf::Node<'a>, place: &str) -> Result<Vec<Copy>, SceneError> {
        let extensions = self.document.as_json().nodes[node.index()].extensions.as_ref();
        let Some(extension) = extensions.and_then(|e| e.others.get("EXT_mesh_gpu_instancing")) else {
            return Ok(vec![Copy::SELF]);
        };
        let place = format!("{place}.extensions.EXT_mesh_gpu_instancing");
        let Some(attributes) = extension.get("attributes").and_then(serde_json::Value::as_object) else {
            return Err(self.broken(place, "has no attributes"));
        };
        let find = |name: &str| -> Result<Option<gltf::Accessor<'a>>, SceneError> {
            let Some(value) = attributes.get(name) else { return Ok(None) };
            let found = value.as_u64().and_then(|i| self.document.accessors().nth(usize::try_from(i).ok()?));
            found.map(Some).ok_or_else(|| self.broken(&*place, format!("{name} names no accessor of the file")))
        };
        let read = Reader { path: self.path, source: self.source };
        let vectors = |name: &str| -> Result<Option<Vec<[f32; 3]>>, SceneError> {
            find(name)?.map(|a| read.floats::<3>(&a, Integers::AsFlagged, None)).transpose()
        };
        let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
        let rotations = find("ROTATION")?.map(|a| read.floats::<4>(&a, Integers::Normalized, None)).transpose()?;
        let counts =
            [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
        let mut given = counts.into_iter().flatten();
        let Some(count) = given.next() else {
            // Only attributes of a program's own: they place nothing, and how many there are is
            // theirs to know.
            self.warn(&place, "has no TRANSLATION, ROTATION or SCALE; the mesh stands once");
            return Ok(vec![Copy::SELF]);
        };
        if given.any(|c| c != count) {
            return Err(self.broken(place, format!("has attributes of different lengths ({counts:?})")));
        }
        let (mut copies, mut lost) = (Vec::with_capacity(count), 0);
        for i in 0..count {
            let mut copy = Copy::SELF;
            if let Some(t) = &translations {
                copy.translation = t[i];
            }
            if let Some(r) = &rotations {
                // Rounded to bytes or words they are not of unit length.
                copy.rotation = Vec4::from(r[i]).try_normalize().unwrap_or(Vec4::W).into();
            }
            if let Some(s) = &scales {
                copy.scale = s[i];
            }
            if !copy.matrix().is_finite() {
                if self.strict {
                    return Err(self.broken(place, format!("copy {i} has a transform that is not finite")));
                }
                lost += 1;
                continue;
            }
            copies.push(copy);
        }
        if lost > 0 {
            self.warn(&place, &format!("{lost} copies have a transform that is not finite and are left out"));
        }
        Ok(copies)
    }

    /// Nodes of their own for copies that stand apart from their node, so that they move with it.
    pub(super) fn with_copies(
        &self,
        nodes: &mut Vec<bouncelight::scene::rig::RigNode>,
        mut instances: Vec<usize>,
    ) -> Vec<usize> {
        for (node, copy) in instances.iter_mut().zip(&self.placed).filter(|(_, copy)| **copy != Copy::SELF) {
            let Copy { translation, rotation, scale } = *copy;
            nodes.push(bouncelight::scene::rig::RigNode { parent: Some(*node), translation, rotation, scale });
            *node = nodes.len() - 1;
        }
        instances
    }
}
