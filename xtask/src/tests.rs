//! Every test program of the workspace, two and two: one alone leaves a fifth of two cores idle,
//! waiting for its slowest test.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Mutex;
use std::time::Instant;

use crate::{command, run};

/// Programs that run at once. Each has as many threads for its tests as there are processors, so
/// more would only take memory.
const AT_ONCE: usize = 2;

/// Programs that take longest, which begin first: with two at once, one of them at the end would have
/// the machine for itself.
const LONGEST: [&str; 6] = [
    "tests/gi/",
    "tests/net/",
    "crates/app/tests/cli/",
    "crates/lab/tests/study/",
    "crates/app/tests/viewer/",
    "crates/lab/tests/reference/",
];

/// As [`LONGEST`], of a run of all: networks in every way take half an hour, spoilt files minutes.
const LONGEST_OF_ALL: [&str; 7] = [
    "tests/net/",
    "crates/scene/tests/fuzz/",
    "tests/memory.rs",
    "tests/gi/",
    "crates/app/tests/cli/",
    "crates/lab/tests/reference/",
    "crates/app/tests/viewer/",
];

/// Ignored tests that assert nothing but write fixtures: they are run by hand.
const WRITERS: [&str; 1] = ["truth::make_the_truth"];

/// So many of the slowest tests are told.
const SLOWEST: usize = 20;

/// What is run, and how.
pub struct Plan<'a> {
    /// File to which tests append what they skip.
    pub skips: &'a Path,
    /// Heavy tests whole, and those that an ordinary run ignores.
    pub all: bool,
}

/// Seconds that a test took, with its program and name.
type Time = (f64, String);

/// A test program as cargo has built it.
pub struct Program {
    /// What people call it: `tests/gi/main.rs`.
    name: String,
    file: PathBuf,
    /// The package's folder, in which cargo starts tests.
    folder: PathBuf,
}

/// Builds all tests and examples, and returns the test programs.
///
/// # Errors
/// What cargo says goes to standard error; the message is that it failed.
pub fn build() -> Result<Vec<Program>, String> {
    let words = ["test", "--workspace", "--no-run", "--message-format", "json-render-diagnostics"];
    let mut cargo = command("cargo", &words);
    let built = cargo.stderr(Stdio::inherit()).output().map_err(|e| format!("cargo: {e}"))?;
    if !built.status.success() {
        return Err(format!("`cargo {}` ended with {}", words.join(" "), built.status));
    }
    let text = String::from_utf8(built.stdout).map_err(|e| format!("cargo's messages: {e}"))?;
    text.lines().filter_map(|line| program(line).transpose()).collect()
}

/// The test program of one of cargo's messages, if it is of one.
fn program(line: &str) -> Result<Option<Program>, String> {
    let message: serde_json::Value = serde_json::from_str(line).map_err(|e| format!("cargo's message {line}: {e}"))?;
    let (Some(file), Some(true)) = (message["executable"].as_str(), message["profile"]["test"].as_bool()) else {
        return Ok(None);
    };
    let path = |value: &serde_json::Value| value.as_str().map(PathBuf::from).ok_or(format!("cargo's message: {line}"));
    let (source, manifest) = (path(&message["target"]["src_path"])?, path(&message["manifest_path"])?);
    let folder = manifest.parent().unwrap_or(Path::new("/")).to_owned();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(&folder);
    let name = source.strip_prefix(root).unwrap_or(&source).to_string_lossy().into_owned();
    Ok(Some(Program { name, file: file.into(), folder }))
}

/// Runs all `programs`, the longest first, then the examples in comments. What one prints comes in
/// one piece, when it has ended; the slowest tests of all of them come last.
///
/// # Errors
/// Names those that failed, when all have run.
pub fn run_all(mut programs: Vec<Program>, plan: &Plan) -> Result<(), String> {
    programs.sort_by_key(|program| rank(&program.name, plan.all));
    let (waiting, failed) = (Mutex::new(VecDeque::from(programs)), Mutex::new(Vec::new()));
    let times = Mutex::new(Vec::new());
    let next = || waiting.lock().expect("no thread panics here").pop_front();
    let work = || {
        while let Some(program) = next() {
            if let Err(message) = run_one(&program, plan, &times) {
                failed.lock().expect("no thread panics here").push(message);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(work);
        }
    });
    let mut failed = failed.into_inner().expect("no thread panics here");
    if let Err(message) = run(command("cargo", &["test", "--workspace", "--doc"]).env("SKIP_LOG", plan.skips)) {
        failed.push(message);
    }
    print_slowest(times.into_inner().expect("no thread panics here"));
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n  ")) }
}

/// Place of a program in the order in which they begin; those of one rank keep cargo's.
fn rank(name: &str, all: bool) -> usize {
    let longest: &[&str] = if all { &LONGEST_OF_ALL } else { &LONGEST };
    longest.iter().position(|prefix| name.starts_with(prefix)).unwrap_or(longest.len())
}

fn run_one(program: &Program, plan: &Plan, times: &Mutex<Vec<Time>>) -> Result<(), String> {
    let begun = Instant::now();
    // Both streams in one file: in the order in which they were written.
    let log = program.file.with_extension("log");
    let error = |e: std::io::Error| format!("{}: {e}", program.name);
    let out = std::fs::File::create(&log).map_err(error)?;
    // Times of tests are an unstable option of libtest, and so is its JSON. It asks for this variable
    // when it runs, so the toolchain stays the stable one; nothing is compiled with it.
    let mut command = command(&program.file.to_string_lossy(), &["-Z", "unstable-options", "--report-time"]);
    command.env("RUSTC_BOOTSTRAP", "1");
    if plan.all {
        command.arg("--include-ignored").env("TESTS", "all");
        for name in WRITERS {
            command.args(["--skip", name]);
        }
    }
    command.current_dir(&program.folder).env("CARGO_MANIFEST_DIR", &program.folder).env("SKIP_LOG", plan.skips);
    let status = command.stdin(Stdio::null()).stderr(out.try_clone().map_err(error)?).stdout(out).status();
    let text = std::fs::read(&log).map_err(error)?;
    let text = String::from_utf8_lossy(&text);
    println!("     Running {} ({:.1} s)\n{text}", program.name, begun.elapsed().as_secs_f64());
    let of_program = text.lines().filter_map(time).map(|(seconds, test)| (seconds, format!("{} {test}", program.name)));
    times.lock().expect("no thread panics here").extend(of_program);
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{} ended with {status}", program.name)),
        Err(e) => Err(format!("{}: {e}", program.name)),
    }
}

/// Seconds and name of the test that a line of libtest tells the end of:
/// `test name ... ok <0.050s>`.
fn time(line: &str) -> Option<(f64, &str)> {
    let (told, seconds) = line.strip_prefix("test ")?.strip_suffix("s>")?.rsplit_once('<')?;
    let (name, _) = told.split_once(" ... ")?;
    Some((seconds.parse().ok()?, name))
}

/// Where time goes: a test that takes more than ten seconds is one to look at. They are seconds of a
/// clock, while other tests run.
fn print_slowest(mut times: Vec<Time>) {
    times.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!("xtask: the slowest of {} tests", times.len());
    for (seconds, test) in times.iter().take(SLOWEST) {
        println!("  {seconds:7.1} s {test}");
    }
}

#[cfg(test)]
mod checks {
    use super::*;

    #[test]
    fn times_are_read_from_what_libtest_prints() {
        assert_eq!(time("test gather::a_room ... ok <12.345s>"), Some((12.345, "gather::a_room")));
        assert_eq!(time("test a ... FAILED <0.001s>"), Some((0.001, "a")));
        assert_eq!(time("test b - should panic ... ok <0.002s>"), Some((0.002, "b - should panic")));
        for other in ["test a ... ignored, by hand", "test result: ok. 1 passed; finished in 0.48s", "<1s>"] {
            assert_eq!(time(other), None, "{other}");
        }
    }

    #[test]
    fn the_longest_begin_first() {
        let begin = |all: bool| {
            let mut names = ["src/lib.rs", "tests/net/main.rs", "crates/app/tests/viewer/main.rs", "tests/gi/main.rs"];
            names.sort_by_key(|name| rank(name, all));
            names
        };
        let [first, second] = [false, true].map(begin);
        assert_eq!(first, ["tests/gi/main.rs", "tests/net/main.rs", "crates/app/tests/viewer/main.rs", "src/lib.rs"]);
        assert_eq!(second, ["tests/net/main.rs", "tests/gi/main.rs", "crates/app/tests/viewer/main.rs", "src/lib.rs"]);
        // A name that is no longer any program's would sort nothing.
        for prefix in LONGEST.iter().chain(&LONGEST_OF_ALL) {
            assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(prefix).exists(), "{prefix}");
        }
    }
}
