//! The weights reader against every kind of bad file, and against mutated ones: an error that names the fault, never a panic.

use bouncelight::net::format::{KEY, Problem, Weights, WeightsError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("weights-format/fixtures").join(name)
}

/// A small network to spoil: two convolutions.
fn sound_document() -> Value {
    json!({
        "version": 1, "licence": "CC0-1.0", "table": {"name": "screen", "version": 1}, "cell": 4,
        "inputs": [{"name": "direct", "channels": 3}, {"name": "hit", "channels": 1}],
        "output": {"tensor": "y", "meaning": "log_irradiance_over_exposure", "channels": 3},
        "graph": [
            {"op": "conv2d", "name": "a", "input": "input", "output": "h", "in_channels": 4, "out_channels": 4,
             "kernel": [3, 3], "stride": 1, "padding": 1, "activation": "relu"},
            {"op": "conv2d", "name": "b", "input": "h", "output": "y", "in_channels": 4, "out_channels": 3, "kernel": [1, 1]}
        ]
    })
}

struct File {
    document: Value,
    /// Name, type, shape, bytes.
    tensors: Vec<(String, &'static str, Vec<u64>, Vec<u8>)>,
}

impl File {
    fn sound() -> Self {
        let make = |name: &str, shape: &[u64]| {
            let bytes = vec![0x3d; 4 * shape.iter().product::<u64>() as usize];
            (name.to_string(), "F32", shape.to_vec(), bytes)
        };
        let tensors = vec![
            make("a.weight", &[4, 4, 3, 3]),
            make("a.bias", &[4]),
            make("b.weight", &[3, 4, 1, 1]),
            make("b.bias", &[3]),
        ];
        Self { document: sound_document(), tensors }
    }

    fn bytes(&self) -> Vec<u8> {
        let (mut header, mut data) = (String::new(), Vec::new());
        for (name, dtype, shape, bytes) in &self.tensors {
            let info = json!({"dtype": dtype, "shape": shape, "data_offsets": [data.len(), data.len() + bytes.len()]});
            header.push_str(&format!(",{}:{info}", Value::from(name.as_str())));
            data.extend_from_slice(bytes);
        }
        let metadata = json!({ KEY: self.document.to_string() });
        container(&format!("{{\"__metadata__\":{metadata}{header}}}"), &data)
    }

    fn problems(&self) -> Vec<Problem> {
        problems(&self.bytes())
    }
}

fn container(header: &str, data: &[u8]) -> Vec<u8> {
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), data].concat()
}

fn problems(bytes: &[u8]) -> Vec<Problem> {
    match Weights::from_bytes(bytes) {
        Err(WeightsError::Invalid { problems, .. }) => problems,
        other => panic!("expected an invalid file, got {other:?}"),
    }
}

/// The file spoilt by `spoil` has exactly one problem, whose sentence contains `words`.
#[track_caller]
fn one(words: &[&str], spoil: impl FnOnce(&mut File)) {
    let mut file = File::sound();
    spoil(&mut file);
    let problems = file.problems();
    assert_eq!(problems.len(), 1, "{problems:?}");
    let text = problems[0].to_string();
    words.iter().for_each(|w| assert!(text.contains(w), "`{w}` is not in `{text}`"));
}

#[test]
fn the_sound_file_is_read() {
    let weights = Weights::from_bytes(&File::sound().bytes()).unwrap();
    assert_eq!((weights.graph.parameters(), weights.graph.input_channels), (148 + 15, 4));
    assert_eq!(weights.hash_text().len(), 16);
    let mut other = File::sound();
    other.tensors[0].3[0] ^= 1;
    assert_ne!(Weights::from_bytes(&other.bytes()).unwrap().content_hash, weights.content_hash);
}

#[test]
fn paths_that_are_no_files() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let missing = Weights::load(&folder.join("no-such.safetensors")).unwrap_err();
    assert!(matches!(&missing, WeightsError::Io { .. }) && missing.to_string().contains("no-such.safetensors"));
    assert!(matches!(Weights::load(folder), Err(WeightsError::NotAFile { .. })));
    let text = Weights::load(&folder.join("Cargo.toml")).unwrap_err();
    assert!(matches!(&text, WeightsError::NotSafetensors { .. }), "{text}");
}

#[test]
fn other_containers_and_truncated_files() {
    let bytes = File::sound().bytes();
    for length in 0..bytes.len() {
        let error = Weights::from_bytes(&bytes[..length]).unwrap_err();
        let named = matches!(error, WeightsError::Truncated { .. } | WeightsError::NotSafetensors { .. });
        assert!(named, "{length} bytes: {error}");
    }
    let huge = [&u64::MAX.to_le_bytes()[..], b"{}"].concat();
    assert!(matches!(Weights::from_bytes(&huge), Err(WeightsError::NotSafetensors { .. })));
    let deep = container(&"{\"a\":".repeat(100_000), b"");
    assert!(matches!(Weights::from_bytes(&deep), Err(WeightsError::NotSafetensors { .. })));
    assert!(problems(&container("{}", b""))[0].to_string().contains("missing"));
    // No metadata document: any other safetensors file.
    let other = problems(&std::fs::read(fixture("add.case.safetensors")).unwrap());
    assert!(matches!(other[..], [Problem::Document(_)]));
}

#[test]
fn tensors() {
    one(&["`b.bias` is missing"], |f| drop(f.tensors.pop()));
    one(&["`c.bias`", "no operator"], |f| f.tensors.push(("c.bias".into(), "F32", vec![1], vec![0; 4])));
    one(&["`a.bias` occurs twice"], |f| {
        let copy = f.tensors[1].clone();
        f.tensors.push(copy);
    });
    one(&["`a.weight`", "[4, 4, 9]"], |f| f.tensors[0].2 = vec![4, 4, 9]);
    one(&["`a.bias`", "I32", "F32 and F16"], |f| f.tensors[1].1 = "I32");
    one(&["`a.bias`", "unknown type `Q4`"], |f| f.tensors[1].1 = "Q4");
    one(&["`a.bias`", "needs 20 bytes", "has 16"], |f| f.tensors[1].2 = vec![5]);
    one(&["`a.bias`", "overflows"], |f| f.tensors[1].2 = vec![u64::MAX, 3]);
    one(&["`b.weight`", "2 values", "index 3"], |f| {
        f.tensors[2].3[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
        f.tensors[2].3[20..24].copy_from_slice(&f32::NEG_INFINITY.to_le_bytes());
    });
}

#[test]
fn places_in_the_file() {
    let at = |from: u64, to: u64, data: usize| {
        let metadata = json!({ KEY: sound_document().to_string() });
        let header = format!(
            "{{\"__metadata__\":{metadata},\"b.bias\":{{\"dtype\":\"F32\",\"shape\":[3],\"data_offsets\":[{from},{to}]}}}}"
        );
        Weights::from_bytes(&container(&header, &vec![0; data])).unwrap_err().to_string()
    };
    assert!(at(4, 16, 16).contains("leaves a hole"));
    assert!(at(0, 12, 13).contains("1 bytes at the end"));
    assert!(at(12, 0, 12).contains("before its beginning"));
    assert!(at(0, u64::MAX, 12).contains("truncated"));
}

#[test]
fn documents() {
    let set =
        |pointer: &'static str, value: Value| move |f: &mut File| *f.document.pointer_mut(pointer).unwrap() = value;
    one(&["version 2", "reads version 1"], set("/version", json!(2)));
    one(&["table `screen`", "version 7"], set("/table/version", json!(7)));
    one(&["table `probe` is unknown"], set("/table/name", json!("probe")));
    one(&["`glow`", "no such feature"], set("/inputs/0/name", json!("glow")));
    one(&["`direct`", "3 channels"], |f| {
        f.document["inputs"] = json!([{"name": "direct", "channels": 4}]);
    });
    one(&["order"], |f| f.document["inputs"].as_array_mut().unwrap().reverse());
    one(&["meaning `loudness`"], set("/output/meaning", json!("loudness")));
    one(&["cell is 0"], set("/cell", json!(0)));
    one(&["licence"], |f| drop(f.document.as_object_mut().unwrap().remove("licence")));
    one(&["`b`", "operator `deconv`"], set("/graph/1/op", json!("deconv")));
    one(&["`b`", "unknown field `dilation`"], |f| f.document["graph"][1]["dilation"] = json!(2));
    one(&["`swish`"], set("/graph/0/activation", json!("swish")));
    one(&["`b` reads tensor `g`"], set("/graph/1/input", json!("g")));
    one(&["`y`", "no operator"], set("/graph/1/output", json!("z")));
    one(&["`h` has 4 channels, 8"], |f| {
        f.document["graph"][1]["in_channels"] = json!(8);
        f.tensors[2].2 = vec![3, 8, 1, 1];
        f.tensors[2].3 = vec![0; 96];
    });
    one(&["kernel width is 9"], set("/graph/0/kernel/1", json!(9)));
    one(&["kernel height is 0"], set("/graph/0/kernel/0", json!(0)));
    one(&["stride is 0"], set("/graph/0/stride", json!(0)));
    one(&["out_channels is 4294967295"], |f| {
        f.document["graph"][1]["out_channels"] = json!(u32::MAX);
        f.document["output"]["channels"] = json!(u32::MAX);
    });
    one(&["`output`", "3 channels, 5"], set("/output/channels", json!(5)));
    assert!(!{
        let mut file = File::sound();
        file.document["graph"] = json!([]);
        file.problems().is_empty()
    });
}

#[test]
fn all_faults_are_reported_at_once() {
    let mut file = File::sound();
    file.tensors[0].2 = vec![4, 4, 9];
    file.tensors[1].1 = "I32";
    file.tensors.pop();
    file.tensors.push(("stray".into(), "F32", vec![1], vec![0; 4]));
    file.document["cell"] = json!(0);
    assert_eq!(file.problems().len(), 5);
    let text = Weights::from_bytes(&file.bytes()).unwrap_err().to_string();
    for word in ["a.weight", "a.bias", "b.bias", "stray", "cell"] {
        assert!(text.contains(word), "{word} in {text}");
    }
}

/// Flips, overwrites, inserts, deletes and swaps pieces of sound files. The reader must come back, with whatever answer.
#[test]
fn mutated_files_never_panic() {
    let sound = File::sound().bytes();
    let fixture = std::fs::read(fixture("upsample.safetensors")).unwrap();
    let mut state = 0x2545_f491_4f6c_dd1du64;
    let mut next = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below.max(1)
    };
    let tokens: [&[u8]; 12] = [
        b"-1",
        b"1e400",
        b"18446744073709551615",
        b"null",
        b"[]",
        b"{}",
        b"\"\"",
        b"0",
        b"}",
        b"\\u0000",
        b"NaN",
        b"\xff",
    ];
    let (mut refused, mut total) = (0, 0);
    for round in 0..24_000 {
        let mut bytes = if round % 2 == 0 { sound.clone() } else { fixture.clone() };
        let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        for _ in 0..1 + next(3) {
            // Mostly the header, where the structure is.
            let reach = if next(8) == 0 { bytes.len() } else { header.min(bytes.len()) };
            let at = next(reach);
            match next(6) {
                0 => bytes[at] ^= 1 << next(8),
                1 => bytes[at] = next(256) as u8,
                2 => {
                    drop(bytes.splice(at..(at + next(5)).min(bytes.len()), tokens[next(tokens.len())].iter().copied()))
                }
                3 => drop(bytes.drain(at..(at + 1 + next(16)).min(bytes.len()))),
                4 => bytes.truncate(at.max(8)),
                _ => {
                    let other = next(reach);
                    bytes.swap(at, other);
                }
            }
            // Half of the time the length is put right, so that mutations get past the first check.
            if next(2) == 0 && bytes.len() >= 8 {
                let length = (header as u64).min(bytes.len() as u64 - 8);
                bytes[..8].copy_from_slice(&length.to_le_bytes());
            }
            if bytes.len() < 9 {
                break;
            }
        }
        total += 1;
        if let Err(error) = Weights::from_bytes(&bytes) {
            assert!(!error.to_string().is_empty());
            refused += 1;
        }
    }
    assert_eq!(total, 24_000);
    println!("{refused} of {total} mutated files refused");
    assert!(refused > total / 2 && refused < total, "some mutations are harmless, most are not: {refused}");
}
