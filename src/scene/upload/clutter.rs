//! How thickly small objects fill a scene, for methods that do not ask what stands between two points.

use crate::scene::{Mesh, Scene};
use glam::{Mat4, Vec3};

/// An object is small where its diagonal is below this share of the scene's: walls and floors are not.
const SMALL: f32 = 0.25;
/// Fewer small objects than this say nothing about a mean.
const FEWEST: usize = 8;

/// The small objects of a scene as an even haze.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Clutter {
    /// Share of light that is stopped on each metre inside the box, 1/m; 0 without enough small objects.
    pub extinction: f32,
    /// Lowest corner of the box that they fill, metres.
    pub low: [f32; 3],
    /// Highest corner.
    pub high: [f32; 3],
}

/// An object's world-space box and mean projected area.
struct Body {
    low: Vec3,
    high: Vec3,
    area: f32,
}

/// The clutter of `scene`. A convex body stops, over all directions, a quarter of its surface's area (Cauchy), so n
/// bodies in a volume V take σ = Σ area / (4 V) of the light on each metre. A body's area is at most that of its box.
pub(super) fn clutter(scene: &Scene) -> Clutter {
    let bodies: Vec<Body> = scene
        .instances
        .iter()
        .filter_map(|i| body(scene.meshes.get(i.mesh)?, &Mat4::from_cols_array_2d(&i.transform)))
        .collect();
    let bounds = |few: &mut dyn Iterator<Item = &Body>| {
        few.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), b| (l.min(b.low), h.max(b.high)))
    };
    let (low, high) = bounds(&mut bodies.iter());
    let limit = SMALL * (high - low).length();
    let small: Vec<&Body> = bodies.iter().filter(|b| (b.high - b.low).length() < limit).collect();
    if small.len() < FEWEST {
        return Clutter::default();
    }
    let (low, high) = bounds(&mut small.iter().copied());
    let size = high - low;
    let area: f32 = small.iter().map(|b| b.area).sum();
    // Never denser than one mean free path across the box.
    let extinction = (area / (size.x * size.y * size.z)).min(1.0 / size.length());
    if extinction.is_finite() && extinction > 0.0 {
        Clutter { extinction, low: low.to_array(), high: high.to_array() }
    } else {
        Clutter::default()
    }
}

fn body(mesh: &Mesh, transform: &Mat4) -> Option<Body> {
    let points: Vec<Vec3> = mesh.positions.iter().map(|&p| transform.transform_point3(p.into())).collect();
    let finite = points.iter().filter(|p| p.is_finite());
    let (low, high) = finite.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
    if mesh.indices.is_empty() || low.x > high.x {
        return None;
    }
    let at = |i: u32| points.get(i as usize).copied().unwrap_or(Vec3::NAN);
    let triangle = |t: &[u32]| {
        let (a, b, c) = (at(t[0]), at(t[1]), at(t[2]));
        let area = 0.5 * (b - a).cross(c - a).length();
        if area.is_finite() { area } else { 0.0 }
    };
    let surface: f32 = mesh.indices.chunks_exact(3).map(triangle).sum();
    let d = high - low;
    let of_box = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x);
    Some(Body { low, high, area: 0.25 * surface.min(of_box) })
}
