//! Which meshes are closed: their back faces need not be drawn.

use bouncelight::gpu_scene::is_closed;
use bouncelight::scene::Mesh;
use bouncelight_scene::shapes::{self, Shape};

#[test]
fn bodies_are_closed_and_what_is_open_or_turned_inside_out_is_not() {
    for shape in [Shape::Cube, Shape::Cylinder, Shape::Cone, Shape::UvSphere, Shape::IcoSphere, Shape::Torus] {
        let mesh = shapes::flat(shape);
        assert!(is_closed(&mesh), "{shape:?}");
        let mut open = mesh.clone();
        open.indices.truncate(mesh.indices.len() - 3);
        assert!(!is_closed(&open), "{shape:?} without a triangle");
        let mut inverted = mesh.clone();
        inverted.indices.reverse();
        assert!(!is_closed(&inverted), "{shape:?} inside out");
        let mut twice = mesh.clone();
        twice.indices.extend_from_slice(&mesh.indices);
        assert!(!is_closed(&twice), "{shape:?} twice");
    }
    assert!(!is_closed(&Mesh::default()));
}
