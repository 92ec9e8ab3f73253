//! The CPU's part of [`SceneRays`](super::SceneRays): a tree for each mesh, and what rays know of its triangles.

use super::emitters::{self, Glow};
use super::gpu::ROW;
use super::image::Reductions;
use super::refit::Refit;
use super::wide::{Block, NODE, WORDS};
use super::{Accel, AccelError, build, surfaces, threads};
use crate::scene::deform::{Deform, Joint, Vertices};
use crate::scene::{Material, Mesh, Scene, octahedral::octahedral_word};
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
}

/// A tree that follows a pose.
pub(super) struct Deforming {
    pub tree: Refit,
    /// The pose that it is in.
    last: Option<(Vec<Joint>, Vec<f32>)>,
    vertices: Vertices,
    pub normals: Vec<[u32; 4]>,
}

impl MeshTree {
    /// Brings the tree into the pose of `deform`, its mesh's; false where it is in that pose or does not deform.
    pub fn follow(&mut self, deform: &Deform) -> bool {
        let Some(own) = self.refit.as_deref_mut() else { return false };
        if own.last.as_ref().is_some_and(|(joints, weights)| *joints == deform.joints && *weights == deform.weights) {
            return false;
        }
        deform.vertices(&mut own.vertices);
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
}

/// Blocks that the tree over `count` instances can need: a node has a family of eight, and there
/// are fewer nodes than instances.
fn top_blocks(count: usize) -> usize {
    (8 * count + 16).next_multiple_of(ROW as usize)
}

/// What one mesh becomes, on any thread: all that rays know of it, but where it lies among the others.
#[derive(Default, Clone)]
pub(crate) struct MeshPart {
    accel: Arc<Accel>,
    normals: Arc<Vec<[u32; 4]>>,
    surfaces: Vec<surfaces::Surface>,
    glows: Vec<Glow>,
    /// Vertices of each triangle of a mesh that deforms.
    deforming: Option<Vec<[u32; 3]>>,
}

impl MeshPart {
    /// Of a mesh of `scene`, and of how it deforms, if it does. One that disagrees in itself is not met: the
    /// upload of the picture's part refuses it.
    pub fn new(scene: &Scene, mesh: &Mesh, reductions: &Reductions, deform: Option<&Deform>) -> Self {
        if mesh.check(scene.materials.len()).is_err() {
            return Self::default();
        }
        let surfaces = surfaces::of_mesh(scene, mesh, reductions);
        let corners = corners(mesh);
        let glows = emitters::glowing(&surfaces, &corners);
        let triangles = || mesh.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
        let normals = Arc::new(normals(triangles(), &mesh.normals));
        let deform = deform.filter(|d| d.check(mesh).is_ok());
        let accel = match deform.map(|d| d.shape.places()) {
            Some(places) => {
                let places: Vec<_> = triangles().map(|t| t.map(|i| places[i as usize])).collect();
                build::build_deforming(&corners, &places)
            }
            None => build::build(&corners),
        };
        Self { accel: accel.into(), normals, surfaces, glows, deforming: deform.map(|_| triangles().collect()) }
    }

    /// The same triangles, with the corners that it was made of, of another material without pictures.
    pub fn of_material(&self, material: &Material, corners: &[[[f32; 3]; 3]]) -> Self {
        let surfaces = vec![surfaces::plain(material); self.surfaces.len()];
        let glows = emitters::glowing(&surfaces, corners);
        Self { accel: self.accel.clone(), normals: self.normals.clone(), surfaces, glows, deforming: None }
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

impl SceneTrees {
    /// Builds them on all of the machine's threads. `progress` as in
    /// [`SceneRays::with_progress`](super::SceneRays::with_progress).
    pub fn build(scene: &Scene, progress: &(dyn Fn(usize, usize) -> bool + Sync)) -> Result<Self, AccelError> {
        let reductions = Reductions::new(scene);
        let (done, stopped) = (AtomicUsize::new(0), AtomicBool::new(!progress(0, scene.meshes.len())));
        let part = |&(index, mesh): &(usize, &Mesh)| {
            if stopped.load(Ordering::Relaxed) {
                return MeshPart::default();
            }
            let part = MeshPart::new(scene, mesh, &reductions, scene.deform_of(index));
            if !progress(done.fetch_add(1, Ordering::Relaxed) + 1, scene.meshes.len()) {
                stopped.store(true, Ordering::Relaxed);
            }
            part
        };
        let all: Vec<(usize, &Mesh)> = scene.meshes.iter().enumerate().collect();
        let parts = threads::map(&all, |m| m.1.indices.len(), part);
        if stopped.into_inner() {
            return Err(AccelError::Stopped);
        }
        drop(reductions);
        Ok(Self::join(parts, scene.instances.len()))
    }

    /// Lays parts one after the other, behind room for a tree over so many instances.
    pub fn join(parts: Vec<MeshPart>, instances: usize) -> Self {
        let top_room = top_blocks(instances);
        let mut blocks = Vec::with_capacity(top_room + parts.iter().map(|p| p.accel.block_count() + 8).sum::<usize>());
        blocks.resize(top_room, [0; WORDS]);
        let mut surfaces = Vec::with_capacity(parts.iter().map(|p| p.surfaces.len()).sum());
        let mut normals = Vec::with_capacity(surfaces.capacity());
        let mut meshes = Vec::with_capacity(parts.len());
        for part in parts {
            let root = blocks.len().next_multiple_of(8);
            blocks.resize(root, [0; WORDS]);
            blocks.extend(part.accel.blocks.iter().map(|b| moved(b, root as u32, &part.surfaces)));
            let refit = part.deforming.map(|triangles| {
                let tree = Refit::new(&blocks[root..], root as u32, triangles, part.surfaces.clone());
                Box::new(Deforming { tree, last: None, vertices: Vertices::default(), normals: Vec::new() })
            });
            meshes.push(MeshTree {
                root: root as u32,
                first_triangle: surfaces.len() as u32,
                bounds: bounds(&part.accel),
                glows: part.glows,
                refit,
            });
            surfaces.extend(part.surfaces.iter().map(surfaces::Surface::packed));
            normals.extend(part.normals.iter());
        }
        Self { blocks, surfaces, normals, meshes, top_room }
    }
}

/// A block of a mesh's tree at its place in the texture.
fn moved(block: &Block, root: u32, surfaces: &[surfaces::Surface]) -> Block {
    let mut block = *block;
    if block[3] & NODE != 0 {
        block[3] += root;
    } else if block.iter().any(|w| *w != 0) {
        let open = |word: u32| surfaces[(word & 0x00ff_ffff) as usize].open();
        block[15] = open(block[7]) | open(block[11]) << 8;
    }
    block
}

/// Corners of all that is in a tree; `None` for an empty one.
fn bounds(accel: &Accel) -> Option<(Vec3, Vec3)> {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for block in accel.blocks.iter().filter(|b| b[3] & NODE == 0 && b.iter().any(|w| *w != 0)) {
        for corner in block.chunks_exact(4) {
            let p = Vec3::new(f32::from_bits(corner[0]), f32::from_bits(corner[1]), f32::from_bits(corner[2]));
            (low, high) = (low.min(p), high.max(p));
        }
    }
    (low.x <= high.x).then_some((low, high))
}
