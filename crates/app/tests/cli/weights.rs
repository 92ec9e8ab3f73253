//! Weights files on the command line: the shipped ones by name, faults by file and tensor.

use crate::program::{bouncelight, fails, is_empty, path};
use std::path::Path;

#[test]
fn invalid_weights_exit_with_4_and_name_the_tensor() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir, "out.png");
    let shipped = std::fs::read(crate::common::root().join("assets/weights/filter.safetensors")).unwrap();
    let text = path(&dir, "text.safetensors");
    std::fs::write(&text, b"these are no weights").unwrap();
    fails(&["render", "interior", "-o", &out, "--weights", &text], 4, &["text.safetensors"]);
    let cut = path(&dir, "cut.safetensors");
    std::fs::write(&cut, &shipped[..shipped.len() - 64]).unwrap();
    fails(&["render", "interior", "-o", &out, "--weights", &cut], 4, &["cut.safetensors"]);
    // The last four bytes belong to the last tensor's last number.
    let nan = path(&dir, "nan.safetensors");
    let mut bytes = shipped.clone();
    let end = bytes.len();
    bytes[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    std::fs::write(&nan, &bytes).unwrap();
    fails(&["render", "interior", "-o", &out, "--weights", &nan], 4, &["nan.safetensors", "weight"]);
    // Renaming a tensor in the header makes one missing and one unexpected; both are reported.
    let missing = path(&dir, "missing.safetensors");
    std::fs::write(&missing, replaced(&shipped, b"\"head.weight\"", b"\"HEAD.weight\"")).unwrap();
    fails(&["render", "interior", "-o", &out, "--weights", &missing], 4, &["head.weight", "HEAD.weight"]);
    fails(&["weights", "verify", &missing], 4, &["head.weight"]);
    // Another shape with as many bytes.
    let misshaped = path(&dir, "misshaped.safetensors");
    std::fs::write(&misshaped, replaced(&shipped, b"[12,12,1,1]", b"[12,1,12,1]")).unwrap();
    fails(&["render", "interior", "-o", &out, "--weights", &misshaped], 4, &["head.weight"]);
    fails(&["weights", "info", dir.path().to_str().unwrap()], 4, &["not a file"]);
    assert!(!Path::new(&out).exists());
}

/// `bytes` with the one occurrence of `from` replaced by `to` of the same length.
fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let at: Vec<usize> = (0..bytes.len() - from.len()).filter(|&i| bytes[i..].starts_with(from)).collect();
    assert_eq!(at.len(), 1, "{} occurs once", String::from_utf8_lossy(from));
    let mut out = bytes.to_vec();
    out[at[0]..at[0] + to.len()].copy_from_slice(to);
    out
}

#[test]
fn the_shipped_network_has_a_name() {
    for command in ["info", "verify"] {
        let out = bouncelight(&["weights", command, "filter"]);
        assert!(out.status.success(), "{command}: {}", String::from_utf8_lossy(&out.stderr));
    }
    fails(&["weights", "verify", "filt"], 4, &["filt"]);
}

/// Files that name what this program does not know are refused.
#[test]
fn unknown_names_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir, "out.png");
    let bad = |name: &str| {
        format!("{}/weights-format/fixtures/bad/{name}.safetensors", concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
    };
    for (name, words) in [
        ("operator_left", &["`n`", "`pixel_shuffle` is unknown"]),
        ("meaning_left", &["`gain_and_rest_on_guess` is unknown", "filter"]),
        ("table_left", &["`screen` is unknown", "cells"]),
    ] {
        fails(&["weights", "verify", &bad(name)], 4, words);
        fails(&["render", "cornell", "-o", &out, "--weights", &bad(name)], 4, words);
    }
    assert!(is_empty(dir.path()));
}
