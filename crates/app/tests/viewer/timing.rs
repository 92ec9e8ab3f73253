//! The timing overlay: it stays when the panel goes, it is moved without the picture's moving, and
//! what it copies and writes says what it is of.

use super::common;
use super::display::Display;
use super::session::{printed, session, succeeds};
use serde_json::json;

#[test]
fn the_timing_overlay_by_hand() {
    let (Some(gpu), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        // Scripts see the picture alone unless they ask for more.
        { "key": "F3" }, { "wait": 4 },
        { "expect": { "/timing/shown": true, "/timing/expanded": false, "/panel": true } },
        { "expect": { "/places/timing/0": { "min": 1.0 } } },
        // All of it; the panel's going leaves it where it is.
        { "key": "Shift+F3" }, { "wait": 4 }, { "expect": { "/timing/expanded": true } },
        { "key": "B" }, { "until": { "/timing/count": { "min": 24 } } }, { "key": "B" }, { "wait": "idle" },
        { "key": "P" }, { "wait": "idle" },
        { "expect": { "/panel": false, "/places/timing: graph/0": { "min": 1.0 },
            "/places/timing: Direct light/0": { "min": 1.0 } } },
        // A group folds, and stays so.
        { "click": "timing: Direct light" }, { "wait": "idle" }, { "expect": { "/timing/unfolded/1": false } },
        // The history goes over a change of method.
        { "save": { "history": "/timing/history" } }, { "key": "M" }, { "wait": "idle" },
        { "expect": { "/timing/runs": { "min": 2 }, "/timing/method": "Ambient + AO" } },
        { "click": "timing: Copy" }, { "wait": 4 },
        { "expect": { "/copied": { "contains": "Ambient + AO · cornell · 640×400" } } },
        { "click": "timing: Save CSV" }, { "wait": 4 },
        { "expect": { "/messages": { "contains": "timing-0001.csv" }, "/errors": 0 } },
        // Dragged by its ground, it goes along, and the camera stays.
        { "save": { "eye": "/camera/eye", "at": "/timing/at" } },
        { "print": ["/places/timing: graph"] },
        { "drag": [[420, 66], [400, 100], [380, 120]] }, { "wait": "idle" },
        { "expect_saved": { "eye": "/camera/eye" } }, { "expect_not_saved": { "at": "/timing/at" } },
        { "screenshot": "timing.png" },
        { "key": "Shift+F3" }, { "wait": 4 }, { "expect": { "/timing/expanded": false } },
        { "click": "timing: close" }, { "wait": 4 },
        { "expect": { "/timing/shown": false, "/places/timing": null } },
        { "key": "F3" }, { "wait": 4 }, { "expect": { "/timing/shown": true } },
    ]);
    let out = session(&display, dir.path(), script, &["cornell", "--method", "direct", "--size", "640x400"]);
    succeeds(&out);
    let csv = std::fs::read_to_string(dir.path().join("timing-0001.csv")).expect("it was written");
    assert!(csv.contains(&gpu.info.name) || csv.contains('"'), "{csv}");
    assert!(csv.contains("cornell,Ambient + AO,640,400,GI,gi.ambient,"), "{csv}");
    let frames = std::fs::read_to_string(dir.path().join("timing-0001.frames.csv")).expect("it was written");
    assert!(frames.contains("Direct only") && frames.contains("Ambient + AO"), "{frames}");
    assert!(!printed(&out).is_empty());
}

/// Few frames have no 95th percentile, and what another method draws is no time of this one.
#[test]
fn every_method_is_measured_in_turn() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        // Room for the last section about a small picture.
        { "wait": "loaded" }, { "zoom": 0.5 }, { "wait": "idle" }, { "key": "X" }, { "wait": 4 },
        { "click": "View" }, { "wait": 30 }, { "click": "Speed and accuracy" }, { "wait": 30 },
        { "click": "measure all" }, { "wait": 6 }, { "expect": { "/touring": true } },
        { "until": { "/touring": false } }, { "wait": 4 },
        { "expect": { "/left": "ssgi", "/split": true, "/measure": false } },
        { "key": "X" }, { "wait": 4 }, { "wait": "idle" },
        { "expect": { "/places/dot neural/0": { "min": 1.0 }, "/places/dot gather/0": { "min": 1.0 },
            "/places/dot direct/0": { "min": 1.0 } } }
    ]);
    succeeds(&session(&display, dir.path(), script, &["cornell", "--method", "ssgi", "--size", "200x380"]));
}
