//! Primitives to [`Mesh`]es.

use gltf::Semantic;
use gltf::mesh::Mode;

use super::accessor::{Integers, Reader};
use super::{Loader, draco};
use crate::SceneError;
use crate::geometry::{self, Topology};
use bouncelight::scene::Mesh;

/// Where a primitive's numbers are: in accessors, or in a compressed stream.
pub(super) struct Vertices<'a> {
    pub(super) reader: Reader<'a>,
    pub(super) primitive: &'a gltf::Primitive<'a>,
    packed: Option<draco::Unpacked>,
    place: &'a str,
}

impl Vertices<'_> {
    /// An attribute of all vertices; empty where the primitive has none.
    pub(super) fn floats<const N: usize>(
        &self,
        semantic: Semantic,
        integers: Integers,
        fill: Option<f32>,
    ) -> Result<Vec<[f32; N]>, SceneError> {
        let Some(accessor) = self.primitive.get(&semantic) else { return Ok(Vec::new()) };
        let unpacked = match &self.packed {
            Some(packed) => packed.floats(&semantic, accessor.normalized(), integers, fill),
            None => Ok(None),
        };
        match unpacked.map_err(|problem| SceneError::broken(self.reader.path, self.place, problem))? {
            Some(values) => Ok(values),
            None => self.reader.floats(&accessor, integers, fill),
        }
    }

    fn indices(&self, vertices: usize) -> Result<Vec<u32>, SceneError> {
        match (&self.packed, self.primitive.indices()) {
            (Some(packed), _) => Ok(packed.indices()),
            (None, Some(accessor)) => self.reader.indices(&accessor),
            (None, None) => Ok((0..vertices as u32).collect()),
        }
    }
}

impl<'a> Loader<'a> {
    /// Scene meshes of a glTF mesh's primitives; read once, shared by all nodes that place it.
    pub(super) fn mesh(&mut self, mesh: &gltf::Mesh<'a>) -> Result<Vec<usize>, SceneError> {
        if let Some(known) = self.meshes.get(&mesh.index()) {
            return Ok(known.clone());
        }
        let mut made = Vec::new();
        for primitive in mesh.primitives() {
            let at = self.scene.meshes.len();
            if self.primitive(mesh, &primitive)? {
                made.push(at);
            }
        }
        self.meshes.insert(mesh.index(), made.clone());
        Ok(made)
    }

    /// Adds one primitive; false with a warning where there is nothing to draw.
    fn primitive(&mut self, mesh: &gltf::Mesh<'a>, primitive: &gltf::Primitive<'a>) -> Result<bool, SceneError> {
        let name = mesh.name().map_or_else(|| format!("meshes[{}]", mesh.index()), str::to_owned);
        let place = format!("meshes[{}].primitives[{}] '{name}'", mesh.index(), primitive.index());
        let topology = match primitive.mode() {
            Mode::Triangles => Topology::List,
            Mode::TriangleStrip => Topology::Strip,
            Mode::TriangleFan => Topology::Fan,
            other => {
                self.warn(&place, &format!("{other:?} are left out; only triangles are drawn"));
                return Ok(false);
            }
        };
        if primitive.get(&Semantic::Positions).is_none() {
            self.warn(&place, "has no POSITION and is left out");
            return Ok(false);
        }
        let packed = self.packed(&place, mesh.index(), primitive.index())?;
        let read =
            Vertices { reader: Reader { path: self.path, source: self.source }, primitive, packed, place: &place };
        let flagged = Integers::AsFlagged;
        let sets = self.sets_of(&primitive.material());
        let mut out = Mesh {
            name,
            positions: read.floats(Semantic::Positions, flagged, None)?,
            normals: read.floats(Semantic::Normals, flagged, None)?,
            tangents: read.floats(Semantic::Tangents, flagged, None)?,
            uv0: read.floats(Semantic::TexCoords(sets[0]), flagged, None)?,
            uv1: read.floats(Semantic::TexCoords(sets[1]), flagged, None)?,
            colors: read.floats(Semantic::Colors(0), Integers::Normalized, Some(1.0))?,
            ..Mesh::default()
        };
        let count = out.positions.len();
        let uv = sets.map(|set| format!("TEXCOORD_{set}"));
        for (attribute, length) in [
            ("NORMAL", out.normals.len()),
            ("TANGENT", out.tangents.len()),
            (&*uv[0], out.uv0.len()),
            (&*uv[1], out.uv1.len()),
            ("COLOR_0", out.colors.len()),
        ] {
            if length != 0 && length != count {
                return Err(self.broken(place, format!("{attribute} has {length} elements, POSITION {count}")));
            }
        }
        let indices = read.indices(count)?;
        // What Draco has packed are triangles, however they were given to it.
        let topology = if read.packed.is_some() { Topology::List } else { topology };
        if let Some(bad) = indices.iter().find(|&&i| i as usize >= count) {
            return Err(self.broken(place, format!("index {bad} is not below the {count} vertices")));
        }
        out.indices = geometry::triangle_list(&indices, topology);
        self.mend_numbers(&place, &uv, &mut out)?;
        if out.indices.is_empty() {
            self.warn(&place, "has no triangle and is left out");
            return Ok(false);
        }
        let draft = self.draft(&place, &read, count, out.normals.is_empty());
        out.material = self.material(&primitive.material());
        let before = out.indices.clone();
        self.finish(&place, sets, &mut out);
        self.scene.meshes.push(out);
        if let Some(draft) = draft {
            self.keep(self.scene.meshes.len() - 1, draft, (&before, count));
        }
        Ok(true)
    }

    /// What is compressed of a primitive, if it is.
    fn packed(&self, place: &str, mesh: usize, primitive: usize) -> Result<Option<draco::Unpacked>, SceneError> {
        let broken = |problem| self.broken(place, problem);
        let json = &self.document.as_json().meshes[mesh].primitives[primitive];
        let Some(packed) = draco::Packed::of(json).map_err(broken)? else { return Ok(None) };
        let view = self.document.views().nth(packed.buffer_view);
        let view = view.ok_or_else(|| broken(format!("its Draco buffer view {} is missing", packed.buffer_view)))?;
        packed.unpack(self.source.view(&view)?).map(Some).map_err(broken)
    }

    /// Numbers that are none: a triangle without a place is left out, every other attribute gets
    /// what a mesh without it has.
    fn mend_numbers(&mut self, place: &str, uv: &[String; 2], mesh: &mut Mesh) -> Result<(), SceneError> {
        fn repair<const N: usize>(values: &mut [[f32; N]], by: [f32; N]) -> Vec<usize> {
            let bad = |v: &[f32; N]| v.iter().any(|c| !c.is_finite());
            let mut found = Vec::new();
            for (i, v) in values.iter_mut().enumerate().filter(|(_, v)| bad(v)) {
                *v = by;
                found.push(i);
            }
            found
        }
        let lost = repair(&mut mesh.positions, [0.0; 3]);
        let found = [
            ("POSITION", lost.clone(), "their triangles are left out"),
            ("NORMAL", repair(&mut mesh.normals, [0.0; 3]), "their triangles' are used"),
            ("TANGENT", repair(&mut mesh.tangents, [0.0; 4]), "they are made anew where a map needs them"),
            (&*uv[0], repair(&mut mesh.uv0, [0.0; 2]), "(0, 0) is used"),
            (&*uv[1], repair(&mut mesh.uv1, [0.0; 2]), "(0, 0) is used"),
            ("COLOR_0", repair(&mut mesh.colors, [1.0; 4]), "they are white"),
        ];
        for (name, at, remedy) in found.iter().filter(|f| !f.1.is_empty()) {
            if self.strict {
                return Err(self.broken(place, format!("{name} of vertex {} is not a finite number", at[0])));
            }
            let what = format!("{name} is not a finite number at {} vertices, the first {}", at.len(), at[0]);
            self.warn(place, &format!("{what}; {remedy}"));
        }
        if lost.is_empty() {
            return Ok(());
        }
        let is_lost = |i: &u32| lost.binary_search(&(*i as usize)).is_ok();
        let kept = mesh.indices.chunks_exact(3).filter(|t| !t.iter().any(is_lost));
        mesh.indices = kept.flatten().copied().collect();
        // Where something is that is drawn, so that the mesh reaches no farther for them.
        let somewhere = mesh.indices.first().map_or([0.0; 3], |&i| mesh.positions[i as usize]);
        lost.iter().for_each(|&i| mesh.positions[i] = somewhere);
        Ok(())
    }

    /// Normals and tangents where they are missing; texture coordinates that a material wants and
    /// the mesh lacks.
    fn finish(&mut self, place: &str, sets: [u32; 2], mesh: &mut Mesh) {
        if mesh.normals.is_empty() {
            geometry::make_flat_normals(mesh);
        } else {
            let bad = geometry::normalize_normals(mesh);
            if bad > 0 {
                self.warn(place, &format!("{bad} normals have no length and were replaced by their triangles'"));
            }
        }
        let material = &self.scene.materials[mesh.material];
        let normal_map = material.normal_texture;
        let wanted = [
            material.base_color_texture,
            material.metallic_roughness_texture,
            normal_map,
            material.occlusion_texture,
            material.emissive_texture,
        ];
        let lacks = |set: u8| wanted.iter().flatten().any(|t| t.uv_set == set);
        let missing: Vec<u8> = [(0, mesh.uv0.is_empty()), (1, mesh.uv1.is_empty())]
            .iter()
            .filter(|(s, e)| *e && lacks(*s))
            .map(|p| p.0)
            .collect();
        for set in missing {
            let set = sets[usize::from(set)];
            self.warn(place, &format!("its material reads TEXCOORD_{set}, which it lacks; (0, 0) is used"));
        }
        match normal_map {
            Some(map) if mesh.tangents.is_empty() => geometry::make_tangents(mesh, map.uv_set, map.transform),
            Some(map) => {
                let bad = geometry::mend_tangents(mesh, map.uv_set, map.transform);
                if bad > 0 {
                    self.warn(place, &format!("{bad} tangents span no plane with their normals and were made anew"));
                }
            }
            None => mesh.tangents.clear(),
        }
    }
}
