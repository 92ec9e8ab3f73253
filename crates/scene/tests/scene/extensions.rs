//! Extensions of glTF about how things are stored and placed.

use bouncelight::scene::Scene;
use glam::{Mat4, Quat, Vec3};
use serde_json::json;

use crate::glb::{Glb, png};
use crate::shared::{assert_sound, world_points};

fn load(glb: &Glb) -> Scene {
    let scene = glb.load().unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    scene
}

/// KHR_mesh_quantization without `normalized`: whole numbers that the node's matrix brings to size,
/// as gltfpack and gltf-transform write them.
#[test]
fn quantised_positions_are_scaled_by_their_node() {
    for (component, width) in [(5121u32, 1), (5123, 2), (5120, 1), (5122, 2)] {
        let mut glb = Glb::triangle();
        glb.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
        glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        // Elements are padded to four bytes.
        let stride = if width == 1 { 4 } else { 8 };
        let mut bytes = vec![0u8; 3 * stride];
        for (vertex, axis) in [(1, 0), (2, 1)] {
            bytes[vertex * stride + axis * width] = 100;
        }
        let p = glb.accessor("VEC3", component, 3, &bytes);
        let view = glb.json["accessors"][p]["bufferView"].as_u64().expect("a view") as usize;
        glb.json["bufferViews"][view]["byteStride"] = json!(stride);
        glb.attribute("POSITION", p);
        glb.json["nodes"] = json!([{"mesh": 0, "scale": [0.02, 0.02, 0.02], "translation": [5.0, 0.0, 0.0]}]);
        let scene = load(&glb);
        let points = world_points(&scene, 0);
        let expected = [Vec3::new(5.0, 0.0, 0.0), Vec3::new(7.0, 0.0, 0.0), Vec3::new(5.0, 2.0, 0.0)];
        assert!(points.iter().zip(expected).all(|(a, b)| a.distance(b) < 1e-5), "{component}: {points:?}");
        assert!(!scene.warnings.iter().any(|w| w.contains("quantization")), "{:?}", scene.warnings);
    }
}

#[test]
fn webp_textures_are_read() {
    let mut webp = Vec::new();
    let pixels = [12u8, 34, 56, 255].repeat(6);
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut webp);
    encoder.encode(&pixels, 3, 2, image::ExtendedColorType::Rgba8).expect("encodes");
    let mut glb = Glb::triangle();
    let uv = glb.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    glb.attribute("TEXCOORD_0", uv);
    let (old, new) = (glb.view(&png([1, 2, 3, 255], 5, 5)), glb.view(&webp));
    glb.json["images"] =
        json!([{"bufferView": old, "mimeType": "image/png"}, {"bufferView": new, "mimeType": "image/webp"}]);
    glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    glb.json["extensionsUsed"] = json!(["EXT_texture_webp"]);
    glb.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
    // Beside a PNG for others, and alone.
    for texture in [json!({"source": 0}), json!({})] {
        let mut texture = texture;
        texture["extensions"] = json!({"EXT_texture_webp": {"source": 1}});
        glb.json["textures"] = json!([texture]);
        let scene = load(&glb);
        let image = &scene.images[0];
        assert_eq!((image.width, image.height, &image.rgba[..4]), (3, 2, &[12, 34, 56, 255][..]));
        assert!(!scene.warnings.iter().any(|w| w.contains("exture")), "{:?}", scene.warnings);
    }
    // Negative control: without the extension the PNG counts; with a wrong one it does, too, and is
    // told.
    glb.json["textures"] = json!([{"source": 0}]);
    assert_eq!(load(&glb).images[0].width, 5);
    glb.json["textures"] = json!([{"source": 0, "extensions": {"EXT_texture_webp": {"source": 7}}}]);
    let scene = load(&glb);
    assert_eq!(scene.images[0].width, 5);
    assert!(scene.warnings.iter().any(|w| w.contains("textures[0]") && w.contains("webp")), "{:?}", scene.warnings);
}

/// A triangle placed three times by EXT_mesh_gpu_instancing, at a node that is moved itself.
fn copies() -> Glb {
    let mut glb = Glb::triangle();
    let t = glb.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 5.0, 0.0]);
    let s = glb.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0, 3.0]);
    // The third is a quarter turn about Z, in normalised bytes.
    let r = glb.accessor("VEC4", 5120, 3, &[0, 0, 0, 127, 0, 0, 0, 127, 0, 0, 90, 90]);
    glb.json["accessors"][r]["normalized"] = json!(true);
    let attributes = json!({"TRANSLATION": t, "ROTATION": r, "SCALE": s, "_COLOR": 0});
    glb.json["nodes"] = json!([{"mesh": 0, "translation": [10.0, 0.0, 0.0],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}]);
    glb.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    glb.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    glb
}

#[test]
fn instances_stand_where_their_attributes_say() {
    let glb = copies();
    let scene = load(&glb);
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 3));
    let expected = [
        Mat4::from_translation(Vec3::new(10.0, 0.0, 0.0)),
        Mat4::from_translation(Vec3::new(15.0, 0.0, 0.0)) * Mat4::from_scale(Vec3::splat(2.0)),
        Mat4::from_translation(Vec3::new(10.0, 5.0, 0.0))
            * Mat4::from_quat(Quat::from_rotation_z(std::f32::consts::FRAC_PI_2))
            * Mat4::from_scale(Vec3::new(1.0, 1.0, 3.0)),
    ];
    for (i, expected) in scene.instances.iter().zip(expected) {
        let found = Mat4::from_cols_array_2d(&i.transform);
        assert!(found.abs_diff_eq(expected, 1e-5), "{found} is not {expected}");
    }
    let refused = |change: &dyn Fn(&mut Glb), word: &str| {
        let mut glb = copies();
        change(&mut glb);
        let message = glb.load().expect_err("is broken").to_string();
        assert!(message.contains("nodes[0].extensions.EXT_mesh_gpu_instancing") && message.contains(word), "{message}");
    };
    let set = |key: &'static str, to: serde_json::Value| {
        move |g: &mut Glb| g.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"][key] = to.clone()
    };
    refused(&set("SCALE", json!(99)), "SCALE names no accessor");
    refused(&set("SCALE", json!("x")), "SCALE names no accessor");
    refused(&|g| g.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"] = json!({}), "no attributes");
    refused(&|g| g.json["accessors"][2]["count"] = json!(2), "different lengths");
}

#[test]
fn instances_move_with_their_animated_node() {
    let mut glb = copies();
    let times = glb.floats("SCALAR", &[0.0, 1.0]);
    let values = glb.floats("VEC3", &[10.0, 0.0, 0.0, 10.0, 0.0, 7.0]);
    glb.json["animations"] = json!([{"samplers": [{"input": times, "output": values}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}]);
    let mut scene = load(&glb);
    let before: Vec<_> = scene.instances.iter().map(|i| Mat4::from_cols_array_2d(&i.transform)).collect();
    assert!(scene.pose(0, 1.0), "there is an animation");
    for (i, before) in scene.instances.iter().zip(before) {
        let expected = Mat4::from_translation(Vec3::new(0.0, 0.0, 7.0)) * before;
        let found = Mat4::from_cols_array_2d(&i.transform);
        assert!(found.abs_diff_eq(expected, 1e-4), "{found} is not {expected}");
    }
}
