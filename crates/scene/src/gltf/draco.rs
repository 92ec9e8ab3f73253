//! KHR_draco_mesh_compression: indices and attributes of a primitive, compressed together in one
//! buffer view.
//!
//! The `draco-core` crate reads the stream; this file says which of its numbers are which of the
//! primitive's.

use std::collections::HashMap;

use draco_core::{DataType, DecoderBuffer, Mesh, MeshDecoder};
use gltf::Semantic;
use serde::Deserialize;

use super::accessor::Integers;

/// The extension's name.
pub(super) const NAME: &str = "KHR_draco_mesh_compression";

/// What the extension says of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Packed {
    /// Index of the buffer view with the stream.
    pub buffer_view: usize,
    /// Names of attributes → their numbers in the stream.
    attributes: HashMap<String, u32>,
}

/// An unpacked primitive.
pub(super) struct Unpacked {
    mesh: Mesh,
    attributes: HashMap<String, u32>,
}

impl Packed {
    /// The extension of a primitive, if it has one.
    ///
    /// # Errors
    /// A sentence when the extension's JSON is not what it must be.
    pub(super) fn of(primitive: &gltf::json::mesh::Primitive) -> Result<Option<Self>, String> {
        let Some(value) = primitive.extensions.as_ref().and_then(|e| e.others.get(NAME)) else { return Ok(None) };
        Self::deserialize(value).map(Some).map_err(|e| format!("its Draco compression: {e}"))
    }

    /// Reads the stream. Memory grows with what is read of it.
    ///
    /// # Errors
    /// A sentence about what is wrong in the stream.
    pub(super) fn unpack(self, data: &[u8]) -> Result<Unpacked, String> {
        let mut mesh = Mesh::new();
        let read = MeshDecoder::new().decode(&mut DecoderBuffer::new(data), &mut mesh);
        read.map_err(|e| format!("its Draco stream cannot be read: {e}"))?;
        Ok(Unpacked { mesh, attributes: self.attributes })
    }
}

impl Unpacked {
    /// Vertex indices of its triangles.
    pub(super) fn indices(&self) -> Vec<u32> {
        self.mesh.faces().iter().flatten().map(|point| point.0).collect()
    }

    /// Vectors of N floats; `None` where the stream does not have the attribute. Integers are as
    /// `integers` and the accessor's flag `normalized` say; a `fill` lets shorter vectors through.
    ///
    /// # Errors
    /// A sentence when the stream's attribute is not what its name promises.
    pub(super) fn floats<const N: usize>(
        &self,
        semantic: &Semantic,
        normalized: bool,
        integers: Integers,
        fill: Option<f32>,
    ) -> Result<Option<Vec<[f32; N]>>, String> {
        let name = semantic.to_string();
        let Some(&id) = self.attributes.get(&name) else { return Ok(None) };
        let missing = || format!("its Draco stream has no attribute {id}, which should be {name}");
        let attribute = self.mesh.attribute_by_unique_id(id).ok_or_else(missing)?;
        let given = usize::from(attribute.num_components());
        if given != N && !(fill.is_some() && given + 1 == N) {
            return Err(format!("{name} has {given} components in its Draco stream where {N} are needed"));
        }
        let scale = match attribute.data_type() {
            _ if !(normalized || integers == Integers::Normalized) => 1.0,
            DataType::Uint8 => 255.0,
            DataType::Int8 => 127.0,
            DataType::Uint16 => 65_535.0,
            DataType::Int16 => 32_767.0,
            DataType::Uint32 => u32::MAX as f32,
            _ => 1.0,
        };
        let values = attribute.read_f32s(self.mesh.num_points(), given);
        let vector = |v: &[f32]| std::array::from_fn(|c| v.get(c).map_or(fill.unwrap_or(0.0), |v| v / scale));
        let clamped = |v: [f32; N]| if scale == 1.0 { v } else { v.map(|c| c.max(-1.0)) };
        Ok(Some(values.chunks_exact(given).map(vector).map(clamped).collect()))
    }
}
