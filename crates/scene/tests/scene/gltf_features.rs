//! What the glTF loader must understand, each on a file made for it.

use bouncelight::scene::{AlphaMode, LightKind, Material, Scene, Wrap};
use glam::{Mat4, Vec3};
use serde_json::json;

use crate::glb::{Glb, load_bytes, png, put};
use crate::shared::assert_sound;

fn load(glb: &Glb) -> Scene {
    let scene = glb.load().unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    scene
}

fn close(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
}

#[test]
fn missing_normals_are_flat_and_default_light_and_camera_are_added() {
    let scene = load(&Glb::triangle());
    assert_eq!(scene.meshes[0].normals, [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert!(scene.warnings[0].contains("sun"));
    assert_eq!((scene.lights.len(), scene.cameras.len()), (1, 1));
    assert_eq!(scene.environment.radiance, [0.125; 3]);
    // The camera sees the triangle.
    let to_view = Mat4::from_cols_array_2d(&scene.cameras[0].transform).inverse();
    for p in &scene.meshes[0].positions {
        let v = to_view.transform_point3(Vec3::from(*p));
        let slope = (scene.cameras[0].yfov / 2.0).tan();
        assert!(v.z < 0.0 && v.y.abs() < -v.z * slope && v.x.abs() < -v.z * slope, "{v}");
    }
    assert!(scene.cameras[0].eye()[2] > 0.5, "from the front");
}

#[test]
fn nodes_transform_and_share_meshes() {
    let mut glb = Glb::triangle();
    glb.json["scenes"] = json!([{"nodes": [0, 3]}]);
    let (s, c) = (std::f32::consts::FRAC_PI_4).sin_cos();
    glb.json["nodes"] = json!([
        {"name": "parent", "translation": [10.0, 0.0, 0.0], "scale": [2.0, 2.0, 2.0], "children": [1, 2]},
        {"name": "a", "mesh": 0, "rotation": [0.0, 0.0, s, c]},
        {"name": "b", "mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,5,0,1]},
        {"name": "mirrored", "mesh": 0, "scale": [-1.0, 1.0, 1.0]},
        {"name": "not in the scene", "mesh": 0},
    ]);
    let scene = load(&glb);
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 3));
    let names: Vec<_> = scene.instances.iter().map(|i| &*i.name).collect();
    assert_eq!(names, ["a", "b", "mirrored"]);
    let x = |i: usize| Mat4::from_cols_array_2d(&scene.instances[i].transform).transform_point3(Vec3::X);
    assert!(x(0).distance(Vec3::new(10.0, 2.0, 0.0)) < 1e-5, "{}", x(0));
    assert!(x(1).distance(Vec3::new(12.0, 10.0, 0.0)) < 1e-5, "{}", x(1));
    assert!(x(2).distance(Vec3::NEG_X) < 1e-5, "{}", x(2));
}

#[test]
fn strips_fans_and_unindexed() {
    let corners = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let make = |mode: u32, corners: &[f32]| {
        let mut glb = Glb::new();
        let p = glb.floats("VEC3", corners);
        glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": p}, "mode": mode});
        glb
    };
    let strip = load(&make(5, &corners));
    assert_eq!(strip.meshes[0].normals, [[0.0, 0.0, 1.0]; 6], "both triangles of the strip face +Z");
    let fan = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    assert_eq!(load(&make(6, &fan)).meshes[0].normals, [[0.0, 0.0, 1.0]; 6]);
    // Read as a strip, the fan's corners fold over: the check can fail.
    assert_ne!(load(&make(5, &fan)).meshes[0].normals, [[0.0, 0.0, 1.0]; 6]);
    assert_eq!(load(&make(4, &corners)).meshes[0].indices.len(), 3, "left-over corners are dropped");
    for mode in [0, 1, 2, 3] {
        let message = make(mode, &corners).load().expect_err("nothing is left").to_string();
        assert!(message.contains("nothing to draw") && message.contains("only triangles"), "{message}");
    }
}

#[test]
fn quantised_and_sparse_accessors() {
    let mut glb = Glb::triangle();
    glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    // Positions as normalised i16 in a stride of 8, normals as i8, texture coordinates as u16,
    // colours as u8 RGB.
    let positions = [[0i16, 0, 0, 99], [32767, 0, 0, 99], [0, -32768, 0, 99]];
    let bytes: Vec<u8> = positions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let p = glb.accessor("VEC3", 5122, 3, &bytes);
    glb.json["accessors"][p]["normalized"] = json!(true);
    let view = glb.json["accessors"][p]["bufferView"].as_u64().expect("a view") as usize;
    glb.json["bufferViews"][view]["byteStride"] = json!(8);
    let n = glb.accessor("VEC3", 5120, 3, &[0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0]);
    glb.json["accessors"][n]["normalized"] = json!(true);
    let view = glb.json["accessors"][n]["bufferView"].as_u64().expect("a view") as usize;
    glb.json["bufferViews"][view]["byteStride"] = json!(4);
    let t = glb.accessor("VEC2", 5123, 3, &[0u16, 0, 65535, 0, 0, 65535].map(u16::to_le_bytes).concat());
    glb.json["accessors"][t]["normalized"] = json!(true);
    let t1 = glb.accessor("VEC2", 5123, 3, &[0u16, 0, 7, 0, 0, 9].map(u16::to_le_bytes).concat());
    let c = glb.accessor("VEC3", 5121, 3, &[255, 0, 0, 0, 255, 0, 0, 0, 51]);
    glb.json["accessors"][c]["normalized"] = json!(true);
    for (name, accessor) in [("POSITION", p), ("NORMAL", n), ("TEXCOORD_0", t), ("TEXCOORD_1", t1), ("COLOR_0", c)] {
        glb.attribute(name, accessor);
    }
    let scene = load(&glb);
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    assert_eq!(mesh.normals, [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(mesh.uv0, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    assert_eq!(mesh.uv1, [[0.0, 0.0], [7.0, 0.0], [0.0, 9.0]]);
    assert_eq!(mesh.colors[2], [0.0, 0.0, 0.2, 1.0]);

    // Sparse over a base, and sparse over zeros.
    for with_base in [true, false] {
        let mut glb = Glb::triangle();
        let at = glb.view(&[1, 0, 2, 0]);
        let values: Vec<u8> = [5.0f32, 6.0, 7.0, 8.0, 9.0, 10.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let values = glb.view(&values);
        glb.json["accessors"][0]["sparse"] = json!({"count": 2,
            "indices": {"bufferView": at, "componentType": 5123}, "values": {"bufferView": values}});
        if !with_base {
            glb.json["accessors"][0].as_object_mut().expect("an accessor").remove("bufferView");
        }
        assert_eq!(load(&glb).meshes[0].positions, [[0.0; 3], [5.0, 6.0, 7.0], [8.0, 9.0, 10.0]]);
    }
}

/// A triangle with texture coordinates and one material, whose one texture holds `image`.
fn textured(image: &[u8]) -> Glb {
    let mut glb = Glb::triangle();
    let uv = glb.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    glb.attribute("TEXCOORD_0", uv);
    let view = glb.view(image);
    glb.json["images"] = json!([{"name": "the image", "bufferView": view, "mimeType": "image/png"}]);
    glb.json["samplers"] = json!([{"magFilter": 9728, "minFilter": 9728, "wrapS": 33071, "wrapT": 33648}]);
    glb.json["textures"] = json!([{"source": 0, "sampler": 0}]);
    glb.json["materials"] = json!([{"name": "m"}]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    glb
}

#[test]
fn materials() {
    let mut glb = textured(&png([10, 20, 30, 255], 4, 2));
    let turned = json!({"KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": std::f32::consts::FRAC_PI_2,
        "scale": [2.0, 3.0]}});
    glb.json["materials"] = json!([{
        "name": "all of it", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.6,
            "baseColorTexture": {"index": 0, "extensions": turned}, "metallicRoughnessTexture": {"index": 0}},
        "normalTexture": {"index": 0, "scale": 0.7, "extensions": turned},
        "occlusionTexture": {"index": 0, "strength": 0.8},
        "emissiveTexture": {"index": 0}, "emissiveFactor": [1.0, 0.5, 0.0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8000.0},
            "KHR_materials_ior": {"ior": 1.0}},
    }]);
    let scene = load(&glb);
    let m = &scene.materials[0];
    assert_eq!((m.base_color, m.metallic, m.roughness), ([0.1, 0.2, 0.3, 0.4], 0.5, 0.6));
    assert_eq!((m.alpha_mode, m.double_sided, m.unlit), (AlphaMode::Mask { cutoff: 0.25 }, true, false));
    assert_eq!((m.emissive, m.normal_scale, m.occlusion_strength), ([8000.0, 4000.0, 0.0], 0.7, 0.8));
    assert_eq!((m.f0, Material::default().f0), (0.0, 0.04), "an index of refraction of 1 reflects nothing");
    let base = m.base_color_texture.expect("a base colour texture");
    assert_eq!(base.sampler.wrap, [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
    assert!(!base.sampler.mag_linear && !base.sampler.min_linear);
    // Scale, then a quarter turn (u' = v, v' = -u), then the offset.
    let expected = [0.0, 3.0, 0.1, -2.0, 0.0, 0.2];
    assert!(close(base.transform.as_flattened(), &expected), "{:?}", base.transform);
    let normal = m.normal_texture.expect("a normal map");
    assert!(close(normal.transform.as_flattened(), &expected), "{:?}", normal.transform);
    // One file image becomes three: read as colour, as data, as normals.
    assert_eq!(scene.images.len(), 3);
    let texels: Vec<&[u8]> = scene.images.iter().map(|i| &i.rgba[..4]).collect();
    assert!(scene.images.iter().all(|i| (i.width, i.height) == (4, 2)));
    // As a normal it points nowhere, and is flat.
    assert!(
        texels.iter().filter(|t| ***t == [10, 20, 30, 255]).count() == 2 && texels.contains(&&[128, 128, 255, 255][..])
    );
    // The glow of a file without lights is lit by a light.
    assert!(matches!(scene.lights[0].kind, LightKind::Spot { .. }));
    assert!(scene.warnings.iter().any(|w| w.contains("emissive")), "{:?}", scene.warnings);

    glb.json["materials"] = json!([{"alphaMode": "BLEND", "extensions": {"KHR_materials_unlit": {}}}]);
    let m = &load(&glb).materials[0];
    assert_eq!((m.alpha_mode, m.unlit, m.base_color), (AlphaMode::Blend, true, [1.0; 4]));
}

#[test]
fn tangents_follow_the_texture() {
    let mut glb = textured(&png([128, 128, 255, 255], 2, 2));
    glb.json["materials"] = json!([{"normalTexture": {"index": 0}}]);
    let scene = load(&glb);
    for t in &scene.meshes[0].tangents {
        assert!(close(t, &[1.0, 0.0, 0.0, 1.0]), "u runs along +X, v's up along +Y: {t:?}");
    }
    // Mirrored texture coordinates turn the tangent and the handedness.
    let uv = glb.floats("VEC2", &[1.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    glb.attribute("TEXCOORD_0", uv);
    for t in &load(&glb).meshes[0].tangents {
        assert!(close(t, &[-1.0, 0.0, 0.0, -1.0]), "{t:?}");
    }
    // Without a normal map nobody needs tangents.
    glb.json["materials"] = json!([{}]);
    assert!(load(&glb).meshes[0].tangents.is_empty());
}

#[test]
fn broken_textures_are_named_and_replaced() {
    let mut cut = png([1, 2, 3, 4], 64, 64);
    cut.truncate(36);
    let color = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    for (bytes, word) in [(&cut[..], "decoded"), (b"no picture at all", "decoded")] {
        let mut glb = textured(bytes);
        glb.json["materials"] = color.clone();
        let scene = load(&glb);
        let found: Vec<_> = scene.warnings.iter().filter(|w| w.contains("'the image'") && w.contains(word)).collect();
        assert_eq!(found.len(), 1, "{:?}", scene.warnings);
        assert_eq!(scene.images[0].rgba[..8], [255, 0, 255, 255, 0, 0, 0, 255]);
    }
    let mut glb = textured(b"");
    glb.json["materials"] = color;
    for (image, word) in [
        (json!({"uri": "not%20here.png"}), "not here.png"),
        (json!({"uri": "data:image/png;base64,AAAA"}), "decoded"),
        (json!({"uri": "data:image/png,AAAA"}), "decoded"),
        (json!({"bufferView": 2, "mimeType": "image/png"}), "decoded"),
    ] {
        glb.json["images"] = json!([image]);
        let scene = load(&glb);
        assert!(scene.warnings.iter().any(|w| w.contains(word) && w.contains("made.glb")), "{:?}", scene.warnings);
        assert!(scene.images[0].name.contains("stand-in"));
    }
    // A texture without an image, and one whose image does not exist.
    for texture in [json!({}), json!({"source": 5})] {
        glb.json["textures"] = json!([texture]);
        assert!(load(&glb).images[0].name.contains("stand-in"));
    }
}

#[test]
fn lights_and_cameras() {
    let mut glb = Glb::triangle();
    glb.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "directional", "intensity": 683.0, "color": [1.0, 0.5, 0.25]},
        {"type": "point", "intensity": 1366.0, "range": 7.0},
        {"type": "spot", "intensity": 683.0, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
    ]}});
    let (s, c) = (-std::f32::consts::FRAC_PI_4).sin_cos();
    let down = [s, 0.0, 0.0, c];
    let light = |i: u32| json!({"KHR_lights_punctual": {"light": i}});
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2, 3, 4, 5]}]);
    glb.json["nodes"] = json!([
        {"mesh": 0},
        {"name": "sun", "rotation": down, "extensions": light(0)},
        {"name": "lamp", "translation": [1.0, 2.0, 3.0], "extensions": light(1)},
        {"name": "spot", "rotation": down, "scale": [3.0, 3.0, 3.0], "extensions": light(2)},
        {"name": "eye", "camera": 0, "translation": [0.0, 1.0, 5.0], "scale": [2.0, 2.0, 2.0]},
        {"name": "flat", "camera": 1},
    ]);
    glb.json["cameras"] = json!([
        {"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.01}},
        {"type": "orthographic", "orthographic": {"xmag": 1.0, "ymag": 1.0, "znear": 0.1, "zfar": 9.0}},
    ]);
    let scene = load(&glb);
    assert_eq!(scene.lights.len(), 3);
    assert_eq!(scene.lights[0].color, [1.0, 0.5, 0.25]);
    let LightKind::Directional { direction, irradiance, angle } = scene.lights[0].kind else { panic!("a sun") };
    assert!(close(&direction, &[0.0, -1.0, 0.0]) && close(&[irradiance], &[1.0]), "{direction:?} {irradiance}");
    assert_eq!(angle, 0.00918);
    let LightKind::Point { position, intensity, range, .. } = scene.lights[1].kind else { panic!("a point light") };
    assert_eq!((position, intensity, range), ([1.0, 2.0, 3.0], 2.0, Some(7.0)));
    let LightKind::Spot { direction, inner_angle, outer_angle, .. } = scene.lights[2].kind else { panic!("a spot") };
    assert!(close(&direction, &[0.0, -1.0, 0.0]) && close(&[inner_angle, outer_angle], &[0.1, 0.2]));
    assert_eq!(scene.cameras.len(), 2);
    let camera = &scene.cameras[0];
    assert_eq!((camera.yfov, camera.near, camera.far), (0.9, 0.01, f32::INFINITY));
    assert_eq!(camera.transform[0], [1.0, 0.0, 0.0, 0.0], "without the node's scale");
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    assert!(scene.warnings[0].contains("orthographic") && scene.warnings[0].contains("flat"));
    assert!(!scene.warnings[0].contains("left out"), "{}", scene.warnings[0]);
    assert_eq!(scene.environment.radiance, [0.0; 3], "a lit file keeps its black sky");
}

#[test]
fn external_files_and_data_uris() {
    let glb = {
        let mut glb = textured(&png([9, 8, 7, 255], 1, 1));
        glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
        glb
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    put(folder.path(), "all data.bin", &glb.bin);
    put(folder.path(), "picture.png", &png([9, 8, 7, 255], 1, 1));
    let mut json = glb.json.clone();
    json["buffers"] = json!([{"byteLength": glb.bin.len(), "uri": "all%20data.bin"}]);
    json["images"] = json!([{"uri": "picture.png"}]);
    let path = put(folder.path(), "outside.gltf", json.to_string().as_bytes());
    let outside = bouncelight_scene::load(path.to_str().expect("a path")).unwrap_or_else(|e| panic!("{e}"));
    let base64 = {
        const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let digit = |group: u32, i: u32| char::from(DIGITS[(group >> (18 - 6 * i) & 63) as usize]);
        let groups = glb.bin.chunks(3).map(|c| (0..3).fold(0, |n, i| n << 8 | u32::from(*c.get(i).unwrap_or(&0))));
        groups.flat_map(|g| (0..4).map(move |i| digit(g, i))).collect::<String>()
    };
    json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{base64}"));
    json["images"] = glb.json["images"].clone();
    let inside = load_bytes("inside.gltf", json.to_string().as_bytes()).unwrap_or_else(|e| panic!("{e}"));
    for scene in [outside, inside, load(&glb)] {
        assert_eq!(scene.images[0].rgba, [9, 8, 7, 255]);
        assert_eq!(scene.meshes[0].positions[1], [1.0, 0.0, 0.0]);
        assert_eq!(scene.warnings.len(), 1, "only the default sun: {:?}", scene.warnings);
    }
}

#[test]
fn nodes_move_as_their_animation_says() {
    let mut glb = Glb::triangle();
    let times = glb.floats("SCALAR", &[0.5, 1.5]);
    let places = glb.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
    glb.json["scenes"] = json!([{"nodes": [0]}]);
    glb.json["nodes"] = json!([
        {"translation": [1.0, 0.0, 0.0], "children": [1, 2]},
        {"name": "moves", "mesh": 0},
        {"name": "stays", "mesh": 0, "translation": [0.0, 0.0, 3.0]},
        {"name": "not in the scene", "mesh": 0},
    ]);
    let channel =
        |node: usize, path: &str, sampler: usize| json!({"sampler": sampler, "target": {"node": node, "path": path}});
    glb.json["animations"] = json!([
        {"name": "up", "samplers": [{"input": times, "output": places}],
            "channels": [channel(1, "translation", 0), channel(3, "translation", 0)]},
        {"name": "broken", "samplers": [{"input": times, "output": 99}],
            "channels": [channel(1, "translation", 0), channel(1, "weights", 7)]},
    ]);
    let mut scene = load(&glb);
    let rig = scene.rig.clone().expect("it moves");
    assert_eq!((rig.animations.len(), rig.animations[0].name.as_str(), rig.animations[0].end), (1, "up", 1.5));
    assert_eq!(rig.animations[0].channels.len(), 1, "a node of no scene moves nothing");
    assert!(scene.warnings.iter().any(|w| w.contains("animations[1].channels[0]")), "{:?}", scene.warnings);
    let at =
        |scene: &Scene, i: usize| Mat4::from_cols_array_2d(&scene.instances[i].transform).transform_point3(Vec3::ZERO);
    let rest = [at(&scene, 0), at(&scene, 1)];
    assert!(scene.pose(0, 1.0) && !scene.pose(1, 1.0));
    assert!(at(&scene, 0).distance(Vec3::new(1.0, 1.0, 0.0)) < 1e-5 && at(&scene, 1) == rest[1], "{}", at(&scene, 0));
    // Negative control: another time is another place, and the beginning is where the file has it.
    assert!(scene.pose(0, 1.4) && at(&scene, 0).y > 1.5);
    assert!(scene.pose(0, 0.0) && at(&scene, 0).distance(rest[0]) < 1e-6);
}

#[test]
fn variants_change_materials() {
    let mut glb = Glb::triangle();
    let colour = |r: f32| json!({"pbrMetallicRoughness": {"baseColorFactor": [r, 0.0, 0.0, 1.0]}});
    glb.json["materials"] = json!([colour(0.1), colour(0.2), colour(0.3)]);
    glb.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    glb.json["extensions"] =
        json!({"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}, {"name": "plain"}]}});
    let primitive = &mut glb.json["meshes"][0]["primitives"][0];
    primitive["material"] = json!(0);
    primitive["extensions"] = json!({"KHR_materials_variants": {"mappings": [
        {"material": 2, "variants": [1, 9]}, {"material": 1, "variants": [0]}, {"material": 77, "variants": [2]}
    ]}});
    let mut scene = load(&glb);
    assert_eq!(scene.variants, ["day", "night", "plain"]);
    assert!(!scene.warnings.iter().any(|w| w.contains("variants")), "{:?}", scene.warnings);
    let red = |scene: &Scene| scene.materials[scene.meshes[0].material].base_color[0];
    let mut seen = vec![red(&scene)];
    for variant in 0..3 {
        assert!(scene.choose_variant(variant));
        seen.push(red(&scene));
    }
    assert!(close(&seen, &[0.1, 0.2, 0.3, 0.1]), "{seen:?}");
    assert!(!scene.choose_variant(3));
}
