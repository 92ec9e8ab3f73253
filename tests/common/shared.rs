//! What several of the scene tests need.

#![allow(dead_code, reason = "each test binary uses a part")]

use bouncelight::scene::Scene;
use glam::{Mat4, Vec3};

/// World positions of the vertices that instance `i` uses.
pub fn world_points(scene: &Scene, i: usize) -> Vec<Vec3> {
    let instance = &scene.instances[i];
    let mesh = &scene.meshes[instance.mesh];
    let world = Mat4::from_cols_array_2d(&instance.transform);
    mesh.indices.iter().map(|&v| world.transform_point3(mesh.positions[v as usize].into())).collect()
}

/// Largest distance from a point of one set to the nearest of the other, both ways.
pub fn hausdorff(a: &[Vec3], b: &[Vec3]) -> f32 {
    let one_way = |from: &[Vec3], to: &[Vec3]| {
        let nearest = |p: &Vec3| to.iter().map(|q| p.distance_squared(*q)).fold(f32::INFINITY, f32::min);
        from.iter().map(nearest).fold(0.0, f32::max).sqrt()
    };
    one_way(a, b).max(one_way(b, a))
}

/// Removes repeated points.
pub fn unique(mut points: Vec<Vec3>) -> Vec<Vec3> {
    points.sort_by_key(|p| p.to_array().map(|c| (c * 1e5).round() as i64));
    points.dedup_by(|a, b| a.distance(*b) < 2e-5);
    points
}

/// Everything that must hold of any scene that was loaded.
pub fn assert_sound(scene: &Scene) {
    assert!(!scene.cameras.is_empty(), "{}: a camera", scene.name);
    let lit = !scene.lights.is_empty() || scene.environment.radiance.iter().any(|r| *r > 0.0);
    assert!(lit || scene.meshes.is_empty(), "{}: light", scene.name);
    for instance in &scene.instances {
        assert!(instance.mesh < scene.meshes.len());
        assert!(instance.transform.iter().flatten().all(|v| v.is_finite()));
    }
    for mesh in &scene.meshes {
        let n = mesh.positions.len();
        assert!(mesh.material < scene.materials.len(), "{}", mesh.name);
        assert_eq!(mesh.normals.len(), n, "{}", mesh.name);
        for (what, len) in [
            ("tangents", mesh.tangents.len()),
            ("uv0", mesh.uv0.len()),
            ("uv1", mesh.uv1.len()),
            ("colors", mesh.colors.len()),
        ] {
            assert!(len == 0 || len == n, "{}: {what} {len} of {n}", mesh.name);
        }
        assert_eq!(mesh.indices.len() % 3, 0);
        assert!(mesh.indices.iter().all(|&i| (i as usize) < n));
        assert!(mesh.positions.iter().flatten().all(|v| v.is_finite()));
        assert!(mesh.normals.iter().all(|&v| (Vec3::from(v).length() - 1.0).abs() < 1e-3), "{}", mesh.name);
        assert!(mesh.tangents.iter().all(|t| t[3].abs() == 1.0), "{}", mesh.name);
        let material = &scene.materials[mesh.material];
        if material.normal_texture.is_some() && !mesh.uv0.is_empty() {
            assert!(!mesh.tangents.is_empty(), "{}: tangents for its normal map", mesh.name);
        }
    }
    for material in &scene.materials {
        let all = [
            material.base_color_texture,
            material.metallic_roughness_texture,
            material.normal_texture,
            material.occlusion_texture,
            material.emissive_texture,
        ];
        assert!(all.iter().flatten().all(|t| t.image < scene.images.len()));
    }
    for image in &scene.images {
        assert_eq!(image.rgba.len(), 4 * image.width as usize * image.height as usize);
    }
}
