//! Morph targets of files.

use super::files::load;
use crate::figures::also;
use crate::glb::Glb;
use bouncelight::scene::Scene;
use glam::Vec3;
use serde_json::json;

/// A triangle with two targets; the second is sparse.
pub fn morphs() -> Glb {
    let mut glb = Glb::triangle();
    let up = glb.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0]);
    let (index, value) = (glb.view(&[1, 0, 0, 0]), glb.view(bytemuck::cast_slice(&[0.5f32, 0.0, 0.0])));
    let sparse = json!({"count": 1, "indices": {"bufferView": index, "componentType": 5121},
        "values": {"bufferView": value}});
    let accessors = glb.json["accessors"].as_array_mut().expect("accessors");
    accessors.push(json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse}));
    let aside = accessors.len() - 1;
    let turned = glb.floats("VEC3", &[1.0, 0.0, 0.0].repeat(3));
    let normals = glb.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    glb.attribute("NORMAL", normals);
    glb.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{"POSITION": up, "NORMAL": turned}, {"POSITION": aside}]);
    glb
}

#[test]
fn morph_targets_add_up_linearly() {
    let expected = |a: f32, b: f32| [[0.0, 0.0, a], [1.0 + 0.5 * b, 0.0, 0.0], [0.0, 1.0, 2.0 * a]];
    let near = |scene: &Scene, a: f32, b: f32| {
        let off = |(p, q): (&[f32; 3], [f32; 3])| Vec3::from(*p).distance(q.into());
        let far = scene.meshes[0].positions.iter().zip(expected(a, b)).map(off).fold(0.0, f32::max);
        let n = Vec3::from(scene.meshes[0].normals[0]);
        far.max(n.distance(Vec3::new(a, 0.0, 1.0).normalize()))
    };
    let mut glb = morphs();
    assert!(near(&load(&glb), 0.0, 0.0) < 1e-6);
    glb.json["meshes"][0]["weights"] = json!([0.25, 0.5]);
    assert!(near(&load(&glb), 0.25, 0.5) < 1e-6, "the mesh's weights");
    glb.json["nodes"][0]["weights"] = json!([-1.0, 2.0]);
    let scene = load(&glb);
    assert!(near(&scene, -1.0, 2.0) < 1e-6, "the node's weights");
    // Negative control.
    assert!(near(&scene, -0.9, 2.0) > 0.05);

    let target = json!({"node": 0, "path": "weights"});
    also(&mut glb, target, "SCALAR", &[0.0, 2.0], &[0.0, 1.0, 1.0, -1.0], "LINEAR");
    let mut scene = load(&glb);
    for t in [0.0f32, 0.5, 1.0, 2.0] {
        assert!(scene.pose(0, t));
        assert!(near(&scene, t / 2.0, 1.0 - t) < 1e-6, "at {t}");
    }
}

/// Where a mesh has no normals, those of its triangles follow the targets.
#[test]
fn flat_triangles_keep_facing_where_they_face() {
    let mut glb = morphs();
    glb.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().expect("attributes").remove("NORMAL");
    glb.json["meshes"][0]["weights"] = json!([1.0, 0.0]);
    let mesh = &load(&glb).meshes[0];
    let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[k]));
    let expected = (b - a).cross(c - a).normalize();
    assert!(Vec3::from(mesh.normals[0]).distance(expected) < 1e-6 && expected.z < 0.6, "{expected}");
}
