//! Triangles that share an edge, joined two by two: a leaf of the tree is one such pair.

use glam::Vec3A;
use obvhs::aabb::Aabb;

use super::hash::{self, Map};

/// Three corners.
pub(super) type Triangle = [[f32; 3]; 3];

/// One triangle, or two that share the edge from the first corner to the third.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    /// The first triangle is corners 0, 1, 2; the second is 0, 2, 3. A single triangle has its
    /// third corner twice.
    pub corners: [[f32; 3]; 4],
    /// Number of each triangle, and how many places its own corner 0 stands to the right of this
    /// pair's corner 0.
    pub triangles: [(u32, u32); 2],
}

impl Pair {
    pub fn aabb(&self) -> Aabb {
        Aabb::from_points(&self.corners.map(Vec3A::from))
    }

    fn single(triangle: &Triangle, index: u32) -> Self {
        let [a, b, c] = *triangle;
        Self { corners: [a, b, c, c], triangles: [(index, 0); 2] }
    }

    /// `first` and `second` share the edge that starts at corner `i` of the first and at corner `j`
    /// of the second, seen from each in its own sense of rotation, so that each one's end is the
    /// other's start.
    fn joined(first: (&Triangle, u32, usize), second: (&Triangle, u32, usize)) -> Self {
        let ((a, a_index, i), (b, b_index, j)) = (first, second);
        // The first triangle turned so that the shared edge is from its third corner to its first.
        let at = |k: usize| a[(i + 1 + k) % 3];
        let corners = [at(0), at(1), at(2), b[(j + 2) % 3]];
        // The second one starts at the same corner, which is where the shared edge begins for it.
        let place = |start: usize| (3 - start as u32 % 3) % 3;
        Self { corners, triangles: [(a_index, place(i + 1)), (b_index, place(j))] }
    }
}

/// Pairs are made whose box has at most this share of the area of both triangles' boxes. Tried from
/// 0.6 to 9 on rooms and spheres: 0.9 visits least; at 1 the corners of cubes are joined, whose box
/// is mostly empty.
const WORTH: f32 = 0.9;

type Edge = [[u32; 3]; 2];

fn edge(triangle: &Triangle, start: usize) -> Edge {
    [triangle[start], triangle[(start + 1) % 3]].map(|p| p.map(f32::to_bits))
}

/// What tells corners apart that are in one place now and may not be later: a number for each.
pub(super) type Places = [[u32; 3]];

fn half_area(triangles: &[&Triangle]) -> f32 {
    triangles.iter().flat_map(|t| t.iter()).fold(Aabb::empty(), |mut sum, p| *sum.extend(Vec3A::from(*p))).half_area()
}

/// Joins the triangles `kept`. Each takes the free neighbour with which it fills the smallest box,
/// if visiting that box costs less than visiting both triangles' own. Corners are the same where
/// they are in one place, or where `places` says so.
pub(super) fn join(triangles: &[Triangle], kept: &[u32], places: Option<&Places>) -> Vec<Pair> {
    let edge_of = |index: u32, start: usize| match places {
        Some(places) => [start, (start + 1) % 3].map(|k| [places[index as usize][k], 0, 0]),
        None => edge(&triangles[index as usize], start),
    };
    let mut owners: Map<Edge, (u32, usize)> = hash::map(kept.len() * 3);
    for &index in kept {
        for start in 0..3 {
            owners.insert(edge_of(index, start), (index, start));
        }
    }
    let mut taken = vec![false; triangles.len()];
    let mut pairs = Vec::with_capacity(kept.len() * 5 / 8);
    for &index in kept {
        if std::mem::replace(&mut taken[index as usize], true) {
            continue;
        }
        let own = &triangles[index as usize];
        let candidates = (0..3).filter_map(|start| {
            let [from, to] = edge_of(index, start);
            let &(other, other_start) = owners.get(&[to, from])?;
            let theirs = &triangles[other as usize];
            let area = half_area(&[own, theirs]);
            let worth = !taken[other as usize] && area <= WORTH * (half_area(&[own]) + half_area(&[theirs]));
            worth.then_some((area, start, other, other_start))
        });
        match candidates.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, start, other, other_start)) => {
                taken[other as usize] = true;
                let second = (&triangles[other as usize], other, other_start);
                pairs.push(Pair::joined((own, index, start), second));
            }
            None => pairs.push(Pair::single(own, index)),
        }
    }
    pairs
}
