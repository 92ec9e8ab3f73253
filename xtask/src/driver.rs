//! An adapter for everything that draws: `bouncelight doctor` says what there is; where that is
//! nothing, or Mesa's CPU driver with a fault that makes frames slow, Debian and Ubuntu have a better
//! one, which is installed after saying so.

use crate::{command, no_install, run};
use std::path::Path;
use std::process::{Command, Stdio};

/// Exit code with which `bouncelight doctor` says that there is no usable adapter.
const NO_ADAPTER: i32 = 3;

/// Where Debian 12 has packages of its successors.
const BACKPORTS: &str = "bookworm-backports";

/// What `bouncelight doctor` finds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Adapter {
    Good,
    /// A CPU driver that compiles shaders anew in each frame.
    SlowDriver,
    /// OpenGL in software and nothing else, which takes minutes over shaders instead of seconds.
    SlowGl,
    None,
}

/// Makes sure that an adapter answers.
///
/// # Errors
/// There is none, and none could be installed.
pub fn make_sure_of_adapter(program: &Path) -> Result<(), String> {
    let found = doctor(program)?;
    let why = match found {
        Adapter::Good => return Ok(()),
        Adapter::SlowDriver => "this CPU driver compiles shaders anew in each frame",
        Adapter::SlowGl => "only OpenGL on the CPU answers, slowly",
        Adapter::None => "no GPU adapter answers",
    };
    let installed = install(found, why);
    match (installed, found) {
        (Err(e), Adapter::None) => Err(e),
        (Err(e), _) => {
            eprintln!("xtask: {e}; going on with what there is");
            Ok(())
        }
        (Ok(()), Adapter::None) if doctor(program)? == Adapter::None => {
            Err("still no adapter after installing mesa-vulkan-drivers".into())
        }
        (Ok(()), _) => Ok(()),
    }
}

/// Installs Mesa's CPU driver for Vulkan.
fn install(found: Adapter, why: &str) -> Result<(), String> {
    let release = std::fs::read_to_string("/etc/os-release").unwrap_or_default();
    if !Path::new("/etc/debian_version").exists() {
        return Err(format!("{why}; `bouncelight doctor` says what to install"));
    }
    let backports = release.lines().any(|line| line == "VERSION_CODENAME=bookworm");
    if found == Adapter::SlowDriver && !backports {
        return Err(format!("{why}; this distribution has no other"));
    }
    let from = if backports { format!(" from {BACKPORTS}") } else { String::new() };
    if no_install() {
        return Err(format!("{why}; --no-install keeps mesa-vulkan-drivers{from} from being installed"));
    }
    eprintln!("xtask: {why}; installing mesa-vulkan-drivers{from} (Vulkan on the CPU) with apt-get");
    let packages = ["install", "-y", "-q", "--no-install-recommends", "mesa-vulkan-drivers"];
    let newer = if backports { install_from_backports(&packages) } else { Err("there are no backports".into()) };
    match newer {
        Err(e) if found != Adapter::SlowDriver => {
            if backports {
                eprintln!("xtask: {e}; installing Debian 12's own, whose frames take three times as long");
            }
            apt(&["update", "-q"])?;
            apt(&packages)
        }
        newer => newer,
    }
}

/// The OpenGL driver comes along: both are parts of one library.
fn install_from_backports(packages: &[&str]) -> Result<(), String> {
    let list = Path::new("/etc/apt/sources.list.d").join(format!("{BACKPORTS}.list"));
    let policy = Command::new("apt-cache").arg("policy").output().map_err(|e| format!("apt-cache: {e}"))?;
    if !String::from_utf8_lossy(&policy.stdout).contains(BACKPORTS) {
        eprintln!("xtask: adding {BACKPORTS} to apt's sources: {}", list.display());
        let line = format!("deb http://deb.debian.org/debian {BACKPORTS} main");
        let script = format!("echo '{line}' > '{}'", list.display());
        run(&mut as_root("sh", &["-c", &script]))?;
    }
    apt(&["update", "-q"])?;
    apt(&[packages, &["libgl1-mesa-dri", "-t", BACKPORTS]].concat())
}

fn doctor(program: &Path) -> Result<Adapter, String> {
    let program = program.to_string_lossy();
    let found =
        command(&program, &["doctor"]).stderr(Stdio::inherit()).output().map_err(|e| format!("{program}: {e}"))?;
    let text = String::from_utf8_lossy(&found.stdout);
    print!("{text}");
    let software = text.contains("software rendering");
    match found.status.code() {
        // The sentence about the adapter: its name, its backend, and that it is software when it
        // is.
        Some(0) if software && text.contains(" (Gl, ") => Ok(Adapter::SlowGl),
        Some(0) if software && text.contains("compiles shaders anew") => Ok(Adapter::SlowDriver),
        Some(0) => Ok(Adapter::Good),
        Some(NO_ADAPTER) => Ok(Adapter::None),
        code => Err(format!("`bouncelight doctor` ended with {code:?}")),
    }
}

/// Runs apt-get.
///
/// # Errors
/// It failed, or `--no-install` forbids it.
pub fn apt(args: &[&str]) -> Result<(), String> {
    if no_install() {
        return Err(format!("--no-install forbids `apt-get {}`", args.join(" ")));
    }
    run(as_root("apt-get", args).env("DEBIAN_FRONTEND", "noninteractive"))
}

/// Containers run as root and often have no sudo.
fn as_root(program: &str, args: &[&str]) -> Command {
    let root = Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.trim_ascii() == b"0");
    if root { command(program, args) } else { command("sudo", &[&[program], args].concat()) }
}
