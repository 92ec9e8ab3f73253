//! Which object lies under the pointer: every triangle is tried, which takes milliseconds for a
//! click.

use bouncelight::render::View;
use bouncelight::scene::{Scene, bounds::instance_bounds};
use glam::{Mat4, Vec3};

/// Start and direction of the ray through `pixel` (pixels from the top left) of `view`.
pub fn ray(view: &View, pixel: [f32; 2]) -> (Vec3, Vec3) {
    let ndc = [2.0 * pixel[0] / view.size[0] as f32 - 1.0, 1.0 - 2.0 * pixel[1] / view.size[1] as f32];
    let eye = Vec3::from(view.eye());
    (eye, (view.frustum_point(ndc, 1.0) - eye).normalize())
}

/// The nearest instance that the ray hits, and how far away, metres.
pub fn pick(scene: &Scene, origin: Vec3, direction: Vec3) -> Option<(usize, f32)> {
    pick_without(scene, None, origin, direction)
}

/// The same as if instance `left_out` were not there.
pub fn pick_without(scene: &Scene, left_out: Option<usize>, origin: Vec3, direction: Vec3) -> Option<(usize, f32)> {
    let mut nearest: Option<(usize, f32)> = None;
    for (i, instance) in scene.instances.iter().enumerate() {
        if left_out == Some(i) {
            continue;
        }
        let Some(mesh) = scene.meshes.get(instance.mesh) else { continue };
        let Some((low, high)) = instance_bounds(instance, mesh) else { continue };
        if !hits_box(origin, direction, low.into(), high.into()) {
            continue;
        }
        let world = Mat4::from_cols_array_2d(&instance.transform);
        let corner =
            |i: u32| world.transform_point3(mesh.positions.get(i as usize).copied().unwrap_or_default().into());
        for t in mesh.indices.chunks_exact(3) {
            let hit = triangle(origin, direction, [corner(t[0]), corner(t[1]), corner(t[2])]);
            nearest = match (nearest, hit) {
                (best, Some(t)) if best.is_none_or(|(_, b)| t < b) => Some((i, t)),
                (best, _) => best,
            };
        }
    }
    nearest
}

fn hits_box(origin: Vec3, direction: Vec3, low: Vec3, high: Vec3) -> bool {
    // A flat box is met, too.
    let pad = Vec3::splat(1e-5 * low.distance(high));
    let (a, b) = ((low - pad - origin) / direction, (high + pad - origin) / direction);
    let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
    far >= near.max(0.0)
}

/// Distance to a triangle seen from either side (Möller and Trumbore 1997).
fn triangle(origin: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = (origin - a) / determinant;
    let u = s.dot(p);
    let q = s.cross(ab);
    let v = direction.dot(q);
    let t = ac.dot(q);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bouncelight::scene::{Camera, Instance, Material, Mesh};

    fn wall(z: f32) -> Instance {
        let transform = Mat4::from_translation(Vec3::new(0.0, 0.0, z)).to_cols_array_2d();
        Instance { name: format!("at {z}"), mesh: 0, transform }
    }

    #[test]
    fn the_nearest_object_under_the_pointer_is_found() {
        let mesh = Mesh {
            positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        let scene = Scene {
            meshes: vec![mesh],
            materials: vec![Material::default()],
            instances: vec![wall(-4.0), wall(-2.0), wall(5.0)],
            ..Scene::default()
        };
        let camera = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], 1.0);
        let view = View::new(&camera, [200, 100], [0.0; 2]);
        let (origin, direction) = ray(&view, [100.0, 50.0]);
        let (object, distance) = pick(&scene, origin, direction).unwrap();
        assert_eq!(object, 1);
        assert!((distance - 2.0).abs() < 1e-4);
        // Above the tip of the nearer one and below that of none: the corner of the picture hits
        // nothing.
        let (origin, direction) = ray(&view, [1.0, 1.0]);
        assert_eq!(pick(&scene, origin, direction), None);
    }
}
