//! Hostile files: glTF, plain and compressed (meshopt, Draco, Basis Universal), OBJ with its library,
//! pictures of the surroundings. No panic, no hang, bounded memory.
//!
//! `SCENE_FUZZ_CASES` (of each of the three kinds) and `SCENE_FUZZ_SEED` make a longer run;
//! `docs/log/2026-11-24-compressed.md` records one.

mod texts;

use crate::glb::Glb;
use crate::spoil::{Random, TOKENS, spoil_text, spoil_value};
use crate::{MEMORY, apart, cases, setting};
use crate::{figures, glb, packed, shared};
use bouncelight_scene::export;
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

/// Cases of each kind where tests run whole, which is what a change to a loader is tried with.
const CASES: u64 = 100_000;
const SEED: u64 = 20_261_124;
/// Longest that one file may take. The honest ones take less than a millisecond; a loaded machine
/// may stop any of them for a while, and a picture of the largest size that is allowed takes its
/// time to be cleared.
const SLOWEST: Duration = Duration::from_secs(5);
/// What a picture may need to be decoded (docs/guide/scenes.md), and room for the rest.
const MOST_MEMORY: usize = (512 + 64) << 20;

/// JSON and binary chunk of a GLB.
fn taken_apart(glb: &[u8]) -> Glb {
    let length = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().expect("four bytes")) as usize;
    let json = 20..20 + length(12);
    let bin = json.end + 8;
    let parsed = serde_json::from_slice(&glb[json]).expect("JSON");
    Glb { json: parsed, bin: glb[bin..bin + length(bin - 8)].to_vec() }
}

/// A triangle with a picture in one of Basis Universal's encodings.
fn textured(picture: &[u8]) -> Glb {
    let mut glb = Glb::triangle();
    let view = glb.view(picture);
    glb.json["images"] = json!([{"bufferView": view, "mimeType": "image/ktx2"}]);
    glb.json["textures"] = json!([{"extensions": {"KHR_texture_basisu": {"source": 0}}}]);
    glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    glb
}

/// The sound files that mutations start from.
fn corpus() -> Vec<Glb> {
    let cornell =
        export::to_glb(&bouncelight_scene::load("cornell").expect("a bundled scene")).expect("it can be written");
    let mut plain = Glb::triangle();
    let view = plain.view(&glb::png([200, 100, 50, 255], 4, 4));
    plain.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    plain.json["textures"] = json!([{"source": 0, "sampler": 0}]);
    plain.json["samplers"] = json!([{"wrapS": 33071, "minFilter": 9984}]);
    plain.json["materials"] = json!([{"alphaMode": "MASK", "normalTexture": {"index": 0},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
        "extensions": {"KHR_materials_transmission": {"transmissionTexture": {"index": 0}},
            "KHR_materials_specular": {"specularColorFactor": [1.0, 0.5, 0.2]}}}]);
    plain.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let times = plain.floats("SCALAR", &[0.0, 1.0]);
    let places = plain.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    plain.json["animations"] = json!([{"samplers": [{"input": times, "output": places}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}]);
    plain.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    // Two bones, and a morph target over them, both moving.
    let mut skinned = figures::strip(4, figures::Coded::TwoSets);
    figures::bends(&mut skinned, 2, 1.0);
    let up = skinned.floats("VEC3", &[0.0, 0.1, 0.2].repeat(10));
    skinned.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": up, "NORMAL": up}]);
    let target = json!({"node": 0, "path": "weights"});
    figures::also(&mut skinned, target, "SCALAR", &[0.0, 1.0], &[0.0, 0.0, 1.0, 0.0, 1.0, 0.0], "CUBICSPLINE");
    let pointer = json!({"extensions": {"KHR_animation_pointer": {"pointer": "/nodes/2/translation"}}});
    figures::also(&mut skinned, pointer, "VEC3", &[0.0, 1.0], &[0.0, 1.0, 0.0, 0.0, 1.5, 0.0], "STEP");
    let packed = Glb { json: packed::strip("EXT_meshopt_compression", "floats, version 0, level 2"), bin: Vec::new() };
    vec![
        taken_apart(&cornell),
        plain,
        skinned,
        packed,
        taken_apart(include_bytes!("../../../../../tests/fixtures/compressed/edgebreaker.glb")),
        taken_apart(include_bytes!("../../../../../tests/fixtures/compressed/sequential.glb")),
        textured(include_bytes!("../../../../../tests/fixtures/compressed/etc1s.ktx2")),
        textured(include_bytes!("../../../../../tests/fixtures/compressed/uastc.ktx2")),
        textured(include_bytes!("../../../../../tests/fixtures/compressed/uastc-zstd.ktx2")),
    ]
}

/// A few bytes flipped, replaced, cut or moved; mostly near the front of something, where the
/// numbers are that matter.
fn spoil_bytes(bytes: &mut Vec<u8>, starts: &[usize], random: &mut Random) {
    for _ in 0..1 + random.below(6) {
        if bytes.is_empty() {
            return;
        }
        let near = *random.pick(starts) + random.below(120);
        let at = if random.below(3) == 0 { random.below(bytes.len()) } else { near.min(bytes.len() - 1) };
        match random.below(10) {
            0..=2 => bytes[at] ^= 1 << random.below(8),
            3..=5 => bytes[at] = random.below(256) as u8,
            6 => bytes[at] = 255,
            7 => bytes.truncate(at),
            8 => drop(bytes.drain(at..(at + 1 + random.below(32)).min(bytes.len()))),
            _ => {
                let other = random.below(bytes.len());
                bytes.swap(at, other);
            }
        }
    }
}

/// A camera and a lamp, without which a file's triangles are looked at for a place to stand, which
/// takes longer than to read them.
fn see_and_light(json: &mut Value) {
    if json["cameras"].is_array() {
        return;
    }
    json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]);
    json["extensions"]["KHR_lights_punctual"] = json!({"lights": [{"type": "point", "intensity": 20.0}]});
    let of_lamp = json!({"KHR_lights_punctual": {"light": 0}});
    let both = json!({"camera": 0, "extensions": of_lamp, "translation": [0.0, 1.0, 3.0]});
    let nodes = json["nodes"].as_array_mut().expect("a sound file's nodes");
    nodes.push(both);
    let last = nodes.len() - 1;
    json["scenes"][0]["nodes"].as_array_mut().expect("a sound file's scene").push(json!(last));
}

/// One hostile file.
fn case(files: &[Glb], random: &mut Random) -> Vec<u8> {
    let file = random.pick(files);
    let mut json = file.json.clone();
    if random.below(4) != 0 {
        see_and_light(&mut json);
    }
    let mut bin = file.bin.clone();
    let views = json["bufferViews"].as_array().into_iter().flatten();
    let mut starts: Vec<usize> =
        views.map(|v| v["byteOffset"].as_u64().unwrap_or(0) as usize).filter(|at| *at < bin.len()).collect();
    starts.push(0);
    if random.below(2) == 0 {
        spoil_bytes(&mut bin, &starts, random);
    } else {
        (0..1 + random.below(3)).for_each(|_| spoil_value(&mut json, random, 0));
    }
    if let Some(uri) = json.pointer_mut("/buffers/0/uri").filter(|_| random.below(3) == 0)
        && let Value::String(text) = uri
        && text.is_ascii()
        && !text.is_empty()
    {
        // Compressed bytes that are in the JSON as base64.
        let at = (text.len() / 4 + random.below(text.len() * 3 / 4)).min(text.len() - 1);
        text.replace_range(at..at + 1, ["A", "/", "z", "7"][random.below(4)]);
    }
    let glb = Glb { json, bin };
    let mut bytes = glb.bytes();
    match random.below(12) {
        0 => {
            let text = spoil_text(&glb.json.to_string(), random);
            bytes = text.into_bytes();
        }
        1 => {
            let at = random.below(bytes.len());
            bytes.splice(at..at, random.pick(&TOKENS).bytes());
        }
        2 => spoil_bytes(&mut bytes, &[0], random),
        _ => {}
    }
    bytes
}

/// What came of a file.
#[derive(Default)]
struct Tally {
    accepted: u64,
    refused: u64,
    slowest: Duration,
    most: usize,
}

impl Tally {
    fn scene(&mut self, path: &Path, bytes: &[u8]) {
        std::fs::write(path, bytes).expect("a temporary file");
        let read = self.read(bytes.len(), || bouncelight_scene::load(path.to_str().expect("a readable path")));
        let Some(mut scene) = read else { return };
        shared::assert_sound(&scene);
        // Any numbers may come of it, but no panic.
        if scene.pose(0, 0.7) {
            assert!(scene.deforms.iter().all(|d| d.bounds().is_none_or(|b| b.0[0] <= b.1[0])));
        }
    }

    fn model(&mut self, path: &Path, [obj, mtl]: &[Vec<u8>; 2]) {
        std::fs::write(path.with_extension("mtl"), mtl).expect("a temporary file");
        self.scene(path, obj);
    }

    fn sky(&mut self, path: &Path, bytes: &[u8]) {
        std::fs::write(path, bytes).expect("a temporary file");
        if let Some((sky, _)) = self.read(bytes.len(), || bouncelight_scene::sky::load(path)) {
            assert!(sky.radiance.iter().all(|v| v.is_finite() && *v >= 0.0));
        }
    }

    /// What `load` makes of a file of so many bytes.
    fn read<T, E: std::fmt::Display>(&mut self, bytes: usize, load: impl FnOnce() -> Result<T, E>) -> Option<T> {
        let (before, started) = (MEMORY.current_usage(), Instant::now());
        MEMORY.reset_peak_usage();
        let read = load();
        let (taken, time) = (MEMORY.peak_usage().saturating_sub(before), started.elapsed());
        assert!(time < SLOWEST, "took {time:?}");
        assert!(taken <= MOST_MEMORY, "took {taken} bytes of memory for a file of {bytes}");
        (self.slowest, self.most) = (self.slowest.max(time), self.most.max(taken));
        match read {
            Ok(read) => {
                self.accepted += 1;
                Some(read)
            }
            Err(error) => {
                self.refused += 1;
                let told = error.to_string();
                assert!(told.contains("case."), "names no file: {told}");
                None
            }
        }
    }
}

#[test]
fn hostile_files() {
    let parts = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    apart("scene::hostile_files", parts, |part| read_part(part, parts));
}

/// Cases `part`, `part + parts` and so on.
fn read_part(part: u64, parts: u64) {
    let (cases, seed) = (cases("SCENE_FUZZ_CASES", CASES), setting("SCENE_FUZZ_SEED", SEED));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let numbers = || (part..cases).step_by(parts as usize).map(|n| (n, Random::new(seed, n)));

    let files = corpus();
    let mut tally = Tally::default();
    files.iter().for_each(|file| tally.scene(&at("case.glb"), &file.bytes()));
    tally.begins_sound(files.len());
    for (number, mut random) in numbers() {
        let bytes = case(&files, &mut random);
        let name = if bytes.first() == Some(&b'{') { "case.gltf" } else { "case.glb" };
        tally.try_one((seed, number), name, &[&bytes], |tally| tally.scene(&at(name), &bytes));
    }
    tally.tell("glTF", files.len());

    let files = texts::models();
    std::fs::write(at("t.png"), glb::png([200, 100, 50, 255], 2, 2)).expect("a temporary file");
    let mut tally = Tally::default();
    files.iter().for_each(|file| tally.model(&at("case.obj"), &file.clone().map(String::into_bytes)));
    tally.begins_sound(files.len());
    for (number, mut random) in numbers() {
        let both = texts::model(&files, &mut random);
        tally.try_one((seed, number), "case.obj", &[&both[0], &both[1]], |tally| tally.model(&at("case.obj"), &both));
    }
    tally.tell("OBJ", files.len());

    let files = texts::skies();
    let mut tally = Tally::default();
    files.iter().for_each(|file| tally.sky(&at("case.sky"), file));
    tally.begins_sound(files.len());
    for (number, mut random) in numbers() {
        let mut bytes = random.pick(&files).clone();
        texts::spoil_bytes(&mut bytes, &mut random);
        tally.try_one((seed, number), "case.sky", &[&bytes], |tally| tally.sky(&at("case.sky"), &bytes));
    }
    tally.tell("skies", files.len());
}

impl Tally {
    fn begins_sound(&self, originals: usize) {
        assert_eq!(self.accepted as usize, originals, "the originals are sound");
    }

    /// Keeps the files of a case that fails.
    fn try_one(&mut self, id: (u64, u64), name: &str, files: &[&Vec<u8>], run: impl FnOnce(&mut Self)) {
        if catch_unwind(AssertUnwindSafe(|| run(self))).is_err() {
            let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{}-{name}", id.0, id.1));
            for (k, bytes) in files.iter().enumerate() {
                std::fs::write(kept.with_added_extension(k.to_string()), bytes).expect("the file can be kept");
            }
            panic!("case {} of seed {} failed; the message is above, the files in {}.*", id.1, id.0, kept.display());
        }
    }

    fn tell(&self, kind: &str, originals: usize) {
        let read = self.accepted + self.refused - originals as u64;
        println!("{kind}: {read} cases, {} accepted, {} refused", self.accepted, self.refused);
        println!("  slowest {:?}, {} MiB of memory at most", self.slowest, self.most >> 20);
        // Some mutations are harmless and many are not; without both the test would ask nothing.
        assert!(self.accepted > read / 20 && self.refused > read / 20);
    }
}
