//! What a window does by itself that nobody asked for: another method than the one it names, numbers
//! that change because they are shown.

use super::common;
use super::display::Display;
use super::session::{printed, session, succeeds};
use serde_json::json;

/// The network that filters `gather` sends rays, so their trees are built when it is first shown: no
/// matter on which side.
#[test]
fn neural_is_drawn_by_neural() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "expect": { "/left": "neural", "/drawn/left": "neural", "/fallback": null, "/errors": 0 } },
        { "expect": { "/passes": { "contains": "gi.trace" } } }, { "expect": { "/passes": { "contains": "net." } } },
        // Another scene has no trees yet: what is drawn meanwhile is what is named.
        { "drop": "paper-room:3" }, { "until": { "/scene/spec": "paper-room:3" } }, { "wait": "idle" },
        { "expect": { "/drawn/left": "neural", "/fallback": null } },
        { "key": "L" }, { "wait": "idle" }, { "expect": { "/feature": { "contains": "layer 1 of" } } }
    ]);
    succeeds(&session(&display, dir.path(), script, &["cornell", "--method", "neural", "--size", "96x72"]));
    let settings =
        json!({ "schema": 1, "left": "direct", "right": "neural", "split": true, "panel": false, "samples": 1 });
    let file = dir.path().join("view.json");
    std::fs::write(&file, settings.to_string()).unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "expect": { "/drawn/left": "direct", "/drawn/right": "neural" } },
        { "expect": { "/passes": { "contains": "gi.trace" } } }
    ]);
    let args = ["cornell", "--size", "96x72", "--settings", file.to_str().unwrap()];
    succeeds(&session(&display, dir.path(), script, &args));
}

/// Two triangles, one of which rises for 2 s, and a spot that shines straight down.
pub fn lively(folder: &std::path::Path) {
    let numbers: [f32; 17] = [-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.5, 0.0];
    let bytes: Vec<u8> = numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
    std::fs::write(folder.join("scene.bin"), bytes).unwrap();
    let view = |offset: u32, length: u32| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let accessor = |view: u32, count: u32, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind });
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let file = json!({
        "asset": { "version": "2.0" }, "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "spot", "intensity": 5000.0, "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.6 } }] } },
        "scene": 0, "scenes": [{ "nodes": [0, 1, 2] }],
        "nodes": [
            { "name": "flag", "mesh": 0 }, { "mesh": 0, "translation": [0.5, 0.0, -1.0] },
            { "translation": [0.0, 3.0, 0.3], "rotation": [-half, 0.0, 0.0, half],
              "extensions": { "KHR_lights_punctual": { "light": 0 } } }
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
        "materials": [{ "doubleSided": true }],
        "buffers": [{ "uri": "scene.bin", "byteLength": 4 * numbers.len() }],
        "bufferViews": [view(0, 36), view(36, 8), view(44, 24)],
        "accessors": [accessor(0, 3, "VEC3"), accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3")],
        "animations": [{ "name": "rise", "samplers": [{ "input": 1, "output": 2 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }] }],
    });
    std::fs::write(folder.join("lively.gltf"), file.to_string()).unwrap();
}

/// An animation plays on while its slider is seen, and a light stays as it is while its numbers are.
#[test]
fn what_is_shown_is_not_changed_by_being_shown() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    lively(dir.path());
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "key": "I" }, { "expect": { "/scene/playing": true } }, { "wait": 60 },
        { "expect": { "/scene/playing": true, "/panel": true } },
        { "key": "I" }, { "expect": { "/scene/playing": false } }, { "wait": "idle" },
        // The spot's entry is open from the start, once the room of the lights is.
        { "print": ["/scene/lights/0"] },
        { "save": { "version": "/version" } },
        { "click": "Lights" }, { "wait": 40 }, { "wait": "idle" },
        { "print": ["/scene/lights/0"] },
        { "expect_saved": { "version": "/version" } }
    ]);
    let out = session(&display, dir.path(), script, &["lively.gltf", "--method", "direct", "--size", "640x720"]);
    succeeds(&out);
    let told = printed(&out);
    assert_eq!(told[0], told[1]);
}

/// The bundled animation: the window's time slider is tried without a file.
#[test]
fn the_bundled_animation_plays() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "expect": { "/scene/animations": 1, "/scene/pose": null, "/errors": 0, "/messages": [] } },
        { "save": { "lights": "/scene/lights" } },
        { "key": "I" }, { "until": { "/scene/pose/1": { "min": 0.3 } } }, { "key": "I" }, { "wait": "idle" },
        // The lamp's light swings with it.
        { "expect_not_saved": { "lights": "/scene/lights" } },
        { "key": "U" }, { "wait": "idle" }, { "expect": { "/scene/pose": null } },
        { "expect_saved": { "lights": "/scene/lights" } }
    ]);
    succeeds(&session(&display, dir.path(), script, &["motion", "--method", "direct", "--size", "640x400"]));
}
