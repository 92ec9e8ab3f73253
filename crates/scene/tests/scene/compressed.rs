//! KHR_draco_mesh_compression and KHR_texture_basisu, against what the encoders' own decoders
//! unpack (`tests/fixtures/compressed/make.mjs`).

use bouncelight::scene::{ColorSpace, Image, Mesh, Scene};
use bouncelight_scene::SceneError;
use serde_json::{Value, json};

use crate::glb::{Glb, load_bytes, png};
use crate::shared::assert_sound;

macro_rules! fixture {
    ($name:literal) => {
        include_bytes!(concat!("../../../../tests/fixtures/compressed/", $name)).as_slice()
    };
}

const DRACO: &str = "KHR_draco_mesh_compression";
const BASIS: &str = "KHR_texture_basisu";

/// JSON and binary chunk of a GLB.
fn chunks(glb: &[u8]) -> Glb {
    let length = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().expect("four bytes")) as usize;
    let json = 20..20 + length(12);
    let bin = json.end + 8;
    let parsed = serde_json::from_slice(&glb[json]).expect("JSON");
    Glb { json: parsed, bin: glb[bin..bin + length(bin - 8)].to_vec() }
}

fn mesh(result: Result<Scene, SceneError>) -> Mesh {
    let mut scene = result.expect("it loads");
    assert_sound(&scene);
    let about: Vec<_> = scene.warnings.iter().filter(|w| w.contains("draco")).collect();
    assert!(about.is_empty(), "{about:?}");
    scene.meshes.remove(0)
}

#[test]
fn draco_unpacks_as_its_own_decoder_does() {
    for (packed, unpacked) in [
        (fixture!("edgebreaker.glb"), fixture!("edgebreaker-unpacked.glb")),
        (fixture!("sequential.glb"), fixture!("sequential-unpacked.glb")),
    ] {
        let (ours, theirs) = (mesh(load_bytes("a.glb", packed)), mesh(load_bytes("a.glb", unpacked)));
        assert_eq!(ours.indices.len(), 12 * 7 * 2 * 3);
        assert_eq!(ours.indices, theirs.indices);
        assert_eq!(ours.positions, theirs.positions);
        assert_eq!(ours.normals, theirs.normals);
        assert_eq!((&ours.uv0, &ours.colors), (&theirs.uv0, &theirs.colors));
        // And what was packed is this ball, to the 14 and 10 bits of the encoder's defaults.
        for (p, n) in ours.positions.iter().zip(&ours.normals) {
            let on_ball = [p[0] / 0.7, p[1], p[2]];
            assert!((0..3).all(|c| (on_ball[c] - n[c]).abs() < 4e-3), "{p:?} {n:?}");
        }
        let red = |c: &[f32; 4]| (0.0..=1.0).contains(&c[0]) && c[3] == 1.0;
        assert!(ours.colors.iter().all(red) && ours.colors.iter().any(|c| c[0] == 1.0));
    }
    // Negative control: the two streams differ in the order of what they pack.
    let [a, b] = [fixture!("edgebreaker.glb"), fixture!("sequential.glb")].map(|f| mesh(load_bytes("a.glb", f)));
    assert_ne!(a.positions, b.positions);
}

#[test]
fn broken_draco_is_refused_with_its_place() {
    let sound = fixture!("edgebreaker.glb");
    let refused = |change: &dyn Fn(&mut Glb), words: &[&str]| {
        let mut glb = chunks(sound);
        change(&mut glb);
        let message = glb.load().expect_err("it is broken").to_string();
        for word in ["made.glb", "meshes[0].primitives[0]"].iter().chain(words) {
            assert!(message.contains(word), "{word}: {message}");
        }
    };
    let set = |key: &'static str, value: Value| {
        move |glb: &mut Glb| glb.json["meshes"][0]["primitives"][0]["extensions"][DRACO][key] = value.clone()
    };
    assert!(chunks(sound).load().is_ok(), "the control loads");
    refused(&set("bufferView", json!(9)), &["buffer view 9"]);
    refused(&set("bufferView", json!("x")), &["Draco compression"]);
    let numbers = |normal: u32| json!({"POSITION": 0, "NORMAL": normal, "TEXCOORD_0": 2, "COLOR_0": 3});
    let given = chunks(sound).json["meshes"][0]["primitives"][0]["extensions"][DRACO]["attributes"].clone();
    let uv = given["TEXCOORD_0"].as_u64().expect("a number") as u32;
    refused(&set("attributes", numbers(uv)), &["NORMAL", "2 components"]);
    refused(&set("attributes", numbers(77)), &["no attribute 77", "NORMAL"]);
    refused(&|glb| glb.bin[20..].fill(0xff), &["Draco stream"]);
    refused(
        &|glb| {
            let view = glb.json["meshes"][0]["primitives"][0]["extensions"][DRACO]["bufferView"].as_u64().unwrap();
            glb.json["bufferViews"][view as usize]["byteLength"] = json!(40);
        },
        &["Draco stream"],
    );
}

/// A triangle whose material has a picture.
fn textured(picture: &[u8]) -> Glb {
    let mut glb = Glb::triangle();
    let view = glb.view(picture);
    glb.json["images"] = json!([{"bufferView": view, "mimeType": "image/ktx2"}]);
    glb.json["textures"] = json!([{"extensions": {BASIS: {"source": 0}}}]);
    glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    (glb.json["extensionsUsed"], glb.json["extensionsRequired"]) = (json!([BASIS]), json!([BASIS]));
    glb
}

fn picture(glb: &Glb) -> (Image, Vec<String>) {
    let mut scene = glb.load().expect("it loads");
    let about = scene.warnings.iter().filter(|w| w.contains("texture")).cloned().collect();
    (scene.images.remove(0), about)
}

#[test]
fn basis_textures_unpack_as_their_own_decoder_does() {
    let source = fixture!("source.rgba");
    let mut errors = Vec::new();
    for (packed, unpacked) in [
        (fixture!("etc1s.ktx2"), fixture!("etc1s.rgba")),
        (fixture!("uastc.ktx2"), fixture!("uastc.rgba")),
        (fixture!("uastc-zstd.ktx2"), fixture!("uastc-zstd.rgba")),
    ] {
        let (image, warnings) = picture(&textured(packed));
        assert_eq!((image.width, image.height, image.color_space), (16, 12, ColorSpace::Srgb));
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(image.rgba, unpacked);
        let off: f64 = image.rgba.iter().zip(source).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        errors.push(off / source.len() as f64);
    }
    println!("mean difference from what was packed: {errors:?}");
    // Of 255, in a picture with nothing smooth in it.
    assert!(errors[0] < 12.0 && errors[1] < 0.5 && errors[2] < 0.5, "{errors:?}");
}

#[test]
fn a_basis_texture_wins_over_the_picture_beside_it() {
    let mut glb = textured(fixture!("uastc.ktx2"));
    let beside = glb.view(&png([1, 2, 3, 255], 5, 5));
    glb.json["images"].as_array_mut().unwrap().push(json!({"bufferView": beside, "mimeType": "image/png"}));
    glb.json["textures"][0]["source"] = json!(1);
    assert_eq!(picture(&glb).0.width, 16);
    // A dangling one is told.
    glb.json["textures"][0]["extensions"][BASIS]["source"] = json!(7);
    let (image, warnings) = picture(&glb);
    assert_eq!(image.width, 5);
    assert!(warnings.iter().any(|w| w.contains("textures[0]") && w.contains(BASIS)), "{warnings:?}");
}

#[test]
fn broken_basis_textures_get_a_checker_and_a_sentence() {
    let sound = fixture!("uastc-zstd.ktx2");
    let told = |bytes: &[u8], words: &[&str]| {
        let (image, warnings) = picture(&textured(bytes));
        assert_eq!((image.width, image.height), (8, 8), "the checker");
        for word in words {
            assert!(warnings.iter().any(|w| w.contains(word)), "{word}: {warnings:?}");
        }
    };
    let set = |at: usize, value: u64, width: usize| {
        let mut bytes = sound.to_vec();
        bytes[at..at + width].copy_from_slice(&value.to_le_bytes()[..width]);
        bytes
    };
    told(&sound[..90], &["cut off after 90 bytes"]);
    told(&sound[..sound.len() / 2], &["cannot be decoded"]);
    told(&set(12, 37, 4), &["Vulkan format 37"]);
    told(&set(20, 0, 4), &["no pixels (0x12)"]);
    told(&set(20, 40_000, 4), &["40000x12", "16384"]);
    // 16,384² texels are a gigabyte.
    let mut large = set(20, 16_384, 4);
    large[24..28].copy_from_slice(&16_384u32.to_le_bytes());
    large[40..44].copy_from_slice(&1u32.to_le_bytes());
    told(&large, &["16384x16384"]);
    // A level that claims to unpack to an exabyte.
    told(&set(96, 1 << 60, 8), &["1152921504606846976 bytes"]);
    told(&set(36, 6, 4), &["cannot be decoded"]);
}
