//! Cascades of a sun: squares in the light's plane that cover what the camera sees of the scene.

use super::shadow_view::ShadowViewGpu;
use super::view::View;
use glam::{Mat4, Vec2, Vec3, Vec4};

/// Share of logarithmic over even spacing of the cascades' ends.
const LOGARITHMIC: f32 = 0.7;
/// Texels that a map keeps free around what it covers, for the filter's reach.
const MARGIN: f32 = 12.0;

/// Views for `count` cascades of light along `direction`, near to far, in maps of `size`² texels.
/// `bounds` are the scene's: casters outside the camera's view still count, nothing beyond them does.
pub(super) fn cascades(
    view: &View,
    direction: Vec3,
    bounds: (Vec3, Vec3),
    count: u32,
    size: u32,
    first_layer: u32,
) -> Vec<ShadowViewGpu> {
    let to_light = -direction.normalize_or(Vec3::NEG_Y);
    let (right, up) = to_light.any_orthonormal_pair();
    let corners: [Vec3; 8] = std::array::from_fn(|i| {
        let pick = |bit: usize, low, high| if i & bit == 0 { low } else { high };
        Vec3::new(pick(1, bounds.0.x, bounds.1.x), pick(2, bounds.0.y, bounds.1.y), pick(4, bounds.0.z, bounds.1.z))
    });
    let plane = |p: Vec3| Vec2::new(p.dot(right), p.dot(up));
    let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    let (mut bottom, mut top) = (f32::INFINITY, f32::NEG_INFINITY);
    let mut far = 0.0f32;
    for c in corners {
        (low, high) = (low.min(plane(c)), high.max(plane(c)));
        (bottom, top) = (bottom.min(c.dot(to_light)), top.max(c.dot(to_light)));
        far = far.max(view.depth_of(c));
    }
    // A flat scene seen edge-on still needs a volume.
    let pad = 0.01 + 0.005 * (top - bottom);
    (bottom, top) = (bottom - pad, top + pad);
    let far = far.min(view.far).max(2.0 * view.near);
    // Cascades shorter than this would be finer than any shadow's blur.
    let near = view.near.max(far / 64.0);
    let end = |i: u32| {
        let s = i as f32 / count as f32;
        let (log, even) = (near * (far / near).powf(s), near + (far - near) * s);
        LOGARITHMIC * log + (1.0 - LOGARITHMIC) * even
    };
    (0..count)
        .map(|i| {
            let (center, radius) = slice(view, if i == 0 { view.near } else { end(i) }, end(i + 1));
            let scene = (high - low).max_element();
            // Inside its sphere the slice may turn without changing the map's texels.
            let mut extent = (2.0 * radius).min(scene).max(1e-3);
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
                layer: first_layer + i,
                size: size as f32,
                pad: [0.0; 3],
            }
        })
        .collect()
}

/// Smallest sphere, centred on the axis, around the frustum between two distances; radius rounded up to a few digits.
fn slice(view: &View, z0: f32, z1: f32) -> (Vec3, f32) {
    let k = Vec2::from(view.tan_half).length_squared();
    let z = (0.5 * (z0 + z1) * (1.0 + k)).min(z1);
    let corner = |z1: f32| (k * z1 * z1 + (z1 - z) * (z1 - z)).sqrt();
    let radius = corner(z0).max(corner(z1));
    (view.frustum_point([0.0, 0.0], z), (radius * 16.0).ceil() / 16.0)
}
