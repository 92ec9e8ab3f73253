//! Hostile files, thousands of them: no panic, no hang, bounded memory.
//!
//! An ordinary run reads a tenth of the cases, `cargo xtask test --all` all of them.

#[path = "../../../../tests/common/mod.rs"]
mod common;
#[path = "../../../../tests/common/corpus.rs"]
mod corpus;
#[path = "../../../../tests/common/figures.rs"]
mod figures;
#[path = "../../../../tests/common/glb.rs"]
mod glb;
#[path = "../../../../tests/common/mutate.rs"]
mod mutate;
#[path = "../../../../tests/common/packed.rs"]
mod packed;
mod scene;
#[path = "../../../../tests/common/shared.rs"]
mod shared;
#[path = "../../../../tests/common/spoil.rs"]
mod spoil;
mod weights;

use peak_alloc::PeakAlloc;
use std::process::{Command, Stdio};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Tells a process that [`apart`] has started which part of the cases is its own.
const PART: &str = "FUZZ_PART";

/// Runs `work` in so many processes of this program, each for the test of that name alone and with
/// the number of its part: the allocator counts for all threads of a process, so one that measures
/// has no other test beside it.
fn apart(test: &str, parts: u64, work: impl FnOnce(u64)) {
    if let Ok(part) = std::env::var(PART) {
        return work(part.parse().expect("a whole number"));
    }
    let program = std::env::current_exe().expect("the test's own program");
    let begin = |part: u64| {
        let mut command = Command::new(&program);
        command.args(["--exact", test, "--nocapture"]).env(PART, part.to_string());
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it can be started")
    };
    let runs: Vec<_> = (0..parts).map(begin).collect();
    let ended = runs.into_iter().map(|run| run.wait_with_output().expect("it ends")).collect::<Vec<_>>();
    for output in &ended {
        let told = String::from_utf8_lossy(&output.stdout);
        print!("{told}");
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
        assert!(told.contains("1 passed") || !output.status.success(), "`{test}` is the name of no test");
    }
    assert!(ended.iter().all(|output| output.status.success()), "a part failed; its message is above");
}

/// The number that an environment variable holds.
fn setting(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().expect("a whole number"))
}

/// Cases to read: as the variable says, else all `whole` or a tenth of them.
fn cases(name: &str, whole: u64) -> u64 {
    setting(name, if common::whole() { whole } else { whole / 10 })
}
