//! The training package's own tests, where Python with PyTorch and OpenEXR is at hand; a visible skip elsewhere.

use std::path::Path;
use std::process::Command;

#[test]
fn training_runs_end_to_end_at_toy_scale() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("training");
    let python = |args: &[&str]| Command::new("python3").args(args).current_dir(&folder).output();
    match python(&["-c", "import torch, OpenEXR, safetensors, PIL, matplotlib"]) {
        Ok(found) if found.status.success() => {}
        Ok(found) => {
            let text = String::from_utf8_lossy(&found.stderr).into_owned();
            return println!("SKIP: {}", text.lines().last().unwrap_or("python3 lacks a package"));
        }
        Err(e) => return println!("SKIP: python3: {e}"),
    }
    let run = python(&["-m", "unittest", "tests.test_toy"]).expect("python3 has just answered");
    let text = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{text}");
    // unittest says how many it ran; an empty run must not pass.
    assert!(text.contains("Ran 11 tests"), "{text}");
}
