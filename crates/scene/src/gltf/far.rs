//! Scenes in map coordinates: millions of metres from the origin, where 32-bit floats are half a metre
//! apart. They are moved to the origin while numbers still have 64 bits.

use glam::{DMat4, DVec3, Mat4};

/// Nearer ones stay: floats are less than a hundredth of a metre apart there.
const FAR: f64 = 65_536.0;

/// Where a scene is to have its origin: whole metres at the middle of its meshes where these are far
/// away together, else the file's own.
pub(super) fn origin<'a>(roots: &[gltf::Node<'a>], nodes: usize) -> DVec3 {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut seen = vec![false; nodes];
    let mut stack: Vec<(gltf::Node<'a>, DMat4)> = roots.iter().map(|n| (n.clone(), DMat4::IDENTITY)).collect();
    while let Some((node, parent)) = stack.pop() {
        if std::mem::replace(&mut seen[node.index()], true) {
            continue;
        }
        let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        for primitive in node.mesh().iter().flat_map(|m| m.primitives()) {
            let Some(accessor) = primitive.get(&gltf::Semantic::Positions) else { continue };
            for corner in [accessor.min(), accessor.max()] {
                let place = corner.as_ref().and_then(point).unwrap_or_default();
                let place = world.transform_point3(place);
                if place.is_finite() {
                    (low, high) = (low.min(place), high.max(place));
                }
            }
        }
        stack.extend(node.children().map(|child| (child, world)));
    }
    let (middle, reach) = (0.5 * (low + high), 0.5 * (high - low).max_element());
    let away = middle.abs().max_element();
    if away > FAR && away > reach && away < f64::from(crate::validate::MAX_DISTANCE) {
        middle.round()
    } else {
        DVec3::ZERO
    }
}

fn point(json: &gltf::json::Value) -> Option<DVec3> {
    let [x, y, z] = json.as_array()?.as_slice() else { return None };
    Some(DVec3::new(x.as_f64()?, y.as_f64()?, z.as_f64()?))
}

/// What is told of a scene that was moved.
pub(super) fn told(origin: DVec3) -> String {
    let [x, y, z] = origin.to_array();
    format!(
        "everything is far from the file's origin, where numbers are coarse; places count from ({x}, {y}, {z}) m instead"
    )
}
