//! A method that sends rays: the window draws before there are any, and with them once there are.

use super::common;
use super::display::Display;
use super::session::{session, succeeds};
use serde_json::json;

#[test]
fn rays_take_over_when_their_trees_are_there() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let script = json!([
        { "wait": "loaded" }, { "wait": "idle" },
        { "expect": { "/drawn/left": "gather", "/fallback": null, "/passes": { "contains": "gi.trace" }, "/errors": 0 } },
        // Another scene has none yet; so has the same one on a new device. Both get theirs.
        { "save": { "frames": "/scene_frames" } },
        { "drop": "paper-room:3" }, { "wait": "idle" },
        { "expect": { "/scene/spec": "paper-room:3", "/drawn/left": "gather", "/fallback": null, "/errors": 0 } },
        { "expect_not_saved": { "frames": "/scene_frames" } },
        { "lose": "device" }, { "wait": 30 }, { "wait": "idle" },
        { "expect": { "/rebuilt": 1, "/drawn/left": "gather", "/fallback": null, "/errors": 0 } },
        // A capture builds rays of its own.
        { "key": "F12" }, { "wait": "idle" }, { "expect": { "/captured": { "contains": ".png" }, "/errors": 0 } },
        { "quit": true }
    ]);
    succeeds(&session(&display, dir.path(), script, &["cornell", "--method", "gather", "--size", "480x300"]));
}
