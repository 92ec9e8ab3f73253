//! From triangles to blocks.

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::pairs::{self, Pair, Triangle};
use super::{Accel, MAX_COORDINATE, STACK_SIZE, split, wide};

/// Share of the nodes that are put at a better place after clustering: of things that move, whose
/// tree is made in every frame, and of triangles. 0.02, 0.05, 0.2 and 0.5 leave the city's rays
/// 28.5, 28.4, 26.9 and 26.9 blocks.
const REINSERTION_OF_THINGS: f32 = 0.05;
const REINSERTION: f32 = 0.2;

/// Boxes alike beyond which the tree is made by halving.
const MOST_ALIKE: usize = 16;

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
    let [a, b, c] = triangle.map(|p| Vec3::from(p).as_dvec3());
    let area = (b - a).cross(c - a).length_squared();
    if area > 0.0 { Kind::Good } else { Kind::Degenerate }
}

/// Whether rays can meet it.
pub(super) fn is_good(triangle: &Triangle) -> bool {
    matches!(kind(triangle), Kind::Good)
}

/// See [`Accel::build`].
pub(super) fn build(triangles: &[Triangle]) -> Accel {
    build_with(triangles, None)
}

/// The same of triangles that will move: those without area may get one, and corners meet where
/// `places` says so.
pub(super) fn build_deforming(triangles: &[Triangle], places: &pairs::Places) -> Accel {
    build_with(triangles, Some(places))
}

fn build_with(triangles: &[Triangle], places: Option<&pairs::Places>) -> Accel {
    let mut accel = Accel::default();
    let mut kept = Vec::with_capacity(triangles.len());
    for (i, triangle) in triangles.iter().enumerate() {
        match kind(triangle) {
            Kind::Good => kept.push(i as u32),
            Kind::NotFinite => accel.dropped_not_finite += 1,
            Kind::Degenerate if places.is_some() => kept.push(i as u32),
            Kind::Degenerate => accel.dropped_degenerate += 1,
        }
    }
    accel.triangles = kept.len();
    accel.blocks = vec![wide::NOTHING];
    if kept.is_empty() {
        return accel;
    }
    let pairs = pairs::join(triangles, &kept, places);
    drop(kept);
    let (boxes, whose) = match places {
        // What moves takes its boxes with it.
        Some(_) => (pairs.iter().map(Pair::aabb).collect(), (0..pairs.len() as u32).collect::<Vec<_>>()),
        None => split::leaves(&pairs),
    };
    // Clustering makes chains of boxes that are all alike, such as many copies of a mesh in one
    // place, in quadratic time.
    let chained = most_alike(&boxes) > MOST_ALIKE;
    let leaf = |i: usize| wide::leaf_block(&pairs[whose[i] as usize]);
    accel.blocks = wide::blocks(&if chained { halved(&boxes) } else { clustered(&boxes, REINSERTION) }, leaf);
    if wide::depth(&accel.blocks) > STACK_SIZE {
        accel.blocks = wide::blocks(&halved(&boxes), leaf);
    }
    accel
}

/// Blocks of a tree over `boxes`, whose leaves `leaf` makes: for a few thousand things that move,
/// so it is quick to build and no deeper than `levels`.
pub(super) fn over_boxes(boxes: &[Aabb], levels: usize, leaf: impl Fn(usize) -> wide::Block) -> Vec<wide::Block> {
    if boxes.is_empty() {
        return vec![wide::NOTHING];
    }
    if most_alike(boxes) <= MOST_ALIKE {
        let blocks = wide::blocks(&clustered(boxes, REINSERTION_OF_THINGS), &leaf);
        if wide::depth(&blocks) <= levels {
            return blocks;
        }
    }
    wide::blocks(&halved(boxes), leaf)
}

fn clustered(boxes: &[Aabb], reinsertion: f32) -> Bvh2 {
    let order = (0..boxes.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(boxes.len());
    let mut tree = builder.build(PlocSearchDistance::Medium, boxes, order, SortPrecision::U64, 3);
    ReinsertionOptimizer::default().run(&mut tree, reinsertion, None);
    tree
}

/// How many boxes are the same, at most.
fn most_alike(boxes: &[Aabb]) -> usize {
    let key = |b: &Aabb| [b.min.to_array(), b.max.to_array()].map(|p| p.map(f32::to_bits));
    let mut keys: Vec<_> = boxes.iter().map(key).collect();
    keys.sort_unstable();
    keys.chunk_by(|a, b| a == b).map(<[_]>::len).max().unwrap_or(0)
}

/// A tree by halving at the median along the longest axis of the centres: log₂ n levels whatever
/// the boxes are.
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
