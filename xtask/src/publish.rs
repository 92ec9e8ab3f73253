//! A dry run of publishing.

use crate::cargo;
use std::path::Path;

/// What crates.io takes, bytes.
const MOST: u64 = 10_000_000;

/// Packs all packages, each after those that it needs, and says how large they are. With `--verify`
/// each is built from its archive alone.
///
/// # Errors
/// What cargo refuses, and packages that are too large.
pub fn dry_run() -> Result<(), String> {
    let all = ["--workspace", "--exclude", "xtask", "--allow-dirty", "--quiet"];
    let verify = std::env::args().any(|word| word == "--verify");
    let unverified: &[&str] = if verify { &[] } else { &["--no-verify"] };
    let folder = Path::new("target/package");
    // Archives of an earlier run would be measured, too.
    for archive in archives(folder) {
        std::fs::remove_file(&archive).map_err(|e| format!("{}: {e}", archive.display()))?;
    }
    cargo(&[&["package"], &all[..], unverified].concat())?;
    let packed = archives(folder);
    for archive in &packed {
        let bytes = std::fs::metadata(archive).map_err(|e| format!("{}: {e}", archive.display()))?.len();
        println!("xtask: {} has {:.1} MB", archive.display(), bytes as f64 / 1e6);
        if bytes >= MOST {
            return Err(format!("{} has {bytes} bytes, crates.io takes {MOST}", archive.display()));
        }
    }
    if packed.is_empty() {
        return Err(format!("no archive in {}", folder.display()));
    }
    // The order, and what a registry would refuse.
    cargo(&[&["publish", "--dry-run", "--no-verify"], &all[..]].concat())
}

/// The packages' archives in `folder`.
fn archives(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "crate")).collect();
    found.sort();
    found
}
