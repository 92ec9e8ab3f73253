//! EXT_lights_area: flat lights that glow on one side.

use crate::glb::Glb;
use bouncelight::scene::{LUMENS_PER_WATT, LightKind, Scene};
use glam::{Mat4, Vec3};
use serde_json::{Value, json};
use std::f32::consts::PI;

fn loaded(light: Value, node: Value) -> Scene {
    let mut glb = Glb::triangle();
    glb.json["extensionsUsed"] = json!(["EXT_lights_area"]);
    glb.json["extensionsRequired"] = json!(["EXT_lights_area"]);
    glb.json["extensions"] = json!({"EXT_lights_area": {"lights": [light]}});
    let mut lamp = node;
    lamp["extensions"] = json!({"EXT_lights_area": {"light": 0}});
    glb.json["nodes"].as_array_mut().unwrap().push(lamp);
    glb.json["scenes"][0]["nodes"] = json!([0, 1]);
    glb.load().unwrap_or_else(|e| panic!("{e}"))
}

/// Area and flux, and where the light goes.
fn measured(scene: &Scene) -> (f32, Vec3, Vec3) {
    let instance = scene.instances.last().unwrap();
    let (mesh, world) = (&scene.meshes[instance.mesh], Mat4::from_cols_array_2d(&instance.transform));
    let corner = |i: u32| world.transform_point3(mesh.positions[i as usize].into());
    let facing: Vec3 = mesh
        .indices
        .chunks_exact(3)
        .map(|t| 0.5 * (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])))
        .sum();
    let material = &scene.materials[mesh.material];
    assert_eq!((material.base_color[0], material.f0, material.double_sided), (0.0, 0.0, false));
    (facing.length(), facing.normalize(), Vec3::from(material.emissive))
}

#[test]
fn area_lights_are_surfaces_of_their_size_and_luminance_that_glow_on_one_side() {
    // Turned to shine along -Y, with scales of which the largest counts.
    let node = json!({"name": "panel", "translation": [1.0, 2.5, -1.0], "rotation": [-0.5f32.sqrt(), 0.0, 0.0, 0.5f32.sqrt()],
        "scale": [1.0, 2.0, 0.5]});
    let rect =
        json!({"type": "rect", "intensity": 2000.0, "color": [1.0, 0.5, 0.25], "size": 0.3, "rect": {"aspect": 2.0}});
    let disk = json!({"type": "disk", "size": 0.5});
    for (light, area, nits) in [(rect, 0.6 * 1.2, [2000.0, 1000.0, 500.0]), (disk, PI * 0.25, [1000.0; 3])] {
        let scene = loaded(light, node.clone());
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let (found, facing, radiance) = measured(&scene);
        assert!((found / area - 1.0).abs() < 1e-4, "{found} m² for {area}");
        assert!(facing.distance(Vec3::NEG_Y) < 1e-5, "it shines along {facing}");
        assert!(radiance.distance(Vec3::from(nits) / LUMENS_PER_WATT) < 1e-5, "{radiance}");
        // What stands in for it has the intensity of the surface along the axis.
        let [light] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
        let LightKind::Spot { direction, intensity, radius, position, .. } = light.kind else { panic!("{light:?}") };
        assert!(light.is_emissive_proxy && Vec3::from(direction).distance(Vec3::NEG_Y) < 1e-5);
        assert!((intensity * light.color[0] / (area * radiance.x) - 1.0).abs() < 1e-4);
        assert!((PI * radius * radius / area - 1.0).abs() < 1e-4);
        assert!(Vec3::from(position).distance(Vec3::new(1.0, 2.5, -1.0)) < 0.02);
    }
}

#[test]
fn area_lights_that_make_no_sense_are_left_out_with_a_warning() {
    let node = json!({"name": "panel"});
    for (light, words) in [
        (json!({"type": "sphere"}), "not known"),
        (json!({"type": "rect", "intensity": -1.0}), "impossible"),
        (json!({"type": "disk", "size": 0.0}), "impossible"),
        (json!({"type": "rect", "size": "large"}), "can be read"),
    ] {
        let scene = loaded(light, node.clone());
        assert_eq!(scene.instances.len(), 1, "{words}");
        assert!(scene.warnings.iter().any(|w| w.contains(words) && w.contains("nodes[1]")), "{:?}", scene.warnings);
    }
    let scene = loaded(json!({"type": "disk"}), json!({"scale": [1.0, 0.0, 1.0]}));
    assert!(scene.warnings.iter().any(|w| w.contains("impossible")), "{:?}", scene.warnings);
}
