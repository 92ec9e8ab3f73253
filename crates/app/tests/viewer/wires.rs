//! The view `wireframe`: lines where edges are, and nowhere else.

use crate::common;
use crate::display::Display;
use crate::session::{mean, session, succeeds};
use serde_json::json;
use std::path::Path;

/// A square of 2 m at z = 0 whose diagonal rises to the right, before one of 1 m, seen from z = 3.
/// It is placed by its node: in the mesh it lies a metre further left.
fn file(folder: &Path) {
    let square = |x: f32, half: f32, z: f32| {
        [[x - half, -half], [x + half, -half], [x + half, half], [x - half, half]].map(|[x, y]| [x, y, z])
    };
    let indices = [0u32, 1, 2, 0, 2, 3];
    let mut bytes: Vec<u8> = [square(-1.0, 1.0, 0.0), square(0.0, 0.5, -1.0)]
        .concat()
        .iter()
        .flatten()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    std::fs::write(folder.join("squares.bin"), &bytes).expect("the folder is writable");
    let accessor = |view: u32, kind: &str, component: u32, count: u32| {
        let mut accessor = json!({"bufferView": view, "count": count, "type": kind});
        accessor["componentType"] = json!(component);
        accessor
    };
    let scene = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0, "translation": [1.0, 0.0, 0.0]}, {"mesh": 1}, {"camera": 0, "translation": [0.0, 0.0, 3.0]},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 2.0 * (2.0f64 / 3.0).atan(), "znear": 0.01}}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 2}]},
            {"primitives": [{"attributes": {"POSITION": 1}, "indices": 2}]},
        ],
        "buffers": [{"byteLength": bytes.len(), "uri": "squares.bin"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 48},
            {"buffer": 0, "byteOffset": 96, "byteLength": 24},
        ],
        "accessors": [
            accessor(0, "VEC3", 5126, 4), accessor(1, "VEC3", 5126, 4), accessor(2, "SCALAR", 5125, 6),
        ],
    });
    std::fs::write(folder.join("squares.gltf"), scene.to_string()).expect("the folder is writable");
}

#[test]
fn edges_are_lines_and_faces_are_not() {
    let (Some(gpu), Some(display)) = (common::gpu(), Display::open()) else { return };
    if !gpu.device.features().contains(bouncelight::wgpu::Features::POLYGON_MODE_LINE) {
        // Then it is refused with a sentence; `viewer::state` tests that.
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    file(dir.path());
    let script = json!([
        { "wait": "loaded" }, { "key": "P" }, { "wait": "idle" }, { "screenshot": "picture.png" },
        { "save": { "scene": "/scene_frames" } },
        { "key": "J" }, { "wait": "idle" }, { "expect": { "/view": "wireframe", "/errors": 0 } },
        { "screenshot": "wires.png" },
        // A view of the same frame draws no scene.
        { "expect_saved": { "scene": "/scene_frames" } },
        { "key": "X" }, { "key": "M" }, { "wait": "idle" },
        { "expect": { "/split": true, "/memory/viewer.wires": { "min": 1 } } }, { "screenshot": "split.png" },
        { "key": "X" }, { "drag": [[200, 150], [215, 150]] }, { "wait": "idle" }, { "screenshot": "turned.png" },
        { "key": "1" }, { "wait": "idle" }, { "expect": { "/view": "picture" } }, { "screenshot": "again.png" },
    ]);
    succeeds(&session(&display, dir.path(), script, &["squares.gltf", "--method", "direct", "--size", "400x300"]));
    let light = |name: &str, x: std::ops::Range<u32>, y: std::ops::Range<u32>| {
        mean(&dir.path().join(name), x, y).iter().sum::<f64>() / 3.0
    };
    // 75 pixels a metre: edges at columns 125 and 275, rows 75 and 225; the diagonal goes through
    // the middle.
    for name in ["wires.png", "split.png"] {
        let face = light(name, 140..170, 85..115);
        for x in [125, 275] {
            // One of these columns is the line.
            let column = light(name, x - 2..x + 2, 90..140);
            assert!(column > face + 20.0, "{name}: column {x}: {column} against {face}");
        }
        let row = light(name, 140..190, 223..227);
        assert!(row > face + 20.0, "{name}: {row} against {face}");
        let diagonal = light(name, 235..245, 105..115);
        assert!(diagonal > face + 8.0, "{name}: {diagonal} against {face}");
        // The second square's edge would stand at column 228.
        let hidden = light(name, 226..231, 160..172);
        assert!((hidden - face).abs() < 8.0, "{name}: what lies behind is hidden: {hidden} against {face}");
    }
    // Negative control: the picture itself has none of these lines.
    let (line, face) = (light("picture.png", 277..279, 90..140), light("picture.png", 140..170, 85..115));
    assert!(light("picture.png", 124..127, 90..140) < face + 8.0 && line < face, "{line} {face}");
    assert!((light("again.png", 235..245, 105..115) - light("again.png", 140..170, 85..115)).abs() < 8.0);
}
