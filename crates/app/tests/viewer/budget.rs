//! Rays a frame: the panel's slider, and the number that the timing overlay tells.

use super::common;
use super::display::Display;
use super::session::{printed, session, succeeds};
use serde_json::{Value, json};

/// Numbers of rays that a session has told.
fn counts(told: &[Value]) -> Vec<f64> {
    told.iter().map(|v| v["/timing/rays"].as_f64().expect("rays were counted")).collect()
}

/// It reaches the method without another being built, the command line and a capture; it stays over a change of
/// methods, and is taken back.
#[test]
fn the_slider_says_how_many_rays_are_sent() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    // Past the first frames of a view, which send more.
    let told = || {
        [
            json!({ "key": "B" }),
            json!({ "wait": 24 }),
            json!({ "key": "B" }),
            json!({ "wait": "idle" }),
            json!({ "print": ["/timing/rays", "/size"] }),
        ]
    };
    let command = |told: Value| [json!({ "key": "K" }), json!({ "wait": 4 }), json!({ "expect": { "/copied": told } })];
    let third = 1.0 / 3.0;
    let parts = [
        json!([{ "zoom": 0.5 }, { "wait": "loaded" }, { "key": "F3" }, { "wait": "idle" }, { "expect": { "/rays": 1.0 } }]),
        json!(command(json!({ "not": { "contains": "rays=" } }))),
        json!(told()),
        json!([
            { "save": { "built": "/built" } },
            { "click": "rays" }, { "wait": "idle" }, { "expect": { "/rays": third, "/undo": [1, 0] } },
        ]),
        json!(told()),
        json!([{ "expect_saved": { "built": "/built" } }]),
        json!(command(json!({ "contains": "--method=gather --samples=1 --accumulate=1 --gather=rays=0.33333334 " }))),
        json!([
            { "key": "Shift+F3" }, { "wait": 4 }, { "click": "timing: Copy" }, { "wait": 4 },
            { "expect": { "/copied": { "contains": " rays a frame (1/3)" } } },
            { "click": "timing: Save CSV" }, { "wait": 4 }, { "key": "Shift+F3" },
            // Another method has none to count, and the next one takes what was chosen.
            { "key": "Shift+M" }, { "wait": "idle" },
            { "expect": { "/drawn/left": "ssgi", "/rays": third, "/timing/rays": null } },
            { "key": "M" }, { "wait": "idle" }, { "expect": { "/drawn/left": "gather" } },
        ]),
        json!(told()),
        json!([{ "key": "Ctrl+Z" }, { "wait": "idle" }, { "expect": { "/rays": 1.0, "/undo": [0, 1] } }]),
        json!(told()),
        json!([
            { "key": "Ctrl+Y" }, { "wait": 4 }, { "expect": { "/rays": third } },
            { "key": "U" }, { "wait": 4 }, { "expect": { "/rays": 1.0 } },
        ]),
    ];
    let script = parts.iter().flat_map(|part| part.as_array().unwrap().clone()).collect();
    let out = session(&display, dir.path(), script, &["cornell", "--method", "gather", "--size", "340x200"]);
    succeeds(&out);
    let told = printed(&out);
    let rays = counts(&told);
    println!("{told:?}");
    let [all, third, again, undone] = rays[..] else { panic!("{rays:?}") };
    let [w, h] = [0, 1].map(|i| told[0]["/size"][i].as_u64().expect("pixels").div_ceil(4));
    let share = (w * h) as f64 / 3.0;
    assert!((0.85 * share..1.15 * share).contains(&third), "{rays:?} of {share}");
    // A method that has just been made limits nothing until its histories are long.
    assert!(again > third, "{rays:?}");
    assert!(all > 1.5 * share && undone > 1.5 * share, "{rays:?} of {share}");
    let csv = std::fs::read_to_string(dir.path().join("timing-0001.csv")).expect("it was written");
    assert!(csv.lines().skip(1).all(|row| row.ends_with(&format!(",{third},0.33333334"))), "{csv}");
}
