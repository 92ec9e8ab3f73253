//! From triangles to the words that traversal reads.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::cwbvh::node::CwBvhNode;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::{Accel, MAX_COORDINATE, NODE_WORDS, STACK_SIZE, TRIANGLE_WORDS};

/// Share of a quantisation step by which boxes grow at least, against rounding in the slab test.
const PAD: f32 = 0.02;

/// Share of the nodes that are put at a better place after clustering.
const REINSERTION: f32 = 0.05;

/// Boxes alike beyond which the tree is made by halving.
const MOST_ALIKE: usize = 16;

type Triangle = [[f32; 3]; 3];

/// What is wrong with a triangle, if anything.
enum Kind {
    Good,
    NotFinite,
    Degenerate,
}

fn kind(triangle: &Triangle) -> Kind {
    let usable = |x: &f32| x.abs() <= MAX_COORDINATE;
    if !triangle.iter().flatten().all(usable) {
        return Kind::NotFinite;
    }
    let [a, b, c] = triangle.map(|p| glam::Vec3::from(p).as_dvec3());
    let area = (b - a).cross(c - a).length_squared();
    if area > 0.0 { Kind::Good } else { Kind::Degenerate }
}

fn aabb(triangle: &Triangle) -> Aabb {
    Aabb::from_points(&triangle.map(Vec3A::from))
}

/// See [`Accel::build`].
pub(super) fn build(triangles: &[Triangle]) -> Accel {
    let mut accel = Accel::default();
    let mut kept = Vec::with_capacity(triangles.len());
    for (i, triangle) in triangles.iter().enumerate() {
        match kind(triangle) {
            Kind::Good => kept.push(i as u32),
            Kind::NotFinite => accel.dropped_not_finite += 1,
            Kind::Degenerate => accel.dropped_degenerate += 1,
        }
    }
    if kept.is_empty() {
        accel.nodes = vec![[0; NODE_WORDS]];
        return accel;
    }
    let tree = tree(triangles, kept);
    accel.triangles = tree.primitive_indices.iter().map(|&i| triangle_words(&triangles[i as usize], i)).collect();
    accel.nodes = encode(&tree, triangles);
    accel
}

fn tree(triangles: &[Triangle], kept: Vec<u32>) -> CwBvh {
    let boxes: Vec<Aabb> = kept.iter().map(|&i| aabb(&triangles[i as usize])).collect();
    let order = (0..kept.len() as u32).collect::<Vec<_>>();
    // Clustering makes chains of boxes that are all alike, such as many copies of a mesh in one place, in quadratic time.
    let mut bvh2 = if most_alike(&boxes) > MOST_ALIKE {
        halved(&boxes)
    } else {
        PlocBuilder::with_capacity(kept.len()).build(PlocSearchDistance::Medium, &boxes, order, SortPrecision::U64, 3)
    };
    ReinsertionOptimizer::default().run(&mut bvh2, REINSERTION, None);
    let mut tree = bvh2_to_cwbvh(&bvh2, 3, true, true);
    if tree_depth(&tree.nodes) > STACK_SIZE {
        tree = bvh2_to_cwbvh(&halved(&boxes), 3, true, true);
    }
    for index in &mut tree.primitive_indices {
        *index = kept[*index as usize];
    }
    tree
}

/// How many boxes are the same, at most.
fn most_alike(boxes: &[Aabb]) -> usize {
    let key = |b: &Aabb| [b.min.to_array(), b.max.to_array()].map(|p| p.map(f32::to_bits));
    let mut keys: Vec<_> = boxes.iter().map(key).collect();
    keys.sort_unstable();
    keys.chunk_by(|a, b| a == b).map(<[_]>::len).max().unwrap_or(0)
}

/// A tree by halving at the median of the centres' longest axis: log₂ n levels whatever the triangles are.
fn halved(boxes: &[Aabb]) -> Bvh2 {
    let mut order = (0..boxes.len() as u32).collect::<Vec<_>>();
    let mut nodes = Vec::with_capacity(2 * boxes.len());
    nodes.push(Bvh2Node::default());
    let mut open = vec![(0usize, 0usize, boxes.len())];
    while let Some((node, from, to)) = open.pop() {
        let own = order[from..to].iter().fold(Aabb::empty(), |sum, &i| sum.union(&boxes[i as usize]));
        if to - from == 1 {
            nodes[node] = Bvh2Node::new(own, 1, from as u32);
            continue;
        }
        let centres = order[from..to].iter().fold(Aabb::empty(), |mut sum, &i| *sum.extend(boxes[i as usize].center()));
        let (axis, middle) = (centres.largest_axis(), (to - from) / 2);
        let key = |i: &u32| boxes[*i as usize].center_axis(axis);
        order[from..to].select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let first = nodes.len();
        nodes.resize(first + 2, Bvh2Node::default());
        nodes[node] = Bvh2Node::new(own, 0, first as u32);
        open.extend([(first, from, from + middle), (first + 1, from + middle, to)]);
    }
    Bvh2 { nodes, primitive_indices: order, children_are_ordered_after_parents: true, ..Default::default() }
}

fn triangle_words(triangle: &Triangle, index: u32) -> [u32; TRIANGLE_WORDS] {
    let [a, b, c] = triangle.map(|p| p.map(f32::to_bits));
    [a[0], a[1], a[2], index, b[0], b[1], b[2], 0, c[0], c[1], c[2], 0]
}

/// Quantises the children's boxes again, a little larger than obvhs does: neighbours must overlap for a ray along their border.
fn encode(tree: &CwBvh, triangles: &[Triangle]) -> Vec<[u32; NODE_WORDS]> {
    let exact = tree.exact_node_aabbs.as_deref().unwrap_or_default();
    let nodes = tree.nodes.iter().zip(exact).map(|(node, own)| {
        let mut node = *node;
        let children: [Option<Aabb>; 8] = std::array::from_fn(|child| {
            if node.is_child_empty(child) {
                return None;
            }
            if !node.is_leaf(child) {
                return Some(exact[node.child_node_index(child) as usize]);
            }
            let (first, count) = node.child_primitives(child);
            let leaf = &tree.primitive_indices[first as usize..(first + count) as usize];
            leaf.iter().map(|&i| aabb(&triangles[i as usize])).reduce(|a, b| a.union(&b))
        });
        requantise(&mut node, own, &children);
        bytemuck::cast(node)
    });
    nodes.collect()
}

fn requantise(node: &mut CwBvhNode, own: &Aabb, children: &[Option<Aabb>; 8]) {
    for axis in 0..3 {
        // One step below and above the box are kept free for the padding.
        // A flat box gets a thickness of a few units in the last place of its coordinates.
        let extent =
            (own.max[axis] - own.min[axis]).max(own.max[axis].abs().max(own.min[axis].abs()) * 3e-5).max(1e-30);
        let step = (extent / 253.0).log2().ceil().exp2();
        let origin = own.min[axis] - step;
        node.p[axis] = origin;
        node.e[axis] = (step.to_bits() >> 23) as u8;
        for (slot, child) in children.iter().enumerate() {
            let Some(child) = child else { continue };
            let low = ((child.min[axis] - origin) / step - PAD).floor().clamp(0.0, 255.0) as u8;
            let high = ((child.max[axis] - origin) / step + PAD).ceil().clamp(0.0, 255.0) as u8;
            let (lows, highs) = match axis {
                0 => (&mut node.child_min_x, &mut node.child_max_x),
                1 => (&mut node.child_min_y, &mut node.child_max_y),
                _ => (&mut node.child_min_z, &mut node.child_max_z),
            };
            (lows[slot], highs[slot]) = (low, high);
        }
    }
}

/// Levels below and with the root.
pub(super) fn depth(nodes: &[[u32; NODE_WORDS]]) -> usize {
    tree_depth(bytemuck::cast_slice(nodes))
}

fn tree_depth(nodes: &[CwBvhNode]) -> usize {
    let mut levels = vec![1u8; nodes.len()];
    // Children come after their parents.
    for (i, node) in nodes.iter().enumerate() {
        for child in 0..node.imask.count_ones() {
            levels[(node.child_base_idx + child) as usize] = levels[i].saturating_add(1);
        }
    }
    levels.into_iter().max().unwrap_or(0).into()
}
