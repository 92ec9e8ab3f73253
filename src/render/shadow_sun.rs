//! Cascades of a sun: squares in the light's plane that cover what the camera sees of the scene,
//! each reaching the same number of times as far as the one before it. All lengths are taken from
//! the scene's own extent: a city and a doll's house have the same cascades, and so has a file in
//! millimetres.

use super::shadow_view::ShadowViewGpu;
use super::view::View;
use crate::gpu_scene::Bounds;
use glam::{Mat4, Vec2, Vec3, Vec4};

/// Texels that a map keeps free around what it covers, for the filter's reach.
const MARGIN: f32 = 12.0;
/// The first cascade's beginning as a share of the last one's end: at least this, so that what is
/// right before the eye leaves something for the rest …
const LEAST_NEAR: f32 = 1.0 / 1024.0;
/// … at most this, which all four cascades of a room deserve; and this where nothing is known to be
/// near.
const MOST_NEAR: f32 = 1.0 / 16.0;
const USUAL_NEAR: f32 = 1.0 / 64.0;

/// What cascades are fitted to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage {
    low: Vec3,
    high: Vec3,
    /// The scene's diagonal.
    extent: f32,
    /// Distances along the view axis: what is seen begins behind the first, the first cascade ends
    /// by the second …
    begin: f32,
    near: f32,
    /// … and the last one at this, the scene's farthest corner.
    far: f32,
}

impl Stage {
    /// Of a scene within `bounds`. `nearest`: distance of the nearest thing that is seen, if known.
    /// Distances are in steps, so that a camera that goes about does not stretch the maps all the
    /// time.
    pub fn new(view: &View, bounds: Option<Bounds>, nearest: Option<f32>) -> Self {
        let (low, high) = bounds.map_or((Vec3::ZERO, Vec3::ZERO), |(low, high)| (low.into(), high.into()));
        let extent = low.distance(high).max(1e-12);
        let eye = Vec3::from(view.eye());
        // From the eye to the boxes' nearest and farthest point: turning the head changes neither.
        let outside = eye.distance(eye.clamp(low, high));
        let farthest = (eye - low).abs().max((eye - high).abs()).length();
        // Rounding must not decide about a step.
        let far = extent * (0.5 * (2.0 * (farthest / extent).log2() - 1e-3).ceil()).exp2();
        let (least, most) = (LEAST_NEAR * far, MOST_NEAR * far);
        let near = nearest.unwrap_or(USUAL_NEAR * far).clamp(least, most).max(outside);
        let near = extent * ((near / extent).log2() + 1e-3).floor().exp2();
        // A point in the picture's corner at that distance is nearer along the axis.
        let begin = outside / (1.0 + Vec2::from(view.tan_half).length_squared()).sqrt();
        Self { low, high, extent, begin, near: near.max(view.near), far: far.max(2.0 * view.near) }
    }

    /// Where cascade `i` of `count` ends.
    fn end(&self, i: u32, count: u32) -> f32 {
        self.near * (self.far / self.near).powf(i as f32 / count as f32)
    }
}

/// Views for `count` cascades of light along `direction`, near to far, in maps of `size`² texels.
/// Casters outside the camera's view still count; beyond the scene's bounds there is nothing.
pub(super) fn cascades(view: &View, direction: Vec3, stage: &Stage, count: u32, size: u32) -> Vec<ShadowViewGpu> {
    let to_light = -direction.normalize_or(Vec3::NEG_Y);
    let (right, up) = to_light.any_orthonormal_pair();
    let plane = |p: Vec3| Vec2::new(p.dot(right), p.dot(up));
    let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    let (mut bottom, mut top) = (f32::INFINITY, f32::NEG_INFINITY);
    for i in 0..8 {
        let pick = |bit: usize, low, high| if i & bit == 0 { low } else { high };
        let (a, b) = (stage.low, stage.high);
        let c = Vec3::new(pick(1, a.x, b.x), pick(2, a.y, b.y), pick(4, a.z, b.z));
        (low, high) = (low.min(plane(c)), high.max(plane(c)));
        (bottom, top) = (bottom.min(c.dot(to_light)), top.max(c.dot(to_light)));
    }
    // A flat scene seen edge-on still needs a volume.
    let pad = 0.005 * (top - bottom) + 1e-3 * stage.extent;
    (bottom, top) = (bottom - pad, top + pad);
    (0..count)
        .map(|i| {
            let begin = if i == 0 { view.near.max(stage.begin) } else { stage.end(i, count) };
            let (center, radius) = slice(view, begin.min(stage.end(i + 1, count)), stage.end(i + 1, count));
            let scene = (high - low).max_element();
            // Inside its sphere the slice may turn without changing the map's texels.
            let mut extent = (2.0 * stage.extent * rounded_up(radius / stage.extent)).min(scene);
            extent = extent.max(1e-6 * stage.extent);
            let half = Vec2::splat(0.5 * extent);
            let mut at = plane(center).clamp((low + half).min(high - half), (low + half).max(high - half));
            extent *= size as f32 / (size as f32 - 2.0 * MARGIN).max(1.0);
            let texel = extent / size as f32;
            at = (at / texel).round() * texel;
            let range = top - bottom;
            let row = |axis: Vec3, scale: f32, offset: f32| (axis * scale).extend(-offset * scale);
            let clip_from_world = Mat4::from_cols(
                row(right, 2.0 / extent, at.x),
                row(up, 2.0 / extent, at.y),
                row(to_light, 1.0 / range, bottom),
                Vec4::W,
            )
            .transpose();
            ShadowViewGpu {
                clip_from_world: clip_from_world.to_cols_array_2d(),
                texel,
                range,
                scale: 1.0 / extent,
                layer: 0,
                size: size as f32,
                pad: [0.0; 3],
            }
        })
        .collect()
}

/// Smallest sphere, centred on the axis, around the frustum between two distances.
fn slice(view: &View, z0: f32, z1: f32) -> (Vec3, f32) {
    let k = Vec2::from(view.tan_half).length_squared();
    let z = (0.5 * (z0 + z1) * (1.0 + k)).min(z1);
    let corner = |z1: f32| (k * z1 * z1 + (z1 - z) * (z1 - z)).sqrt();
    (view.frustum_point([0.0, 0.0], z), corner(z0).max(corner(z1)))
}

/// The next number of four binary digits: what only rounding tells apart has the same map.
fn rounded_up(x: f32) -> f32 {
    let step = (x.log2().floor() - 3.0).exp2();
    (x / step * (1.0 - 1e-5)).ceil() * step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    const SUN: Vec3 = Vec3::new(0.3, -1.0, 0.4);

    fn view(eye: Vec3, target: Vec3) -> View {
        View::new(&Camera::look_at(eye.into(), target.into(), 0.9), [1280, 720], [0.0; 2])
    }

    /// Texel, metres, of the first cascade that holds a point; `None` where none does.
    fn texel_at(cascades: &[ShadowViewGpu], p: Vec3) -> Option<f32> {
        let inside = |c: &&ShadowViewGpu| {
            let q = Mat4::from_cols_array_2d(&c.clip_from_world) * p.extend(1.0);
            q.x.abs() < 1.0 && q.y.abs() < 1.0 && q.z > 0.0 && q.z < 1.0
        };
        cascades.iter().find(inside).map(|c| c.texel)
    }

    #[test]
    fn shadows_are_sharp_at_ones_feet_and_reach_the_horizon_whatever_the_unit() {
        // A city of 4 km, seen from the street and from a roof; a doll's house of half a metre.
        let places = [
            (Vec3::new(4000.0, 80.0, 4000.0), Vec3::new(100.0, 1.7, 50.0), Some(1.7)),
            (Vec3::new(4000.0, 80.0, 4000.0), Vec3::new(100.0, 60.0, 50.0), Some(20.0)),
            (Vec3::new(0.5, 0.4, 0.3), Vec3::new(0.25, 0.15, 0.28), Some(0.05)),
            (Vec3::new(0.5, 0.4, 0.3), Vec3::new(0.25, 0.15, 0.28), None),
        ];
        for (size, eye, nearest) in places {
            let made = |k: f32| {
                let v = view(eye * k, (eye + Vec3::new(1.0, -0.3, 1.0)) * k);
                let stage = Stage::new(&v, Some(([0.0; 3], (size * k).into())), nearest.map(|n| n * k));
                cascades(&v, SUN, &stage, 4, 2048)
            };
            let one = made(1.0);
            let texels: Vec<f32> = one.iter().map(|c| c.texel).collect();
            println!("{size}, nearest {nearest:?}: {texels:?}");
            // Towards the horizon, on the ground: never missing, and no coarser than a 40th of the
            // distance.
            let far = (size.x - eye.x).min(size.z - eye.z) / Vec2::new(1.0, 1.0).length();
            for step in 0..=40 {
                let d = far * (0.002f32).powf(1.0 - step as f32 / 40.0);
                if d < nearest.unwrap_or(far / 16.0) {
                    continue;
                }
                let p = eye + Vec3::new(d, -eye.y, d) * 0.99;
                let texel = texel_at(&one, p).unwrap_or_else(|| panic!("no cascade {d} m off"));
                assert!(texel < p.distance(eye) / 40.0, "{texel} m a texel {d} m off");
            }
            for k in [1e-3, 1e3] {
                for (a, b) in one.iter().zip(made(k)) {
                    assert!((b.texel / k / a.texel - 1.0).abs() < 1e-4, "x{k}: {} {}", b.texel, a.texel);
                }
            }
        }
    }

    #[test]
    fn going_about_changes_the_maps_in_whole_texels() {
        let bounds = Some(([0.0; 3], [60.0, 10.0, 60.0]));
        let made = |at: f32| {
            let eye = Vec3::new(20.0 + at, 1.7, 20.0 + 0.3 * at);
            let v = view(eye, eye + Vec3::new(at.sin(), -0.1, at.cos()));
            cascades(&v, SUN, &Stage::new(&v, bounds, Some(1.7)), 4, 1024)
        };
        let first = made(0.0);
        for step in 1..40 {
            for (a, b) in first.iter().zip(made(0.05 * step as f32)) {
                assert_eq!(a.texel, b.texel, "step {step}");
                let shift = 0.5 * a.size * (a.clip_from_world[3][0] - b.clip_from_world[3][0]);
                assert!((shift - shift.round()).abs() < 0.02, "step {step}: {shift} texels");
            }
        }
    }
}
