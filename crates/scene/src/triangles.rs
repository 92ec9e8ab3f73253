//! Placed triangles in world space, for whoever looks a scene over.

use bouncelight::scene::{Instance, Scene};
use glam::{Mat4, Vec3};

/// Whose a triangle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Owner {
    /// Index into [`Scene::instances`].
    pub instance: usize,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// Triangles that are enough to know a scene by.
const ENOUGH: usize = 1_000_000;
/// Triangles of an instance that are always taken: walls and furniture have few.
const FEW: usize = 64;

/// Corners, counter-clockwise seen from the front, and whose they are; what refers to something
/// that is not there is left out. All of up to a million triangles; of a scene with more, of each
/// instance every so many.
pub fn of(scene: &Scene) -> impl Iterator<Item = ([Vec3; 3], Owner)> {
    let of_instance = |i: &Instance| scene.meshes.get(i.mesh).map_or(0, |m| m.indices.len() / 3);
    let all: usize = scene.instances.iter().map(of_instance).sum();
    let share = (ENOUGH / scene.instances.len().max(1)).max(FEW);
    let placed = scene.instances.iter().enumerate();
    let placed = placed.filter_map(|(n, i)| Some((n, i, scene.meshes.get(i.mesh)?)));
    placed.flat_map(move |(number, instance, mesh)| {
        let world = Mat4::from_cols_array_2d(&instance.transform);
        let flipped = world.determinant() < 0.0;
        let step = if all <= ENOUGH { 1 } else { (mesh.indices.len() / 3).div_ceil(share).max(1) };
        mesh.indices.chunks_exact(3).step_by(step).filter_map(move |t| {
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

#[cfg(test)]
mod tests {
    use super::*;
    use bouncelight::scene::Mesh;

    fn scene(triangles: usize, instances: usize) -> Scene {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = Mesh { positions, indices: [0, 1, 2].repeat(triangles), ..Default::default() };
        let transform = Mat4::IDENTITY.to_cols_array_2d();
        let one = |i| Instance { name: format!("{i}"), mesh: 0, transform };
        Scene { meshes: vec![mesh], instances: (0..instances).map(one).collect(), ..Default::default() }
    }

    #[test]
    fn all_of_a_scene_are_met_and_enough_of_a_huge_one() {
        assert_eq!(of(&scene(1000, 100)).count(), 100_000);
        let some = of(&scene(10_000, 10_000)).count();
        assert!((ENOUGH / 2..=ENOUGH).contains(&some), "{some} of a hundred million");
        // Each instance is there, and small ones whole.
        assert_eq!(of(&scene(12, 100_000)).count(), 1_200_000);
        let last = of(&scene(10_000, 1000)).last().expect("there are some").1;
        assert_eq!(last.instance, 999);
    }
}
