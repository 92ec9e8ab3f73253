//! `bouncelight view` for real: a window under Xvfb on whatever adapter answers, driven by scripts
//! with mouse and keys.

#![recursion_limit = "512"]

mod budget;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod display;
mod faults;
mod framing;
#[path = "../../../../tests/common/glb.rs"]
mod glb;
#[path = "../../../../tests/common/linear.rs"]
mod linear;
mod rays;
mod reference;
mod session;
mod switches;
mod timing;
mod tour;
mod wires;

use display::Display;
use serde_json::json;
use session::{mean, session, succeeds};
use std::process::Command;

/// What is seen beyond the scene, and half the resolution while the view moves on a slow device.
#[test]
fn backdrops_and_coarse_motion() {
    let (Some(gpu), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let mut script = vec![
        json!({ "wait": "loaded" }),
        json!({ "wait": "idle" }),
        json!({ "key": "P" }),
        json!({ "wait": "idle" }),
        json!({ "expect": { "/backdrop": "shown", "/coarse": false } }),
        json!({ "screenshot": "shown.png" }),
        json!({ "key": "Shift+O" }),
        json!({ "key": "Shift+O" }),
        json!({ "wait": "idle" }),
        json!({ "expect": { "/backdrop": "hidden" } }),
        json!({ "screenshot": "hidden.png" }),
        json!({ "key": "K" }),
        json!({ "expect": { "/copied": { "contains": "--backdrop=hidden" } } }),
        json!({ "key": "Shift+O" }),
        json!({ "wait": "idle" }),
        json!({ "expect": { "/backdrop": "transparent" } }),
        json!({ "key": "Shift+O" }),
        json!({ "key": "Z" }),
    ];
    if gpu.is_software() {
        script.push(json!({ "expect": { "/coarse": true } }));
    }
    // There and back: what rests is whole again.
    script.extend([
        json!({ "drag": [[120, 75], [130, 75], [120, 75]] }),
        json!({ "screenshot": "moving.png" }),
        json!({ "wait": "idle" }),
        json!({ "key": "C" }),
        json!({ "wait": "idle" }),
        json!({ "screenshot": "rests.png" }),
    ]);
    let arguments = ["interior", "--method", "gather", "--size", "480x300"];
    succeeds(&session(&display, dir.path(), json!(script), &arguments));
    // Below is what the window tells of the line that was copied, for a while.
    let all = |name: &str| mean(&dir.path().join(name), 0..480, 0..260);
    let apart = |a: &str, b: &str| (0..3).map(|c| (all(a)[c] - all(b)[c]).abs()).fold(0.0, f64::max);
    assert!(apart("shown.png", "rests.png") < 0.5, "{:?} {:?}", all("shown.png"), all("rests.png"));
    assert!(apart("shown.png", "moving.png") < 8.0, "{:?} {:?}", all("shown.png"), all("moving.png"));
}

/// The required half of the viewer in one session: loading, keys, orbiting, flying, light, objects,
/// a file that is no scene, a dropped scene, sizes, loss of surface and device, and that nothing is
/// drawn when nothing happens.
#[test]
fn a_session_with_mouse_and_keys() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("bad.glb"), b"glTF\x02\0\0\0\xff\0\0\0").unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "expect": { "/scene/spec": "cornell", "/left": "ambient", "/panel": true, "/errors": 0, "/camera/file": 0 } },
        // Nothing changes, nothing converges: no frame is drawn.
        { "save": { "frames": "/frames", "scene": "/scene_frames" } }, { "wait": 30 },
        { "expect_saved": { "frames": "/frames", "scene": "/scene_frames" } },
        // Keys choose what is shown; a view of the same frame draws no scene.
        { "key": "3" }, { "wait": "idle" }, { "expect": { "/view": "normal" } },
        { "expect_saved": { "scene": "/scene_frames" } },
        { "expect_not_saved": { "frames": "/frames" } }, { "screenshot": "normal.png" },
        { "key": "1" }, { "key": "." }, { "key": "." }, { "key": "T" },
        { "expect": { "/exposure": 0.5, "/tonemap": "agx" } },
        { "key": "P" }, { "wait": "idle" }, { "expect": { "/panel": false, "/size": [480, 300] } },
        { "screenshot": "picture.png" },
        // Hands move the camera: drag orbits, the wheel comes nearer, W flies.
        { "save": { "eye": "/camera/eye", "target": "/camera/target" } },
        { "drag": [[240, 150], [250, 150], [280, 160]] }, { "wait": "idle" },
        { "expect_not_saved": { "eye": "/camera/eye" } }, { "expect_saved": { "target": "/camera/target" } },
        { "expect": { "/camera/file": null } },
        { "save": { "eye": "/camera/eye" } }, { "wheel": 2 }, { "wait": "idle" },
        { "expect_not_saved": { "eye": "/camera/eye" } },
        { "save": { "target": "/camera/target" } }, { "hold": "W" }, { "wait": 3 }, { "release": "W" },
        { "wait": "idle" },
        { "expect_not_saved": { "target": "/camera/target" } },
        // In flight the wheel changes the speed and leaves the eye where it is.
        { "key": "G" }, { "save": { "speed": "/camera/speed", "eye": "/camera/eye" } }, { "wheel": 1 },
        { "expect_not_saved": { "speed": "/camera/speed" } }, { "expect_saved": { "eye": "/camera/eye" } },
        { "key": "G" },
        { "key": "C" }, { "wait": "idle" }, { "expect": { "/camera/file": 0 } },
        // Select and move an object; undo.
        { "click": [240, 230] }, { "expect": { "/selected": { "min": 0 } } }, { "key": "Right" },
        { "expect": { "/scene/moved": 1 } },
        { "key": "U" }, { "expect": { "/scene/moved": 0 } }, { "key": "Escape" }, { "expect": { "/selected": null } },
        // A method switch builds beside the window and then shows.
        { "key": "M" }, { "wait": "idle" }, { "expect": { "/left": "ssgi", "/drawn/left": "ssgi",
            "/passes": { "contains": "ssgi" } } },
        // A bad file is told and the old scene stays; a good name replaces it.
        { "drop": "bad.glb" }, { "wait": "idle" },
        { "expect": { "/scene/spec": "cornell", "/messages": { "contains": "bad.glb" }, "/errors": 1 } },
        { "key": "Escape" }, { "drop": "paper-room:3" }, { "wait": "idle" },
        { "expect": { "/scene/spec": "paper-room:3" } },
        // The sun turns under Ctrl and drag.
        { "save": { "lights": "/scene/lights" } }, { "drag": [[240, 150], [200, 140], [180, 140]], "keys": "Ctrl" },
        { "wait": "idle" }, { "expect_not_saved": { "lights": "/scene/lights" } },
        // Sizes, as a window manager throws them at a window; then none at all.
        { "resize": [300, 200] }, { "resize": [500, 240] }, { "resize": [170, 400] }, { "resize": [321, 243] },
        { "wait": 20 },
        { "wait": "idle" }, { "expect": { "/window": [321, 243], "/size": [321, 243] } },
        { "minimise": true }, { "wait": 5 }, { "minimise": false }, { "wait": "idle" },
        { "lose": "surface" }, { "wait": "idle" },
        { "lose": "device" }, { "wait": 30 }, { "wait": "idle" },
        { "expect": { "/rebuilt": 1, "/loaded": true, "/scene/spec": "paper-room:3", "/drawn/left": "ssgi" } },
        { "screenshot": "after.png" },
        // Times, memory and the overlay's own cost are known.
        { "expect": { "/cpu_ms": { "min": 0.0 }, "/overlay_ms": { "min": 0.0 }, "/memory/depth": (4 * 321 * 243) } },
        { "key": "H" }, { "expect": { "/help": true } }, { "quit": true }
    ]);
    let out = session(&display, dir.path(), script, &["cornell", "--method", "ambient", "--size", "480x300"]);
    succeeds(&out);
    // The box's floor points up: half red, full green, half blue. The picture itself shows no such
    // colour.
    let (x, y) = (60..100, 245..255);
    let normal = mean(&dir.path().join("normal.png"), x, y);
    assert!(normal[1] > normal[0] + 20.0 || normal[2] > 100.0, "{normal:?}");
    let picture = mean(&dir.path().join("picture.png"), 0..480, 0..300);
    assert!(picture.iter().sum::<f64>() > 30.0, "something is to be seen: {picture:?}");
    let after = mean(&dir.path().join("after.png"), 0..321, 0..243);
    assert!(after.iter().sum::<f64>() > 30.0, "and after the device was lost: {after:?}");
    assert!(!dir.path().join("config").exists(), "scripted runs save nothing");
}

/// F12, Shift+F12, and the command line that draws the very same picture, edits of lights and
/// objects included.
#[test]
fn the_copied_command_draws_the_same_picture() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "key": "P" }, { "wait": "idle" },
        { "drag": [[120, 75], [140, 80]] }, { "drag": [[120, 75], [90, 70]], "keys": "Ctrl" },
        { "click": [120, 110] }, { "key": "Right" },
        { "key": "." }, { "wait": "idle" }, { "screenshot": "window.png" }, { "key": "K" },
        { "expect": { "/copied": { "contains": "--eye=" } } },
        { "key": "F12" }, { "wait": "idle" }, { "expect": { "/captured": { "contains": ".png" } } },
        { "key": "Shift+F12" }, { "wait": "idle" }, { "expect": { "/captured": { "contains": ".exr" } } }
    ]);
    let out = session(&display, dir.path(), script, &["paper-room:3", "--method", "ambient", "--size", "240x150"]);
    succeeds(&out);
    let captured = dir.path().join("bouncelight-0001.png");
    let (ours, metadata) = bouncelight_scene::image_io::read_png_with_metadata(&captured).expect("F12 wrote it");
    let command = &metadata.iter().find(|(k, _)| k == "Command").expect("the command stands in the file").1;
    assert!(
        command.contains("--light=") && command.contains("--object=") && command.contains("--exposure=0.25"),
        "{command}"
    );
    let drawn = dir.path().join("drawn.png");
    let line =
        command.replacen("bouncelight ", "\"$0\" ", 1).replacen(captured.to_str().unwrap(), drawn.to_str().unwrap(), 1);
    let run = |line: &str| {
        let out = Command::new("sh")
            .args(["-c", line, env!("CARGO_BIN_EXE_bouncelight")])
            .env("NODEVICE_SELECT", "1")
            .output();
        succeeds(&out.expect("a shell"));
        bouncelight_scene::image_io::read_png(&drawn).expect("it was drawn")
    };
    let theirs = run(&line);
    assert_eq!((ours.width, ours.height), (240, 150));
    assert!(ours.pixels == theirs.pixels, "the picture is the same, byte by byte");
    // What the window showed is that picture, but for the name in its corner.
    let window = bouncelight_scene::image_io::read_png(&dir.path().join("window.png")).unwrap();
    let below = |image: &bouncelight_scene::image_io::Image| image.pixels[240 * 30 * 3..240 * 90 * 3].to_vec();
    let apart: f32 =
        below(&window).iter().zip(below(&ours)).map(|(a, b)| (a - b).abs()).sum::<f32>() / (240.0 * 60.0 * 3.0);
    assert!(apart < 0.012, "{apart}");
    // Negative control: without the turned sun it is another picture.
    let light = line.find("'--light=").expect("the sun was turned");
    let end = light + 1 + line[light + 1..].find('\'').unwrap() + 1;
    let other = run(&format!("{}{}", &line[..light], &line[end..]));
    assert!(ours.pixels != other.pixels);
    let layers =
        bouncelight_scene::image_io::read_exr(&dir.path().join("bouncelight-0001.exr")).expect("Shift+F12 wrote it");
    assert!(layers.layer("DiffInd").is_ok() && layers.layer("Depth").is_ok());
}

/// The split, the live reference, the error map with its numbers.
#[test]
fn methods_and_the_live_reference_side_by_side() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "key": "P" }, { "wait": "idle" },
        { "key": "X" }, { "expect": { "/split": true, "/right": "reference" } }, { "wait": "samples:2" },
        { "save": { "line": "/line", "eye": "/camera/eye" } }, { "drag": [[56, 50], [66, 50], [80, 52]] },
        { "expect_not_saved": { "line": "/line" } }, { "expect_saved": { "eye": "/camera/eye" } },
        { "key": "9" }, { "wait": "idle" },
        { "expect": { "/view": "error", "/reference/samples": 4, "/reference/finished": true,
            "/verdict/psnr": { "min": 8.0, "max": 30.0 } } },
        { "screenshot": "error.png" },
        // Another camera begins anew.
        { "key": "1" }, { "key": "V" }, { "wait": 60 }, { "wait": "idle" },
        { "expect": { "/reference/finished": true } },
        // A method without a network has no inputs to show.
        { "key": "0" }, { "key": "0" }, { "wait": "idle" }, { "expect": { "/view": "feature", "/feature": null } },
    ]);
    let out = session(&display, dir.path(), script, &["cornell", "--method", "direct", "--size", "112x84"]);
    succeeds(&out);
    let error = mean(&dir.path().join("error.png"), 0..112, 30..84);
    assert!(error[0] > 5.0, "direct light alone is wrong somewhere: {error:?}");
}

/// Where there is no display, a sentence and an exit code, no panic.
#[test]
fn without_a_display_it_says_so() {
    let out = Command::new(env!("CARGO_BIN_EXE_bouncelight"))
        .arg("view")
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .expect("the program starts");
    let text = String::from_utf8_lossy(&out.stderr);
    if cfg!(target_os = "linux") {
        assert_eq!(out.status.code(), Some(1), "{text}");
        assert!(text.contains("no window can be opened") && !text.contains("panicked"), "{text}");
        assert!(!text.contains("..") && !text.contains(".rs:"), "{text}");
    }
    let out =
        Command::new(env!("CARGO_BIN_EXE_bouncelight")).args(["view", "--script", "missing.json"]).output().unwrap();
    assert_eq!(out.status.code(), Some(2), "{}", String::from_utf8_lossy(&out.stderr));
}
