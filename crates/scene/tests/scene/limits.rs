//! What a scene file may make the program read.

use std::path::Path;

use bouncelight::scene::Scene;
use bouncelight_scene::{LoadOptions, SceneError};
use serde_json::json;

use crate::glb::{Glb, load_bytes, png, put};

/// A textured triangle whose buffer and image have these URIs.
fn triangle(buffer: Option<&str>, image: &str) -> Vec<u8> {
    let mut glb = Glb::triangle();
    let uv = glb.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    glb.attribute("TEXCOORD_0", uv);
    glb.json["images"] = json!([{"uri": image}]);
    glb.json["textures"] = json!([{"source": 0}]);
    glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    if let Some(uri) = buffer {
        glb.json["buffers"] = json!([{"byteLength": glb.bin.len(), "uri": uri}]);
    }
    glb.bytes()
}

fn load(path: &Path, allow_outside: bool) -> Result<Scene, SceneError> {
    bouncelight_scene::load_with(
        path.to_str().expect("a path"),
        LoadOptions { allow_outside, ..LoadOptions::default() },
    )
}

#[test]
fn names_stay_in_the_folder_unless_allowed() {
    let outer = tempfile::tempdir().expect("a folder");
    let folder = outer.path().join("scene");
    std::fs::create_dir_all(folder.join("textures")).expect("folders");
    let picture = png([9, 8, 7, 255], 1, 1);
    put(outer.path(), "out.png", &picture);
    put(&folder, "textures/in.png", &picture);
    std::os::unix::fs::symlink(outer.path().join("out.png"), folder.join("link.png")).expect("a link");
    let whole = |name: &str| outer.path().join(name).display().to_string();
    let url = |name: &str| format!("file://{}", whole(name));
    let outside =
        ["../out.png", "textures/../../out.png", &whole("out.png"), &url("out.png"), "link.png", "%2e%2e/out.png"];
    let inside =
        ["textures/in.png", "./textures/../textures/in.png", "../scene/textures/in.png", &url("scene/textures/in.png")];
    for (names, allowed) in [(&outside[..], false), (&inside[..], true)] {
        for name in names {
            let path = put(&folder, "a.glb", &triangle(None, name));
            let told =
                |s: &Scene| s.warnings.iter().any(|w| w.contains("lies outside") && w.contains("--allow-outside"));
            let scene = load(&path, false).expect("a texture is not worth refusing a file");
            assert_eq!(told(&scene), !allowed, "{name}: {:?}", scene.warnings);
            assert_eq!(scene.images[0].rgba[0] == 9, allowed, "{name}");
            let scene = load(&path, true).expect("loads");
            assert!(!told(&scene) && scene.images[0].rgba[0] == 9, "{name}: {:?}", scene.warnings);
        }
    }
    // Whether there is such a file outside is not told.
    let path = put(&folder, "a.glb", &triangle(None, "../none.png"));
    assert!(load(&path, false).expect("loads").warnings[0].contains("lies outside"));
    // A buffer is worth it.
    put(outer.path(), "out.bin", &[0; 100]);
    let path = put(&folder, "a.glb", &triangle(Some("../out.bin"), "textures/in.png"));
    let message = load(&path, false).expect_err("has no geometry").to_string();
    assert!(message.contains("buffers[0]") && message.contains("'../out.bin' lies outside"), "{message}");

    let obj = b"mtllib ../up.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n";
    put(outer.path(), "up.mtl", b"newmtl m\nKd 0.5 0.5 0.5\nmap_Kd out.png\n");
    let path = put(&folder, "a.obj", obj);
    let scene = load(&path, false).expect("a library is not worth refusing a file");
    assert!(scene.warnings.iter().any(|w| w.contains("'../up.mtl' lies outside")), "{:?}", scene.warnings);
    assert_eq!(load(&path, true).expect("loads").materials[0].name, "m");
}

#[test]
fn relative_scene_paths_have_a_folder_too() {
    // The tests run in the package's folder.
    let folder = tempfile::tempdir_in(".").expect("a folder");
    put(folder.path(), "in.png", &png([9, 8, 7, 255], 1, 1));
    let path = put(folder.path(), "a.glb", &triangle(None, "in.png"));
    let relative = Path::new(path.file_name().expect("a name"));
    let relative = Path::new(folder.path().file_name().expect("a name")).join(relative);
    assert_eq!(load(&relative, false).expect("loads").images[0].rgba[0], 9);
}

#[test]
fn devices_and_pipes_are_not_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe.png");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs");
    assert!(made.success());
    std::fs::create_dir(folder.path().join("folder.png")).expect("a folder");
    for name in ["pipe.png", "folder.png", "/dev/zero"] {
        let path = put(folder.path(), "a.glb", &triangle(None, name));
        let scene = load(&path, true).expect("loads");
        assert!(
            scene.warnings.iter().any(|w| w.contains(name) && w.contains("not a regular file")),
            "{:?}",
            scene.warnings
        );
        let path = put(folder.path(), "b.glb", &triangle(Some(name), "x.png"));
        let message = load(&path, true).expect_err("no geometry").to_string();
        assert!(message.contains("not a regular file"), "{message}");
    }
    // The scene itself, and the surroundings.
    for name in ["pipe.glb", "pipe.gltf", "pipe.obj"] {
        let path = folder.path().join(name);
        std::fs::rename(folder.path().join("pipe.png"), &path).expect("renames");
        let message = load(&path, false).expect_err("a pipe").to_string();
        assert!(message.contains(name) && message.contains("regular file"), "{message}");
        std::fs::rename(&path, folder.path().join("pipe.png")).expect("renames");
    }
    let message = bouncelight_scene::sky::load(&pipe).expect_err("a pipe").to_string();
    assert!(message.contains("pipe.png") && message.contains("not a regular file"), "{message}");
}

#[test]
fn files_too_large_are_refused_before_they_are_read() {
    let folder = tempfile::tempdir().expect("a folder");
    // Sparse: it takes no room on the disk.
    let huge = std::fs::File::create(folder.path().join("huge.png")).expect("a file");
    huge.set_len(1 << 40).expect("a sparse file");
    let path = put(folder.path(), "a.glb", &triangle(None, "huge.png"));
    let start = std::time::Instant::now();
    let scene = load(&path, false).expect("loads");
    assert!(
        scene.warnings.iter().any(|w| w.contains("huge.png") && w.contains("1099511627776")),
        "{:?}",
        scene.warnings
    );
    assert!(start.elapsed().as_secs() < 5);
}

#[test]
fn file_uris_are_files() {
    let folder = tempfile::tempdir().expect("a folder");
    put(folder.path(), "my in.png", &png([9, 8, 7, 255], 1, 1));
    let at = folder.path().display();
    for (uri, word) in [
        (format!("file://{at}/my%20in.png"), ""),
        (format!("file://localhost{at}/my%20in.png"), ""),
        (format!("file:{at}/my%20in.png"), ""),
        (format!("FILE://{at}/my%20in.png"), ""),
        ("my%20in.png".to_owned(), ""),
        (format!("file://server{at}/my%20in.png"), "another machine"),
        ("https://server/in.png".to_owned(), "network"),
        (format!("file://{at}/gone.png"), "cannot be read"),
    ] {
        let scene = load(&put(folder.path(), "a.glb", &triangle(None, &uri)), false).expect("loads");
        assert_eq!(scene.images[0].rgba[0] == 9, word.is_empty(), "{uri}: {:?}", scene.warnings);
        assert!(word.is_empty() || scene.warnings.iter().any(|w| w.contains(word)), "{uri}: {:?}", scene.warnings);
    }
}

#[test]
fn a_byte_order_mark_is_no_content() {
    let mark = "\u{feff}";
    let obj = format!("{mark}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_eq!(load_bytes("a.obj", obj.as_bytes()).expect("loads").meshes[0].positions.len(), 3);
    let mut glb = Glb::triangle();
    // The triangle as JSON alone: positions as zeros with sparse values would do, a data URI is
    // shorter.
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAEAAAACAAAA";
    glb.json["buffers"] = json!([{"byteLength": 48, "uri": format!("data:x;base64,{data}")}]);
    let text = format!("{mark}{}", glb.json);
    assert_eq!(load_bytes("a.gltf", text.as_bytes()).expect("loads").meshes[0].indices, [0, 1, 2]);
    let folder = tempfile::tempdir().expect("a folder");
    put(folder.path(), "m.mtl", format!("{mark}newmtl m\nKd 1 0 0\n").as_bytes());
    let path = put(folder.path(), "a.obj", b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
    assert_eq!(load(&path, false).expect("loads").materials[0].base_color, [1.0, 0.0, 0.0, 1.0]);
}

#[test]
fn unknown_lights_are_left_out() {
    let mut glb = Glb::triangle();
    let kinds = json!([{"type": "laser", "name": "beam"}, {"type": "point"}]);
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": kinds}});
    let light = |i: u32| json!({"KHR_lights_punctual": {"light": i}});
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    glb.json["nodes"] = json!([{"mesh": 0}, {"extensions": light(0)}, {"extensions": light(1)}]);
    let scene = glb.load().expect("loads");
    assert_eq!(scene.lights.len(), 1, "the other light shines");
    let place = "extensions.KHR_lights_punctual.lights[0] 'beam'";
    let told: Vec<_> = scene.warnings.iter().filter(|w| w.contains(place) && w.contains("left out")).collect();
    assert_eq!(told.len(), 1, "{:?}", scene.warnings);
}
