//! The scene's small objects, which are too many to ask one by one for large distances and too small for surfels.

use crate::scene::{Mesh, Scene};
use glam::{Mat4, Vec3};

/// An object is small where its diagonal is below this share of the scene's: walls and floors are not.
const SMALL: f32 = 0.25;
/// Meshes with no more triangles than this are measured at 16 points a triangle, others at one.
const COARSE: usize = 256;

/// A small object in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Body {
    /// Corners of its box, metres.
    pub low: Vec3,
    pub high: Vec3,
    /// Mean of its surface, metres.
    pub centre: Vec3,
    /// Surface, m².
    pub surface: f32,
    /// Mean distance of its surface from the sphere of the same surface around `centre`, in radii of that sphere.
    pub misfit: f32,
}

impl Body {
    /// Radius of the sphere that has as much surface, metres.
    pub fn radius(&self) -> f32 {
        (self.surface / (4.0 * std::f32::consts::PI)).sqrt()
    }

    fn diagonal(&self) -> f32 {
        (self.high - self.low).length()
    }
}

/// The small objects of `scene`.
pub(super) fn small(scene: &Scene) -> Vec<Body> {
    let all: Vec<Body> = scene
        .instances
        .iter()
        .filter_map(|i| body(scene.meshes.get(i.mesh)?, &Mat4::from_cols_array_2d(&i.transform)))
        .collect();
    let (low, high) = bounds(&all);
    let limit = SMALL * (high - low).length();
    all.into_iter().filter(|b| b.diagonal() < limit).collect()
}

/// The box of all.
pub(super) fn bounds(bodies: &[Body]) -> (Vec3, Vec3) {
    bodies.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), b| (l.min(b.low), h.max(b.high)))
}

fn body(mesh: &Mesh, transform: &Mat4) -> Option<Body> {
    let points: Vec<Vec3> = mesh.positions.iter().map(|&p| transform.transform_point3(p.into())).collect();
    let finite = points.iter().filter(|p| p.is_finite());
    let (low, high) = finite.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
    if mesh.indices.is_empty() || low.x > high.x {
        return None;
    }
    let at = |i: u32| points.get(i as usize).copied().unwrap_or(Vec3::NAN);
    let triangles = || {
        mesh.indices.chunks_exact(3).filter_map(|t| {
            let [a, b, c] = [at(t[0]), at(t[1]), at(t[2])];
            let area = 0.5 * (b - a).cross(c - a).length();
            area.is_finite().then_some(([a, b, c], area))
        })
    };
    let (surface, moment) =
        triangles().fold((0.0, Vec3::ZERO), |(s, m), ([a, b, c], area)| (s + area, m + area / 3.0 * (a + b + c)));
    let empty = Body { low, high, centre: 0.5 * (low + high), surface: 0.0, misfit: f32::INFINITY };
    if surface <= 0.0 {
        return Some(empty);
    }
    let mut body = Body { centre: moment / surface, surface, ..empty };
    let parts = if mesh.indices.len() <= 3 * COARSE { 4 } else { 1 };
    let off = |p: Vec3| ((p - body.centre).length() - body.radius()).abs();
    let sum: f32 = triangles()
        .map(|(corners, area)| area * inside(corners, parts).map(off).sum::<f32>() / (parts * parts) as f32)
        .sum();
    body.misfit = sum / (surface * body.radius());
    Some(body)
}

/// Middles of the `parts`² equal triangles that a triangle is made of.
fn inside([a, b, c]: [Vec3; 3], parts: usize) -> impl Iterator<Item = Vec3> {
    let step = 1.0 / parts as f32;
    let at = move |u: f32, v: f32| a + step * (u * (b - a) + v * (c - a));
    (0..parts).flat_map(move |i| {
        let upright = (0..parts - i).map(move |j| at(i as f32 + 1.0 / 3.0, j as f32 + 1.0 / 3.0));
        let inverted = (0..parts - i - 1).map(move |j| at(i as f32 + 2.0 / 3.0, j as f32 + 2.0 / 3.0));
        upright.chain(inverted)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_triangle_have_its_middle() {
        let corners = [Vec3::ZERO, Vec3::new(3.0, 0.0, 0.0), Vec3::new(0.0, 6.0, 0.0)];
        for parts in [1, 2, 4] {
            let all: Vec<Vec3> = inside(corners, parts).collect();
            assert_eq!(all.len(), parts * parts);
            let mean = all.iter().sum::<Vec3>() / all.len() as f32;
            assert!((mean - Vec3::new(1.0, 2.0, 0.0)).length() < 1e-5, "{parts}: {mean}");
            assert!(all.iter().all(|p| p.x > 0.0 && p.y > 0.0 && p.x / 3.0 + p.y / 6.0 < 1.0));
        }
    }
}
