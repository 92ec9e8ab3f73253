//! What a tuner has found on a device is kept.

use crate::common;
use bouncelight::net::tune::Cache;

/// On the command line: something else in the cache's place is told, ignored and replaced.
#[test]
fn a_corrupt_cache_is_told_and_replaced() {
    if common::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("deep/tuned.json");
    std::fs::create_dir_all(cache.parent().unwrap()).unwrap();
    std::fs::write(&cache, "{\"version\": 5, \"dev").unwrap();
    let run = || {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bouncelight"));
        command
            .args(["weights", "tune", "--size", "8x8"])
            .arg(common::root().join("weights-format/fixtures/conv1x1.safetensors"));
        command.arg("--cache").arg(&cache).output().unwrap()
    };
    let first = run();
    let said = String::from_utf8_lossy(&first.stderr).into_owned();
    assert!(first.status.success() && said.contains("tuned.json is ignored"), "{said}");
    let text = std::fs::read_to_string(&cache).unwrap();
    assert!(Cache::parse(&text).is_ok());
    let second = run();
    let said = String::from_utf8_lossy(&second.stderr).into_owned();
    assert!(second.status.success() && !said.contains("ignored"), "{said}");
    assert!(String::from_utf8_lossy(&second.stdout).contains("0 layers tuned"));
    assert_eq!(std::fs::read_to_string(&cache).unwrap(), text);
}
