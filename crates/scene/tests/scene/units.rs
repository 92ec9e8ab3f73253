//! Files of another unit of length or another vertical.

use bouncelight::scene::{LightKind, Scene};
use bouncelight_scene::units::{Units, Up};
use bouncelight_scene::{LoadOptions, load_with};
use glam::{Mat4, Vec3};
use serde_json::json;

use crate::glb::{Glb, put};
use crate::shared::assert_sound;

fn load(name: &str, bytes: &[u8], scale: f32, up: Up) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = put(folder.path(), name, bytes);
    let options = LoadOptions { units: Units { scale, up }, ..LoadOptions::default() };
    let scene = load_with(path.to_str().expect("text"), options).unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    scene
}

/// World position of vertex `v` of the first instance.
fn place(scene: &Scene, v: usize) -> Vec3 {
    let p = scene.meshes[scene.instances[0].mesh].positions[v];
    Mat4::from_cols_array_2d(&scene.instances[0].transform).transform_point3(p.into())
}

#[test]
fn scale_and_up_reach_all_that_has_a_length_or_a_direction() {
    let mut glb = Glb::triangle();
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "range": 4000.0}]}});
    glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 10.0}}]);
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    glb.json["nodes"] = json!([
        {"mesh": 0, "translation": [0.0, 3000.0, 2000.0]},
        {"translation": [1000.0, 0.0, 2500.0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"translation": [0.0, -5000.0, 1000.0], "camera": 0},
    ]);
    let bytes = glb.bytes();
    let scene = load("made.glb", &bytes, 0.001, Up::Z);
    assert!(place(&scene, 0).distance(Vec3::new(0.0, 2.0, -3.0)) < 1e-5, "{}", place(&scene, 0));
    let LightKind::Point { position, range, intensity, .. } = scene.lights[0].kind else { panic!("a point") };
    assert!(Vec3::from(position).distance(Vec3::new(1.0, 2.5, 0.0)) < 1e-5 && range == Some(4.0), "{position:?}");
    let eye = Vec3::from(scene.cameras[0].eye());
    assert!(eye.distance(Vec3::new(0.0, 1.0, 5.0)) < 1e-5 && (scene.cameras[0].near - 0.01).abs() < 1e-6, "{eye}");
    // Control: as the file has it.
    let plain = load("made.glb", &bytes, 1.0, Up::Y);
    assert_eq!(place(&plain, 0), Vec3::new(0.0, 3000.0, 2000.0));
    assert_eq!(plain.cameras[0].near, 10.0);
    let LightKind::Point { intensity: before, .. } = plain.lights[0].kind else { panic!("a point") };
    assert_eq!(before, intensity, "candela are candela");
}

#[test]
fn scale_and_up_of_an_obj() {
    let text = b"v 0 0 0\nv 1000 0 0\nv 0 0 1000\nf 1 2 3\n";
    let scene = load("made.obj", text, 0.001, Up::Z);
    assert!(place(&scene, 2).distance(Vec3::Y) < 1e-6, "{}", place(&scene, 2));
    assert_eq!(place(&load("made.obj", text, 1.0, Up::Y), 2), Vec3::new(0.0, 0.0, 1000.0));
}

#[test]
fn a_strange_size_is_told_once_and_not_where_the_unit_was_said() {
    let text = |side: f32| format!("v 0 0 0\nv {side} 0 0\nv 0 {side} 0\nf 1 2 3\n").into_bytes();
    let told = |side: f32, scale: f32| {
        let scene = load("made.obj", &text(side), scale, Up::Y);
        scene.warnings.into_iter().filter(|w| w.contains("--scale")).collect::<Vec<_>>()
    };
    let large = told(6500.0, 1.0);
    assert!(large.len() == 1 && large[0].contains("6.5 km"), "{large:?}");
    assert_eq!(told(0.002, 1.0).len(), 1);
    assert!(told(6500.0, 0.001).is_empty() && told(20.0, 1.0).is_empty());
}
