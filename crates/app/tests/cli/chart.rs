//! `bouncelight chart` from the command line: a small chart, taken up again, with a scene that
//! fails.

use crate::common;
use assert_cmd::Command;
use bouncelight_lab::study::chart::{Metric, Record, report};
use std::path::Path;

fn chart(out: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("bouncelight").expect("it was built");
    command.args(["chart", "--out"]).arg(out).args([
        "--methods",
        "direct,ambient",
        "--size",
        "64x32",
        "--samples",
        "1",
        "--frames",
        "1",
        "--warmup",
        "1",
        "--error",
        "0.5",
        "--max-samples",
        "32",
        "--paths",
        "4",
        "--no-generator",
    ]);
    command.args(more).assert()
}

fn json(out: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(out.join("chart.json")).expect("written")).expect("JSON")
}

#[test]
fn a_small_chart_is_made_and_taken_up_again() {
    if common::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let page = folder.path().join("results.md");
    let scenes = ["--scenes", "cornell,paper-room:7", "--page", page.to_str().expect("a plain path")];
    let done = chart(&out, &scenes).success();
    let said = String::from_utf8_lossy(&done.get_output().stdout).into_owned();
    assert!(said.contains("modelled") && said.contains("never measured") && said.contains("ambient"), "{said}");
    let record = json(&out);
    assert_eq!(record["schema"], 1);
    // Two methods and two counts of paths in two scenes.
    let units = record["units"].as_array().expect("a list");
    assert_eq!(units.len(), 8);
    let light = |entry: &str, scene: &str| {
        let unit = units.iter().find(|u| u["entry"] == entry && u["scene"] == scene).expect("it is there");
        unit["scores"]["light"].as_f64().expect("a number")
    };
    assert!((light("direct", "paper-room:7") - 1.0).abs() < 1e-6, "no light is all of it missing");
    assert!(light("ambient", "paper-room:7") < 0.8);
    assert!(light("4 paths", "paper-room:7") < light("1 path", "paper-room:7"));
    for text in ["device", "provenance", "scenes"] {
        assert!(!record[text].is_null(), "{text}");
    }
    let csv = std::fs::read_to_string(out.join("chart.csv")).expect("written");
    let columns = csv.lines().next().expect("a head").split(',').count();
    assert_eq!(csv.lines().count(), 9);
    assert!(csv.lines().all(|l| l.split(',').count() >= columns), "{csv}");
    let words = std::fs::read_to_string(&page).expect("written");
    assert!(words.contains("(out/chart.svg)") && words.contains("Frontier as measured here"), "{words}");
    // Again: everything is kept, times too, but for the last bit, which JSON's reader may miss.
    let again = chart(&out, &scenes).success();
    let kept = json(&out);
    for (old, new) in units.iter().zip(kept["units"].as_array().expect("a list")) {
        let ms = |unit: &serde_json::Value| unit["time"]["wall_ms"]["median"].as_f64().expect("a number");
        assert_eq!((&old["key"], &old["entry"], &old["scene"]), (&new["key"], &new["entry"], &new["scene"]));
        assert!((ms(old) / ms(new) - 1.0).abs() < 1e-12, "{old} {new}");
    }
    assert!(String::from_utf8_lossy(&again.get_output().stderr).find("warning").is_none());
    // One more method leaves the others alone; a scene that cannot be read fails at the end and
    // loses nothing.
    let broken = folder.path().join("broken.glb");
    std::fs::write(&broken, "no scene").expect("writable");
    let scenes = format!("cornell,paper-room:7,{}", broken.display());
    let failed = chart(&out, &["--scenes", &scenes]).code(1);
    let said = String::from_utf8_lossy(&failed.get_output().stderr).into_owned();
    assert!(said.contains("broken") && said.contains("the others are charted"), "{said}");
    assert_eq!(json(&out)["units"].as_array().map(Vec::len), Some(8));
    assert_eq!(json(&out)["scenes"].as_array().map(Vec::len), Some(3));
}

/// The page in docs is what its record gives; `RENEW=1` writes it anew.
#[test]
fn the_page_of_results_is_made_of_its_record() {
    let docs = crate::common::root().join("docs");
    let record = std::fs::read_to_string(docs.join("results/chart.json")).expect("it is in the repository");
    let record: Record = serde_json::from_str(&record).expect("a record");
    let made = report::page(&record, Metric::Light, "../results/chart.svg");
    let page = docs.join("reports/chart.md");
    if std::env::var_os("RENEW").is_some() {
        std::fs::write(&page, &made).expect("writable");
    }
    assert!(std::fs::read_to_string(&page).expect("it is there") == made, "changed by hand: RENEW=1 makes it anew");
    let other = Record { samples: record.samples + 1, ..record };
    assert!(report::page(&other, Metric::Light, "../results/chart.svg") != made, "negative control");
}

/// A folder as other programs' references stand in: its own size, its samples, its sky.
#[test]
fn a_folder_with_a_reference_is_judged_by_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (room, out) = (folder.path().join("refs/room"), folder.path().join("out"));
    std::fs::create_dir_all(&room).expect("a folder");
    let scene = bouncelight_lab::scenes::load("cornell").expect("it ships");
    bouncelight_scene::export::write_glb(&scene, &room.join("scene.glb")).expect("written");
    std::fs::write(room.join("meta.json"), r#"{"world": 0.1, "light": "sun", "spp": 64}"#).expect("written");
    let mut traced = Command::cargo_bin("bouncelight").expect("it was built");
    traced.current_dir(&room).args(["trace", "scene.glb", "--environment", "0.1", "--size", "48x24", "-q"]);
    let layers = ["--spp", "64", "--no-caustics", "--aov", "all", "-o", "frame0000.exr"];
    traced.args(layers).assert().success();
    let refs = folder.path().join("refs");
    chart(&out, &["--scenes", refs.to_str().expect("plain"), "--no-caustics"]).success();
    let record = json(&out);
    let scene = &record["scenes"][0];
    assert_eq!((&scene["name"], &scene["reference"]), (&"room".into(), &"room/frame0000.exr".into()));
    assert_eq!((&scene["size"], &scene["samples"]), (&[48, 24].into(), &[64, 64].into()), "not --size's");
    assert_eq!(record["no_caustics"], true);
    let light = |entry: &str| {
        let units = record["units"].as_array().expect("a list");
        let unit = units.iter().find(|u| u["entry"] == entry).expect("it is there");
        unit["scores"]["light"].as_f64().expect("a number")
    };
    println!("ambient {}, 1 path {}, 4 paths {}", light("ambient"), light("1 path"), light("4 paths"));
    assert!((light("direct") - 1.0).abs() < 1e-6, "no light is all of it missing");
    assert!(light("4 paths") < light("1 path") && light("4 paths") < 0.4);
    assert!(std::fs::read_to_string(out.join("results.md")).expect("written").contains("`--no-caustics`"));
}

#[test]
fn what_cannot_be_is_refused_before_the_work() {
    if common::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let empty = folder.path().join("empty");
    std::fs::create_dir(&empty).expect("a folder");
    let out = folder.path().join("out");
    let refused = chart(&out, &["--scenes", empty.to_str().expect("plain")]).code(2);
    assert!(String::from_utf8_lossy(&refused.get_output().stderr).contains("no references here"));
    chart(&out, &["--weights", "/nowhere/w.safetensors"]).code(4);
    std::fs::create_dir_all(&out).expect("a folder");
    std::fs::write(out.join("chart.json"), "{}").expect("writable");
    let refused = chart(&out, &["--scenes", "cornell"]).code(1);
    assert!(String::from_utf8_lossy(&refused.get_output().stderr).contains("not a record of `chart`"));
    let mut command = Command::cargo_bin("bouncelight").expect("it was built");
    command.args(["chart", "--out", "x", "--methods", "magic"]).assert().code(2);
}
