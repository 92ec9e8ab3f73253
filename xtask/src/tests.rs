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
    let name = source.strip_prefix(&folder).unwrap_or(&source).to_string_lossy().into_owned();
    Ok(Some(Program { name, file: file.into(), folder }))
}

/// Runs all `programs`, then the examples in comments. What one prints comes in one piece, when it
/// has ended.
///
/// # Errors
/// Names those that failed, when all have run.
pub fn run_all(programs: Vec<Program>, skips: &Path) -> Result<(), String> {
    let (waiting, failed) = (Mutex::new(VecDeque::from(programs)), Mutex::new(Vec::new()));
    let next = || waiting.lock().expect("no thread panics here").pop_front();
    let work = || {
        while let Some(program) = next() {
            if let Err(message) = run_one(&program, skips) {
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
    if let Err(message) = run(command("cargo", &["test", "--workspace", "--doc"]).env("SKIP_LOG", skips)) {
        failed.push(message);
    }
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n  ")) }
}

fn run_one(program: &Program, skips: &Path) -> Result<(), String> {
    let begun = Instant::now();
    // Both streams in one file: in the order in which they were written.
    let log = program.file.with_extension("log");
    let error = |e: std::io::Error| format!("{}: {e}", program.name);
    let out = std::fs::File::create(&log).map_err(error)?;
    let mut command = command(&program.file.to_string_lossy(), &[]);
    command.current_dir(&program.folder).env("CARGO_MANIFEST_DIR", &program.folder).env("SKIP_LOG", skips);
    let status = command.stdin(Stdio::null()).stderr(out.try_clone().map_err(error)?).stdout(out).status();
    let text = std::fs::read(&log).map_err(error)?;
    println!(
        "     Running {} ({:.1} s)\n{}",
        program.name,
        begun.elapsed().as_secs_f64(),
        String::from_utf8_lossy(&text)
    );
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{} ended with {status}", program.name)),
        Err(e) => Err(format!("{}: {e}", program.name)),
    }
}
