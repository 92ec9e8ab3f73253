//! Every placed triangle in world space.

use super::Scene;
use glam::{Mat4, Vec3};

/// Whose a triangle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Owner {
    /// Index into [`Scene::instances`].
    pub instance: usize,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// Corners, counter-clockwise seen from the front, and whose they are; what refers to something that is not there is
/// left out.
pub fn of(scene: &Scene) -> impl Iterator<Item = ([Vec3; 3], Owner)> {
    let placed = scene.instances.iter().enumerate();
    let placed = placed.filter_map(|(n, i)| Some((n, i, scene.meshes.get(i.mesh)?)));
    placed.flat_map(|(number, instance, mesh)| {
        let world = Mat4::from_cols_array_2d(&instance.transform);
        let flipped = world.determinant() < 0.0;
        mesh.indices.chunks_exact(3).filter_map(move |t| {
            let mut corners = [Vec3::ZERO; 3];
            for (corner, &i) in corners.iter_mut().zip(t) {
                *corner = world.transform_point3(Vec3::from(*mesh.positions.get(i as usize)?));
            }
            if flipped {
                corners.swap(1, 2);
            }
            Some((corners, Owner { instance: number, material: mesh.material }))
        })
    })
}
