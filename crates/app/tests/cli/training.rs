//! The training package's own tests, where Python with PyTorch and OpenEXR is at hand; a visible
//! skip elsewhere.

use crate::common;
use std::process::Command;

/// Test modules, and how many tests each has: an empty run must not pass.
const MODULES: [(&str, u32); 5] = [
    ("tests.test_pix2pix", 13),
    ("tests.test_judge", 1),
    ("tests.test_turned", 4),
    ("tests.test_filter", 11),
    ("tests.test_chart", 2),
];

#[test]
fn training_runs_end_to_end_at_toy_scale() {
    let folder = crate::common::root().join("training");
    let python = |args: &[&str]| {
        let program = env!("CARGO_BIN_EXE_bouncelight");
        Command::new("python3").args(args).current_dir(&folder).env("BOUNCELIGHT", program).output()
    };
    if !common::python(common::Need::Torch, "torch, OpenEXR, safetensors, PIL, matplotlib") {
        return;
    }
    for (module, tests) in MODULES {
        let run = python(&["-m", "unittest", module]).expect("python3 has just answered");
        let text = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{module}: {text}");
        assert!(text.contains(&format!("Ran {tests} test")), "{module}: {text}");
    }
}
