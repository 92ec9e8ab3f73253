//! What can be switched, dropped and changed under the window's feet while it runs.

use super::common;
use super::display::Display;
use super::linear::linear_bytes;
use super::session::{mean, printed, session, session_with, succeeds};
use bouncelight::net::format::CELLS_V1;
use serde_json::json;
use std::path::{Path, PathBuf};

fn shipped() -> PathBuf {
    crate::common::root().join("assets/weights/filter.safetensors")
}

/// A network of one layer, which answers zeros.
fn other(folder: &Path) -> PathBuf {
    let path = folder.join("one_layer.safetensors");
    std::fs::write(&path, linear_bytes("cells", CELLS_V1, "filter", &[0.0; 12 * 15], &[0.0; 12])).unwrap();
    path
}

/// A sky of one colour as Radiance .hdr without run lengths: 8×4 pixels of (mantissa, exponent).
fn sky(rgbe: [u8; 4]) -> Vec<u8> {
    let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n".to_vec();
    (0..32).for_each(|_| file.extend(rgbe));
    file
}

/// Weights by file and broken; the network's layers and inputs as pictures; a split between two
/// raster methods; the frontier's dots; the flicker meter; light theme.
#[test]
fn methods_weights_and_views_switch_at_run_time() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("bad.safetensors"), b"not at all").unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        // The frontier: a dot for each method that was drawn, and a click on it chooses the method.
        // A few frames make no dot; `B` draws more of them.
        { "click": "Speed and accuracy" }, { "wait": 30 }, { "wait": "idle" },
        { "expect": { "/places/dot ambient": null } },
        { "key": "B" }, { "until": { "/places/dot ambient/0": { "min": 300.0 } } }, { "key": "M" },
        { "until": { "/places/dot ssgi/0": { "min": 300.0 } } }, { "key": "B" }, { "wait": "idle" },
        { "expect": { "/left": "ssgi", "/places/dot ambient/0": { "min": 300.0 } } },
        { "screenshot": "frontier.png" },
        { "click": "dot ambient" }, { "wait": "idle" }, { "expect": { "/left": "ambient", "/drawn/left": "ambient" } },
        { "click": "Speed and accuracy" }, { "wait": 30 }, { "wait": "idle" },
        // Two raster methods beside each other.
        { "key": "X" }, { "key": "Escape" }, { "key": "Shift+T" }, { "expect": { "/dark": false, "/split": true } },
        { "key": "X" }, { "wait": "idle" }, { "screenshot": "light.png" }, { "key": "Shift+T" },
        // The flicker meter needs frames of one view.
        { "key": "Shift+B" }, { "key": "N" }, { "key": "N" }, { "wait": "idle" },
        { "expect": { "/samples": 4, "/still": 4, "/flicker": { "min": 1e-5, "max": 0.1 } } },
        { "key": "Shift+N" }, { "key": "Shift+N" }, { "key": "Shift+B" },
        // Weights that are none are told; others are used at once.
        { "drop": "bad.safetensors" }, { "wait": "idle" },
        { "expect": { "/left": "ambient", "/weights": null, "/errors": 1,
            "/messages": { "contains": "bad.safetensors" } } },
        { "key": "Escape" }, { "wait": 2 },
        { "drop": shipped() }, { "wait": "idle" },
        { "expect": { "/left": "neural", "/drawn/left": "neural", "/weights": { "contains": "filter" }, "/errors": 0 } },
        { "save": { "passes": "/passes" } },
        // What goes in, and what layers make of it.
        { "key": "0" }, { "wait": "idle" }, { "expect": { "/feature": { "contains": "`light` (1 of 15)" } } },
        { "key": "L" }, { "wait": "idle" }, { "expect": { "/view": "layer",
            "/feature": { "contains": "layer 1 of" } } },
        { "key": "L" }, { "wait": "idle" }, { "expect": { "/feature": { "contains": "layer 2 of" } } },
        { "screenshot": "layer.png" }, { "key": "1" },
        { "drop": other(dir.path()) }, { "wait": "idle" }, { "expect": { "/weights": { "contains": "one_layer" } } },
        { "expect_not_saved": { "passes": "/passes" } }
    ]);
    let out = session(&display, dir.path(), script, &["cornell", "--method", "ambient", "--size", "640x650"]);
    succeeds(&out);
    let ground = |name: &str| mean(&dir.path().join(name), 345..355, 500..520);
    assert!(ground("light.png")[0] > 200.0 && ground("frontier.png")[0] < 60.0, "{:?}", ground("light.png"));
}

/// Left and right of the line are two methods' pictures: each half is that of the method alone.
#[test]
fn a_split_shows_two_raster_methods() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("sky.hdr"), sky([0, 128, 255, 129])).unwrap();
    let script = json!([
        { "wait": "loaded" }, { "key": "P" }, { "wait": "idle" }, { "screenshot": "direct.png" },
        { "key": "M" }, { "wait": "idle" }, { "screenshot": "ambient.png" }, { "key": "Shift+M" }, { "wait": "idle" },
        { "key": "X" }, { "wait": 2 }, { "click": [100, 60] },
        { "key": "X" }, { "wait": "idle" }, { "expect": { "/split": false } }
    ]);
    succeeds(&session(&display, dir.path(), script, &["cornell", "--method", "direct", "--size", "200x150"]));
    let settings =
        json!({ "schema": 1, "left": "direct", "right": "ambient", "split": true, "panel": false, "samples": 1 });
    let file = dir.path().join("view.json");
    std::fs::write(&file, settings.to_string()).unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "expect": { "/split": true, "/drawn/left": "direct", "/drawn/right": "ambient", "/samples": 1 } },
        { "screenshot": "split.png" },
        // Surroundings dropped from a picture.
        { "drop": "sky.hdr" }, { "wait": "idle" },
        { "expect": { "/scene/environment": { "contains": "sky.hdr" }, "/scene/sky/2": { "min": 1.9, "max": 2.1 } } },
        { "key": "V" }, { "wait": "idle" }, { "screenshot": "sky.png" }, { "key": "U" }, { "wait": "idle" },
        { "expect": { "/scene/environment": null } }
    ]);
    let args = ["cornell", "--size", "200x150", "--settings", file.to_str().unwrap()];
    succeeds(&session(&display, dir.path(), script, &args));
    // Below the names.
    let part = |name: &str, x: std::ops::Range<u32>| mean(&dir.path().join(name), x, 70..140);
    let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f64>();
    let (left, right) = (10..90, 110..190);
    assert!(apart(part("split.png", left.clone()), part("direct.png", left.clone())) < 1.0);
    assert!(apart(part("split.png", right.clone()), part("ambient.png", right.clone())) < 1.0);
    // Negative control: the other method's half is another picture.
    assert!(apart(part("split.png", right.clone()), part("direct.png", right)) > 3.0);
    assert!(apart(part("split.png", left.clone()), part("ambient.png", left)) > 3.0);
    let corner = mean(&dir.path().join("sky.png"), 2..20, 120..148);
    assert!(corner[2] > 150.0 && corner[2] > corner[0] + 50.0, "the sky is blue: {corner:?}");
}

/// `--watch`: the scene, the weights and a shader change; what is broken is told and the old state
/// stays.
#[test]
fn watched_files_are_loaded_again_and_broken_ones_told() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let quad = |z: f32| format!("v -1 -1 {z}\nv 1 -1 {z}\nv 0 1 {z}\nf 1 2 3\n");
    std::fs::write(at("scene.obj"), quad(0.0)).unwrap();
    std::fs::write(at("two.obj"), quad(0.0) + "o more\n" + &quad(-1.0).replace("1 2 3", "4 5 6")).unwrap();
    std::fs::write(at("bad.obj"), "v 0 0 0\nf 1 2 99\n").unwrap();
    std::fs::copy(shipped(), at("net.safetensors")).unwrap();
    std::fs::rename(other(dir.path()), at("other.safetensors")).unwrap();
    std::fs::write(at("junk"), "junk").unwrap();
    let gi = at("shaders").join("gi");
    std::fs::create_dir_all(&gi).unwrap();
    let ambient = std::fs::read_to_string(crate::common::root().join("shaders/gi/ambient.wgsl")).unwrap();
    std::fs::write(gi.join("ambient.wgsl"), &ambient).unwrap();
    std::fs::write(at("good.wgsl"), ambient.clone() + "\n// changed\n").unwrap();
    std::fs::write(at("bad.wgsl"), ambient + "\nfn broken( {\n").unwrap();
    let shader = "shaders/gi/ambient.wgsl";
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" }, { "expect": { "/scene/objects": 1, "/left": "ambient" } },
        { "wait": 80 },
        { "copy": ["two.obj", "scene.obj"] }, { "until": { "/scene/objects": 2 } }, { "wait": "idle" },
        { "copy": ["bad.obj", "scene.obj"] }, { "until": { "/errors": 1 } }, { "wait": "idle" },
        { "expect": { "/scene/objects": 2, "/messages": { "contains": "scene.obj" } } }, { "key": "Escape" },
        { "copy": ["bad.wgsl", shader] }, { "until": { "/errors": 1 } }, { "wait": "idle" },
        { "expect": { "/drawn/left": "ambient", "/loaded": true, "/left": "ambient",
            "/messages": { "contains": "gi/ambient.wgsl:" } } },
        { "screenshot": "broken.png" },
        { "key": "Escape" }, { "save": { "built": "/built" } }, { "copy": ["good.wgsl", shader] }, { "wait": 80 },
        { "wait": "idle" },
        { "expect": { "/errors": 0, "/drawn/left": "ambient" } }, { "expect_not_saved": { "built": "/built" } },
        { "drop": "net.safetensors" }, { "wait": "idle" }, { "expect": { "/drawn/left": "neural" } }, { "wait": 80 },
        { "save": { "passes": "/passes", "built": "/built" } }, { "copy": ["junk", "net.safetensors"] },
        { "until": { "/errors": 1 } },
        { "wait": "idle" }, { "expect": { "/drawn/left": "neural", "/messages": { "contains": "net.safetensors" } } },
        { "expect_saved": { "built": "/built" } }, { "key": "Escape" },
        { "copy": ["other.safetensors", "net.safetensors"] }, { "wait": 80 }, { "wait": "idle" },
        { "expect": { "/errors": 0 } },
        { "expect_not_saved": { "built": "/built", "passes": "/passes" } }
    ]);
    let args = ["scene.obj", "--watch", "--method", "ambient", "--size", "220x160"];
    let shaders = at("shaders");
    let out = session_with(&display, dir.path(), script, &args, &[("BOUNCELIGHT_SHADERS", shaders.to_str().unwrap())]);
    succeeds(&out);
}

/// A window of no size, other densities, and a long measurement: the overlay is not laid out for
/// every frame, and a drag moves the camera all the same.
#[test]
fn sizes_densities_and_the_overlays_own_cost() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" }, { "expect": { "/density_drawn": 1.0, "/window": [480, 300] } },
        { "resize": [0, 0] }, { "wait": 10 }, { "save": { "frames": "/frames" } }, { "key": "3" }, { "wait": 10 },
        { "expect_saved": { "frames": "/frames" } },
        { "resize": [420, 260] }, { "wait": 10 }, { "wait": "idle" },
        { "expect": { "/window": [420, 260], "/view": "normal" } },
        { "expect_not_saved": { "frames": "/frames" } },
        { "save": { "size": "/size" } }, { "scale": 2.0 }, { "key": "1" }, { "wait": "idle" },
        { "screenshot": "double.png" },
        { "expect": { "/density_drawn": 2.0, "/window": [420, 260] } }, { "expect_not_saved": { "size": "/size" } },
        { "scale": 1.0 }, { "key": "1" }, { "wait": "idle" }, { "expect": { "/density_drawn": 1.0 } },
        { "expect_saved": { "size": "/size" } },
        // Frame after frame.
        { "resize": [380, 120] }, { "wait": 10 }, { "wait": "idle" }, { "key": "B" }, { "wait": 20 },
        { "print": ["/layouts", "/frames", "/camera/eye/0"] },
        { "press": [20, 50] }, { "move": [25, 50] }, { "wait": 60 }, { "move": [30, 50] }, { "move": [35, 50] },
        { "wait": 2 },
        { "print": ["/layouts", "/frames", "/camera/eye/0", "/overlay_ms", "/cpu_ms"] },
        { "move": [40, 50] }, { "lift": [40, 50] }, { "key": "B" }, { "wait": "idle" }, { "print": ["/camera/eye/0"] }
    ]);
    let out = session(&display, dir.path(), script, &["cornell", "--method", "direct", "--size", "480x300"]);
    succeeds(&out);
    let told = printed(&out);
    let number = |i: usize, name: &str| told[i][name].as_f64().expect("a number");
    let (frames, layouts) =
        (number(1, "/frames") - number(0, "/frames"), number(1, "/layouts") - number(0, "/layouts"));
    assert!(frames >= 60.0 && layouts < 0.5 * frames, "{layouts} layouts in {frames} frames");
    let eyes: Vec<f64> = (0..3).map(|i| number(i, "/camera/eye/0")).collect();
    assert!(eyes[0] > eyes[1] && eyes[1] > eyes[2], "the drag turned the scene all the way: {eyes:?}");
}

/// A path is recorded while hands move the camera, written, dropped again and played.
#[test]
fn a_camera_path_is_recorded_and_played() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "key": "P" }, { "wait": "idle" }, { "key": "Y" },
        { "expect": { "/path/playing": false } },
        { "key": "R" }, { "expect": { "/path/recording": true } }, { "save": { "start": "/camera/eye/0" } },
        { "drag": [[100, 75], [110, 75], [130, 75], [150, 75]] }, { "wait": "idle" },
        { "save": { "end": "/camera/eye" } },
        { "key": "R" }, { "expect": { "/path/recording": false, "/path/keys": { "min": 2 },
            "/messages": { "contains": "camera-0001.json" } } },
        { "key": "V" }, { "wait": "idle" }, { "expect_not_saved": { "end": "/camera/eye" } },
        { "drop": "camera-0001.json" }, { "key": "Y" }, { "expect": { "/path/playing": true } },
        { "until": { "/path/playing": false } }, { "wait": "idle" }, { "expect_saved": { "end": "/camera/eye" } },
        { "drop": "script.json" }, { "expect": { "/errors": 1 } }
    ]);
    succeeds(&session(&display, dir.path(), script, &["cornell", "--method", "direct", "--size", "200x150"]));
    let path = bouncelight_scene::path::CameraPath::load(&dir.path().join("camera-0001.json")).expect("it was written");
    assert!(path.end() > 0.05 && path.keys.len() >= 2);
    // The command line draws it: two frames, the first and a later one, which differ.
    let render = |frames: &str| {
        let args = [
            "render",
            "cornell",
            "--method",
            "direct",
            "--size",
            "60x40",
            "--path",
            "camera-0001.json",
            "--fixed-dt",
            "1/50",
        ];
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bouncelight"));
        command
            .args(args)
            .args(["--frames", frames, "-o", "out_{frame:03}.png"])
            .current_dir(dir.path())
            .env("NODEVICE_SELECT", "1");
        command.output().expect("the program starts")
    };
    succeeds(&render("0..1"));
    succeeds(&render("500..501"));
    let picture =
        |name: &str| bouncelight_scene::image_io::read_png(&dir.path().join(name)).expect("it was drawn").pixels;
    assert_ne!(picture("out_000.png"), picture("out_500.png"));
    assert_eq!(render("3..3").status.code(), Some(2));
}

/// A file with an animation and two variants: both change the picture, and the copied command draws
/// what is seen.
#[test]
fn animations_play_and_variants_change_materials() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let numbers: Vec<f32> = [
        // A triangle, two times, two places.
        [-1.0f32, -1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 1.0, 0.0].to_vec(),
        vec![0.0, 2.0],
        vec![0.0, 0.0, 0.0, 0.0, 1.5, 0.0],
    ]
    .concat();
    std::fs::write(dir.path().join("scene.bin"), bytes(&numbers)).unwrap();
    let material = |r: f32, b: f32| {
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [r, 0.05, b, 1.0] },
        "doubleSided": true })
    };
    let view = |offset: u32, length: u32| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let accessor = |view: u32, count: u32, kind: &str| {
        json!({ "bufferView": view, "componentType": 5126,
        "count": count, "type": kind })
    };
    let mappings = json!({ "mappings": [{ "material": 1, "variants": [0] }] });
    let file = json!({
        "asset": { "version": "2.0" }, "extensionsUsed": ["KHR_materials_variants"],
        "extensions": { "KHR_materials_variants": { "variants": [{ "name": "in blue" }] } },
        "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "name": "flag", "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0,
            "extensions": { "KHR_materials_variants": mappings } }] }],
        "materials": [material(0.8, 0.05), material(0.05, 0.8)],
        "buffers": [{ "uri": "scene.bin", "byteLength": 4 * numbers.len() }],
        "bufferViews": [view(0, 36), view(36, 8), view(44, 24)],
        "accessors": [accessor(0, 3, "VEC3"), accessor(1, 2, "SCALAR"), accessor(2, 2, "VEC3")],
        "animations": [{ "name": "rise", "samplers": [{ "input": 1, "output": 2 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }] }],
    });
    std::fs::write(dir.path().join("flag.gltf"), file.to_string()).unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "expect": { "/scene/animations": 1, "/scene/variants": ["in blue"], "/scene/pose": null } },
        { "key": "P" }, { "wait": "idle" }, { "screenshot": "rest.png" }, { "save": { "frames": "/scene_frames" } },
        { "key": "I" }, { "until": { "/scene/pose/1": { "min": 0.3 } } }, { "key": "I" }, { "wait": "idle" },
        { "expect_not_saved": { "frames": "/scene_frames" } }, { "save": { "pose": "/scene/pose" } }, { "wait": 10 },
        { "expect_saved": { "pose": "/scene/pose" } }, { "screenshot": "risen.png" },
        { "variant": 0 }, { "wait": "idle" }, { "expect": { "/scene/variant": 0 } },
        { "expect_saved": { "pose": "/scene/pose" } },
        { "screenshot": "blue.png" }, { "key": "K" },
        { "expect": { "/copied": { "contains": "--animation=0" } } },
        { "expect": { "/copied": { "contains": "'--variant=in blue'" } } },
        { "key": "F12" }, { "wait": "idle" }, { "key": "U" }, { "wait": "idle" },
        { "expect": { "/scene/variant": null, "/scene/pose": null } }, { "screenshot": "again.png" },
        { "key": "Shift+O" }, { "key": "Shift+O" }, { "key": "Shift+O" },
        { "expect": { "/backdrop": "transparent" } }, { "wait": "idle" }, { "key": "F12" }, { "wait": "idle" }
    ]);
    succeeds(&session(&display, dir.path(), script, &["flag.gltf", "--method", "direct", "--size", "200x160"]));
    let all = |name: &str| bouncelight_scene::image_io::read_png(&dir.path().join(name)).expect("it was drawn").pixels;
    assert!(all("rest.png") != all("risen.png"));
    // In the middle of the triangle: pictures of such files are exposed by measure.
    let middle = |name: &str| mean(&dir.path().join(name), 84..96, 50..70);
    let ([red, _, blue], [red_before, _, blue_before]) = (middle("blue.png"), middle("risen.png"));
    assert!(blue > red + 50.0 && red_before > blue_before + 50.0, "{red} {blue}, before {red_before} {blue_before}");
    // The command in the picture's metadata draws it again.
    let captured = dir.path().join("bouncelight-0001.png");
    let (ours, metadata) = bouncelight_scene::image_io::read_png_with_metadata(&captured).expect("F12 wrote it");
    let command = &metadata.iter().find(|(k, _)| k == "Command").expect("the command stands in the file").1;
    let line = command.replacen("bouncelight ", "\"$0\" ", 1).replacen(captured.to_str().unwrap(), "drawn.png", 1);
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", &line, env!("CARGO_BIN_EXE_bouncelight")]).current_dir(dir.path()).env("NODEVICE_SELECT", "1");
    succeeds(&shell.output().expect("a shell"));
    assert!(ours.pixels == all("drawn.png"), "byte by byte");
    // With a transparent background it has alpha; negative control: it has none before a sky.
    let clear = bouncelight_scene::image_io::read_png(&dir.path().join("bouncelight-0002.png")).expect("F12 wrote it");
    assert_eq!((ours.channels, clear.channels), (3, 4));
    let alpha = |a: f32| clear.pixels.chunks_exact(4).filter(|p| p[3] == a).count();
    assert!(alpha(0.0) > 1000 && alpha(1.0) > 1000, "{} {}", alpha(0.0), alpha(1.0));
}

fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|v| v.to_le_bytes()).collect()
}
