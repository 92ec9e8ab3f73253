//! Skins and morph targets. None is worth refusing a file: what is broken is left out with a
//! warning, and the mesh stands as it was modelled.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{Mat4, Vec3};
use gltf::Semantic;

use super::Loader;
use super::accessor::{Integers, Reader};
use super::mesh::Vertices;
use crate::SceneError;
use bouncelight::scene::Mesh;
use bouncelight::scene::deform::{self, Deform, Delta, Joint, Shape};
use bouncelight::scene::rig::{self, RigDeform, Skin};

/// Vertices of all the meshes that are copied because nodes deform them apart, and what all morph
/// targets of a file may add to vertices: more than people have, and what keeps a small file from
/// asking for all memory.
const MOST_COPIED: usize = 1 << 22;
const MOST_DELTAS: usize = 1 << 22;
/// Elements of morph targets that are read at all, most of which add nothing.
const MOST_READ: usize = 1 << 28;

/// What a primitive says of its deformation; vertices as those of its mesh.
#[derive(Default)]
pub(super) struct Draft {
    sets: usize,
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
    targets: usize,
    /// What targets do to vertices, by vertex and target.
    deltas: Vec<(u32, Delta)>,
    /// The mesh's normals are those of its triangles.
    flat: bool,
}

/// A mesh that a node deforms.
struct Pending {
    mesh: usize,
    /// The mesh that it is a copy of, or itself.
    of: usize,
    node: usize,
    skin: Option<usize>,
}

/// A mesh as it deforms at rest.
struct Resolved {
    mesh: usize,
    of: usize,
    skinned: bool,
    joints: Vec<Joint>,
    weights: Vec<f32>,
    free: bool,
}

/// State of one load.
#[derive(Default)]
pub(super) struct Deforming {
    /// By scene mesh.
    drafts: HashMap<usize, Draft>,
    /// Scene meshes that have a place, and whether they deform there.
    taken: HashMap<usize, bool>,
    /// Their copies that do not.
    plain: HashMap<usize, usize>,
    /// Original and copy.
    copies: Vec<(usize, usize)>,
    pending: Vec<Pending>,
    resolved: Vec<Resolved>,
    /// Vertices of the copies, and deltas and elements of targets so far.
    copied: usize,
    deltas: usize,
    read: usize,
}

impl Draft {
    /// Follows vertices that were repeated: vertex i is what `from[i]` was.
    fn repeat(&mut self, from: &[u32]) {
        let each = self.sets;
        let held = || from.iter().flat_map(|&i| (0..each).map(move |s| i as usize * each + s));
        self.joints = held().map(|i| self.joints[i]).collect();
        self.weights = held().map(|i| self.weights[i]).collect();
        let begin = |v: u32| self.deltas.partition_point(|d| d.0 < v);
        let of = |(to, &v): (u32, &u32)| self.deltas[begin(v)..begin(v + 1)].iter().map(move |d| (to, d.1));
        self.deltas = (0u32..).zip(from).flat_map(of).collect();
    }

    /// What moves `mesh`, whose vertices are as they are at rest.
    fn shape(&self, mesh: &Mesh, skinned: bool) -> Shape {
        let rest = deform::Vertices {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            tangents: mesh.tangents.clone(),
        };
        let mut shape = Shape { rest, targets: self.targets, ..Shape::default() };
        if skinned {
            (shape.sets, shape.joints, shape.weights) = (self.sets, self.joints.clone(), self.weights.clone());
        }
        if self.targets > 0 {
            let deltas = if self.flat { self.turned(mesh) } else { self.deltas.clone() };
            let begin = |v: usize| deltas.partition_point(|d| (d.0 as usize) < v) as u32;
            shape.first = (0..=mesh.positions.len()).map(begin).collect();
            shape.deltas = deltas.into_iter().map(|d| d.1).collect();
        }
        shape.measure();
        shape
    }

    /// The deltas with what targets do to the normals of flat triangles, which follows from where
    /// they put the corners.
    fn turned(&self, mesh: &Mesh) -> Vec<(u32, Delta)> {
        let mut all: BTreeMap<(u32, u32), Delta> = self.deltas.iter().map(|d| ((d.0, d.1.target), d.1)).collect();
        for t in mesh.indices.chunks_exact(3) {
            let own = t.iter().flat_map(|&v| all.range((v, 0)..(v + 1, 0)).map(|(key, _)| key.1));
            for target in own.collect::<BTreeSet<u32>>() {
                let [a, b, c] = [t[0], t[1], t[2]].map(|v| {
                    let moved = all.get(&(v, target)).map_or(Vec3::ZERO, |d| d.position.into());
                    (Vec3::from(mesh.positions[v as usize]) + moved).as_dvec3()
                });
                let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
                for &v in t {
                    let delta = all.entry((v, target)).or_insert(Delta { target, ..Delta::zeroed() });
                    delta.normal = (normal.as_vec3() - Vec3::from(mesh.normals[v as usize])).to_array();
                }
            }
        }
        all.into_iter().map(|((v, _), delta)| (v, delta)).collect()
    }
}

impl<'a> Loader<'a> {
    /// What of a primitive deforms; `flat`: it has no normals.
    pub(super) fn draft(&mut self, place: &str, read: &Vertices<'_>, count: usize, flat: bool) -> Option<Draft> {
        let mut draft = Draft { flat, ..Draft::default() };
        let broken = |e: SceneError| e.to_string();
        if let Err(problem) = self.influences(place, read, count, &mut draft) {
            self.warn(place, &format!("its skin is left out and it stands in its bind pose: {problem}"));
            (draft.sets, draft.joints, draft.weights) = Default::default();
        }
        for (t, target) in read.primitive.morph_targets().enumerate() {
            let floats = |accessor: Option<gltf::Accessor>, name: &str| -> Result<Vec<[f32; 3]>, String> {
                let Some(accessor) = accessor else { return Ok(Vec::new()) };
                let values = read.reader.floats::<3>(&accessor, Integers::AsFlagged, None).map_err(broken)?;
                if values.len() != count {
                    return Err(format!("{name} of target {t} has {} elements, POSITION {count}", values.len()));
                }
                match values.iter().position(|v| v.iter().any(|c| !c.is_finite())) {
                    Some(v) => Err(format!("{name} of target {t}, vertex {v}, is not a finite number")),
                    None => Ok(values),
                }
            };
            let mut read_all = || -> Result<(), String> {
                self.deforming.read = self.deforming.read.saturating_add(3 * count);
                if self.deforming.read > MOST_READ {
                    return Err(format!("all targets together have more than {MOST_READ} elements"));
                }
                let positions = floats(target.positions(), "POSITION")?;
                let normals = floats(target.normals(), "NORMAL")?;
                let tangents = floats(target.tangents(), "TANGENT")?;
                let of = |values: &[[f32; 3]], v: usize| values.get(v).copied().unwrap_or_default();
                let delta = |v: usize| Delta {
                    target: t as u32,
                    position: of(&positions, v),
                    normal: of(&normals, v),
                    tangent: of(&tangents, v),
                };
                let adds = |d: &Delta| [d.position, d.normal, d.tangent] != [[0.0; 3]; 3];
                let found: Vec<_> = (0..count).map(|v| (v as u32, delta(v))).filter(|d| adds(&d.1)).collect();
                self.deforming.deltas += found.len();
                if self.deforming.deltas > MOST_DELTAS {
                    return Err(format!("all targets together move more than {MOST_DELTAS} vertices"));
                }
                draft.deltas.extend(found);
                Ok(())
            };
            if let Err(problem) = read_all() {
                // What weighs it still counts it.
                self.warn(place, &format!("a morph target is left out: {problem}"));
            }
            draft.targets += 1;
        }
        // Stable, so that each vertex keeps the order of targets.
        draft.deltas.sort_by_key(|d| d.0);
        (draft.sets > 0 || draft.targets > 0).then_some(draft)
    }

    /// Joints of each vertex, and their weights.
    fn influences(&mut self, place: &str, read: &Vertices<'_>, n: usize, draft: &mut Draft) -> Result<(), String> {
        let broken = |e: SceneError| e.to_string();
        let mut sets = Vec::new();
        for set in 0..2 {
            let joints = read.floats::<4>(Semantic::Joints(set), Integers::AsFlagged, None).map_err(broken)?;
            let weights = read.floats::<4>(Semantic::Weights(set), Integers::Normalized, None).map_err(broken)?;
            if joints.is_empty() && weights.is_empty() {
                break;
            }
            if [joints.len(), weights.len()] != [n; 2] {
                let lengths = format!("JOINTS_{set} has {} elements, WEIGHTS_{set} {}", joints.len(), weights.len());
                return Err(format!("{lengths}, POSITION {n}"));
            }
            if let Some(v) = joints.iter().position(|j| j.iter().any(|j| *j != j.clamp(0.0, 65_535.0).trunc())) {
                return Err(format!("JOINTS_{set} of vertex {v} is not an index"));
            }
            if let Some(v) = weights.iter().position(|w| w.iter().any(|w| !w.is_finite() || *w < 0.0)) {
                return Err(format!("WEIGHTS_{set} of vertex {v} is negative or not a finite number"));
            }
            sets.push((joints, weights));
        }
        if read.primitive.get(&Semantic::Joints(2)).is_some() {
            self.warn(place, "has more than eight joints a vertex; the first eight count");
        }
        draft.sets = sets.len();
        let (mut uneven, mut weightless) = (0, 0);
        for v in 0..if sets.is_empty() { 0 } else { n } {
            let sum: f32 = sets.iter().flat_map(|s| s.1[v]).sum();
            let sound = sum > 0.0 && sum.is_finite();
            uneven += usize::from(sound && (sum - 1.0).abs() > 0.01);
            weightless += usize::from(!sound);
            for (s, (joints, weights)) in sets.iter().enumerate() {
                draft.joints.push(joints[v].map(|j| j as u16));
                let first = if s == 0 { [1.0, 0.0, 0.0, 0.0] } else { [0.0; 4] };
                draft.weights.push(if sound { weights[v].map(|w| w / sum) } else { first });
            }
        }
        if uneven > 0 {
            self.warn(place, &format!("the joints' weights of {uneven} vertices do not sum to 1 and are scaled"));
        }
        if weightless > 0 {
            self.warn(place, &format!("{weightless} vertices have no weights and follow their first joint"));
        }
        Ok(())
    }

    /// Keeps what deforms scene mesh `mesh`, whose `indices` were these before its vertices were
    /// finished.
    pub(super) fn keep(&mut self, mesh: usize, mut draft: Draft, before: (&[u32], usize)) {
        let made = &self.scene.meshes[mesh];
        if made.positions.len() != before.1 || made.indices != before.0 {
            draft.repeat(before.0);
        }
        self.deforming.drafts.insert(mesh, draft);
    }

    /// The scene mesh that a node places where the file has `mesh`: one of its own if it deforms
    /// there.
    pub(super) fn own(&mut self, node: &gltf::Node<'a>, place: &str, mesh: usize) -> usize {
        let skin = self.document.as_json().nodes[node.index()].skin.map(|s| s.value());
        let facts = self.deforming.drafts.get(&mesh).map(|d| (d.sets > 0, d.targets > 0));
        let (skinned, morphs) = facts.unwrap_or_default();
        if skin.is_some() && !skinned {
            self.warn(place, "its skin is ignored: the mesh has no JOINTS_0 and WEIGHTS_0");
        }
        let skin = skin.filter(|_| skinned);
        if facts.is_none() {
            return mesh;
        }
        let mut deforms = morphs || skin.is_some();
        let vertices = self.scene.meshes[mesh].positions.len();
        if deforms && self.deforming.taken.contains_key(&mesh) {
            self.deforming.copied += vertices;
            if self.deforming.copied > MOST_COPIED {
                self.warn(place, &format!("does not deform: nodes deform more than {MOST_COPIED} vertices apart"));
                deforms = false;
            }
        }
        let own = match (self.deforming.taken.get(&mesh), deforms) {
            (None, _) | (Some(false), false) => {
                self.deforming.taken.insert(mesh, deforms);
                mesh
            }
            (_, true) => self.copy(mesh),
            (_, false) => match self.deforming.plain.get(&mesh) {
                Some(&plain) => plain,
                None => {
                    let plain = self.copy(mesh);
                    self.deforming.plain.insert(mesh, plain);
                    plain
                }
            },
        };
        if deforms {
            self.deforming.pending.push(Pending { mesh: own, of: mesh, node: node.index(), skin });
        }
        own
    }

    fn copy(&mut self, mesh: usize) -> usize {
        self.scene.meshes.push(self.scene.meshes[mesh].clone());
        let copy = self.scene.meshes.len() - 1;
        self.deforming.copies.push((mesh, copy));
        copy
    }

    /// Copies of scene mesh `mesh` that nodes have for themselves.
    pub(super) fn copies_of(&self, mesh: usize) -> Vec<usize> {
        self.deforming.copies.iter().filter(|c| c.0 == mesh).map(|c| c.1).collect()
    }

    /// Vertices of `mesh` were repeated: its triangles were `before` then.
    pub(super) fn repeated(&mut self, mesh: usize, before: &[u32]) {
        if let Some(draft) = self.deforming.drafts.get_mut(&mesh) {
            draft.repeat(before);
        }
    }

    /// Finds what all that deforms hangs on. `nodes`: place of each glTF node in the scene's list,
    /// with its world transform at rest.
    pub(super) fn resolve(&mut self, nodes: &HashMap<usize, (usize, Mat4)>) -> (Vec<Skin>, Vec<RigDeform>) {
        let (mut skins, mut deforms) = (Vec::new(), Vec::new());
        let worlds: HashMap<usize, Mat4> = nodes.values().copied().collect();
        let mut known: HashMap<usize, Result<usize, String>> = HashMap::new();
        for Pending { mesh, of, node, skin } in std::mem::take(&mut self.deforming.pending) {
            let Some(&(at, world)) = nodes.get(&node) else { continue };
            let found = skin.map(|s| {
                let read = known.entry(s).or_insert_with(|| {
                    let read = self.skin(s, nodes)?;
                    skins.push(read);
                    Ok(skins.len() - 1)
                });
                let found = read.clone()?;
                let (count, draft) = (skins[found].joints.len(), &self.deforming.drafts[&of]);
                match draft.joints.iter().flatten().find(|j| usize::from(**j) >= count) {
                    Some(joint) => Err(format!("a vertex names joint {joint} of {count}")),
                    None => Ok(found),
                }
            });
            let skin = match found.transpose() {
                Ok(skin) => skin,
                Err(problem) => {
                    let what = format!("its skin is left out and it stands in its bind pose: {problem}");
                    self.warn(&format!("nodes[{node}]"), &what);
                    None
                }
            };
            let targets = self.deforming.drafts[&of].targets;
            if skin.is_none() && targets == 0 {
                continue;
            }
            let weights = self.weights(node, targets);
            let (joints, free) = skin.map_or((Vec::new(), false), |s| {
                let skin: &Skin = &skins[s];
                rig::joints(world, skin.joints.iter().map(|j| worlds[j]).zip(&skin.inverse_bind))
            });
            deforms.push(RigDeform { node: at, skin, weights: weights.clone() });
            self.deforming.resolved.push(Resolved { mesh, of, skinned: skin.is_some(), joints, weights, free });
        }
        (skins, deforms)
    }

    /// A skin's joints, as places in the scene's list of nodes.
    fn skin(&self, index: usize, nodes: &HashMap<usize, (usize, Mat4)>) -> Result<Skin, String> {
        let skin = self.document.as_json().skins.get(index).ok_or(format!("skins[{index}] does not exist"))?;
        let joint = |(k, j): (usize, &gltf::json::Index<gltf::json::Node>)| {
            let found = nodes.get(&j.value()).map(|n| n.0);
            found.ok_or(format!("skins[{index}].joints[{k}] is not a node of the scene"))
        };
        let joints = skin.joints.iter().enumerate().map(joint).collect::<Result<Vec<_>, _>>()?;
        let mut inverse_bind = match skin.inverse_bind_matrices {
            None => vec![Mat4::IDENTITY.to_cols_array_2d(); joints.len()],
            Some(accessor) => {
                let accessor = self.document.accessors().nth(accessor.value());
                let accessor = accessor.ok_or(format!("skins[{index}].inverseBindMatrices names no accessor"))?;
                let reader = Reader { path: self.path, source: self.source };
                reader.matrices(&accessor).map_err(|e| e.to_string())?
            }
        };
        if inverse_bind.len() < joints.len() {
            return Err(format!("skins[{index}] has {} joints and {} matrices", joints.len(), inverse_bind.len()));
        }
        inverse_bind.truncate(joints.len());
        if inverse_bind.iter().flatten().flatten().any(|c| !c.is_finite()) {
            return Err(format!("skins[{index}].inverseBindMatrices are not finite numbers"));
        }
        Ok(Skin { joints, inverse_bind })
    }

    /// Weights of a node's morph targets at rest.
    fn weights(&mut self, node: usize, targets: usize) -> Vec<f32> {
        let json = self.document.as_json();
        let of_mesh = || json.nodes[node].mesh.and_then(|m| json.meshes[m.value()].weights.clone());
        let mut weights = json.nodes[node].weights.clone().or_else(of_mesh).unwrap_or_default();
        if !weights.is_empty() && weights.len() != targets || weights.iter().any(|w| !w.is_finite()) {
            let what = format!("{} weights for {targets} morph targets; what is missing is 0", weights.len());
            self.warn(&format!("nodes[{node}]"), &what);
        }
        weights.iter_mut().filter(|w| !w.is_finite()).for_each(|w| *w = 0.0);
        weights.resize(targets, 0.0);
        weights
    }

    /// Puts vertices where they are at rest. What no animation can move does not deform.
    pub(super) fn settle_deforms(&mut self) {
        let mut shapes: HashMap<(usize, bool), Arc<Shape>> = HashMap::new();
        let mut sound = Vec::new();
        for resolved in std::mem::take(&mut self.deforming.resolved) {
            let Resolved { mesh, of, skinned, joints, weights, free } = resolved;
            let draft = &self.deforming.drafts[&of];
            let make = || Arc::new(draft.shape(&self.scene.meshes[mesh], skinned));
            let shape = shapes.entry((of, skinned)).or_insert_with(make).clone();
            let deform = Deform { mesh, shape, joints, weights };
            let mut moved = deform::Vertices::default();
            deform.vertices(&mut moved);
            sound.push(moved.positions.iter().flatten().all(|c| c.is_finite()));
            if sound.last() == Some(&false) {
                let name = self.scene.meshes[mesh].name.clone();
                self.warn(&format!("mesh '{name}'"), "is deformed beyond all numbers and stands as it was modelled");
                continue;
            }
            self.scene.deforms.push(deform);
            if free {
                let of_mesh = self.scene.instances.iter_mut().filter(|i| i.mesh == mesh);
                of_mesh.for_each(|i| i.transform = Mat4::IDENTITY.to_cols_array_2d());
            }
        }
        self.scene.move_vertices();
        match &mut self.scene.rig {
            None => self.scene.deforms.clear(),
            Some(rig) => {
                let mut kept = sound.into_iter();
                rig.deforms.retain(|_| kept.next().unwrap_or(true));
            }
        }
    }
}
