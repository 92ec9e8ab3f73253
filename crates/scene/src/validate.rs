//! Whether what was loaded can be drawn at all.

use super::SceneError;
use bouncelight::scene::{Scene, bounds};
use glam::{DMat4, DVec3, Mat4};
use std::path::Path;

/// How far from the origin, metres, something may be: products of three such lengths are still
/// finite floats.
pub const MAX_DISTANCE: f32 = 1e12;

/// Leaves out what lies beyond [`MAX_DISTANCE`], with a warning.
///
/// # Errors
/// [`SceneError::NothingToDraw`] where no triangle is left that has an area.
pub(crate) fn validate(scene: &mut Scene, path: &Path) -> Result<(), SceneError> {
    let far = |v: f32| !v.is_finite() || v.abs() > MAX_DISTANCE;
    let lost: Vec<bool> = scene
        .instances
        .iter()
        .map(|i| {
            let Some(mesh) = scene.meshes.get(i.mesh).filter(|m| !m.indices.is_empty()) else { return false };
            bounds::instance_bounds(i, mesh).is_none_or(|(low, high)| low.iter().chain(&high).any(|v| far(*v)))
        })
        .collect();
    for (instance, _) in scene.instances.iter().zip(&lost).filter(|(_, lost)| **lost) {
        scene.warnings.push(format!(
            "{}: '{}' reaches more than {MAX_DISTANCE:e} m from the origin and is left out",
            path.display(),
            instance.name
        ));
    }
    let mut kept = lost.iter().map(|l| !l);
    scene.instances.retain(|_| kept.next().unwrap_or(true));
    if let Some(rig) = &mut scene.rig {
        let mut kept = lost.iter().map(|l| !l);
        rig.instances.retain(|_| kept.next().unwrap_or(true));
    }
    if has_area(scene) {
        return Ok(());
    }
    let reason = if lost.contains(&true) {
        format!("everything reaches more than {MAX_DISTANCE:e} m from the origin; is a unit or an exponent wrong?")
    } else if scene.instances.is_empty() {
        "no triangle is placed in the scene".to_owned()
    } else {
        "no triangle has an area; is a scale zero?".to_owned()
    };
    let because = scene.warnings.first().map(|w| format!(" (first warning: {w})")).unwrap_or_default();
    Err(SceneError::NothingToDraw { path: path.to_owned(), reason: reason + &because })
}

/// Whether any placed triangle has an area. Stops at the first.
fn has_area(scene: &Scene) -> bool {
    scene.instances.iter().any(|instance| {
        let Some(mesh) = scene.meshes.get(instance.mesh) else { return false };
        let world: DMat4 = Mat4::from_cols_array_2d(&instance.transform).as_dmat4();
        mesh.indices.chunks_exact(3).any(|t| {
            let [a, b, c] = [0, 1, 2].map(|k| {
                let [x, y, z] = mesh.positions[t[k] as usize];
                world.transform_point3(DVec3::new(x.into(), y.into(), z.into()))
            });
            (b - a).cross(c - a).length_squared() > 0.0
        })
    })
}
