//! What a picture takes in: all that a file's camera framed, and the scene without what was
//! forgotten far away.

use super::common;
use super::display::Display;
use super::glb::Glb;
use super::session::{mean, printed, session, succeeds};
use bouncelight_scene::image_io::read_png;
use serde_json::{Value, json};
use std::path::Path;

/// Glowing squares of edge 2 · `half` in the plane z, each cut into `cuts`² small ones, one mesh for all.
fn squares(glb: &mut Glb, places: &[([f32; 3], f32, u16)]) {
    let mut corners = Vec::new();
    for &([x, y, z], half, cuts) in places {
        let step = 2.0 * half / f32::from(cuts);
        for i in 0..cuts * cuts {
            let (u, v) = (x - half + f32::from(i % cuts) * step, y - half + f32::from(i / cuts) * step);
            for (a, b) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                corners.extend([u + a * step, v + b * step, z]);
            }
        }
    }
    let positions = glb.floats("VEC3", &corners);
    let primitive = json!({ "attributes": { "POSITION": positions }, "material": 0 });
    glb.json["meshes"] = json!([{ "primitives": [primitive] }]);
    let glow = json!({ "emissiveFactor": [1.0, 1.0, 1.0], "extensions": { "KHR_materials_unlit": {} },
        "pbrMetallicRoughness": { "baseColorFactor": [1.0, 1.0, 1.0, 1.0] }, "doubleSided": true });
    glb.json["materials"] = json!([glow]);
    glb.json["extensionsUsed"] = json!(["KHR_materials_unlit"]);
}

/// A file's camera at z = 3 that sees 1.5 m up and down, and what it sees from side to side.
fn framed(folder: &Path, name: &str, lens: Value) {
    let mut glb = Glb::new();
    squares(&mut glb, &[([-2.6, 0.0, 0.0], 0.3, 1), ([2.6, 0.0, 0.0], 0.3, 1)]);
    glb.json["nodes"] = json!([{ "mesh": 0 }, { "camera": 0, "translation": [0.0, 0.0, 3.0] }]);
    glb.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    glb.json["cameras"] = json!([lens]);
    std::fs::write(folder.join(name), glb.bytes()).unwrap();
}

/// Columns that are bright around the middle row, where text is not: the first and the last of them.
fn bright(path: &Path) -> Option<[u32; 2]> {
    let image = read_png(path).expect("a picture");
    // Higher than letters.
    let rows = || image.height / 2 - 8..image.height / 2 + 8;
    let at = |x: u32| rows().all(|y| image.pixels[((y * image.width + x) * image.channels) as usize] > 0.5);
    Some([(0..image.width).find(|x| at(*x))?, (0..image.width).rev().find(|x| at(*x))?])
}

#[test]
fn a_narrow_window_shows_what_a_files_camera_framed() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let yfov = 2.0 * 0.5f64.atan();
    framed(
        dir.path(),
        "wide.glb",
        json!({ "type": "perspective", "perspective":
        { "yfov": yfov, "aspectRatio": 2.0, "znear": 0.01 } }),
    );
    framed(dir.path(), "silent.glb", json!({ "type": "perspective", "perspective": { "yfov": yfov, "znear": 0.01 } }));
    let script = json!([
        { "wait": "loaded" }, { "key": "P" }, { "wait": "idle" },
        // As wide as framed, wider, and narrower: 1.5 m up and down where there is room, else 3 m to each side.
        { "resize": [400, 200] }, { "wait": 10 }, { "wait": "idle" }, { "print": ["/camera/fov"] }, { "screenshot": "framed.png" },
        { "resize": [480, 200] }, { "wait": 10 }, { "wait": "idle" }, { "print": ["/camera/fov"] },
        { "resize": [200, 300] }, { "wait": 10 }, { "wait": "idle" }, { "print": ["/camera/fov"] }, { "screenshot": "narrow.png" },
        { "expect": { "/camera/file": 0 } }, { "key": "F12" }, { "wait": "idle" },
        // Hands go on from what is seen.
        { "save": { "fov": "/camera/fov" } }, { "drag": [[100, 60], [112, 60], [130, 64]] }, { "wait": "idle" },
        { "expect": { "/camera/file": null } }, { "expect_saved": { "fov": "/camera/fov" } },
        // A file that says nothing keeps its vertical field.
        { "drop": "silent.glb" }, { "until": { "/scene/spec": "silent.glb" } }, { "wait": "idle" },
        { "print": ["/camera/fov"] }, { "screenshot": "silent.png" },
    ]);
    let args = ["wide.glb", "--method", "direct", "--size", "400x200"];
    let out = session(&display, dir.path(), script, &args);
    succeeds(&out);
    let fovs: Vec<f64> = printed(&out).iter().map(|v| v["/camera/fov"].as_f64().unwrap()).collect();
    let tall = 2.0 * 1.5f64.atan();
    for (found, wanted) in fovs.iter().zip([yfov, yfov, tall, yfov]) {
        assert!((found - wanted.to_degrees()).abs() < 0.01, "{fovs:?}");
    }
    // 2.9 m of 3 to each side.
    let at = |name: &str| bright(&dir.path().join(name));
    assert_eq!(at("framed.png"), Some([7, 392]));
    assert_eq!(at("narrow.png"), Some([3, 196]));
    assert_eq!(at("silent.png"), None, "it is cut off, as without this rule");
    // F12 and the command line draw the same.
    assert_eq!(at("bouncelight-0001.png"), Some([3, 196]));
    let render = |fov: &[&str], name: &str| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bouncelight"));
        let args = ["render", "wide.glb", "--method", "direct", "--size", "200x300", "--exposure", "0", "-o", name];
        succeeds(&command.args(args).args(fov).current_dir(dir.path()).env("NODEVICE_SELECT", "1").output().unwrap());
        bright(&dir.path().join(name))
    };
    assert_eq!(render(&[], "line.png"), Some([3, 196]));
    // A field that is asked for is the vertical one.
    assert_eq!(render(&["--fov", "53.13"], "asked.png"), None);
}

/// A square of many triangles and three small ones that nobody meant, each further away.
#[test]
fn forgotten_things_take_no_room_in_the_picture() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, strays: &[([f32; 3], f32, u16)]| {
        let mut glb = Glb::new();
        squares(&mut glb, &[&[([0.0, 0.0, 0.0], 1.0, 16)], strays].concat());
        std::fs::write(dir.path().join(name), glb.bytes()).unwrap();
    };
    write("alone.glb", &[]);
    write("strays.glb", &[([0.0, -3.0, 0.0], 0.05, 1), ([1.0, -6.0, 0.0], 0.05, 1), ([4.0, 0.0, 0.0], 0.05, 1)]);
    // Negative control: as large as a fifth of it, it is meant.
    write("meant.glb", &[([0.0, -3.0, 0.0], 0.45, 4)]);
    let view = |name: &str| {
        json!([{ "drop": name }, { "until": { "/scene/spec": name } }, { "wait": "idle" },
        { "print": ["/camera/target", "/camera/eye"] }, { "screenshot": format!("{name}.png") },
        { "key": "V" }, { "wait": "idle" }, { "key": "F" }, { "wait": "idle" }, { "print": ["/camera/target", "/camera/eye"] }])
    };
    let mut script = vec![json!({ "wait": "loaded" }), json!({ "key": "P" }), json!({ "wait": "idle" })];
    for name in ["strays.glb", "alone.glb", "meant.glb"] {
        script.extend(view(name).as_array().unwrap().clone());
    }
    let out = session(&display, dir.path(), json!(script), &["cornell", "--method", "direct", "--size", "240x160"]);
    succeeds(&out);
    let places: Vec<Vec<f64>> = printed(&out)
        .iter()
        .map(|v| {
            ["/camera/target", "/camera/eye"]
                .iter()
                .flat_map(|p| v[*p].as_array().unwrap())
                .map(|n| n.as_f64().unwrap())
                .collect()
        })
        .collect();
    let apart = |a: usize, b: usize| places[a].iter().zip(&places[b]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(0, 2) < 1e-3 && apart(1, 3) < 1e-3, "{places:?}");
    assert!(apart(4, 2) > 0.5 && apart(5, 3) > 0.5, "{places:?}");
    let light = |name: &str| mean(&dir.path().join(name), 0..240, 0..160)[0];
    assert!(light("strays.glb.png") > 0.9 * light("alone.glb.png"), "the square fills the picture");
}
