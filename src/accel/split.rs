//! Boxes of pairs that fill them badly, cut in two: a long triangle across a room has a box as
//! large as the room, and every ray comes by. Each part of such a box becomes a leaf of its own
//! with the same pair in it (early split clipping, Ernst and Greiner 2007), those first that save
//! most.
//!
//! Counts of blocks below are those that a nearest hit reads (docs/log/2026-11-28-trees.md), each
//! number varied beside the others as they stood when it was chosen.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::splits::split_triangle;

use super::MAX_TRIANGLES;
use super::pairs::Pair;

/// Leaves that are added at most, of all pairs. Of the 28.4 blocks that a ray of the city reads
/// 0.05, 0.2 and 0.5 leave 25.6, 23.9 and 23.9.
const MORE: f32 = 0.2;

/// Both parts have at most this share of the box's area: 0.75 and 0.95 leave 25.1 and 23.9 blocks.
const WORTH: f32 = 0.95;

/// Places along a box's longest side where it may be cut. Along all three 1, 3 and 7 leave 24.9,
/// 24.4 and 23.1 blocks, 7 along the longest 23.2 in half the time.
const CUTS: u8 = 7;

/// Boxes of less than this share of the mean area stay whole: nothing, 0.5, 1 and 2 leave the
/// city's rays 23.2, 23.2, 24.4 and 24.4 blocks, the hotel's 12.1, 11.7, 12.2 and 11.7 of 15.3.
const LEAST: f32 = 0.5;

/// Pairs beyond which nothing is cut: there building is slow as it is, and blocks are numbered in
/// 24 bits.
const MOST: usize = MAX_TRIANGLES as usize / 4;

/// A box's best cut.
struct Cut {
    saved: f32,
    leaf: usize,
    parts: [Aabb; 2],
}

impl PartialEq for Cut {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Cut {}

impl PartialOrd for Cut {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cut {
    fn cmp(&self, other: &Self) -> Ordering {
        self.saved.total_cmp(&other.saved).then(other.leaf.cmp(&self.leaf))
    }
}

/// What of the pair lies in `within` on either side of the plane, boxes grown against the rounding
/// of where edges cross it. `None` where nothing lies on one side.
fn halves(pair: &Pair, within: &Aabb, axis: usize, at: f32) -> Option<[Aabb; 2]> {
    let (mut low_side, mut high_side) = (*within, *within);
    (low_side.max[axis], high_side.min[axis]) = (at, at);
    let slack = Vec3A::splat(4.0 * f32::EPSILON * within.min.abs().max(within.max.abs()).max_element());
    let mut parts = [Aabb::empty(); 2];
    for triangle in [[0, 1, 2, 0], [0, 2, 3, 0]] {
        let (low, high) = split_triangle(axis as u32, at, triangle.map(|k| Vec3A::from(pair.corners[k])));
        for (part, (clipped, side)) in parts.iter_mut().zip([(low, low_side), (high, high_side)]) {
            let inside = Aabb::new(clipped.min - slack, clipped.max + slack).intersection(&side);
            if inside.min.cmple(inside.max).all() {
                *part = part.union(&inside);
            }
        }
    }
    parts.iter().all(|p| p.min.cmple(p.max).all()).then_some(parts)
}

fn best_cut(pair: &Pair, within: &Aabb, leaf: usize, least: f32) -> Option<Cut> {
    let axis = within.largest_axis();
    let (low, high, area) = (within.min[axis], within.max[axis], within.half_area());
    if area < least {
        return None;
    }
    let cuts = (1..=CUTS).map(|n| low + (high - low) * f32::from(n) / f32::from(CUTS + 1));
    let cuts = cuts.filter(|at| low < *at && *at < high).filter_map(|at| {
        let parts = halves(pair, within, axis, at)?;
        Some(Cut { saved: area - parts[0].half_area() - parts[1].half_area(), leaf, parts })
    });
    cuts.max_by(|a, b| a.saved.total_cmp(&b.saved)).filter(|cut| cut.saved >= (1.0 - WORTH) * area)
}

/// The box of each leaf, and which of the pairs is in it.
pub(super) fn leaves(pairs: &[Pair]) -> (Vec<Aabb>, Vec<u32>) {
    let mut boxes: Vec<Aabb> = pairs.iter().map(Pair::aabb).collect();
    let mut whose: Vec<u32> = (0..pairs.len() as u32).collect();
    if pairs.len() > MOST {
        return (boxes, whose);
    }
    let all: f64 = boxes.iter().map(|b| f64::from(b.half_area())).sum();
    let least = LEAST * (all / pairs.len() as f64) as f32;
    let cut = |pair: u32, within: &Aabb, leaf: usize| best_cut(&pairs[pair as usize], within, leaf, least);
    let mut cuts: BinaryHeap<Cut> = (0..pairs.len()).filter_map(|i| cut(i as u32, &boxes[i], i)).collect();
    for _ in 0..(MORE * pairs.len() as f32) as usize {
        let Some(Cut { leaf, parts: [low, high], .. }) = cuts.pop() else { break };
        let (other, pair) = (boxes.len(), whose[leaf]);
        boxes[leaf] = low;
        boxes.push(high);
        whose.push(pair);
        cuts.extend([leaf, other].into_iter().filter_map(|i| cut(pair, &boxes[i], i)));
    }
    (boxes, whose)
}

#[cfg(test)]
mod tests {
    use super::super::pairs;
    use super::*;
    use crate::numbers::SplitMix;

    /// Long triangles that lean, as in a bundle of rods thrown down.
    fn rods() -> Vec<[[f32; 3]; 3]> {
        let mut random = SplitMix::new(5);
        let mut number = || random.next();
        let mut point = |reach: f32, from: [f32; 3]| from.map(|x| x + reach * (number() - 0.5));
        let rod = |_| {
            let (a, b) = (point(10.0, [1000.0; 3]), point(10.0, [1000.0; 3]));
            [a, b, point(0.1, b)]
        };
        (0..200).map(rod).collect()
    }

    fn pairs_of(triangles: &[[[f32; 3]; 3]]) -> Vec<Pair> {
        pairs::join(triangles, &(0..triangles.len() as u32).collect::<Vec<_>>(), None)
    }

    fn area(boxes: &[Aabb]) -> f32 {
        boxes.iter().map(Aabb::half_area).sum()
    }

    #[test]
    fn parts_hold_all_of_a_pair_and_are_smaller() {
        let triangles = rods();
        let pairs = pairs_of(&triangles);
        let (boxes, whose) = leaves(&pairs);
        assert_eq!((boxes.len(), whose.len()), (240, 240));
        let whole: Vec<Aabb> = pairs.iter().map(Pair::aabb).collect();
        // A fifth of them in halves, the largest ones.
        assert!(area(&boxes) < 0.8 * area(&whole), "{} of {}", area(&boxes), area(&whole));
        // Every place of a triangle is in one of its parts; not in the parts of another (control).
        let missing = |shift: usize| {
            let places = (0..pairs.len()).flat_map(|i| (0..=100).map(move |n| (i, n as f32 / 100.0)));
            let lost = places.filter(|&(i, t)| {
                let [a, b, c, _] = pairs[(i + shift) % pairs.len()].corners.map(Vec3A::from);
                let at = a + (b + (c - b) * t - a) * t;
                let inside = |b: &Aabb| b.min.cmple(at).all() && b.max.cmpge(at).all();
                !boxes.iter().zip(&whose).any(|(b, w)| *w as usize == i && inside(b))
            });
            lost.count()
        };
        assert_eq!(missing(0), 0);
        assert!(missing(1) > 10_000);
    }

    #[test]
    fn what_fills_its_box_stays_whole() {
        let square =
            |z: f32| [[[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z]], [[0.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]]];
        let triangles: Vec<_> = (0..20).flat_map(|i| square(i as f32)).collect();
        let (boxes, whose) = leaves(&pairs_of(&triangles));
        assert_eq!((boxes.len(), whose), (20, (0..20).collect()));
    }
}
