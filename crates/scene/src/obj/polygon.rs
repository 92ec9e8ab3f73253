//! Polygons to triangles.

use glam::{DVec2, DVec3};

/// Tests of corners against triangles that all polygons of a file together may take; what is left
/// is cut as if it were convex.
pub(super) const MOST_TESTS: usize = 400_000_000;

/// Cuts polygons, and remembers how much that has taken.
#[derive(Default)]
pub(super) struct Cutter {
    places: Vec<DVec2>,
    turns: Vec<f64>,
    left: Vec<usize>,
    tests: usize,
    /// Polygons that were cut as if they were convex for want of time.
    pub(super) rough: usize,
}

impl Cutter {
    /// The triangles of a polygon, as numbers of its corners. A convex one becomes a fan around its
    /// first corner, any other loses an ear at a time.
    pub(super) fn cut(&mut self, corners: &[[f32; 3]], out: &mut Vec<[usize; 3]>) {
        out.clear();
        let n = corners.len();
        if n < 3 {
            return;
        }
        if n == 3 || !self.flatten(corners) || self.tests > MOST_TESTS {
            self.rough += usize::from(self.tests > MOST_TESTS);
            out.extend((1..n - 1).map(|i| [0, i, i + 1]));
            return;
        }
        self.left.clear();
        self.left.extend(0..n);
        let mut at = 0;
        let mut tried = 0;
        while self.left.len() > 3 {
            let m = self.left.len();
            let [a, b, c] = [at + m - 1, at, at + 1].map(|i| self.left[i % m]);
            // Where nothing is an ear, the polygon crosses itself: any corner is as good.
            if tried < m && self.tests <= MOST_TESTS && !self.is_ear(a, b, c) {
                (at, tried) = ((at + 1) % m, tried + 1);
                continue;
            }
            out.push([a, b, c]);
            self.left.remove(at);
            (at, tried) = (at % (m - 1), 0);
        }
        out.push([self.left[0], self.left[1], self.left[2]]);
    }

    /// Lays a polygon into its plane, counter-clockwise; false where it has none or is convex.
    fn flatten(&mut self, corners: &[[f32; 3]]) -> bool {
        let n = corners.len();
        let place = |i: usize| DVec3::from(corners[i % n].map(f64::from));
        let first = place(0);
        // Twice the area, along the normal.
        let normal: DVec3 = (1..n - 1).map(|i| (place(i) - first).cross(place(i + 1) - first)).sum();
        let turn = |i: usize| (place(i + 1) - place(i)).cross(place(i + 2) - place(i + 1)).dot(normal);
        let bound = -1e-9 * normal.length_squared();
        if !bound.is_finite() || bound == 0.0 || (0..n).all(|i| turn(i) >= bound) {
            return false;
        }
        let Some((x, y)) = normal.try_normalize().map(|n| n.any_orthonormal_pair()) else { return false };
        self.places.clear();
        self.places.extend((0..n).map(|i| place(i) - first).map(|p| DVec2::new(p.dot(x), p.dot(y))));
        self.turns.clear();
        let flat = &self.places;
        self.turns.extend((0..n).map(|i| cross(flat[(i + n - 1) % n], flat[i], flat[(i + 1) % n])));
        true
    }

    /// Whether corner `b` between `a` and `c` can be cut off: it turns the polygon's way, and no
    /// corner that turns the other way is in its triangle.
    fn is_ear(&mut self, a: usize, b: usize, c: usize) -> bool {
        let (p, q, r) = (self.places[a], self.places[b], self.places[c]);
        if cross(p, q, r) <= 0.0 {
            return false;
        }
        self.tests += self.left.len();
        // Corners at the triangle's own places are how a hole hangs on its outline.
        !self.left.iter().any(|&i| {
            let s = self.places[i];
            let inside = || cross(p, q, s) >= 0.0 && cross(q, r, s) >= 0.0 && cross(r, p, s) >= 0.0;
            self.turns[i] < 0.0 && ![p, q, r].contains(&s) && inside()
        })
    }
}

/// Twice the area of a triangle, positive where it is counter-clockwise.
fn cross(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(corners: &[[f32; 2]]) -> Vec<[usize; 3]> {
        let mut out = Vec::new();
        let corners: Vec<[f32; 3]> = corners.iter().map(|c| [c[0], c[1], 0.5]).collect();
        Cutter::default().cut(&corners, &mut out);
        out
    }

    /// Signed areas of the triangles.
    fn areas(corners: &[[f32; 2]]) -> Vec<f64> {
        let at = |i: usize| DVec2::from(corners[i].map(f64::from));
        cut(corners).iter().map(|t| cross(at(t[0]), at(t[1]), at(t[2])) / 2.0).collect()
    }

    #[test]
    fn what_is_convex_stays_a_fan() {
        assert_eq!(cut(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(cut(&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0]]), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(cut(&[[0.0, 0.0]; 5]).len(), 3);
        assert_eq!(cut(&[[0.0, 0.0], [1.0, 0.0]]), [[0; 3]; 0]);
    }

    #[test]
    fn triangles_of_a_concave_polygon_cover_it_once() {
        let dart = [[-1.0, 0.0], [0.0, 0.5], [1.0, 0.0], [0.0, 2.0]];
        let ell = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        // A square with a square hole, hung on the outline.
        let frame = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        let comb: Vec<[f32; 2]> = (0..40)
            .map(|i| [i as f32, if i % 2 == 0 { 0.5 } else { 5.0 }])
            .chain([[39.0, -1.0], [0.0, -1.0]])
            .rev()
            .collect();
        let outline = |c: &[[f32; 2]]| -> f64 {
            let at = |i: usize| DVec2::from(c[i % c.len()].map(f64::from));
            (0..c.len()).map(|i| at(i).perp_dot(at(i + 1)) / 2.0).sum()
        };
        for corners in [&dart[..], &ell, &frame, &comb] {
            for turned in 0..corners.len() {
                let mut corners = corners.to_vec();
                corners.rotate_left(turned);
                for _ in 0..2 {
                    let (areas, whole) = (areas(&corners), outline(&corners));
                    assert_eq!(areas.len(), corners.len() - 2);
                    assert!(areas.iter().all(|a| a * whole >= 0.0), "{areas:?}");
                    assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-9);
                    corners.reverse();
                }
            }
        }
        // Negative control: the fan of the dart turns one of its triangles over.
        let at = |i: usize| DVec2::from(dart[i].map(f64::from));
        assert!(cross(at(0), at(1), at(2)) * cross(at(0), at(2), at(3)) < 0.0);
    }

    #[test]
    fn any_corners_end() {
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 24) as f32 / 16.0
        };
        for n in 3..200 {
            let corners: Vec<[f32; 2]> = (0..n).map(|_| [next(), next()]).collect();
            assert_eq!(cut(&corners).len(), n - 2);
        }
        let far = [[f32::MAX, 0.0], [0.0, f32::MAX], [-f32::MAX, 0.0], [0.0, -1.0]];
        assert_eq!(cut(&far).len(), 2);
    }
}
