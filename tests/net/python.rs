//! The Python package and this reader: each reads what the other writes, and both find the same
//! faults.

use crate::common::{self, Need};
use crate::{corpus, mutate, spoil};
use bouncelight::net::format::{Dtype, Weights};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("weights-format").join(name)
}

fn python() -> bool {
    common::python(Need::Python, "numpy")
}

fn run(arguments: &[&str]) -> String {
    let mut command = Command::new("python3");
    let out = command.args(arguments).env("PYTHONPATH", folder("python")).output().expect("python3 has just answered");
    assert!(out.status.success(), "{}{}", String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).expect("Python prints text")
}

/// `fixtures/bad/expected.json` lists by hand what is wrong; the package's tests hold the package
/// against the same list.
#[test]
fn bad_files_have_the_faults_that_are_expected() {
    let text = std::fs::read_to_string(folder("fixtures/bad/expected.json")).unwrap();
    let expected: serde_json::Map<String, serde_json::Value> = serde_json::from_str(&text).unwrap();
    assert!(expected.len() > 50);
    for (name, faults) in expected {
        let faults: Vec<[String; 2]> = serde_json::from_value(faults).unwrap();
        let wanted: BTreeSet<(String, String)> = faults.into_iter().map(|[code, subject]| (code, subject)).collect();
        let found = match Weights::load(&folder(&format!("fixtures/bad/{name}.safetensors"))) {
            Ok(_) => Vec::new(),
            Err(error) => error.faults(),
        };
        let found: BTreeSet<_> = found.into_iter().map(|(code, subject)| (code.to_string(), subject)).collect();
        assert_eq!(found, wanted, "{name}");
    }
}

/// Both readers on hostile files. Known to differ: a half surrogate in a text of an operator, which
/// spoils the document for the package and the operator for us; no file of this seed has one.
#[test]
fn hostile_files_have_the_same_faults() {
    if !python() {
        return;
    }
    let (made, files) = (tempfile::tempdir().unwrap(), corpus::weights());
    let mut wanted = Vec::new();
    for case in 0..600 {
        let bytes = mutate::case(&files, &mut spoil::Random::new(5, case));
        std::fs::write(made.path().join(format!("{case}.safetensors")), &bytes).unwrap();
        let faults = Weights::from_bytes(&bytes).err().map_or(Vec::new(), |e| e.faults());
        wanted.push(faults.into_iter().map(|(code, subject)| [code.to_string(), subject]).collect::<BTreeSet<_>>());
    }
    let script = "
import json, sys
import bouncelight_weights as bw
found = ([[p.code, p.subject] for p in bw.verify(f'{sys.argv[1]}/{i}.safetensors')] for i in range(600))
print(json.dumps(list(found)))
";
    let text = run(&["-c", script, made.path().to_str().expect("a temporary path is text")]);
    let found: Vec<BTreeSet<[String; 2]>> = serde_json::from_str(&text).unwrap();
    for (case, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
        assert_eq!(found, wanted, "case {case}");
    }
    assert!(wanted.iter().filter(|w| w.is_empty()).count() > 20 && wanted.iter().filter(|w| w.len() > 1).count() > 50);
}

#[test]
fn the_package_reads_our_files_and_passes_its_tests() {
    if !python() {
        return;
    }
    let made = tempfile::tempdir().unwrap();
    let mut paths = Vec::new();
    for name in ["unet", "conv5x5_s3", "add"] {
        let weights = Weights::load(&folder(&format!("fixtures/{name}.safetensors"))).unwrap();
        for dtype in [Dtype::F32, Dtype::F16, Dtype::I8] {
            let path = made.path().join(format!("{name}_{}.safetensors", dtype.name()));
            std::fs::write(&path, weights.clone().stored_as(dtype).to_bytes()).unwrap();
            paths.push(path.to_str().expect("a temporary path is text").to_string());
        }
    }
    let script = folder("python/tests/test_package.py");
    let mut arguments = vec![script.to_str().expect("the checkout's path is text")];
    arguments.extend(paths.iter().map(String::as_str));
    let text = run(&arguments);
    // An empty run must not pass.
    assert!(text.contains("ran 7 tests on 9 files"), "{text}");
    print!("{text}");
    // What the package's tests left out.
    text.lines().filter_map(|line| line.strip_prefix("SKIP: ")).for_each(|reason| common::skip(Need::Python, reason));
}

#[test]
fn we_read_the_packages_files() {
    if !python() {
        return;
    }
    let made = tempfile::tempdir().unwrap();
    let script = "
import json, sys
import numpy as np
import bouncelight_weights as bw
from bouncelight_weights.graph import complete
from bouncelight_weights.operators import tensors
graph, output = bw.unet(widths=(4, 6))
rng = np.random.default_rng(3)
arrays = {n: rng.normal(0, 1, s).astype(np.float32) for op in complete(graph) for n, s in tensors(op).items()}
half = {n: a.astype(np.float16) for n, a in arrays.items()}
sums = {}
for name, stored in (('F32', arrays), ('F16', half), ('I8', bw.quantised(arrays, graph))):
    path = f'{sys.argv[1]}/{name}.safetensors'
    bw.write(path, stored, bw.document(graph, output))
    ramp = lambda a: float((a.astype(np.float64).ravel() * (1 + np.arange(a.size) % 7)).sum())
    sums[name] = {n: ramp(a) for n, a in bw.read(path)[0].items()}
print(json.dumps(sums))
";
    let text = run(&["-c", script, made.path().to_str().expect("a temporary path is text")]);
    let sums: serde_json::Value = serde_json::from_str(&text).unwrap();
    for dtype in [Dtype::F32, Dtype::F16, Dtype::I8] {
        let weights = Weights::load(&made.path().join(format!("{}.safetensors", dtype.name()))).unwrap();
        assert!(weights.tensors().values().any(|t| t.stored == dtype));
        for (name, tensor) in weights.tensors() {
            let ours: f64 = tensor.data.iter().enumerate().map(|(i, v)| f64::from(*v) * (1 + i % 7) as f64).sum();
            let theirs = sums[dtype.name()][name].as_f64().expect("a number for each tensor");
            assert!((ours - theirs).abs() < 1e-6 * (1.0 + theirs.abs()), "{name} as {dtype:?}: {ours} {theirs}");
        }
    }
}

#[test]
fn the_schema_knows_every_operator() {
    let schema: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder("schema.json")).unwrap()).unwrap();
    let known: BTreeSet<&str> = schema["$defs"].as_object().unwrap().keys().map(String::as_str).collect();
    assert_eq!(known, bouncelight::net::op_facts::KINDS.into_iter().collect());
}
