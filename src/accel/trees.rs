//! The CPU's part of [`SceneRays`](super::SceneRays): a tree for each mesh, and what rays know of
//! its triangles.

use super::emitters::{self, Glow};
use super::gpu::ROW;
use super::image::Reductions;
use super::pieces::{self, Made, Pieces, Seen};
use super::refit::Refit;
use super::wide::{Block, NODE, WORDS};
use super::{Accel, AccelError, build, surfaces, threads, wide};
use crate::scene::deform::{Deform, Joint, Vertices};
use crate::scene::{Instance, Material, Mesh, Scene, octahedral::octahedral_word};
use glam::Vec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// A mesh's tree, where it lies in the texture, and what of it glows.
pub(super) struct MeshTree {
    pub root: u32,
    pub first_triangle: u32,
    /// Object space; `None` for a mesh that nothing can hit.
    pub bounds: Option<(Vec3, Vec3)>,
    pub glows: Vec<Glow>,
    /// Of a mesh that deforms.
    pub refit: Option<Box<Deforming>>,
    /// Meshes whose triangles lie in this tree, too, this one among them; none but in a tree of
    /// several.
    pub together: Vec<usize>,
}

/// A tree that follows a pose.
pub(super) struct Deforming {
    pub tree: Refit,
    /// The pose that it is in.
    last: Option<(Vec<Joint>, Vec<f32>)>,
    vertices: Vertices,
    made: Vec<Made>,
    pub normals: Vec<[u32; 4]>,
}

impl MeshTree {
    /// Brings the tree into the pose of `deform`, its mesh's; false where it is in that pose or
    /// does not deform.
    pub fn follow(&mut self, deform: &Deform) -> bool {
        let Some(own) = self.refit.as_deref_mut() else { return false };
        if own.last.as_ref().is_some_and(|(joints, weights)| *joints == deform.joints && *weights == deform.weights) {
            return false;
        }
        deform.vertices(&mut own.vertices);
        for new in &own.made {
            new.push(&mut own.vertices.positions, &mut own.vertices.normals);
        }
        self.bounds = own.tree.follow(&own.vertices.positions);
        own.normals = normals(own.tree.triangles.iter().copied(), &own.vertices.normals);
        if own.tree.surfaces.iter().any(|s| s.glow_by_area() > 0.0) {
            self.glows = emitters::glowing(&own.tree.surfaces, &own.tree.corners(&own.vertices.positions));
        }
        own.last = Some((deform.joints.clone(), deform.weights.clone()));
        true
    }
}

/// Octahedral normals of the corners of triangles.
fn normals(triangles: impl Iterator<Item = [u32; 3]>, of: &[[f32; 3]]) -> Vec<[u32; 4]> {
    let normal = |i: u32| octahedral_word(of[i as usize]);
    triangles.map(|t| [normal(t[0]), normal(t[1]), normal(t[2]), 0]).collect()
}

/// What trees are made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct How {
    /// A tree for each mesh.
    pub alone: bool,
    /// What differs within a triangle is met in pieces.
    pub pieces: bool,
}

/// All that is uploaded once.
pub(super) struct SceneTrees {
    /// Room for the tree over the instances, then the meshes' trees.
    pub blocks: Vec<Block>,
    pub surfaces: Vec<surfaces::Packed>,
    /// Of each triangle the normals of its corners, octahedral, object space.
    pub normals: Vec<[u32; 4]>,
    pub meshes: Vec<MeshTree>,
    /// Blocks of that room.
    pub top_room: usize,
    /// Whether a triangle is met in pieces.
    pub cut: bool,
}

/// Blocks that the tree over `count` instances can need: a node has a family of eight, and there
/// are fewer nodes than instances.
fn top_blocks(count: usize) -> usize {
    (8 * count + 16).next_multiple_of(ROW as usize)
}

/// What one mesh becomes, on any thread: all that rays know of it, but where it lies among the
/// others.
#[derive(Default, Clone)]
pub(crate) struct MeshPart {
    accel: Arc<Accel>,
    normals: Arc<Vec<[u32; 4]>>,
    surfaces: Vec<surfaces::Surface>,
    glows: Vec<Glow>,
    /// Of a mesh that deforms the vertices of each triangle, and those that it has got.
    deforming: Option<(Vec<[u32; 3]>, Vec<Made>)>,
    /// Meshes whose triangles the tree holds, one after the other; none where they are this one's.
    together: Vec<usize>,
}

impl MeshPart {
    /// Of a mesh of `scene` in `pieces`, and of how it deforms, if it does. One that disagrees in
    /// itself is not met: the upload of the picture's part refuses it.
    pub fn new(scene: &Scene, mesh: &Mesh, reductions: &Reductions, deform: Option<&Deform>, pieces: &Pieces) -> Self {
        if mesh.check(scene.materials.len()).is_err() {
            return Self::default();
        }
        let deform = deform.filter(|d| d.check(mesh).is_ok());
        let Seen { mesh, made } = pieces.met(scene, mesh, reductions);
        let corners = corners(&mesh);
        let part = Self::without_tree(scene, &mesh, made.len(), reductions, &corners);
        let triangles = || mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
        let accel = match deform.map(|d| pieces::places_of(&made, d.shape.places())) {
            Some(places) => {
                let places: Vec<_> = triangles().map(|t| t.map(|i| places[i as usize])).collect();
                build::build_deforming(&corners, &places)
            }
            None => build::build(&corners),
        };
        Self { accel: accel.into(), deforming: deform.map(|_| (triangles().collect(), made)), ..part }
    }

    /// `made`: how many vertices the mesh has got.
    fn without_tree(
        scene: &Scene,
        mesh: &Mesh,
        made: usize,
        reductions: &Reductions,
        corners: &[[[f32; 3]; 3]],
    ) -> Self {
        let surfaces = surfaces::of_mesh(scene, mesh, mesh.positions.len() - made, reductions);
        let triangles = mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
        let normals = Arc::new(normals(triangles, &mesh.normals));
        Self { normals, glows: emitters::glowing(&surfaces, corners), surfaces, ..Self::default() }
    }

    /// Of meshes that are in one place, with one tree, which the first of them has. `done` hears of
    /// each.
    fn of_all(
        scene: &Scene,
        meshes: &[usize],
        reductions: &Reductions,
        pieces: &[Pieces],
        done: impl Fn(),
    ) -> Vec<Self> {
        let mut all = Vec::new();
        let mut parts: Vec<Self> = Vec::with_capacity(meshes.len());
        for &i in meshes {
            let Seen { mesh, made } = pieces[i].met(scene, &scene.meshes[i], reductions);
            let own = corners(&mesh);
            parts.push(Self::without_tree(scene, &mesh, made.len(), reductions, &own));
            all.extend(own);
            done();
        }
        let glows = parts.iter_mut().flat_map(|p| std::mem::take(&mut p.glows)).collect();
        let first = &mut parts[0];
        (first.accel, first.glows, first.together) = (build::build(&all).into(), glows, meshes.to_vec());
        parts
    }

    /// The same triangles, with the corners that it was made of, of another material without
    /// pictures.
    pub fn of_material(&self, material: &Material, corners: &[[[f32; 3]; 3]]) -> Self {
        let surfaces = vec![surfaces::plain(material); self.surfaces.len()];
        let glows = emitters::glowing(&surfaces, corners);
        Self { accel: self.accel.clone(), normals: self.normals.clone(), surfaces, glows, ..Self::default() }
    }

    /// Triangles, those that no ray can hit among them.
    pub fn triangles(&self) -> usize {
        self.surfaces.len()
    }

    /// Triangles that no ray can hit: not finite, too far out or without area.
    pub fn dropped(&self) -> usize {
        self.accel.dropped_not_finite + self.accel.dropped_degenerate
    }
}

/// Corners of a mesh's triangles, whose indices were checked.
pub(crate) fn corners(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    mesh.indices.chunks_exact(3).map(|t| [0, 1, 2].map(|k| mesh.positions[t[k] as usize])).collect()
}

/// Meshes by the trees they share: those that are met in one place each, all in the same, share
/// one, since the trees of what lies side by side overlap, and a ray walks through all of them.
/// Files cut what is one thing by its materials. What deforms, cannot be met or shows in several
/// places has its own, and where something is animated whatever hangs on another node. The first of
/// each is the least; `alone`: none share.
fn shared(scene: &Scene, alone: bool) -> Vec<Vec<usize>> {
    let mut places = vec![Vec::new(); scene.meshes.len()];
    for (i, instance) in scene.instances.iter().enumerate() {
        if let Some(of) = places.get_mut(instance.mesh) {
            of.push(i);
        }
    }
    let node = |i: usize| scene.rig.as_ref().and_then(|r| r.instances.get(i).copied());
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut known = std::collections::HashMap::new();
    for (mesh, places) in places.iter().enumerate() {
        let sound = || {
            let of = &scene.meshes[mesh];
            of.check(scene.materials.len()).is_ok() && scene.deform_of(mesh).is_none() && can_be_met(of)
        };
        if let [place] = places[..]
            && !alone
            && sound()
        {
            let key = (scene.instances[place].transform.map(|c| c.map(f32::to_bits)), node(place));
            let group = *known.entry(key).or_insert(groups.len());
            if group < groups.len() {
                groups[group].push(mesh);
                continue;
            }
        }
        groups.push(vec![mesh]);
    }
    groups
}

/// Whether there is a triangle that a ray can hit. Indices were checked.
fn can_be_met(mesh: &Mesh) -> bool {
    let corner = |i: &u32| mesh.positions[*i as usize];
    mesh.indices.chunks_exact(3).any(|t| build::is_good(&[corner(&t[0]), corner(&t[1]), corner(&t[2])]))
}

impl SceneTrees {
    /// Builds them on all of the machine's threads. `progress` as in
    /// [`SceneRays::with_progress`](super::SceneRays::with_progress).
    pub fn build(
        scene: &Scene,
        progress: &(dyn Fn(usize, usize) -> bool + Sync),
        how: How,
    ) -> Result<Self, AccelError> {
        let reductions = Reductions::new(scene);
        let pieces =
            if how.pieces { Pieces::of(scene, &reductions) } else { vec![Pieces::default(); scene.meshes.len()] };
        let (done, stopped) = (AtomicUsize::new(0), AtomicBool::new(!progress(0, scene.meshes.len())));
        let one_done = || {
            if !progress(done.fetch_add(1, Ordering::Relaxed) + 1, scene.meshes.len()) {
                stopped.store(true, Ordering::Relaxed);
            }
        };
        let groups = shared(scene, how.alone);
        let make = |group: &Vec<usize>| {
            if stopped.load(Ordering::Relaxed) {
                return Vec::new();
            }
            if let [mesh] = group[..] {
                let deform = scene.deform_of(mesh);
                let part = MeshPart::new(scene, &scene.meshes[mesh], &reductions, deform, &pieces[mesh]);
                one_done();
                return vec![part];
            }
            MeshPart::of_all(scene, group, &reductions, &pieces, one_done)
        };
        let size = |group: &Vec<usize>| group.iter().map(|&m| scene.meshes[m].indices.len()).sum();
        let made = threads::map(&groups, size, make);
        if stopped.into_inner() {
            return Err(AccelError::Stopped);
        }
        drop(reductions);
        let mut parts = vec![MeshPart::default(); scene.meshes.len()];
        for (mesh, part) in groups.iter().flatten().zip(made.into_iter().flatten()) {
            parts[*mesh] = part;
        }
        let cut = pieces.iter().any(Pieces::any);
        Ok(Self { cut, ..Self::join(parts, scene.instances.len()) })
    }

    /// Lays parts one after the other, behind room for a tree over so many instances.
    pub fn join(parts: Vec<MeshPart>, instances: usize) -> Self {
        let top_room = top_blocks(instances);
        let mut blocks = Vec::with_capacity(top_room + parts.iter().map(|p| p.accel.block_count() + 8).sum::<usize>());
        blocks.resize(top_room, [0; WORDS]);
        let surfaces: Vec<_> = parts.iter().flat_map(|p| p.surfaces.iter().copied()).collect();
        let normals = parts.iter().flat_map(|p| p.normals.iter().copied()).collect();
        let firsts: Vec<usize> =
            parts.iter().scan(0, |sum, p| Some(std::mem::replace(sum, *sum + p.surfaces.len()))).collect();
        let sizes: Vec<usize> = parts.iter().map(|p| p.surfaces.len()).collect();
        let mut meshes = Vec::with_capacity(parts.len());
        for (part, &first) in parts.into_iter().zip(&firsts) {
            let root = blocks.len().next_multiple_of(8);
            blocks.resize(root, [0; WORDS]);
            // What stands in the tree as one list of triangles lies among those of all meshes.
            let numbers: Vec<u32> = part
                .together
                .iter()
                .flat_map(|&m| firsts[m] - first..firsts[m] - first + sizes[m])
                .map(|i| i as u32)
                .collect();
            let number = |i: u32| numbers.get(i as usize).copied().unwrap_or(i);
            blocks.extend(part.accel.blocks.iter().map(|b| moved(b, root as u32, &surfaces[first..], number)));
            let refit = part.deforming.map(|(triangles, made)| {
                let tree = Refit::new(&blocks[root..], root as u32, triangles, part.surfaces.clone());
                Box::new(Deforming { tree, last: None, vertices: Vertices::default(), made, normals: Vec::new() })
            });
            meshes.push(MeshTree {
                root: root as u32,
                first_triangle: first as u32,
                bounds: bounds(&part.accel),
                glows: part.glows,
                refit,
                together: part.together,
            });
        }
        let surfaces = surfaces.iter().map(surfaces::Surface::packed).collect();
        Self { blocks, surfaces, normals, meshes, top_room, cut: false }
    }
}

/// Whether something that shares a tree has gone to another place than the rest of it.
pub(super) fn apart(meshes: &[MeshTree], instances: &[Instance]) -> bool {
    if meshes.iter().all(|m| m.together.is_empty()) {
        return false;
    }
    let mut places = vec![None; meshes.len()];
    for instance in instances {
        if let Some(place) = places.get_mut(instance.mesh) {
            *place = Some(instance.transform);
        }
    }
    meshes.iter().any(|m| m.together.iter().any(|&other| places[other] != places[m.together[0]]))
}

/// A block of a mesh's tree at its place in the texture, its triangles by the numbers that `number`
/// gives them among `surfaces`.
fn moved(block: &Block, root: u32, surfaces: &[surfaces::Surface], number: impl Fn(u32) -> u32) -> Block {
    let mut block = *block;
    if block[3] & NODE != 0 {
        block[3] += root;
    } else if wide::is_leaf(&block) {
        for at in [7, 11] {
            block[at] = block[at] & 0xff00_0000 | number(block[at] & 0x00ff_ffff);
        }
        let open = |word: u32| surfaces[(word & 0x00ff_ffff) as usize].open();
        block[15] = open(block[7]) | open(block[11]) << 8;
    }
    block
}

/// Corners of all that is in a tree; `None` for an empty one.
fn bounds(accel: &Accel) -> Option<(Vec3, Vec3)> {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for block in accel.blocks.iter().filter(|b| wide::is_leaf(b)) {
        for corner in block.chunks_exact(4) {
            let p = Vec3::new(f32::from_bits(corner[0]), f32::from_bits(corner[1]), f32::from_bits(corner[2]));
            (low, high) = (low.min(p), high.max(p));
        }
    }
    (low.x <= high.x).then_some((low, high))
}
