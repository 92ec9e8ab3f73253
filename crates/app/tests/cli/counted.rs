//! What `bench --count` says of cards that nobody has measured.

use crate::common;
use serde_json::Value;

#[test]
fn a_counted_frame_has_modelled_times_with_their_range() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().expect("a folder");
    let json = dir.path().join("bench.json");
    let run = |more: &[&str]| {
        let base = ["bench", "cornell", "--method", "ambient", "--size", "64x32", "--frames", "1", "--warmup", "0"];
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bouncelight"));
        command.args(base).args(more).output().expect("the program runs")
    };
    let file = json.to_str().expect("a path");
    let out = run(&["--count", "--json", file]);
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(text.contains("modelled for a GTX 1050, not measured"), "{text}");
    let read = || -> Value { serde_json::from_slice(&std::fs::read(&json).expect("written")).expect("JSON") };
    let record = read();
    let method = &record["methods"][0];
    for card in ["gtx_1050", "gtx_1650"] {
        let [least, ms, most] = ["least", "ms", "most"].map(|key| method["modelled"][card][key].as_f64().expect(key));
        assert!(0.0 < least && least < ms && ms < most, "{card}: {least} {ms} {most}");
        // A method without history never rests.
        assert_eq!(method["modelled_at_rest"][card], method["modelled"][card]);
    }
    for cost in method["costs"].as_array().expect("counted") {
        for key in ["dispatches", "threads", "links", "longest", "steps", "barriers"] {
            assert!(cost[key].is_f64(), "{key} of {cost}");
        }
        assert!(cost["threads"].as_f64() >= Some(32.0), "{cost}");
    }
    // A record of an earlier version has neither; what is not counted is not modelled.
    let mut earlier = record.clone();
    let old = earlier["methods"][0].as_object_mut().expect("a method");
    old.remove("modelled");
    old.remove("modelled_at_rest");
    for cost in old["costs"].as_array_mut().expect("costs") {
        let cost = cost.as_object_mut().expect("a cost");
        cost.retain(|key, _| ["pass", "flops", "bytes"].contains(&key.as_str()));
    }
    old["wall_ms"]["median"] = 1e6.into();
    old["gpu_ms"] = Value::Null;
    std::fs::write(&json, earlier.to_string()).expect("written");
    let out = run(&["--compare", file, "--fail-over", "5%"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(run(&["--json", file]).status.success());
    assert!(read()["methods"][0].get("modelled").is_none());
}
