//! Spheres that stand in for small compact objects where these keep light from what is right beside them.

use super::bodies::Body;

/// Mean distance of an object's surface from the sphere of the same surface, in its radii, up to which the sphere stands in.
/// Of the shapes in paper rooms: balls 0.03 to 0.05, cylinders 0.10, cubes 0.12, cones 0.16; rings, which have 0.23, are not
/// like a ball.
const MISFIT: f32 = 0.2;
/// More spheres than this are not looked at (`gi::contact` has a bit for each in every tile); the largest count.
pub const MOST_SPHERES: u32 = 1024;

/// World-space centre and radius, metres, of the sphere for each of the `small` objects that are like one, largest first; as
/// many as `count`, with spheres of radius 0 at the end.
pub(super) fn spheres(small: &[Body], count: usize) -> Vec<[f32; 4]> {
    let like = small.iter().filter(|b| b.misfit < MISFIT);
    let mut all: Vec<[f32; 4]> =
        like.map(|b| b.centre.extend(b.radius()).to_array()).filter(|s| s.iter().all(|n| n.is_finite())).collect();
    all.sort_by(|a, b| b[3].total_cmp(&a[3]));
    all.resize(count.min(MOST_SPHERES as usize), [0.0; 4]);
    all
}

#[cfg(test)]
mod tests {
    use super::super::bodies::small;
    use super::*;
    use crate::scene::{Instance, Mesh, Scene};
    use glam::{Mat4, Vec3};

    /// A unit cube about the origin.
    fn cube() -> Mesh {
        let positions = (0..8).map(|i| [0, 1, 2].map(|k| (i >> k & 1) as f32 - 0.5)).collect();
        let indices = vec![
            0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5,
        ];
        Mesh { positions, indices, ..Default::default() }
    }

    fn scene(boxes: &[([f32; 3], [f32; 3])]) -> Scene {
        let instance = |(at, size): &([f32; 3], [f32; 3])| Instance {
            name: String::new(),
            mesh: 0,
            transform: (Mat4::from_translation(Vec3::from(*at)) * Mat4::from_scale(Vec3::from(*size)))
                .to_cols_array_2d(),
        };
        Scene { meshes: vec![cube()], instances: boxes.iter().map(instance).collect(), ..Default::default() }
    }

    #[test]
    fn compact_objects_get_a_sphere_of_their_surface_and_others_none() {
        let floor = ([0.0, -1.0, 0.0], [40.0, 0.1, 40.0]);
        let cubes = [([1.0, 2.0, 3.0], [2.0; 3]), ([-5.0, 1.0, 0.0], [1.0; 3])];
        let plate = ([4.0, 1.0, 0.0], [2.0, 0.02, 2.0]);
        let bar = ([8.0, 1.0, 0.0], [0.2, 4.0, 0.2]);
        let flat = ([0.0, 3.0, 0.0], [0.0; 3]);
        let broken = ([f32::NAN; 3], [1.0; 3]);
        let scene = scene(&[floor, cubes[1], plate, bar, cubes[0], flat, broken]);
        let found = spheres(&small(&scene), scene.instances.len());
        assert_eq!(found.len(), 7);
        for (s, (at, size)) in found.iter().zip(cubes) {
            let radius = size[0] * (6.0 / (4.0 * std::f32::consts::PI)).sqrt();
            assert!((s[3] / radius - 1.0).abs() < 1e-5, "{s:?}");
            assert!((Vec3::from_slice(s) - Vec3::from(at)).length() < 1e-5, "{s:?}");
        }
        assert!(found[2..].iter().all(|s| *s == [0.0; 4]), "a floor, a plate and a bar are no balls: {found:?}");
        assert!(spheres(&small(&Scene::default()), 0).is_empty());
    }
}
