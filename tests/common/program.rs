//! The program as tests run it.

#![allow(dead_code, reason = "each test binary uses a part")]

use std::process::Output;

/// Runs the program with `args`.
pub fn bouncelight(args: &[&str]) -> Output {
    let mut command = assert_cmd::Command::new(env!("CARGO_BIN_EXE_bouncelight"));
    command.args(args).output().expect("the program starts")
}

/// Runs and checks the exit code and that standard error holds every one of `words`; never a panic
/// message.
#[track_caller]
pub fn fails(args: &[&str], code: i32, words: &[&str]) {
    let out = bouncelight(args);
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{args:?}: {text}");
    assert!(!text.contains("panicked"), "{args:?}: {text}");
    for word in words {
        assert!(text.contains(word), "{args:?}: `{word}` is missing in: {text}");
    }
}

/// A file's path as text.
pub fn path(dir: &tempfile::TempDir, name: &str) -> String {
    dir.path().join(name).to_str().expect("a temporary path is text").into()
}

/// Whether nothing lies in a folder.
pub fn is_empty(dir: &std::path::Path) -> bool {
    std::fs::read_dir(dir).expect("the folder exists").next().is_none()
}
