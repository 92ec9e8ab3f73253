//! Meshes whose vertices move: morph targets, then a skin (glTF 2.0, sections 3.7.2.2 and 3.7.3.3).
//!
//! A [`Shape`] is what never changes of such a mesh, a [`Deform`] how it stands now: a matrix for
//! each joint and a weight for each target. Whoever draws moves the vertices on the GPU
//! (`render/deform.rs`); here they are moved for what the CPU asks of them: rays, bounds, files,
//! the path tracer. Both do the same arithmetic.

use super::{Mesh, Scene};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use std::collections::HashMap;
use std::sync::Arc;

/// Rows of a matrix whose fourth row is 0, 0, 0, 1: from where a vertex is at rest to where its
/// joint has it, both in the space of the instance.
pub type Joint = [[f32; 4]; 3];

/// Offsets that a morph target adds to a vertex at weight 1.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Delta {
    /// Index of the target.
    pub target: u32,
    /// Metres.
    pub position: [f32; 3],
    /// Added to the unit normal.
    pub normal: [f32; 3],
    /// Added to the unit tangent.
    pub tangent: [f32; 3],
}

/// Vertices as they are now; tangents where the mesh has some.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Vertices {
    /// Space of the instance, metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit.
    pub normals: Vec<[f32; 3]>,
    /// Unit, with handedness.
    pub tangents: Vec<[f32; 4]>,
}

/// Constant part of a deforming mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    /// Before targets and joints.
    pub rest: Vertices,
    /// Sets of four joints that each vertex has: 0 to 2.
    pub sets: usize,
    /// Joints of each vertex, set after set.
    pub joints: Vec<[u16; 4]>,
    /// Their weights: at least 0, of each vertex 1 in all.
    pub weights: Vec<[f32; 4]>,
    /// Morph targets.
    pub targets: usize,
    /// Where in `deltas` those of each vertex begin, and the end; empty without targets.
    pub first: Vec<u32>,
    /// Offsets by targets, vertex after vertex.
    pub deltas: Vec<Delta>,
    /// Boxes around what each joint holds at rest; without a skin one around everything.
    pub reach: Vec<(usize, Vec3, Vec3)>,
    /// Box around what each target adds, with the origin.
    pub swing: Vec<(Vec3, Vec3)>,
}

/// A mesh of a scene that deforms, as it stands now.
#[derive(Debug, Clone, PartialEq)]
pub struct Deform {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Its constant part.
    pub shape: Arc<Shape>,
    /// Matrices of joints, as many as [`Shape::joints`] name; empty without a skin.
    pub joints: Vec<Joint>,
    /// One for each target.
    pub weights: Vec<f32>,
}

impl Shape {
    /// Puts boxes around all that can move; call after the fields are filled.
    pub fn measure(&mut self) {
        let mut boxes: HashMap<usize, (Vec3, Vec3)> = HashMap::new();
        for (v, &p) in self.rest.positions.iter().enumerate() {
            let p = Vec3::from(p);
            let mut extend = |joint| {
                let own = boxes.entry(joint).or_insert((p, p));
                *own = (own.0.min(p), own.1.max(p));
            };
            if self.sets == 0 {
                extend(0);
            }
            for s in v * self.sets..(v + 1) * self.sets {
                let held = self.joints[s].iter().zip(self.weights[s]).filter(|(_, w)| *w > 0.0);
                held.for_each(|(&joint, _)| extend(usize::from(joint)));
            }
        }
        self.reach = boxes.into_iter().map(|(joint, (low, high))| (joint, low, high)).collect();
        self.reach.sort_by_key(|r| r.0);
        self.swing = vec![(Vec3::ZERO, Vec3::ZERO); self.targets];
        for delta in &self.deltas {
            let (swing, d) = (&mut self.swing[delta.target as usize], Vec3::from(delta.position));
            *swing = (swing.0.min(d), swing.1.max(d));
        }
    }

    /// Numbers that are the same for vertices that stand in one place and always will: where
    /// triangles meet, whatever the file repeats for its textures' sake.
    pub fn places(&self) -> Vec<u32> {
        let mut known: HashMap<Vec<u32>, u32> = HashMap::with_capacity(self.rest.positions.len());
        let place = |v: usize| {
            let mut key: Vec<u32> = self.rest.positions[v].iter().map(|c| (c + 0.0).to_bits()).collect();
            for s in v * self.sets..(v + 1) * self.sets {
                key.extend(self.joints[s].iter().map(|j| u32::from(*j)));
                key.extend(self.weights[s].iter().map(|w| w.to_bits()));
            }
            for delta in self.deltas_of(v) {
                key.push(delta.target);
                key.extend(delta.position.map(f32::to_bits));
            }
            let next = known.len() as u32;
            *known.entry(key).or_insert(next)
        };
        (0..self.rest.positions.len()).map(place).collect()
    }

    /// What targets do to vertex `v`.
    pub fn deltas_of(&self, v: usize) -> &[Delta] {
        match self.first.get(v..v + 2) {
            Some(&[from, to]) => &self.deltas[from as usize..to as usize],
            _ => &[],
        }
    }
}

impl Deform {
    /// Whether it agrees with itself and with `mesh`, its mesh.
    ///
    /// # Errors
    /// What disagrees, in words that follow the mesh's name.
    pub(crate) fn check(&self, mesh: &Mesh) -> Result<(), String> {
        let (shape, n) = (&self.shape, mesh.positions.len());
        let rest = &shape.rest;
        if [rest.positions.len(), rest.normals.len()] != [n; 2] || rest.tangents.len() != mesh.tangents.len() {
            return Err(format!("deforms from {} vertices into {n}", rest.positions.len()));
        }
        let held = shape.sets * n;
        if shape.sets > 2 || shape.joints.len() != held || shape.weights.len() != held {
            return Err("has joints or weights for other vertices".into());
        }
        if let Some(joint) = shape.joints.iter().flatten().find(|j| usize::from(**j) >= self.joints.len()) {
            return Err(format!("joint {joint} of {}", self.joints.len()));
        }
        let whole = shape.first.len() == n + 1
            && shape.first.is_sorted()
            && shape.first.last().is_some_and(|last| *last as usize <= shape.deltas.len());
        if self.weights.len() != shape.targets || !(whole || shape.first.is_empty()) {
            return Err(format!("has {} weights for {} morph targets", self.weights.len(), shape.targets));
        }
        match shape.deltas.iter().find(|d| d.target as usize >= shape.targets) {
            Some(delta) => Err(format!("morph target {} of {}", delta.target, shape.targets)),
            None => Ok(()),
        }
    }

    /// Moves all vertices into `out`.
    pub fn vertices(&self, out: &mut Vertices) {
        let rest = &self.shape.rest;
        let tangents = !rest.tangents.is_empty();
        out.positions.clear();
        out.normals.clear();
        out.tangents.clear();
        for v in 0..rest.positions.len() {
            let (mut p, mut n) = (Vec3::from(rest.positions[v]), Vec3::from(rest.normals[v]));
            let mut t = if tangents { Vec4::from(rest.tangents[v]).truncate() } else { Vec3::ZERO };
            for delta in self.shape.deltas_of(v) {
                let w = self.weights[delta.target as usize];
                p += w * Vec3::from(delta.position);
                n += w * Vec3::from(delta.normal);
                t += w * Vec3::from(delta.tangent);
            }
            if self.shape.sets > 0 {
                let [r0, r1, r2] = self.blended(v);
                p = Vec3::new(r0.dot(p.extend(1.0)), r1.dot(p.extend(1.0)), r2.dot(p.extend(1.0)));
                let [r0, r1, r2] = [r0, r1, r2].map(Vec4::truncate);
                // The cofactor matrix is the inverse transpose times the determinant: right for
                // normals, never singular.
                let (c0, c1, c2) = (r1.cross(r2), r2.cross(r0), r0.cross(r1));
                let mirror = if r0.dot(c0) < 0.0 { -1.0 } else { 1.0 };
                n = Vec3::new(c0.dot(n), c1.dot(n), c2.dot(n)) * mirror;
                t = Vec3::new(r0.dot(t), r1.dot(t), r2.dot(t));
            }
            out.positions.push(p.to_array());
            out.normals.push(n.try_normalize().unwrap_or(Vec3::from(rest.normals[v])).to_array());
            if tangents {
                let own = Vec4::from(rest.tangents[v]);
                out.tangents.push(t.try_normalize().unwrap_or(own.truncate()).extend(own.w).to_array());
            }
        }
    }

    /// The mean of vertex `v`'s joints by its weights.
    fn blended(&self, v: usize) -> [Vec4; 3] {
        let mut rows = [Vec4::ZERO; 3];
        for s in v * self.shape.sets..(v + 1) * self.shape.sets {
            for (&joint, w) in self.shape.joints[s].iter().zip(self.shape.weights[s]) {
                let matrix = &self.joints[usize::from(joint)];
                rows.iter_mut().zip(matrix).for_each(|(row, m)| *row += w * Vec4::from(*m));
            }
        }
        rows
    }

    /// Whether its joints turn all of it over, so that front faces wind the other way round.
    pub fn turns_over(&self) -> bool {
        let turns = |rows: &Joint| {
            let [a, b, c] = rows.map(|row| Vec4::from(row).truncate());
            a.dot(b.cross(c)) < 0.0
        };
        self.shape.sets > 0 && !self.joints.is_empty() && self.joints.iter().all(turns)
    }

    /// A box around all vertices, larger where joints blend or targets pull: it asks joints, not
    /// vertices. `None` without vertices.
    pub fn bounds(&self) -> Option<([f32; 3], [f32; 3])> {
        let (mut swing_low, mut swing_high) = (Vec3::ZERO, Vec3::ZERO);
        for ((low, high), &w) in self.shape.swing.iter().zip(&self.weights) {
            let (a, b) = (*low * w, *high * w);
            (swing_low, swing_high) = (swing_low + a.min(b), swing_high + a.max(b));
        }
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &(joint, a, b) in &self.shape.reach {
            let (a, b) = (a + swing_low, b + swing_high);
            // A vertex is a mean of where its joints have it, so it is within the box around their
            // boxes.
            let corners = (0..8).map(|i| Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), a, b));
            for p in corners {
                let p = match self.joints.get(joint) {
                    Some(rows) => Vec3::from(rows.map(|r| Vec4::from(r).dot(p.extend(1.0)))),
                    None => p,
                };
                if p.is_finite() {
                    (low, high) = (low.min(p), high.max(p));
                }
            }
        }
        let pad = 1e-6 * (high - low);
        (low.x <= high.x).then(|| ((low - pad).to_array(), (high + pad).to_array()))
    }
}

/// Joints and weights of all that deforms, one after the other, as the GPU reads them.
pub fn pose_of(deforms: &[Deform]) -> Vec<f32> {
    deforms.iter().flat_map(|d| d.joints.as_flattened().as_flattened().iter().chain(&d.weights).copied()).collect()
}

impl Scene {
    /// The deformation of mesh `mesh`, if it deforms.
    pub fn deform_of(&self, mesh: usize) -> Option<&Deform> {
        self.deforms.iter().find(|d| d.mesh == mesh)
    }

    /// Writes the vertices of all deforming meshes as they stand now, for whoever reads
    /// [`Scene::meshes`].
    pub fn move_vertices(&mut self) {
        for deform in &self.deforms {
            let Some(mesh) = self.meshes.get_mut(deform.mesh) else { continue };
            let mut moved = Vertices::default();
            deform.vertices(&mut moved);
            (mesh.positions, mesh.normals) = (moved.positions, moved.normals);
            if !mesh.tangents.is_empty() {
                mesh.tangents = moved.tangents;
            }
        }
    }
}
