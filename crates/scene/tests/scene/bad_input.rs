//! Every kind of broken input is an error that names the file and the place, or a warning; never a
//! panic.

use bouncelight::scene;
use bouncelight_scene::{SceneError, export};
use serde_json::json;

use crate::glb::{Glb, load_bytes, put};

/// Asserts that loading failed and that the message holds all the words, the file's name first
/// among them.
#[track_caller]
fn refused(result: Result<scene::Scene, SceneError>, words: &[&str]) {
    let message = match result {
        Ok(_) => panic!("was accepted; expected {words:?}"),
        Err(e) => e.to_string(),
    };
    println!("{message}");
    for word in words {
        assert!(message.contains(word), "'{word}' is not in: {message}");
    }
}

#[test]
fn specifications() {
    refused(bouncelight_scene::load("nowhere/at/all.glb"), &["nowhere/at/all.glb", "no such file"]);
    refused(bouncelight_scene::load("nowhere.obj"), &["nowhere.obj", "no such file"]);
    refused(bouncelight_scene::load(env!("CARGO_MANIFEST_DIR")), &[env!("CARGO_MANIFEST_DIR"), "is a folder", ".glb"]);
    refused(
        bouncelight_lab::scenes::load("cornel"),
        &["cornel", "cornell", "interior", "motion", "paper-room:INDEX", "home:INDEX"],
    );
    refused(bouncelight_lab::scenes::load("Cargo.toml"), &["Cargo.toml", "`.toml`", ".gltf"]);
    for bad in ["paper-room:", "paper-room", "paper-room:-1", "paper-room:x", "paper-room:1.5", "paper-room:4000000000"]
    {
        refused(bouncelight_lab::scenes::load(bad), &[bad, "paper-room:INDEX", "whole number", "65535"]);
    }
    for bad in ["home:", "home", "home:-1", "home:x", "home:1.5", "home:4000000000"] {
        refused(bouncelight_lab::scenes::load(bad), &[bad, "home:INDEX", "whole number", "65535"]);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let odd = folder.path().join("folder.glb");
    std::fs::create_dir(&odd).expect("a folder");
    assert!(matches!(bouncelight_scene::load(odd.to_str().expect("a path")), Err(SceneError::IsFolder { .. })));
}

#[test]
fn containers() {
    let good = Glb::triangle().bytes();
    assert!(load_bytes("made.glb", &good).is_ok(), "the control loads");
    for name in ["made.glb", "made.gltf", "made.obj"] {
        refused(load_bytes(name, b""), &[name, "empty (0 bytes)"]);
    }
    // Cut anywhere, a GLB is refused.
    for length in (1..good.len()).step_by(7).chain([4, 11, 12, 19, 20, good.len() - 1]) {
        refused(load_bytes("cut.glb", &good[..length]), &["cut.glb", "GLB"]);
    }
    refused(load_bytes("cut.glb", &good[..good.len() - 8]), &["truncated"]);
    refused(load_bytes("not.glb", b"{\"asset\":{}}"), &["not.glb", "glTF"]);
    let mut old = good.clone();
    old[4] = 1;
    refused(load_bytes("old.glb", &old), &["version 1"]);
    let mut chunk = good.clone();
    chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    refused(load_bytes("chunk.glb", &chunk), &["GLB chunk"]);
    let mut length = good.clone();
    length[8..12].copy_from_slice(&3u32.to_le_bytes());
    refused(load_bytes("length.glb", &length), &["GLB"]);
    refused(load_bytes("text.gltf", b"not json"), &["text.gltf", "JSON", "line 1"]);
    refused(load_bytes("asset.gltf", b"{}"), &["asset.gltf", "asset"]);
}

/// Any single flipped byte may be refused or loaded, but not crash.
#[test]
fn flipped_bytes_never_panic() {
    let good = Glb::triangle().bytes();
    for i in 0..good.len() {
        for flip in [0x01, 0x10, 0x80] {
            let mut bytes = good.clone();
            bytes[i] ^= flip;
            let _ = load_bytes("flipped.glb", &bytes);
        }
    }
}

#[test]
fn accessors() {
    let spoil = |change: &dyn Fn(&mut Glb)| {
        let mut glb = Glb::triangle();
        change(&mut glb);
        glb.load()
    };
    let set = |pointer: &'static str, value: serde_json::Value| {
        spoil(&move |g: &mut Glb| {
            let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
            let parent = g.json.pointer_mut(parent).expect("the parent");
            match parent.as_array_mut() {
                Some(list) => list[key.parse::<usize>().expect("an index")] = value.clone(),
                None => parent[key] = value.clone(),
            }
        })
    };
    refused(set("/accessors/0/count", json!(4)), &["made.glb", "accessors[0]", "beyond"]);
    refused(set("/accessors/0/count", json!(4_000_000_000u32)), &["accessors[0]", "beyond"]);
    refused(set("/accessors/0/count", json!(u64::MAX)), &["accessors[0]", "beyond"]);
    refused(set("/accessors/0/byteOffset", json!(u64::MAX)), &["accessors[0]", "beyond"]);
    refused(set("/accessors/0/byteOffset", json!(4)), &["accessors[0]", "beyond"]);
    refused(set("/accessors/0/bufferView", json!(77)), &["accessors[0].bufferView", "does not have"]);
    refused(set("/accessors/0/type", json!("VEC2")), &["accessors[0]", "2 components where 3"]);
    refused(set("/accessors/0/type", json!("VEC9")), &["accessors[0].type"]);
    refused(set("/accessors/0/componentType", json!(1)), &["accessors[0].componentType"]);
    refused(set("/accessors/1/componentType", json!(5126)), &["accessors[1]", "indices"]);
    refused(set("/bufferViews/0/byteLength", json!(35)), &["accessors[0]", "beyond"]);
    refused(set("/bufferViews/0/byteOffset", json!(u64::MAX)), &["bufferViews[0]", "beyond"]);
    refused(set("/bufferViews/0/byteStride", json!(4)), &["accessors[0]", "stride 4"]);
    refused(set("/bufferViews/0/buffer", json!(3)), &["bufferViews[0].buffer"]);
    refused(set("/buffers", json!([{"byteLength": 1_000_000}])), &["buffers[0]", "of 1000000"]);
    refused(set("/buffers", json!([{"byteLength": 48, "uri": "gone.bin"}])), &["buffers[0]", "gone.bin"]);
    refused(set("/buffers", json!([{"byteLength": 48, "uri": "https://a.b/c"}])), &["buffers[0]", "network"]);
    refused(set("/buffers", json!([{"byteLength": 3, "uri": "data:x;base64,!!!!"}])), &["buffers[0]", "base64"]);
    refused(set("/nodes/0/mesh", json!(9)), &["nodes[0].mesh", "does not have"]);
    refused(set("/scene", json!(9)), &["scene"]);
    let none = |g: &mut Glb| {
        let accessor = g.json["accessors"][0].as_object_mut().expect("an accessor");
        accessor.remove("bufferView");
        accessor.insert("count".into(), json!(4_000_000_000u32));
        accessor.insert(
            "sparse".into(),
            json!({"count": 1, "indices": {"bufferView": 1, "componentType": 5125}, "values": {"bufferView": 0}}),
        );
    };
    refused(spoil(&none), &["accessors[0]", "without any data"]);
    let sparse = |g: &mut Glb| {
        g.json["accessors"][0]["sparse"] = json!({"count": 1,
            "indices": {"bufferView": 1, "byteOffset": 8, "componentType": 5121}, "values": {"bufferView": 0}});
        g.bin[36 + 8] = 3;
    };
    refused(spoil(&sparse), &["accessors[0]", "sparse index 3"]);
    let zero = |g: &mut Glb| g.json["accessors"][0]["count"] = json!(0);
    refused(spoil(&zero), &["index 0"]);
}

#[test]
fn geometry() {
    let mut glb = Glb::triangle();
    glb.bin[36..40].copy_from_slice(&9u32.to_le_bytes());
    refused(glb.load(), &["meshes[0].primitives[0]", "thing", "index 9", "3 vertices"]);
    let mut glb = Glb::triangle();
    glb.attribute("POSITION", 7);
    refused(glb.load(), &["meshes[0].primitives[0].attributes", "accessor 7"]);
    for bad in [f32::NAN, f32::INFINITY] {
        let mut glb = Glb::triangle();
        glb.bin[16..20].copy_from_slice(&bad.to_le_bytes());
        refused(glb.load(), &["nothing to draw", "meshes[0]", "'thing'", "POSITION", "1 vertices, the first 1"]);
    }
    let mut glb = Glb::triangle();
    let normals = glb.floats("VEC3", &[0.0, 0.0, 1.0]);
    glb.attribute("NORMAL", normals);
    refused(glb.load(), &["NORMAL has 1 elements, POSITION 3"]);
}

#[test]
fn nodes() {
    let mut glb = Glb::triangle();
    glb.json["nodes"] = json!([{"children": [1]}, {"children": [0]}]);
    refused(glb.load(), &["nodes[0]", "cycles"]);
    glb.json["nodes"] = json!([{"children": [0]}]);
    refused(glb.load(), &["nodes[0]", "cycles"]);
    glb.json["nodes"] = json!([{"children": [1, 1]}, {"mesh": 0}]);
    refused(glb.load(), &["nodes[1]", "twice"]);
    glb.json["nodes"] = json!([{"children": [7]}]);
    refused(glb.load(), &["nodes[0].children[0]"]);
    // A chain of a hundred thousand nodes is odd, but a tree.
    let mut deep: Vec<_> = (1..100_000).map(|i| json!({"children": [i]})).collect();
    deep.push(json!({"mesh": 0, "translation": [1.0, 2.0, 3.0]}));
    glb.json["nodes"] = json!(deep);
    let scene = glb.load().expect("a deep tree");
    assert_eq!(scene.instances[0].transform[3], [1.0, 2.0, 3.0, 1.0]);
}

#[test]
fn references() {
    let punctual = |light: serde_json::Value| json!({"KHR_lights_punctual": {"lights": [light]}});
    let uses = |i: u32| json!({"KHR_lights_punctual": {"light": i}});
    let mut glb = Glb::triangle();
    glb.json["extensions"] = punctual(json!({"type": "point"}));
    glb.json["nodes"] = json!([{"extensions": uses(9)}]);
    refused(glb.load(), &["nodes[0]", "light"]);
    glb.json["nodes"] = json!([{"mesh": 0, "extensions": uses(0)}]);
    assert!(glb.load().is_ok());
    let mut glb = Glb::triangle();
    glb.json["nodes"] = json!([{"mesh": 0, "camera": 0}]);
    refused(glb.load(), &["nodes[0].camera"]);
    for camera in [json!({"type": "perspective"}), json!({"type": "orthographic"}), json!({"type": "fisheye"})] {
        glb.json["cameras"] = json!([camera]);
        let scene = glb.load().expect("a camera without a lens is left out");
        assert!(scene.warnings.iter().any(|w| w.contains("cameras[0]")) && scene.cameras[0].name == "framing");
    }
    glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": -1.0, "znear": 0.0}}]);
    let scene = glb.load().expect("an impossible lens is left out");
    assert!(scene.warnings.iter().any(|w| w.contains("lens")) && scene.cameras[0].name == "framing");
    for [xmag, ymag] in [[0.0, 1.0], [1.0, 0.0], [-1.0, 1.0], [1.0, -2.0], [1e20, 1.0], [1.0, 1e20]] {
        let lens = json!({"xmag": xmag, "ymag": ymag, "znear": 0.1, "zfar": 9.0});
        glb.json["cameras"] = json!([{"type": "orthographic", "orthographic": lens}]);
        let scene = glb.load().expect("a lens without size is left out");
        let about: Vec<_> = scene.warnings.iter().filter(|w| w.contains("cameras[0]")).collect();
        assert!(matches!(&about[..], [w] if w.contains("ymag") && w.contains("left out")), "{about:?}");
        assert_eq!((scene.cameras.len(), &*scene.cameras[0].name), (1, "framing"));
    }
    let mut glb = Glb::triangle();
    glb.json["nodes"] = json!([{"mesh": 0, "skin": 4}]);
    refused(glb.load(), &["nodes[0].skin"]);
    let mut glb = Glb::triangle();
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(4);
    refused(glb.load(), &["material"]);
    glb.json["materials"] = json!([{}, {}, {}, {}, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 2}}}]);
    refused(glb.load(), &["materials[4]", "baseColorTexture"]);
    glb.json["materials"][4] = json!({"normalTexture": {"index": 2}});
    refused(glb.load(), &["materials[4]", "normalTexture"]);
    glb.json["materials"][4] = json!({"emissiveFactor": [1e30, -5.0, 0.0], "alphaMode": "MASK", "alphaCutoff": -3.0});
    let scene = glb.load().expect("clamped");
    assert!(scene.warnings.iter().any(|w| w.contains("out of range")), "{:?}", scene.warnings);
    assert!(scene.materials[0].emissive.iter().all(|e| (0.0..=1e9).contains(e)));
}

#[test]
fn required_extensions() {
    let mut glb = Glb::triangle();
    glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization", "KHR_texture_transform"]);
    assert!(glb.load().is_ok());
    glb.json["extensionsUsed"] = json!(["KHR_texture_transform", "KHR_materials_iridescence"]);
    let scene = glb.load().expect("used is not required");
    let about = |word: &str| scene.warnings.iter().filter(|w| w.contains(word)).count();
    assert_eq!((about("KHR_materials_iridescence"), about("KHR_texture_transform")), (1, 0), "{:?}", scene.warnings);
    // All of them in one message.
    glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization", "ACME_secret", "ACME_other"]);
    refused(glb.load(), &["made.glb", "not supported: ACME_secret, ACME_other; export the file without"]);
}

#[test]
fn obj_files() {
    refused(load_bytes("a.obj", b"v 0 0 0\nv 1 x 0\n"), &["a.obj", "line 2", "'x'"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nv 1 nan 0\n"), &["line 2", "'nan'"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nv 1 0\n"), &["line 2", "2 numbers"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), &["line 4", "'4'"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nf 0 1 1\n"), &["line 2", "'0'"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nf 1/1 1 1\n"), &["line 2", "'1/1'"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nf 99999999999999999999 1 1\n"), &["line 2"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nusemtl\n"), &["line 2", "usemtl"]);
    // Not text at all, and text without a face.
    refused(load_bytes("a.obj", &[0xff, 0xfe, 0x00, 0x80]), &["a.obj", "nothing to draw", "no triangle is placed"]);
    refused(load_bytes("a.obj", b"v 0 0 0\nv 1 0 0\n"), &["nothing to draw"]);
}

#[test]
fn unwritable_output() {
    let scene = bouncelight_scene::load("cornell").expect("a bundled scene");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let blocked = folder.path().join("no such folder").join("a.glb");
    let error = export::write_glb(&scene, &blocked).expect_err("there is no such folder").to_string();
    assert!(error.contains("a.glb") && error.contains("cannot be written"), "{error}");
    // A folder in the way: nothing is left behind.
    let taken = folder.path().join("taken.glb");
    std::fs::create_dir(&taken).expect("a folder");
    put(&taken, "full", b"x");
    assert!(export::write_glb(&scene, &taken).is_err());
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("readable").collect();
    assert_eq!(left.len(), 1, "{left:?}");
}
