//! The weights reader against every kind of bad file, and against mutated ones: an error that names
//! the fault, never a panic.

use bouncelight::net::format::{Dtype, KEY, Problem, Weights, WeightsError};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("weights-format/fixtures").join(name)
}

/// A small network to spoil: two convolutions.
fn sound_document() -> Value {
    json!({
        "version": 1, "licence": "CC0-1.0", "table": {"name": "cells", "version": 1}, "cell": 4,
        "inputs": [{"name": "normal", "channels": 3}, {"name": "hit", "channels": 1}],
        "output": {"tensor": "y", "meaning": "plain", "channels": 3},
        "graph": [
            {"op": "conv2d", "name": "a", "input": "input", "output": "h", "in_channels": 4, "out_channels": 4,
             "kernel": [3, 3], "stride": 1, "padding": 1, "activation": "relu"},
            {"op": "conv2d", "name": "b", "input": "h", "output": "y", "in_channels": 4, "out_channels": 3,
                "kernel": [1, 1]}
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
    one(&["version 3", "up to version 2"], set("/version", json!(3)));
    one(&["table `cells`", "version 7"], set("/table/version", json!(7)));
    one(&["table `probe` is unknown"], set("/table/name", json!("probe")));
    one(&["`b`", "`pixel_shuffle` is unknown"], set("/graph/1/op", json!("pixel_shuffle")));
    one(&["`glow`", "no such feature"], set("/inputs/0/name", json!("glow")));
    one(&["`normal`", "3 channels"], |f| {
        f.document["inputs"] = json!([{"name": "normal", "channels": 4}]);
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
fn version_2_writes_its_encodings() {
    let second = |spoil: fn(&mut Value)| {
        move |f: &mut File| {
            f.document["version"] = json!(2);
            f.document["inputs"] = json!([
                {"name": "normal", "channels": 3, "encoding": "gravity_frame"},
                {"name": "hit", "channels": 1, "encoding": "flag"}
            ]);
            spoil(&mut f.document);
        }
    };
    let mut file = File::sound();
    second(|_| {})(&mut file);
    let weights = Weights::from_bytes(&file.bytes()).unwrap();
    // A file of version 1 means the same.
    assert_eq!(weights.inputs, Weights::from_bytes(&File::sound().bytes()).unwrap().inputs);
    one(&["`hit`", "missing"], second(|d| drop(d["inputs"][1].as_object_mut().unwrap().remove("encoding"))));
    one(&["`hit`", "encoding `signed`", "known: flag"], second(|d| d["inputs"][1]["encoding"] = json!("signed")));
    one(&["`normal`", "came with version 2"], |f| f.document["inputs"][0]["encoding"] = json!("gravity_frame"));
    one(&["licence is empty"], second(|d| d["licence"] = json!(" ")));
}

#[test]
fn operators_with_a_field_twice() {
    let file = File::sound();
    let mut text = file.document.to_string();
    text = text.replace(r#""name":"a""#, r#""name":"a","stride":1"#);
    let header = json!({"__metadata__": {KEY: text}}).to_string();
    let found = problems(&container(&header, b""));
    assert!(found.iter().any(|p| p.to_string().contains("`stride` stands twice")), "{found:?}");
}

/// The sound file with the weights of `a` as bytes.
fn in_bytes() -> File {
    let mut file = File::sound();
    file.tensors[0] = ("a.weight".into(), "I8", vec![4, 4, 3, 3], (0..144).map(|i| i as u8).collect());
    let scales = [0.5f32, 0.25, 2.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    file.tensors.insert(1, ("a.weight_scale".into(), "F32", vec![4], scales));
    file
}

#[test]
fn bytes_are_multiplied_with_the_scale_of_their_output_channel() {
    let weights = Weights::from_bytes(&in_bytes().bytes()).unwrap();
    let tensor = &weights.tensors()["a.weight"];
    assert_eq!(tensor.stored, Dtype::I8);
    assert_eq!((tensor.data[1], tensor.data[35], tensor.data[36], tensor.data[143]), (0.5, 17.5, 9.0, -113.0));
    assert!(!weights.tensors().contains_key("a.weight_scale"), "scales are no tensors of the graph");
    let spoilt = |words: &[&str], spoil: fn(&mut File)| {
        one(words, |f| {
            *f = in_bytes();
            spoil(f);
        })
    };
    spoilt(&["`a.weight_scale` is missing"], |f| drop(f.tensors.remove(1)));
    spoilt(&["`a.weight_scale`", "[3]", "[4]"], |f| {
        f.tensors[1].2 = vec![3];
        f.tensors[1].3.truncate(12);
    });
    spoilt(&["`a.weight_scale`", "F16", "scales are F32"], |f| {
        f.tensors[1].1 = "F16";
        f.tensors[1].3.truncate(8);
    });
    for bad in [f32::NAN, f32::INFINITY, 0.0, -1.0, f32::MAX] {
        one(&["`a.weight_scale`", "index 2"], |f| {
            *f = in_bytes();
            f.tensors[1].3[8..12].copy_from_slice(&bad.to_le_bytes());
        });
    }
    one(&["`a.bias`", "I8"], |f| {
        f.tensors[1].1 = "I8";
        f.tensors[1].3.truncate(4);
    });
    // Scales without bytes belong to nothing.
    one(&["`a.weight_scale`", "no operator"], |f| {
        f.tensors.push(("a.weight_scale".into(), "F32", vec![4], vec![0; 16]))
    });
}

#[test]
fn what_is_written_is_read_again() {
    for name in ["unet", "conv3x3_wide", "upsample4", "add"] {
        let weights = Weights::load(&fixture(&format!("{name}.safetensors"))).unwrap();
        for (dtype, tolerance) in [(Dtype::F32, 0.0), (Dtype::F16, 1.0 / 2048.0), (Dtype::I8, 0.5 / 127.0)] {
            let bytes = weights.clone().stored_as(dtype).to_bytes();
            let again = Weights::from_bytes(&bytes).unwrap();
            assert_eq!(
                (&again.graph, &again.inputs, &again.provenance),
                (&weights.graph, &weights.inputs, &weights.provenance)
            );
            for (name, tensor) in weights.tensors() {
                let largest = tensor.data.iter().fold(0f32, |m, v| m.max(v.abs()));
                let other = &again.tensors()[name];
                assert_eq!(
                    (other.stored == dtype, &other.shape),
                    (tensor.shape.len() == 4 || dtype == Dtype::F32, &tensor.shape)
                );
                let worst = tensor.data.iter().zip(&other.data).fold(0f32, |m, (a, b)| m.max((a - b).abs()));
                let allowed = if tensor.shape.len() == 4 { 1.001 * tolerance * largest } else { 0.0 };
                assert!(worst <= allowed, "{name} as {dtype:?}: {worst} > {allowed}");
            }
        }
    }
}

#[test]
fn variances_below_zero() {
    let mut file = File::sound();
    file.document["graph"].as_array_mut().unwrap().insert(
        1,
        json!({"op": "batch_norm", "name": "n", "input": "h", "output": "i", "channels": 4, "affine": false}),
    );
    file.document["graph"][2]["input"] = json!("i");
    let four = |v: f32| [0.0, 0.0, v, 0.0].iter().flat_map(|v: &f32| v.to_le_bytes()).collect::<Vec<u8>>();
    file.tensors.push(("n.running_mean".into(), "F32", vec![4], four(-1.0)));
    file.tensors.push(("n.running_var".into(), "F32", vec![4], four(1.0)));
    Weights::from_bytes(&file.bytes()).unwrap();
    file.tensors.last_mut().unwrap().3 = four(-1.0);
    let found = file.problems();
    assert!(
        matches!(&found[..], [Problem::Negative { tensor, index: 2, .. }] if tensor == "n.running_var"),
        "{found:?}"
    );
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
