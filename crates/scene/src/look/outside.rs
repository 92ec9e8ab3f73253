//! A camera that looks at all of the scene from outside, at an angle from which one sees much of
//! it.

use super::Extent;
use crate::triangles;
use bouncelight::scene::{AlphaMode, Camera, Scene};
use glam::Vec3;
use std::collections::HashSet;

/// Vertical field of view, radians (38°): long enough that nothing near looks stretched.
pub const YFOV: f32 = 0.663;

/// Angle to either side of a straight view, radians (35°).
const THREE_QUARTER: f32 = 0.61;

/// How much more than the scene the picture shows.
const MARGIN: f32 = 1.06;

/// What a scene is like as seen from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Anything.
    Body,
    /// A room that is open to one side, into which one looks straight.
    Boxed,
    /// Rooms without ceilings.
    Roofless,
}

/// Directions from the scene to the eye, and how much each is liked before anything is known of the
/// scene: three-quarter views from a little above, the front first. Straight ones, which look into
/// boxes, and steep ones, which look over walls, have to be clearly deeper.
fn proposals(shape: Shape) -> Vec<(Vec3, f32)> {
    // Into rooms without ceilings one looks from above, steeply enough to see their floors.
    let steep = if shape == Shape::Roofless { 1.6 } else { 0.72 };
    let straight = if shape == Shape::Boxed { 1.2 } else { 0.8 };
    let mut all = Vec::new();
    for (side, front) in [(0.0, 1.25), (1.0, 1.0), (2.0, 0.95), (3.0, 1.0)] {
        for (turn, around) in [(THREE_QUARTER, 1.05), (-THREE_QUARTER, 1.04), (0.0, straight)] {
            for (rise, above) in [(0.36f32, 1.0), (0.0, 0.75), (0.87, steep)] {
                let (sin, cos) = (side * std::f32::consts::FRAC_PI_2 + turn).sin_cos();
                let (up, out) = rise.sin_cos();
                all.push((Vec3::new(sin * out, up, cos * out), front * around * above));
            }
        }
    }
    all
}

/// The direction to the eye that is liked most, given how deep one sees into the scene from there
/// and how many of its things, and that depth as a share of the scene's.
pub fn direction(scene: &Scene, core: &Extent, shape: Shape) -> (Vec3, f32) {
    let views: Vec<_> =
        proposals(shape).into_iter().map(|(back, liking)| (back, liking, seen(scene, core, back))).collect();
    let most = views.iter().map(|(.., seen)| seen.things).max().unwrap_or(1).max(1);
    // Depth alone would take the side of a house whose rooms are open above.
    let score = |liking: f32, seen: Seen| (seen.depth + 0.02) * (0.4 + seen.things as f32 / most as f32) * liking;
    let best = views.into_iter().max_by(|a, b| score(a.1, a.2).total_cmp(&score(b.1, b.2)));
    best.map_or((Vec3::Z, 0.0), |(back, _, seen)| (back, seen.depth))
}

/// The nearest eye that sees all of `core` when it looks along −`back`, in a picture `aspect` times
/// as wide as high;
pub fn camera(scene: &Scene, core: &Extent, back: Vec3, yfov: f32, aspect: f32) -> Camera {
    let (right, up) = axes(back);
    let slope = (0.5 * yfov).tan() / MARGIN;
    let sides = [(right, slope * aspect.clamp(0.05, 20.0)), (up, slope)];
    // A point is seen where |x − offset| ≤ slope · (distance − z): each side of the picture asks
    // for one largest sum.
    let mut sums = [[f32::NEG_INFINITY; 2]; 2];
    let mut nearest = f32::NEG_INFINITY;
    let mut take = |p: Vec3| {
        let p = p.clamp(core.low, core.high) - core.middle();
        let z = p.dot(back);
        nearest = nearest.max(z);
        for ((axis, slope), [plus, minus]) in sides.iter().zip(&mut sums) {
            let (x, z) = (p.dot(*axis), slope * z);
            (*plus, *minus) = (plus.max(z + x), minus.max(z - x));
        }
    };
    for (corners, _) in triangles::of(scene) {
        corners.into_iter().filter(|p| core.holds(*p)).for_each(&mut take);
    }
    // Whatever reaches out of it, its middle is there.
    take(core.middle());
    let distances = sides.iter().zip(&sums).map(|((_, slope), [plus, minus])| 0.5 * (plus + minus) / slope);
    let size = core.size();
    // Flat things have no depth that would hold the eye off.
    let distance = distances.fold(0.0f32, f32::max).max(nearest + 0.05 * size).max(f32::MIN_POSITIVE);
    let offset: Vec3 = sides.iter().zip(&sums).map(|((axis, _), [plus, minus])| axis * (0.5 * (plus - minus))).sum();
    let target = core.middle() + offset;
    let eye = target + back * distance;
    let near = (1e-3 * distance).min(0.5 * (distance - nearest)).max(1e-6 * distance);
    Camera { name: super::FRAMING.to_owned(), near, ..Camera::look_at(eye.into(), target.into(), yfov) }
}

/// Right and up of who looks along −`back`.
pub fn axes(back: Vec3) -> (Vec3, Vec3) {
    let right = if back.y.abs() > 0.999_99 { Vec3::X } else { Vec3::Y.cross(back).normalize() };
    (right, back.cross(right))
}

/// What a parallel view from `back` sees. A small depth buffer without perspective.
fn seen(scene: &Scene, core: &Extent, back: Vec3) -> Seen {
    const SIZE: usize = 40;
    let (right, up) = axes(back);
    let half = (0.5 * (core.high - core.low)).max(Vec3::splat(1e-6 * core.size()));
    let extent = [right, up, back].map(|axis| half.dot(axis.abs()));
    let scale = Vec3::new(0.5 * SIZE as f32 / extent[0], 0.5 * SIZE as f32 / extent[1], 0.5 / extent[2]);
    let mut nearest = vec![(f32::INFINITY, 0); SIZE * SIZE];
    for (corners, owner) in triangles::of(scene) {
        let Some(material) = scene.materials.get(owner.material).filter(|m| m.alpha_mode != AlphaMode::Blend) else {
            continue;
        };
        if !corners.iter().all(|p| core.holds(*p)) {
            continue;
        }
        let [a, b, c] = corners.map(|p| {
            let p = p - core.middle();
            Vec3::new(p.dot(right) + extent[0], p.dot(up) + extent[1], extent[2] - p.dot(back)) * scale
        });
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area == 0.0 || (!material.double_sided && area < 0.0) {
            continue;
        }
        splat(&mut nearest, SIZE, ([a, b, c], owner.instance), area);
    }
    let seen: Vec<(f32, usize)> = nearest.into_iter().filter(|(d, _)| d.is_finite()).collect();
    let things: HashSet<usize> = seen.iter().map(|(_, instance)| *instance).collect();
    let depth = seen.iter().map(|(d, _)| d).sum::<f32>() / seen.len().max(1) as f32;
    Seen { depth, things: things.len() }
}

/// What one sees from a side.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Mean depth behind the near side of the bounding box, as a share of the box's extent along
    /// the view.
    depth: f32,
    /// How many instances.
    things: usize,
}

/// Rasterises one triangle (x, y in pixels, z depth) at pixel centres.
fn splat(nearest: &mut [(f32, usize)], size: usize, ([a, b, c], instance): ([Vec3; 3], usize), area: f32) {
    let low = a.min(b).min(c).max(Vec3::ZERO);
    let high = a.max(b).max(c).min(Vec3::splat(size as f32));
    for y in low.y as usize..(high.y.ceil().max(0.0) as usize).min(size) {
        for x in low.x as usize..(high.x.ceil().max(0.0) as usize).min(size) {
            let p = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0);
            let edge = |u: Vec3, v: Vec3| (v - u).truncate().perp_dot((p - u).truncate()) / area;
            let (wa, wb, wc) = (edge(b, c), edge(c, a), edge(a, b));
            if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                let depth = wa * a.z + wb * b.z + wc * c.z;
                let cell = &mut nearest[y * size + x];
                if depth < cell.0 {
                    *cell = (depth, instance);
                }
            }
        }
    }
}
