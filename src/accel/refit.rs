//! Trees of meshes that deform: the tree that was built stays, its boxes follow the vertices
//! (Lauterbach et al., "RT-DEFORM: Interactive Ray Tracing of Dynamic Scenes using BVHs", RT 2006).
//! Hits are those of a tree built anew; what a far pose costs is looser boxes.

use super::wide::{self, Block, NODE};
use super::{MAX_COORDINATE, surfaces};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;

/// A mesh's tree with what it takes to move it.
#[derive(Debug, Clone)]
pub(super) struct Refit {
    /// As they lie in the texture from `root` on.
    pub blocks: Vec<Block>,
    pub root: u32,
    /// Of each node the children that hold something, a bit each; of a leaf 1 where it holds
    /// triangles.
    held: Vec<u8>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    pub surfaces: Vec<surfaces::Surface>,
    /// Of each block, on the way.
    boxes: Vec<Aabb>,
}

impl Refit {
    /// Of `blocks` that begin at block `root` of the texture.
    pub fn new(blocks: &[Block], root: u32, triangles: Vec<[u32; 3]>, surfaces: Vec<surfaces::Surface>) -> Self {
        let holds = |b: &Block| b[3] & NODE != 0 || wide::is_leaf(b);
        let held = |b: &Block| {
            if b[3] & NODE == 0 {
                return u8::from(wide::is_leaf(b));
            }
            let first = ((b[3] & !NODE) - root) as usize;
            (0..8).map(|i| u8::from(holds(&blocks[first + i])) << i).sum()
        };
        let held = blocks.iter().map(held).collect();
        Self { blocks: blocks.to_vec(), root, held, triangles, surfaces, boxes: Vec::new() }
    }

    /// Moves the corners to `positions`, vertices of the mesh, and all boxes after them. Answers
    /// the box around everything; `None` where there is nothing.
    pub fn follow(&mut self, positions: &[[f32; 3]]) -> Option<(Vec3, Vec3)> {
        self.boxes.clear();
        self.boxes.resize(self.blocks.len(), Aabb::empty());
        // Children lie behind their parents.
        for i in (0..self.blocks.len()).rev() {
            let held = self.held[i];
            let block = &mut self.blocks[i];
            if block[3] & NODE != 0 {
                let first = ((block[3] & !NODE) - self.root) as usize;
                let children: [Option<Aabb>; 8] =
                    std::array::from_fn(|c| (held >> c & 1 != 0).then(|| self.boxes[first + c]));
                let own = children.iter().flatten().fold(Aabb::empty(), |all, one| all.union(one));
                wide::put_boxes(block, &own, &children);
                self.boxes[i] = own;
            } else if held != 0 {
                let corners = corners(block, &self.triangles, positions);
                for (corner, words) in corners.iter().zip(block.chunks_exact_mut(4)) {
                    words[..3].copy_from_slice(&corner.map(f32::to_bits));
                }
                self.boxes[i] = Aabb::from_points(&corners.map(Vec3A::from));
            }
        }
        let whole = self.boxes.first().filter(|b| b.min.x <= b.max.x)?;
        Some((whole.min.into(), whole.max.into()))
    }

    /// Corners of all triangles.
    pub fn corners(&self, positions: &[[f32; 3]]) -> Vec<[[f32; 3]; 3]> {
        self.triangles.iter().map(|t| t.map(|i| positions[i as usize])).collect()
    }
}

/// Corners of the two triangles of a leaf, see [`Pair`](super::pairs::Pair). What cannot be met is
/// put in one point.
fn corners(block: &Block, triangles: &[[u32; 3]], positions: &[[f32; 3]]) -> [[f32; 3]; 4] {
    let corner = |word: u32, k: usize| {
        // How many places the triangle's own corner 0 stands to the right.
        let place = (word >> 24) as usize;
        positions[triangles[(word & 0x00ff_ffff) as usize][(3 - place + k) % 3] as usize]
    };
    let found = [corner(block[7], 0), corner(block[7], 1), corner(block[7], 2), corner(block[11], 2)];
    let usable = found.iter().flatten().all(|c| c.abs() <= MAX_COORDINATE);
    if usable { found } else { [[0.0; 3]; 4] }
}
