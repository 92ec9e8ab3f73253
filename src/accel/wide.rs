//! From a binary tree to blocks of eight children.
//!
//! A block is 16 words, four texels, one cache line: an inner node or a leaf. The eight children of
//! a node are eight blocks in a row, so a child needs no pointer of its own; places without a child
//! hold a leaf that nothing hits.
//!
//! | words | node | leaf |
//! |---|---|---|
//! | 0–2 | corner along x, y, z: 24 bits signed in steps, and the step's exponent in the low 8 | corner 0 |
//! | 3 | first child's block; bit 31 is set | 0 |
//! | 4–7 | along x: low planes of children 0–3, 4–7, then high ones; a byte each, in steps | corner 1; number (24 bits) and place of the first triangle |
//! | 8–11 | along y | corner 2; the same of the second triangle |
//! | 12–15 | along z | corner 3; which share of all rays the triangles let through, in 1/255: the first's in the low byte, the second's above it |
//!
//! A third kind of leaf is an instance of a mesh: words 0–2, 4–6 and 8–10 are the rows of what
//! brings directions from the world into the mesh's space, 12–14 what is then added to places; word
//! 3 is the root of the mesh's tree with bit 30 set, word 7 the number of the mesh's first triangle
//! among those of all meshes, word 11 the number of the instance.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

use super::pairs::Pair;

/// Words of a block.
pub(crate) const WORDS: usize = 16;

/// A block's words.
pub(crate) type Block = [u32; WORDS];

/// A leaf that nothing hits, however drivers round: its corners are one point, and both of its
/// triangles let all rays through.
pub(crate) const NOTHING: Block = {
    let mut block = [0; WORDS];
    block[15] = 0xffff;
    block
};

/// Whether a block is a leaf with triangles, or an instance; no node, no empty place, no mere room.
pub(crate) fn is_leaf(block: &Block) -> bool {
    block[3] & NODE == 0 && *block != NOTHING && *block != [0; WORDS]
}

/// Marks a node.
pub(crate) const NODE: u32 = 1 << 31;

/// Marks an instance.
pub(crate) const INSTANCE: u32 = 1 << 30;

/// Share of a step by which children's boxes grow at least, against rounding in the slab test.
const PAD: f32 = 0.02;

/// The cheapest way to cover a subtree with 1 to 8 blocks.
#[derive(Clone, Copy, Default)]
struct Cover {
    /// Expected visits, times area, with at most k+1 blocks.
    cost: [f32; 8],
    /// How many of the k+1 blocks the left half gets; 0 when one less is as good. For k = 0: of the
    /// eight children of its one block.
    left: [u8; 8],
}

/// Visiting any block costs the same, so a node's cost is its area plus its children's.
fn covers(tree: &Bvh2, order: &[u32]) -> Vec<Cover> {
    let mut covers = vec![Cover::default(); tree.nodes.len()];
    for &index in order.iter().rev() {
        let node = &tree.nodes[index as usize];
        let area = node.aabb().half_area();
        if node.is_leaf() {
            covers[index as usize].cost = [area; 8];
            continue;
        }
        let (a, b) = (covers[node.first_index as usize], covers[node.first_index as usize + 1]);
        let split = |blocks: usize| {
            let costs = (1..blocks).map(|left| (a.cost[left - 1] + b.cost[blocks - left - 1], left as u8));
            costs.min_by(|x, y| x.0.total_cmp(&y.0)).unwrap_or((f32::INFINITY, 0))
        };
        let mut cover = Cover::default();
        let children = split(8);
        (cover.cost[0], cover.left[0]) = (area + children.0, children.1);
        for k in 1..8 {
            let best = split(k + 1);
            (cover.cost[k], cover.left[k]) = if best.0 < cover.cost[k - 1] { best } else { (cover.cost[k - 1], 0) };
        }
        covers[index as usize] = cover;
    }
    covers
}

/// The nodes below `node` that become its block's children.
fn children(tree: &Bvh2, covers: &[Cover], node: u32) -> Vec<u32> {
    let mut found = Vec::with_capacity(8);
    let left = usize::from(covers[node as usize].left[0]);
    let first = tree.nodes[node as usize].first_index;
    let mut open = vec![(first + 1, 8 - left), (first, left)];
    while let Some((node, mut blocks)) = open.pop() {
        let cover = &covers[node as usize];
        while blocks > 1 && cover.left[blocks - 1] == 0 {
            blocks -= 1;
        }
        if blocks == 1 {
            found.push(node);
            continue;
        }
        let left = usize::from(cover.left[blocks - 1]);
        let first = tree.nodes[node as usize].first_index;
        open.extend([(first + 1, blocks - left), (first, left)]);
    }
    found
}

/// Puts children at the places from which a ray's octant tells a good order: place bits 4, 2, 1
/// stand for the high side in x, y, z. Greedy, as Ylitie et al. found good enough.
fn places(tree: &Bvh2, node: u32, children: &[u32]) -> [Option<u32>; 8] {
    let centre = tree.nodes[node as usize].aabb().center();
    let mut costs = Vec::with_capacity(64);
    for &child in children {
        let offset = tree.nodes[child as usize].aabb().center() - centre;
        for place in 0..8usize {
            let sign = |bit: usize| if place & bit != 0 { -1.0 } else { 1.0 };
            costs.push((Vec3A::new(sign(4), sign(2), sign(1)).dot(offset), place, child));
        }
    }
    costs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut placed = [None; 8];
    for (_, place, child) in costs {
        if placed[place].is_none() && !placed.contains(&Some(child)) {
            placed[place] = Some(child);
        }
    }
    placed
}

fn node_block(tree: &Bvh2, node: u32, placed: &[Option<u32>; 8], first: usize) -> Block {
    let mut block = [0; WORDS];
    block[3] = NODE | first as u32;
    let of = |node: u32| *tree.nodes[node as usize].aabb();
    put_boxes(&mut block, &of(node), &placed.map(|child| child.map(of)));
    block
}

/// Writes a node's own box and those of its children, place by place, into its block.
pub(super) fn put_boxes(block: &mut Block, own: &Aabb, children: &[Option<Aabb>; 8]) {
    for axis in 0..3 {
        let (low, high) = (own.min[axis], own.max[axis]);
        // One step on either side is kept free for padding and rounding, and a step is no finer
        // than the corner's 23 bits.
        let finest = low.abs().max(high.abs()) / 4_194_304.0;
        let step = ((high - low) / 252.0).max(finest).max(1e-30).log2().ceil().exp2();
        let corner = (low / step - PAD).floor() - 1.0;
        block[axis] = ((corner as i32) << 8) as u32 | (step.to_bits() >> 23);
        let planes = 4 + 4 * axis;
        block[planes..planes + 4].fill(0);
        for (place, child) in children.iter().enumerate() {
            // Places without a child get a box that is inside out.
            let (mut from, mut to) = (255, 0);
            if let Some(child) = child {
                from = (child.min[axis] / step - corner - PAD).floor().clamp(0.0, 255.0) as u32;
                to = (child.max[axis] / step - corner + PAD).ceil().clamp(0.0, 255.0) as u32;
            }
            let (word, shift) = (planes + place / 4, 8 * (place % 4));
            block[word] |= from << shift;
            block[word + 2] |= to << shift;
        }
    }
}

pub(super) fn leaf_block(pair: &Pair) -> Block {
    let mut block = [0; WORDS];
    for (corner, words) in pair.corners.iter().zip(block.chunks_exact_mut(4)) {
        words[..3].copy_from_slice(&corner.map(f32::to_bits));
    }
    let [(a, a_place), (b, b_place)] = pair.triangles;
    (block[7], block[11]) = (a | a_place << 24, b | b_place << 24);
    block
}

/// The blocks of `tree`, whose leaves `leaf` makes of the number of what is in them; the first one
/// is the root.
pub(super) fn blocks(tree: &Bvh2, leaf: impl Fn(usize) -> Block) -> Vec<Block> {
    // Parents before their children.
    let mut order = vec![0u32];
    let mut at = 0;
    while let Some(&index) = order.get(at) {
        let node = &tree.nodes[index as usize];
        if !node.is_leaf() {
            order.extend([node.first_index, node.first_index + 1]);
        }
        at += 1;
    }
    let covers = covers(tree, &order);
    drop(order);
    let mut blocks = vec![NOTHING];
    // Depth first, so that what is near in space is near in memory.
    let mut open = vec![(0u32, 0usize)];
    while let Some((index, block)) = open.pop() {
        let node = &tree.nodes[index as usize];
        if node.is_leaf() {
            blocks[block] = leaf(tree.primitive_indices[node.first_index as usize] as usize);
            continue;
        }
        let placed = places(tree, index, &children(tree, &covers, index));
        // Families start at multiples of eight; the root's has only the root.
        let first = blocks.len().next_multiple_of(8);
        blocks.resize(first + 8, NOTHING);
        blocks[block] = node_block(tree, index, &placed, first);
        open.extend(placed.iter().enumerate().filter_map(|(place, child)| Some(((*child)?, first + place))));
    }
    blocks
}

/// Levels of the tree, leaves counted.
pub(super) fn depth(blocks: &[Block]) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0usize, 1usize)];
    while let Some((index, level)) = open.pop() {
        deepest = deepest.max(level);
        let link = blocks[index][3];
        if link & NODE != 0 {
            let first = (link & !NODE) as usize;
            open.extend((first..first + 8).map(|child| (child, level + 1)));
        }
    }
    deepest
}
