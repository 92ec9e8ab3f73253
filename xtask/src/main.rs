//! `cargo xtask demo | test | hosts | gpu-report | conformance | figures | publish | ci`: set-up and checks; no
//! product code.
//!
//! Every command first makes sure of a wgpu adapter (`driver.rs`).

mod driver;
mod figures;
mod publish;
mod tests;
mod time;

use driver::{apt, make_sure_of_adapter};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const USAGE: &str = "\
usage: cargo xtask COMMAND

  demo   draw the bundled interior with the shipped weights: out/demo.png and a timing table
  test [--all]
         every test, which were skipped, and which were slowest (an adapter is made sure of first; REQUIRE_GPU=1 makes a
         missing one an error, REQUIRE_ALL=1 all that .ci/run installs)
         --all runs heavy tests whole, which otherwise do a tenth, and those that are otherwise ignored: hours
  hosts  the pass in other renderers: exports, sets up Python with moderngl in target/hosts, runs examples/moderngl/test.py
         and a picture (needs python3 with venv, the network for pip, and EGL); the page of examples/webgpu in Chromium,
         where there is one; then crates/bevy, its test and a picture
         (some 280 crates, which two cores build in half an hour)
  gpu-report [--dev] [--minutes M] [--sizes WxH,...] [--scenes NAME,...] [--triangles N,...] [--out FOLDER] [--no-pytorch]
         measures on this device all that docs/ projects: docs/measured/DEVICE.json and DEVICE.md, in less than eight minutes
         --fit FILE fits the model of what cards take to such a record instead, and says how well they agree
         (--dev builds without release's optimisation: for rehearsals)
  conformance
         docs/reports/conformance.md: glTF feature by feature, the rasteriser beside the path tracer
  figures
         the pictures of docs, in place: the frame graph, each pass (examples/passes.rs), the demo, the viewer's window
         (needs xvfb-run), mistakes of hosts, conformance, the gallery (needs f3d and the files); python3 with Pillow
  publish [--verify]
         a dry run of publishing the packages in order; each must pack below 10 MB (--verify also builds each from its
         archive)
  ci     what continuous integration runs (.ci/run)

Where no GPU answers, Debian and Ubuntu get Mesa's CPU driver (on Debian 12 that of its backports, whose frames take a
third of the time); what is installed is said first. --no-install refuses.";

/// Whether nothing may be installed.
fn no_install() -> bool {
    std::env::args().any(|word| word == "--no-install")
}

/// Exit code with which `bouncelight render` says that a picture differs from its reference.
const ABOVE_THRESHOLD: i32 = 5;

fn main() -> ExitCode {
    let command = std::env::args().nth(1).unwrap_or_default();
    let done = match command.as_str() {
        "demo" => demo(),
        "test" => test(),
        "hosts" => hosts(),
        "gpu-report" => gpu_report(std::env::args().skip(2).filter(|word| word != "--no-install").collect()),
        "conformance" => conformance(),
        "figures" => figures::draw(),
        "publish" => publish::dry_run(),
        "ci" => ci(),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask {command}: {message}");
            ExitCode::FAILURE
        }
    }
}

fn demo() -> Result<(), String> {
    // Without the window, whose crates take two cores a minute and a half.
    let program = ["--release", "--package", "bouncelight-app", "--no-default-features"];
    cargo(&[["build"].as_slice(), &program].concat())?;
    make_sure_of_adapter(&built("release")?)?;
    cargo(&[["run", "--quiet"].as_slice(), &program, &["--", "demo"]].concat())
}

fn test() -> Result<(), String> {
    // The program as tests have it: `cargo build` would take other features of dependencies, and
    // compile them twice.
    let begun = time::Spent::now();
    let programs = tests::build()?;
    let built_after = time::Spent::now();
    make_sure_of_adapter(&built("debug")?)?;
    make_sure_of_display()?;
    // Tests append what they skip to this file: `tests/common`.
    let skips = std::env::current_exe().map_err(|e| format!("own path: {e}"))?.with_file_name("skips.txt");
    if skips.exists() {
        std::fs::remove_file(&skips).map_err(|e| format!("{}: {e}", skips.display()))?;
    }
    let all = std::env::args().any(|word| word == "--all");
    let tested = tests::run_all(programs, &tests::Plan { skips: &skips, all });
    print_skips(&std::fs::read_to_string(&skips).unwrap_or_default());
    println!("xtask: built in {}", built_after.since(&begun));
    println!("xtask: built and tested in {}", time::Spent::now().since(&begun));
    tested
}

/// How many tests were skipped for want of what; a line is that and the test, maybe more than once.
fn print_skips(lines: &str) {
    let mut tests: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for (need, test) in lines.lines().filter_map(|line| line.split_once('\t')) {
        tests.entry(need).or_default().insert(test);
    }
    println!("xtask: {} tests were skipped", tests.values().flatten().collect::<BTreeSet<_>>().len());
    for (need, tests) in tests {
        println!("  {:3} for want of: {need} ({})", tests.len(), tests.into_iter().collect::<Vec<_>>().join(", "));
    }
}

/// Everything that the documentation projects, measured on the device at hand.
fn gpu_report(mut args: Vec<String>) -> Result<(), String> {
    let dev = args.iter().any(|a| a == "--dev");
    let profile: &[&str] = if dev { &[] } else { &["--release"] };
    args.retain(|a| a != "--dev");
    let build = ["build", "--bin", "bouncelight", "--example", "gpu_report"];
    cargo(&[&build, profile].concat())?;
    make_sure_of_adapter(&built(if dev { "debug" } else { "release" })?)?;
    // A source that is not committed has no name that others could find.
    let git = |words: &[&str]| command("git", words).output().ok().filter(|o| o.status.success());
    let clean = git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|o| o.stdout.is_empty());
    if let Some(head) = git(&["rev-parse", "--short=12", "HEAD"]) {
        let hash = String::from_utf8_lossy(&head.stdout).trim().to_owned();
        args.extend(["--commit".into(), if clean { hash } else { format!("{hash} with changes") }]);
    }
    let words: Vec<&str> = args.iter().map(String::as_str).collect();
    cargo(&[&["run", "--quiet", "--example", "gpu_report"], profile, &["--"], &words].concat())
}

/// The page of glTF's features, written by the test that holds their bounds.
fn conformance() -> Result<(), String> {
    cargo(&["test", "--test", "reference", "--no-run"])?;
    make_sure_of_adapter(&built("debug")?)?;
    let words = ["test", "--test", "reference", "--", "--exact", "conformance::page", "--nocapture"];
    // Tests run in their package's folder.
    let docs = std::env::current_dir().map_err(|e| format!("own folder: {e}"))?.join("docs");
    run(command("cargo", &words).env("CONFORMANCE_DOCS", docs))
}

/// Hosts in other languages; their tests are their own programs.
fn hosts() -> Result<(), String> {
    cargo(&["build", "--bin", "bouncelight", "--example", "moderngl_yardstick", "--example", "export_scene"])?;
    let program = built("debug")?;
    make_sure_of_adapter(&program)?;
    if Command::new("spirv-val").arg("--version").output().is_err()
        && std::path::Path::new("/etc/debian_version").exists()
    {
        eprintln!("xtask: no spirv-val; installing spirv-tools with apt-get");
        apt(&["install", "-y", "-q", "--no-install-recommends", "spirv-tools"])?;
    }
    cargo(&["test", "--test", "cli", "export::"])?;
    let folder = program.parent().ok_or("the program has no folder")?;
    let work = folder.with_file_name("hosts");
    std::fs::create_dir_all(&work).map_err(|e| format!("{}: {e}", work.display()))?;
    let text = |path: &std::path::Path| path.to_string_lossy().into_owned();
    let [program, yardstick, scene_writer] =
        ["bouncelight", "examples/moderngl_yardstick", "examples/export_scene"].map(|p| text(&folder.join(p)));
    let (venv, glb) = (text(&work.join("venv")), text(&work.join("cornell.glb")));
    let python = format!("{venv}/bin/python");
    if !std::path::Path::new(&python).exists() {
        run(&mut command("python3", &["-m", "venv", &venv]))?;
    }
    run(&mut command(&python, &["-m", "pip", "install", "-q", "-r", "examples/moderngl/requirements.txt"]))?;
    run(&mut command(&scene_writer, &["cornell", &glb]))?;
    for method in ["gather", "neural"] {
        let folder = text(&work.join(format!("moderngl-{method}")));
        let target = ["--method", method, "--target", "glsl430", "--size", "160x96", "-o", &folder];
        run(&mut command(&program, &[["-q", "export", "cornell"].as_slice(), &target].concat()))?;
        run(&mut command(&python, &["examples/moderngl/test.py", &folder, "cornell", &glb, &yardstick]))?;
    }
    // The whole picture.
    let [folder, picture, ours] =
        ["moderngl-picture", "moderngl.png", "bouncelight.png"].map(|name| text(&work.join(name)));
    let size = ["--size", "384x384"];
    let target = ["-q", "export", "cornell", "--target", "glsl430", "-o", &folder];
    run(&mut command(&program, &[target.as_slice(), &size].concat()))?;
    run(&mut command(&python, &["examples/moderngl/main.py", &folder, &glb, &picture]))?;
    is_ours(&program, &picture, &ours)?;
    browser(&program, &python, &glb, &work)?;

    // Bevy: a package of its own, which states a newer Rust than it needs.
    let package = ["--manifest-path", "crates/bevy/Cargo.toml", "--ignore-rust-version", "--locked"];
    cargo(&[["test"].as_slice(), &package].concat())?;
    let picture = text(&work.join("bevy.png"));
    cargo(&[["run", "--example", "scene"].as_slice(), &package, &["--", &glb, &picture]].concat())?;
    is_ours(&program, &picture, &ours)
}

/// The page of examples/webgpu in headless Chromium, on SwiftShader: at 128×128 steep surfaces have
/// the worst depth. The network is left out: its shaders take SwiftShader two minutes and more to
/// compile.
fn browser(program: &str, python: &str, glb: &str, work: &Path) -> Result<(), String> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let Some(chromium) = names.into_iter().find(|c| Command::new(c).arg("--version").output().is_ok()) else {
        eprintln!("xtask: SKIP the page in a browser: no {}", names.join(", no "));
        return Ok(());
    };
    for size in ["128x128", "192x192"] {
        let data = work.join(format!("webgpu-{size}"));
        std::fs::create_dir_all(&data).map_err(|e| format!("{}: {e}", data.display()))?;
        std::fs::copy(glb, data.join("scene.glb")).map_err(|e| format!("{}: {e}", data.display()))?;
        let folder = data.join("gather").to_string_lossy().into_owned();
        run(&mut command(program, &["-q", "export", "cornell", "--size", size, "--target", "wgsl", "-o", &folder]))?;
        let data = data.to_string_lossy().into_owned();
        let test = ["examples/webgpu/test.py", &data, "cornell", "--program", program, "--chromium", chromium];
        run(&mut command(python, &[test.as_slice(), &["--methods", "gather"]].concat()))?;
    }
    Ok(())
}

/// Compares a host's picture of `cornell` with our renderer's, and as a control with ours without
/// the light that the pass finds.
fn is_ours(program: &str, picture: &str, ours: &str) -> Result<(), String> {
    let render = ["-q", "render", "cornell", "--size", "384x384", "--tonemap", "none", "-o", ours];
    let render = [render.as_slice(), &["--reference", picture, "--metric", "flip", "--threshold", "0.05"]].concat();
    match command(program, &[render.as_slice(), &["--method", "direct"]].concat()).status() {
        Ok(status) if status.code() == Some(ABOVE_THRESHOLD) => {
            eprintln!("xtask: without the pass it is, as it should")
        }
        other => return Err(format!("without the pass's light the pictures should differ: {other:?}")),
    }
    run(&mut command(program, &[render.as_slice(), &["--method", "gather", "--accumulate", "64"]].concat()))
}

fn ci() -> Result<(), String> {
    run(&mut command("bash", &[".ci/run"]))
}

/// The program as cargo has built it in the folder `profile`, beside which xtask lies.
fn built(profile: &str) -> Result<PathBuf, String> {
    let own = std::env::current_exe().map_err(|e| format!("own path: {e}"))?;
    let target = own.ancestors().nth(2).ok_or("own path has no folder")?;
    Ok(target.join(profile).join(format!("bouncelight{}", std::env::consts::EXE_SUFFIX)))
}

/// The viewer's tests need an X server without a screen, and what a window under X loads at run
/// time.
fn make_sure_of_display() -> Result<(), String> {
    let runs = |program: &str| Command::new(program).arg("-help").output().is_ok();
    if runs("Xvfb") || !std::path::Path::new("/etc/debian_version").exists() {
        return Ok(());
    }
    eprintln!("xtask: no Xvfb; installing xvfb and X's client libraries with apt-get, for the viewer's tests");
    apt(&["update", "-q"])?;
    let libraries = ["libx11-6", "libx11-xcb1", "libxcursor1", "libxi6", "libxrandr2", "libxkbcommon-x11-0"];
    apt(&[["install", "-y", "-q", "--no-install-recommends", "xvfb"].as_slice(), &libraries].concat())
}

fn cargo(args: &[&str]) -> Result<(), String> {
    run(&mut command("cargo", args))
}

fn command(program: &str, args: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(args).current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    // Without a display, Mesa's layer that asks the desktop for its preferred card can only
    // complain.
    if ["DISPLAY", "WAYLAND_DISPLAY"].iter().all(|name| std::env::var_os(name).is_none()) {
        command.env("NODEVICE_SELECT", "1");
    }
    command
}

fn run(command: &mut Command) -> Result<(), String> {
    let shown = format!("{command:?}").replace('"', "");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{shown}` ended with {status}")),
        Err(e) => Err(format!("`{shown}`: {e}")),
    }
}
