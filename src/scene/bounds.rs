//! How large a scene is.

use glam::{Mat4, Vec3};

use super::{Instance, Mesh, Scene};

/// Lowest and highest corner of the box, parallel to the axes, around every placed vertex that a
/// triangle uses; `None` where nothing is placed.
pub fn world_bounds(scene: &Scene) -> Option<([f32; 3], [f32; 3])> {
    let boxes = scene.instances.iter().filter_map(|i| instance_bounds(i, scene.meshes.get(i.mesh)?));
    boxes.reduce(|a, b| {
        let low = Vec3::from(a.0).min(b.0.into());
        (low.into(), Vec3::from(a.1).max(b.1.into()).into())
    })
}

/// The same for one instance of `mesh`.
pub fn instance_bounds(instance: &Instance, mesh: &Mesh) -> Option<([f32; 3], [f32; 3])> {
    let world = Mat4::from_cols_array_2d(&instance.transform);
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &index in &mesh.indices {
        let point = world.transform_point3(Vec3::from(*mesh.positions.get(index as usize)?));
        low = low.min(point);
        high = high.max(point);
    }
    (low.x <= high.x).then(|| (low.into(), high.into()))
}

/// As [`instance_bounds`], for whoever draws one pose after the other without the CPU's vertices:
/// of what deforms, the box around all that its joints hold.
pub fn posed_bounds(instance: &Instance, scene: &Scene) -> Option<([f32; 3], [f32; 3])> {
    let Some(deform) = scene.deform_of(instance.mesh) else {
        return instance_bounds(instance, scene.meshes.get(instance.mesh)?);
    };
    let world = Mat4::from_cols_array_2d(&instance.transform);
    let (low, high) = deform.bounds()?;
    let corner = |i: usize| Vec3::from_array([0, 1, 2].map(|k| if i >> k & 1 != 0 { high[k] } else { low[k] }));
    let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| world.transform_point3(corner(i)));
    let folded = |pick: fn(Vec3, Vec3) -> Vec3| corners.into_iter().reduce(pick).map(|v| v.to_array());
    folded(Vec3::min).zip(folded(Vec3::max))
}
