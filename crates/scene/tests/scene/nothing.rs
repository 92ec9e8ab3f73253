//! Scenes of nothing are told, and default light is there only as long as there is no other.

use bouncelight::scene::{Environment, LightKind, Scene};
use bouncelight_scene::load;
use serde_json::json;

use crate::glb::{Glb, load_bytes};

#[track_caller]
fn nothing(glb: &Glb, word: &str) {
    let message = glb.load().expect_err("there is nothing").to_string();
    assert!(message.contains("made.glb: there is nothing to draw") && message.contains(word), "{message}");
}

#[test]
fn there_must_be_something_to_draw() {
    let mut glb = Glb::triangle();
    glb.json["nodes"] = json!([{"name": "empty"}]);
    nothing(&glb, "no triangle is placed");
    glb.json["nodes"] = json!([{"mesh": 0, "scale": [0.0, 0.0, 0.0]}]);
    nothing(&glb, "no triangle has an area");
    glb.json["nodes"] = json!([{"mesh": 0, "scale": [1e38, 1e38, 1.0]}]);
    nothing(&glb, "1e12 m from the origin");
    let mut glb = Glb::new();
    let huge = glb.floats("VEC3", &[-3e38, -3e38, 0.0, 3e38, -3e38, 0.0, 0.0, 3e38, 0.0]);
    glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": huge}});
    nothing(&glb, "1e12 m from the origin");
    let message = load_bytes("noise.obj", &[7, 99, 200, 13, 10, 0, 255]).expect_err("noise").to_string();
    assert!(message.contains("noise.obj: there is nothing to draw"), "{message}");
    // A flat scale leaves an area; large and small are still something.
    let mut glb = Glb::triangle();
    for scale in [[1.0, 1.0, 0.0], [1e-6, 1e-6, 1e-6], [1e9, 1e9, 1e9]] {
        glb.json["nodes"] = json!([{"mesh": 0, "scale": scale}]);
        assert_eq!(glb.load().unwrap_or_else(|e| panic!("{scale:?}: {e}")).instances.len(), 1);
    }
}

#[test]
fn what_is_too_far_is_left_out_beside_what_is_not() {
    let mut glb = Glb::triangle();
    glb.json["scenes"] = json!([{"nodes": [0, 1]}]);
    glb.json["nodes"] =
        json!([{"name": "far", "mesh": 0, "translation": [2e30, 0.0, 0.0]}, {"name": "near", "mesh": 0}]);
    let scene = glb.load().expect("one is left");
    assert_eq!((scene.instances.len(), &*scene.instances[0].name), (1, "near"));
    assert!(scene.warnings.iter().any(|w| w.contains("'far' reaches")), "{:?}", scene.warnings);
    assert!(scene.cameras[0].eye()[0].abs() < 10.0, "the camera frames what is left");
}

/// A triangle of half a square metre that glows with this radiance in a large room of another
/// material.
fn glowing(radiance: f32) -> Scene {
    let mut glb = Glb::triangle();
    glb.json["materials"] = json!([{"emissiveFactor": [1.0, 1.0, 1.0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": radiance}}}, {}]);
    glb.json["meshes"] = json!([
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 1}]},
    ]);
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    let corner = |x: f32| json!({"mesh": 1, "translation": [x, x, x]});
    glb.json["nodes"] = json!([{"mesh": 0}, corner(-2.0), corner(2.0)]);
    glb.load().unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_faint_glow_is_no_light() {
    let sun = |s: &Scene| s.lights.iter().any(|l| matches!(l.kind, LightKind::Directional { .. }));
    let told = |s: &Scene, word: &str| s.warnings.iter().any(|w| w.contains(word));
    // The box is 5 m by 5 m by 4 m: π · 0.5 m² over its 130 m² times 0.02 is a radiance of 1.66.
    for (radiance, own) in [(0.002, false), (1.5, false), (1.8, true), (50.0, true)] {
        let scene = glowing(radiance);
        assert_eq!(sun(&scene), !own, "{radiance}");
        assert_eq!(scene.default_light, !own);
        assert_eq!(scene.lights.iter().any(|l| l.is_emissive_proxy), own, "{radiance}: {:?}", scene.lights);
        assert_eq!((told(&scene, "faint glow"), told(&scene, "emissive proxies")), (!own, own), "{:?}", scene.warnings);
    }
    // The same in another unit of length.
    let mut glb = Glb::triangle();
    glb.json["materials"] = json!([{"emissiveFactor": [0.002, 0.002, 0.002]}]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    for scale in [1.0, 1e-3, 1e3] {
        glb.json["nodes"] = json!([{"mesh": 0, "scale": [scale, scale, scale]}]);
        assert!(sun(&glb.load().expect("loads")), "{scale}");
    }
}

#[test]
fn given_surroundings_replace_default_sky_and_sun() {
    let mut scene = Glb::triangle().load().expect("loads");
    assert!(scene.default_light && scene.lights.len() == 1 && scene.warnings.len() == 1);
    bouncelight_scene::defaults::surround(&mut scene, Environment::constant([0.5; 3]));
    assert!(!scene.default_light && scene.lights.is_empty(), "{:?}", scene.lights);
    assert_eq!((scene.environment.radiance, scene.warnings.len()), ([0.5; 3], 0), "{:?}", scene.warnings);
    // A second time changes the sky only; a scene with light of its own keeps it.
    bouncelight_scene::defaults::surround(&mut scene, Environment::constant([0.1; 3]));
    assert_eq!(scene.environment.radiance, [0.1; 3]);
    let mut cornell = load("cornell").expect("bundled");
    let lights = cornell.lights.len();
    bouncelight_scene::defaults::surround(&mut cornell, Environment::constant([0.1; 3]));
    assert_eq!((cornell.lights.len(), lights > 0), (lights, true));
    // A faint glow, too faint to be the light beside nothing, is stood for under a sky that
    // somebody gave.
    let mut faint = glowing(0.5);
    bouncelight_scene::defaults::surround(&mut faint, Environment::constant([0.1; 3]));
    assert!(faint.lights.len() == 1 && faint.lights[0].is_emissive_proxy, "{:?}", faint.lights);
    assert!(!faint.warnings.iter().any(|w| w.contains("sun")), "{:?}", faint.warnings);
}
