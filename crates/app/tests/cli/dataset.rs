//! `dataset` as a user meets it: shards, checksums, what a sample's file holds.

use crate::common;
use crate::program::bouncelight;
use std::path::Path;

/// A dataset of the tests' size into `out`.
fn make(out: &Path, more: &[&str]) -> String {
    let args = ["dataset", "--size", "32x16", "--spp", "2", "--moments", "1", "--views", "1"];
    let done = bouncelight(&[&args[..], more, &["--out", out.to_str().expect("a temporary path is text")]].concat());
    let told = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{told}");
    told
}

#[test]
fn a_dataset_is_made_in_shards_with_its_light_and_checksums() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("samples");
    let make = |shard: &str| make(&out, &["--recipe", "paper-room-varied", "--rooms", "7-8", "--shard", shard]);
    assert!(make("0/2").contains("1 samples, 0.0 MB"));
    assert!(!out.join("varied0007.glb").exists(), "not asked for");
    let first = std::fs::read(out.join("varied0007_view0.safetensors")).unwrap();
    assert!(!out.join("varied0008_view0.safetensors").exists(), "that is the other shard's");
    // What a kill leaves: a sample without its line in the list, another not begun.
    std::fs::remove_file(out.join("SHA256SUMS")).unwrap();
    make("0/2");
    make("1/2");
    assert_eq!(first, std::fs::read(out.join("varied0007_view0.safetensors")).unwrap(), "it was kept");
    let list = std::fs::read_to_string(out.join("SHA256SUMS")).unwrap();
    let named: Vec<_> = list.lines().map(|l| l.split_once("  ").expect("sum and name").1).collect();
    assert_eq!(named, ["varied0007_view0.safetensors", "varied0008_view0.safetensors"]);
    let file = safetensors::SafeTensors::deserialize(&first).unwrap();
    let values = |name: &str| -> Vec<f32> { bytemuck::pod_collect_to_vec(file.tensor(name).unwrap().data()) };
    assert_eq!((file.tensor("features.1").unwrap().shape(), values("noise").len()), (&[15, 4, 8][..], 1));
    assert_eq!(values("light").len(), 3 * 32);
    assert!(values("light").iter().all(|x| x.is_finite()) && values("light").iter().any(|x| *x > 0.0));
}

#[test]
fn rooms_are_exported_on_request() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let whole = dir.path().join("whole");
    make(&whole, &["--recipe", "paper-room-varied", "--rooms", "7", "--export"]);
    // The exported room is the room, and the record says where it is looked at from.
    let exported = bouncelight_lab::scenes::load(whole.join("varied0007.glb").to_str().unwrap()).unwrap();
    let own = bouncelight_lab::study::varied::scene(7);
    assert_eq!(exported.instances.len(), own.instances.len());
    let text = std::fs::read_to_string(whole.join("varied0007_views.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(record["views"].as_array().map(Vec::len), Some(1));
    let sky = record["environment"].as_array().unwrap();
    assert!((sky[0].as_f64().unwrap() as f32 - own.environment.radiance[0]).abs() < 1e-6);
}

/// Views through a scene are chosen by what they show: none stands before a wall.
#[test]
fn views_of_a_scene_are_chosen_and_written_down() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("scene");
    make(&out, &["--recipe", "scene", "--scene", "cornell"]);
    assert!(out.join("cornell_view0.safetensors").exists());
    let text = std::fs::read_to_string(out.join("cornell_views.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(record["views"].as_array().map(Vec::len), Some(1));
}

#[test]
fn samples_show_light_that_has_changed_and_end_with_the_scene() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let make = |moments: &str| {
        let out = dir.path().join(moments);
        let room = ["dataset", "--recipe", "home", "--rooms", "0", "--views", "1", "--size", "64x32", "--spp", "2"];
        let done = bouncelight(&[&room[..], &["--moments", moments, "--out", out.to_str().expect("text")]].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        std::fs::read(out.join("home0000_view0.safetensors")).unwrap()
    };
    let (still, changing) = (make("22"), make("8,lamp,thing"));
    let still = safetensors::SafeTensors::deserialize(&still).unwrap();
    let changing = safetensors::SafeTensors::deserialize(&changing).unwrap();
    let values = |file: &safetensors::SafeTensors<'_>, name: &str| -> Vec<f32> {
        bytemuck::pod_collect_to_vec(file.tensor(name).expect(name).data())
    };
    let ages = ["8", "lamp", "thing"].map(|when| values(&changing, &format!("age.{when}"))[0]);
    assert_eq!(ages, [8.0, 22.0, 36.0]);
    assert_eq!(changing.tensor("changed.lamp").unwrap().shape(), [1, 8, 16]);
    // What is to be learnt is the light of the scene itself, found after all has come to its place.
    assert_eq!(values(&still, "light"), values(&changing, "light"));
    // Cells remember fewer frames after a change than at rest.
    let frames = |file: &safetensors::SafeTensors<'_>, when: &str| -> f32 {
        let past = values(file, &format!("past.{when}"));
        past[3 * 128..4 * 128].iter().sum()
    };
    let (rest, lamp, thing) = (frames(&still, "22"), frames(&changing, "lamp"), frames(&changing, "thing"));
    assert!(lamp < 0.9 * rest, "{lamp} {rest}");
    // And they would remember more in 36 frames.
    assert!(thing < 0.9 * rest, "{thing} {rest}");
}
