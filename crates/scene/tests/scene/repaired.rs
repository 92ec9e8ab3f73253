//! glTF files that say something wrong or unknown where a picture can do without it: they are drawn
//! as the file without it, with a warning.

use bouncelight::scene::{self, AlphaMode, LightKind, Scene};
use bouncelight_scene::{LoadOptions, SceneError};
use serde_json::{Value, json};

use crate::glb::{Glb, load_bytes, png, put};
use crate::shared::{assert_sound, world_points};

#[track_caller]
pub fn load(glb: &Glb) -> Scene {
    let scene = glb.load().unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    scene
}

fn strict(glb: &Glb) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = put(folder.path(), "made.glb", &glb.bytes());
    let options = LoadOptions { strict: true, ..LoadOptions::default() };
    bouncelight_scene::load_with(path.to_str().expect("a path"), options)
}

#[track_caller]
pub fn warned(scene: &Scene, words: &[&str]) {
    let found = scene.warnings.iter().any(|w| words.iter().all(|word| w.contains(word)));
    assert!(found, "{words:?}: {:?}", scene.warnings);
}

/// A square in the plane z = 0 whose four corners triangles share.
pub fn square() -> Glb {
    let mut glb = Glb::new();
    let places = glb.floats("VEC3", &[-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0]);
    let indices = glb.accessor("SCALAR", 5125, 6, &[0u32, 1, 2, 0, 2, 3].map(u32::to_le_bytes).concat());
    glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": places}, "indices": indices});
    glb
}

#[test]
fn words_that_no_picture_needs() {
    let plain = load(&Glb::triangle());
    let same = |name: &str, words: &[&str], change: &dyn Fn(&mut Glb)| {
        let mut glb = Glb::triangle();
        change(&mut glb);
        let scene = load(&glb);
        assert_eq!((scene.instances.len(), world_points(&scene, 0)), (1, world_points(&plain, 0)), "{name}");
        warned(&scene, words);
    };
    let attribute = |name: &'static str, component: u32| {
        move |g: &mut Glb| {
            let values = g.floats("VEC4", &[0.5; 12]);
            g.json["accessors"][values]["componentType"] = json!(component);
            g.attribute(name, values);
        }
    };
    same("extension", &["primitives[0]", "attributes"], &attribute("KHR_gaussian_splatting:ROTATION", 5126));
    same("old name", &["attributes"], &attribute("BATCHID", 5126));
    same("doubles", &["TANGENT", "unknown kind"], &attribute("TANGENT", 5130));
    same("signed words", &["JOINTS_0", "unknown kind"], &attribute("JOINTS_0", 5124));
    same("nobody's", &["accessors[2]"], &|g| {
        g.json["accessors"]
            .as_array_mut()
            .expect("a list")
            .push(json!({"componentType": 5130, "count": 1, "type": "X"}));
    });
    same("mode", &["meshes[1].primitives[0]", "mode"], &|g| {
        let other = json!({"primitives": [{"mode": 7, "attributes": {"POSITION": 0}}]});
        g.json["meshes"].as_array_mut().expect("a list").push(other);
        g.json["nodes"] = json!([{"mesh": 0}, {"mesh": 1}]);
        g.json["scenes"] = json!([{"nodes": [0, 1]}]);
    });
    same("sampler", &["samplers[0]"], &|g| {
        g.json["samplers"] = json!([{"wrapS": 10496, "magFilter": 1, "minFilter": 2}])
    });
    same("target", &["bufferViews[0].target"], &|g| g.json["bufferViews"][0]["target"] = json!(7));
    same("camera", &["cameras[0]", "projection"], &|g| {
        g.json["cameras"] = json!([{"type": "fisheye"}]);
        g.json["nodes"][0]["camera"] = json!(0);
    });
    let mut alpha = Glb::triangle();
    alpha.json["materials"] = json!([{"alphaMode": "DITHER"}]);
    alpha.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let read = load(&alpha);
    assert_eq!(read.materials[read.meshes[0].material].alpha_mode, AlphaMode::Opaque);
    warned(&read, &["materials[0].alphaMode"]);
    // Negative controls: what the picture needs is refused, and everything where that is asked for.
    let mut needed = Glb::triangle();
    needed.json["accessors"][0]["componentType"] = json!(5130);
    assert!(needed.load().is_err());
    let mut unknown = Glb::triangle();
    attribute("BATCHID", 5126)(&mut unknown);
    assert!(unknown.load().is_ok() && strict(&unknown).is_err() && strict(&Glb::triangle()).is_ok());
}

#[test]
fn other_spellings_of_numbers_and_names() {
    let mut glb = Glb::triangle();
    let bytes: String = glb.bin.iter().map(|b| format!("%{b:02X}")).collect();
    let base64 = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAEAAAACAAAA";
    glb.json["buffers"] = json!([{"byteLength": 48, "uri": "URI"}]);
    glb.bin.clear();
    let json = glb.json.to_string();
    let read = |json: &str, uri: &str| load_bytes("made.gltf", json.replace("URI", uri).as_bytes());
    let octets = "data:application/octet-stream";
    let plain = read(&json, &format!("{octets};base64,{base64}")).expect("it loads");
    let uris = [
        format!("{octets},{bytes}"),
        format!("data:,{bytes}"),
        format!("DATA:application/octet-stream;BASE64,{base64}"),
        format!("{octets};charset=x;base64,{}", base64.replace('g', "%67").replace('A', "%41")),
        format!("{octets};base64,{}", base64.replace("AACA", "AA CA\\n")),
    ];
    for uri in uris {
        let scene = read(&json, &uri).unwrap_or_else(|e| panic!("{uri}: {e}"));
        assert_eq!(scene.meshes[0].positions, plain.meshes[0].positions, "{uri}");
    }
    let uri = format!("{octets};base64,{base64}");
    let count = "\"count\":3";
    for (from, to) in [
        (count, "\"count\":3.0"),
        (count, "\"count\":3e0"),
        (count, "\"count\":0.3e1"),
        ("\"byteLength\":48", "\"byteLength\":48.0"),
        ("\"componentType\":5126", "\"componentType\":5126.0"),
        ("\"POSITION\":0", "\"POSITION\":0.0"),
        ("\"nodes\":[0]", "\"nodes\":[0,null]"),
        ("\"scene\":0", "\"scene\":0,\"animations\":null"),
        ("\"scene\":0", "\"scene\":0,\"extras\":[NaN,nan,-NaN,Infinity,-Infinity,1e400,-1e999,\"1e400 \\\" NaN\"]"),
        ("\"nodes\":[{", "\"nodes\":[{\"translation\":[NaN,-nan,0],"),
    ] {
        assert!(json.contains(from), "{from}");
        let scene = read(&json.replace(from, to), &uri).unwrap_or_else(|e| panic!("{to}: {e}"));
        assert_eq!(scene.meshes[0].positions, plain.meshes[0].positions, "{to}");
        warned(&scene, &["made.gltf", "JSON"]);
    }
    let filled = load_bytes("made.gltf", (json.replace("URI", &uri) + "\0\0\0").as_bytes()).expect("it loads");
    assert_eq!(filled.meshes[0].positions, plain.meshes[0].positions);
    let told = |to: &str| read(&json.replace("\"scene\":0", to), &uri).expect("it loads").warnings.join(" ");
    let strange = told("\"scene\":0,\"extras\":[NaN,Infinity,1e400]");
    assert!(strange.contains("1 numbers are NaN") && strange.contains("2 numbers are larger"), "{strange}");
    // Negative controls.
    assert!(read(&json.replace(count, "\"count\":1e400"), &uri).is_err());
    assert!(read(&json.replace(count, "\"count\":Nan3"), &uri).is_err());
    assert!(read(&json.replace(count, "\"count\":3.5"), &uri).is_err());
    assert!(read(&json, "data:application/octet-stream;base64").is_err());
    let told = read(&json, &format!("{octets},%00")).map(drop).unwrap_err().to_string();
    assert!(told.contains("1 bytes of 48"), "{told}");
}

#[test]
fn names_of_files_as_people_write_them() {
    let mut glb = Glb::triangle();
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("sub")).expect("a folder");
    for name in ["sub/a.bin", "b c.bin", "d#e.bin", "100%.bin", "f%20g.bin"] {
        put(folder.path(), name, &glb.bin);
    }
    glb.bin.clear();
    let mut read = |uri: &str| {
        glb.json["buffers"] = json!([{"byteLength": 48, "uri": uri}]);
        let path = put(folder.path(), "made.gltf", glb.json.to_string().as_bytes());
        bouncelight_scene::load(path.to_str().expect("a path"))
    };
    for uri in [
        "sub\\a.bin",
        ".\\sub\\a.bin",
        "sub%5Ca.bin",
        "b%20c.bin",
        "b c.bin",
        "d#e.bin",
        "d%23e.bin",
        "100%.bin",
        "100%25.bin",
        "f%2520g.bin",
        "f%20g.bin",
    ] {
        assert!(read(uri).is_ok(), "{uri}: {:?}", read(uri).err());
    }
    for uri in ["sub\\b.bin", "..\\a.bin", "sub%5C..%5C..%5Ca.bin"] {
        assert!(read(uri).is_err(), "{uri}");
    }
}

#[test]
fn a_number_that_is_none_takes_one_triangle_or_nothing() {
    let spoilt = |name: &str, per: usize, kind: &str, at: usize| {
        let mut glb = square();
        let mut values = match name {
            "NORMAL" => [0.0, 0.0, 1.0].repeat(4),
            "TANGENT" => [1.0, 0.0, 0.0, 1.0].repeat(4),
            _ => vec![0.5; 4 * per],
        };
        values[at * per] = f32::NAN;
        if name == "TANGENT" {
            let normals = glb.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
            glb.attribute("NORMAL", normals);
        }
        let accessor = glb.floats(kind, &values);
        glb.attribute(name, accessor);
        glb
    };
    for (name, per, kind) in [
        ("NORMAL", 3, "VEC3"),
        ("TANGENT", 4, "VEC4"),
        ("TEXCOORD_0", 2, "VEC2"),
        ("TEXCOORD_1", 2, "VEC2"),
        ("COLOR_0", 4, "VEC4"),
    ] {
        let glb = spoilt(name, per, kind, 2);
        let scene = load(&glb);
        let mesh = &scene.meshes[0];
        assert_eq!(mesh.indices.len(), 6, "{name}");
        assert!(mesh.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]), "{name}: {:?}", mesh.normals);
        assert!(mesh.uv0.iter().chain(&mesh.uv1).flatten().chain(mesh.colors.iter().flatten()).all(|v| v.is_finite()));
        warned(&scene, &[name, "1 vertices, the first 2"]);
        let told = strict(&glb).map(drop).expect_err("it is refused").to_string();
        assert!(told.contains(&format!("{name} of vertex 2")), "{told}");
    }
    // A corner of one triangle, and one of both.
    for (vertex, left) in [(1, 3), (3, 3), (2, 0)] {
        let mut glb = square();
        glb.bin[12 * vertex..12 * vertex + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
        let read = glb.load();
        if left == 0 {
            let told = read.map(drop).expect_err("nothing is left").to_string();
            assert!(told.contains("nothing to draw") && told.contains("POSITION"), "{told}");
            continue;
        }
        let scene = read.expect("it loads");
        assert_sound(&scene);
        assert_eq!(scene.meshes[0].indices.len(), left);
        let reach = scene.meshes[0].positions.iter().flatten().fold(0.0f32, |m, c| m.max(c.abs()));
        assert_eq!(reach, 1.0, "it reaches no farther");
        warned(&scene, &["POSITION", "triangles are left out"]);
        assert!(strict(&glb).is_err());
    }
    // A copy that is nowhere.
    let mut glb = square();
    let places = glb.floats("VEC3", &[0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 4.0, 0.0, 0.0]);
    let copies = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    glb.json["nodes"] = json!([{"mesh": 0, "extensions": copies}]);
    let scene = load(&glb);
    assert_eq!((scene.instances.len(), scene.instances[1].transform[3][0]), (2, 4.0));
    warned(&scene, &["1 copies", "left out"]);
    assert!(strict(&glb).is_err());
    // A node that is nowhere.
    let mut glb = square();
    glb.json["nodes"] =
        json!([{"mesh": 0}, {"mesh": 0, "translation": [1e39, 0.0, 0.0], "children": [2]}, {"mesh": 0}]);
    glb.json["scenes"] = json!([{"nodes": [0, 1]}]);
    let scene = load(&glb);
    assert_eq!(scene.instances.len(), 1);
    warned(&scene, &["nodes[1]", "left out"]);
}

#[test]
fn normals_without_a_length_are_those_of_their_triangles() {
    let wall = |normals: [[f32; 3]; 4]| {
        let mut glb = square();
        let normals = glb.floats("VEC3", normals.as_flattened());
        glb.attribute("NORMAL", normals);
        load(&glb)
    };
    let front = [0.0, 0.0, 1.0];
    for bad in [[0.0; 3], [1e-30, 0.0, 0.0], [0.0, -0.0, 1e-40]] {
        for normals in [[bad; 4], [bad, front, front, front]] {
            let scene = wall(normals);
            assert_eq!(scene.meshes[0].normals, [front; 4], "{normals:?}");
            warned(&scene, &["normals have no length"]);
        }
    }
    // Negative control: those of the file stay.
    assert_eq!(wall([[0.0, 1.0, 0.0]; 4]).meshes[0].normals, [[0.0, 1.0, 0.0]; 4]);
}

#[test]
fn a_third_set_of_texture_coordinates() {
    let read = |sets: &[u32], json: Value| {
        let mut glb = square();
        for set in sets {
            let values = glb.floats("VEC2", &[*set as f32; 8]);
            glb.attribute(&format!("TEXCOORD_{set}"), values);
        }
        let view = glb.view(&png([200, 100, 50, 255], 2, 2));
        glb.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
        glb.json["textures"] = json!([{"source": 0}]);
        glb.json["materials"] = json!([json]);
        glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        load(&glb)
    };
    // What each texture reads at the first vertex.
    let seen = |scene: &Scene| {
        let (mesh, material) = (&scene.meshes[0], &scene.materials[scene.meshes[0].material]);
        let at = |t: Option<scene::TextureRef>| t.map(|t| [&mesh.uv0, &mesh.uv1][usize::from(t.uv_set)][0][0]);
        [at(material.base_color_texture), at(material.emissive_texture), at(material.occlusion_texture)]
    };
    let base = |set: u32| json!({"baseColorTexture": {"index": 0, "texCoord": set}});
    let both =
        |a: u32, b: u32| json!({"pbrMetallicRoughness": base(a), "emissiveTexture": {"index": 0, "texCoord": b}});
    for set in [0, 1, 2, 3] {
        assert_eq!(
            seen(&read(&[0, 1, 2, 3], json!({"pbrMetallicRoughness": base(set)}))),
            [Some(set as f32), None, None]
        );
    }
    for (a, b) in [(0, 1), (1, 0), (0, 2), (2, 0), (2, 3), (3, 1)] {
        assert_eq!(seen(&read(&[0, 1, 2, 3], both(a, b))), [Some(a as f32), Some(b as f32), None], "{a} {b}");
    }
    let moved = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0,
        "extensions": {"KHR_texture_transform": {"texCoord": 2}}}}});
    assert_eq!(seen(&read(&[0, 2], moved))[0], Some(2.0));
    // Negative control: of three at once one is left out, and told.
    let mut three = both(0, 1);
    three["occlusionTexture"] = json!({"index": 0, "texCoord": 2});
    let three = read(&[0, 1, 2], three);
    assert_eq!(seen(&three), [Some(0.0), Some(1.0), None]);
    warned(&three, &["occlusionTexture", "TEXCOORD_2"]);
}

#[test]
fn animations_with_odd_channels() {
    let moved = |channels: Value| {
        let mut glb = square();
        let times = glb.floats("SCALAR", &[0.0, 1.0, 1.0, 2.0]);
        let places = glb.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 5.0, 0.0, 0.0, 6.0, 0.0, 0.0]);
        glb.json["animations"] = json!([{"samplers": [{"input": times, "output": places}], "channels": channels}]);
        load(&glb)
    };
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": "translation"}});
    let at = |mut scene: Scene, time: f32| {
        assert!(scene.pose(0, time));
        scene.instances[0].transform[3][0]
    };
    // Two keys at one time: a jump.
    let expected = [(0.5, 0.5), (0.99, 0.99), (1.0, 5.0), (1.5, 5.5), (2.0, 6.0), (3.0, 6.0)];
    for (time, x) in expected {
        assert!((at(moved(json!([channel])), time) - x).abs() < 1e-5, "{time}");
    }
    // Channels that move nothing beside one that does.
    for odd in [
        json!({"sampler": 0, "target": {"path": "translation"}}),
        json!({"sampler": 0, "target": {}}),
        json!({"sampler": 0}),
    ] {
        let scene = moved(json!([odd, channel]));
        warned(&scene, &["animations[0].channels[0]"]);
        assert!((at(scene, 0.5) - 0.5).abs() < 1e-5);
    }
    assert!(!moved(json!([{"sampler": 0, "target": {"path": "translation"}}])).pose(0, 0.0));
}

#[test]
fn a_spot_without_its_cone_is_the_default_one() {
    let mut glb = square();
    let lit = |glb: &mut Glb, light: Value| {
        glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        glb.json["nodes"] = json!([{"mesh": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}]);
        load(glb).lights[0].kind
    };
    let given = lit(&mut glb, json!({"type": "spot", "spot": {}}));
    assert!(
        matches!(given, LightKind::Spot { outer_angle, .. } if (outer_angle - std::f32::consts::FRAC_PI_4).abs() < 1e-5)
    );
    assert_eq!(lit(&mut glb, json!({"type": "spot"})), given);
    assert_ne!(lit(&mut glb, json!({"type": "spot", "spot": {"outerConeAngle": 0.5}})), given);
}
