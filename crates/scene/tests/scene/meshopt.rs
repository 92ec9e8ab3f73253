//! Files with EXT_meshopt_compression and KHR_meshopt_compression. That every mode and filter
//! unpacks as meshoptimizer has it is tested beside the decoder, on the same cases.

use bouncelight::scene::{self, Scene};
use bouncelight_scene::SceneError;
use serde_json::{Value, json};

use crate::common::shared_path;
use crate::glb::load_bytes;
use crate::packed::{case, length, strip, uri};
use crate::shared::assert_sound;

/// The same without compression.
fn plain() -> Value {
    let mut file = strip("EXT_meshopt_compression", "floats, version 0, level 2");
    let cases = [case("floats, version 0, level 2"), case("strip of 4 bytes")];
    for (i, case) in cases.iter().enumerate() {
        file["buffers"][i + 2] = json!({"uri": uri(&case["unpacked"]), "byteLength": length(&case["unpacked"])});
        file["bufferViews"][i].as_object_mut().expect("a view").remove("extensions");
    }
    file.as_object_mut().expect("a file").remove("extensionsRequired");
    file
}

fn load(file: &Value) -> Result<Scene, SceneError> {
    load_bytes("packed.gltf", file.to_string().as_bytes())
}

#[test]
fn compressed_geometry_is_what_was_compressed() {
    let expected = load(&plain()).expect("the control loads");
    assert_eq!((expected.meshes[0].positions.len(), expected.meshes[0].indices.len()), (68 * 3, 68 * 3));
    for (extension, version) in [
        ("EXT_meshopt_compression", "floats, version 0, level 2"),
        ("KHR_meshopt_compression", "floats, version 0, level 2"),
        ("KHR_meshopt_compression", "floats, version 1, level 3"),
    ] {
        let mut file = strip(extension, version);
        let check = |file: &Value, what: &str| {
            let scene = load(file).unwrap_or_else(|e| panic!("{extension}, {what}: {e}"));
            assert_sound(&scene);
            assert_eq!(scene.meshes[0].positions, expected.meshes[0].positions, "{extension}, {what}");
            assert_eq!(scene.meshes[0].indices.len(), expected.meshes[0].indices.len());
            let warnings: Vec<_> = scene.warnings.iter().filter(|w| w.contains("meshopt")).collect();
            assert!(warnings.is_empty(), "{warnings:?}");
        };
        check(&file, "without fallback");
        // A placeholder need not say that it is one.
        file["buffers"][2].as_object_mut().expect("a buffer").remove("extensions");
        check(&file, "with a plain placeholder");
        // A fallback is not needed, not even to exist.
        file["buffers"][2]["uri"] = json!("gone.bin");
        check(&file, "with a missing fallback");
        file["buffers"][2]["uri"] = json!(uri(&case("floats, version 0, level 2")["unpacked"]));
        check(&file, "with a fallback");
    }
    // Negative control: where the extension is not there, the buffer's own bytes count.
    let mut other = plain();
    let text = other["buffers"][2]["uri"].as_str().expect("a URI").replacen("AAAAAAAAAAA", "AAAgQAAAAAA", 1);
    other["buffers"][2]["uri"] = json!(text);
    assert_ne!(load(&other).expect("loads").meshes[0].positions, expected.meshes[0].positions);
}

#[test]
fn broken_compression_is_refused_with_its_place() {
    let refused = |change: &dyn Fn(&mut Value), words: &[&str]| {
        let mut file = strip("EXT_meshopt_compression", "floats, version 0, level 2");
        change(&mut file);
        let message = load(&file).expect_err("is broken").to_string();
        println!("{message}");
        for word in ["packed.gltf", "bufferViews[0]"].iter().chain(words).filter(|w| !w.is_empty()) {
            assert!(message.contains(word), "'{word}' is not in: {message}");
        }
    };
    let set = |key: &'static str, value: Value| {
        move |f: &mut Value| f["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value.clone()
    };
    refused(&set("mode", json!("MAGIC")), &["mode 'MAGIC'"]);
    refused(&set("filter", json!("BLUR")), &["filter 'BLUR'"]);
    refused(&set("filter", json!("QUATERNION")), &["stride of 12"]);
    refused(&set("byteStride", json!(7)), &["stride of 7"]);
    refused(&set("byteStride", json!("x")), &["meshopt compression"]);
    refused(&set("buffer", json!(9)), &["does not exist"]);
    refused(&set("byteOffset", json!(u64::MAX)), &["reach beyond"]);
    refused(&set("byteLength", json!(100_000)), &["reach beyond"]);
    refused(&set("byteLength", json!(20)), &["ends too early"]);
    refused(&set("count", json!(60)), &["left over"]);
    refused(&set("count", json!(4_000_000_000u64)), &["ends too early"]);
    refused(&set("mode", json!("TRIANGLES")), &["stride of 12"]);
    refused(&|f| f["bufferViews"][0]["byteLength"] = json!(850), &["unpacks to 840 bytes of 850"]);
    // A placeholder that somebody reads as it is.
    let mut file = strip("EXT_meshopt_compression", "floats, version 0, level 2");
    file["bufferViews"][0].as_object_mut().expect("a view").remove("extensions");
    let message = load(&file).expect_err("no bytes").to_string();
    assert!(message.contains("buffers[2]") && message.contains("neither a URI"), "{message}");
}

#[test]
fn files_made_by_gltfpack_load() {
    // Triangles and bounds as the files' accessors announce them, without the hotel's primitive of
    // lines.
    let apartment = ([0.443_761, -0.099_278, -11.433_722], [12.805_583, 2.680_519, -0.129_991]);
    let hotel = ([6791.5, -66.1975, -11_129.199], [13_274.5, 2130.74, -1134.32]);
    for (name, meshes, triangles, (low, high)) in
        [("dream-apartment", 67, 177_934, apartment), ("hotel", 11, 99_029, hotel)]
    {
        let Some(path) = shared_path(&format!("real/meshopt/{name}.glb")) else { continue };
        let scene = bouncelight_scene::load(path.to_str().expect("a path")).unwrap_or_else(|e| panic!("{e}"));
        assert_sound(&scene);
        let count: usize = scene.meshes.iter().map(|m| m.indices.len() / 3).sum();
        println!("{name}: {} meshes, {count} triangles, {:?}", scene.meshes.len(), scene.warnings);
        assert_eq!((scene.meshes.len(), count), (meshes, triangles));
        let (found_low, found_high) = scene::bounds::world_bounds(&scene).expect("bounds");
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * high[0]);
        assert!(near(found_low, low) && near(found_high, high), "{found_low:?} {found_high:?}");
    }
}
