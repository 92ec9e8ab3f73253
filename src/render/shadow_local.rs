//! Perspective shadow views of spot lights (one map) and of point lights and wide spots (six faces
//! of a cube).

use super::shadow_view::ShadowViewGpu;
use glam::{Mat4, Vec3, Vec4};

/// What faces and cones show beyond their edge, in tangent units, so that filters never reach
/// outside. `LOCAL_SEARCH` in `shaders/lib/shadow_maps.wgsl` stays below it.
const MARGIN: f32 = 0.15;

/// Near plane of lamps without a size, as a share of the scene's extent: floats keep all distances
/// beyond it.
const LEAST_NEAR: f32 = 1e-6;

/// Near plane of a lamp: what is inside the lamp itself casts no shadow. `extent`: the scene's
/// diagonal.
pub(super) fn near(radius: f32, extent: f32) -> f32 {
    (0.5 * radius).max(LEAST_NEAR * extent).max(f32::MIN_POSITIVE)
}

/// The view of a spot light along `direction` with half angle `outer` (radians).
pub(super) fn spot(position: Vec3, direction: Vec3, outer: f32, near: f32, size: u32) -> ShadowViewGpu {
    let forward = direction.normalize_or(Vec3::NEG_Y);
    let (right, up) = forward.any_orthonormal_pair();
    perspective(position, [right, up, forward], outer.tan(), near, size)
}

/// Views along +X, −X, +Y, −Y, +Z, −Z in this order.
pub(super) fn cube(position: Vec3, near: f32, size: u32) -> [ShadowViewGpu; 6] {
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    axes.map(|axis| {
        let (right, up) = axis.any_orthonormal_pair();
        perspective(position, [right, up, axis], 1.0, near, size)
    })
}

fn perspective(p: Vec3, axes: [Vec3; 3], tangent: f32, near: f32, size: u32) -> ShadowViewGpu {
    let focal = 1.0 / (tangent + MARGIN);
    let row = |axis: Vec3, scale: f32| (axis * scale).extend(-axis.dot(p) * scale);
    let clip_from_world =
        Mat4::from_cols(row(axes[0], focal), row(axes[1], focal), Vec4::new(0.0, 0.0, 0.0, near), row(axes[2], 1.0))
            .transpose();
    ShadowViewGpu {
        clip_from_world: clip_from_world.to_cols_array_2d(),
        texel: 2.0 / (focal * size as f32),
        range: near,
        scale: 0.5 * focal,
        layer: 0,
        size: size as f32,
        pad: [0.0; 3],
    }
}
