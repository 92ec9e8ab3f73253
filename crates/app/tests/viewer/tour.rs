//! Long or many-sided looks at the window, asked for by name: they take too long for every day.
//!
//! `cargo test --test viewer -- --ignored --nocapture twelve_views` writes twelve pictures of the
//! window to `$VIEWS` (`views` without it); `… tour` goes on for `$SECONDS_LONG` (120 without it) and
//! fails where memory grows or a badge is wrong.

use super::common;
use super::display::Display;
use super::faults::lively;
use super::session::{printed, session, succeeds};
use serde_json::{Value, json};

#[test]
#[ignore = "writes pictures to be looked at"]
fn twelve_views() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    lively(dir.path());
    let shot = |name: &str| json!({ "screenshot": format!("{name}.png") });
    let idle = || json!({ "wait": "idle" });
    let script = json!([
        { "wait": "loaded" }, { "key": "F3" }, idle(), shot("01-first"),
        { "key": "Shift+F3" }, { "key": "B" }, { "until": { "/timing/count": { "min": 21 } } },
        { "key": "Shift+M" }, { "until": { "/timing/count": { "min": 8 } } }, { "key": "B" }, idle(),
        { "move": [470, 130] }, { "wait": 4 }, idle(), shot("02-timing"), { "key": "P" }, idle(), shot("03-timing-alone"),
        { "key": "P" }, { "key": "Shift+F3" }, { "key": "H" }, idle(), shot("04-controls"), { "key": "H" },
        { "key": "X" }, { "wait": 8 }, shot("05-waiting-for-the-reference"), { "wait": "samples:2" }, idle(), shot("06-split"),
        { "key": "9" }, idle(), { "move": [300, 300] }, { "wait": 4 }, idle(), shot("07-error"), { "key": "1" }, { "key": "X" },
        { "click": [330, 300] }, { "wait": 4 }, idle(), shot("08-handles"), { "key": "Escape" },
        { "click": "Scene" }, { "wait": 30 }, { "click": "View" }, { "wait": 30 }, { "click": "Lights" }, { "wait": 30 }, idle(), shot("09-lights"),
        { "click": "Lights" }, { "wait": 30 }, { "click": "Performance" }, { "wait": 30 }, { "click": "Memory" }, { "wait": 30 }, idle(),
        shot("10-performance"),
        { "drop": "lively.gltf" }, { "until": { "/scene/spec": "lively.gltf" } }, { "click": "Scene" }, { "wait": 30 }, idle(),
        shot("11-a-file-without-a-sky"),
        { "drop": "interior" }, { "until": { "/scene/spec": "interior" } }, { "key": "J" }, { "key": "Shift+T" }, idle(),
        shot("12-light-wireframe"),
    ]);
    let args = ["interior", "--method", "ssgi", "--size", "960x540"];
    succeeds(&session(&display, dir.path(), script, &args));
    let to = std::path::PathBuf::from(std::env::var_os("VIEWS").unwrap_or("views".into()));
    std::fs::create_dir_all(&to).unwrap();
    let mut count = 0;
    for entry in std::fs::read_dir(dir.path()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "png") {
            std::fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
            count += 1;
        }
    }
    assert_eq!(count, 12);
}

/// One round: all methods, a split, the reference, the error view, an animation, sizes, ten scenes.
fn round() -> Vec<Value> {
    let mut steps = Vec::new();
    for method in ["direct", "ambient", "ssgi", "gather", "neural"] {
        steps.extend([
            json!({ "wait": "idle" }),
            json!({ "expect": { "/left": method, "/drawn/left": method, "/fallback": null, "/errors": 0 } }),
            json!({ "drag": [[100, 70], [108, 72], [100, 70]] }),
            json!({ "key": "M" }),
        ]);
    }
    steps.extend([
        json!({ "wait": "idle" }),
        json!({ "expect": { "/left": "direct" } }),
        json!({ "key": "X" }),
        json!({ "wait": "samples:4" }),
        json!({ "wait": "idle" }),
        json!({ "key": "9" }),
        json!({ "wait": "idle" }),
        json!({ "expect": { "/verdict/by": ["direct", "reference"] } }),
        json!({ "key": "1" }),
        json!({ "key": "X" }),
        json!({ "drop": "lively.gltf" }),
        json!({ "until": { "/scene/spec": "lively.gltf" } }),
        json!({ "key": "I" }),
        json!({ "wait": 20 }),
        json!({ "expect": { "/scene/playing": true } }),
        json!({ "key": "I" }),
        json!({ "resize": [300, 200] }),
        json!({ "wait": "idle" }),
        json!({ "resize": [240, 180] }),
        json!({ "wait": "idle" }),
    ]);
    for i in 0..10 {
        let name = format!("paper-room:{i}");
        steps.extend([
            json!({ "drop": name }),
            json!({ "until": { "/scene/spec": name } }),
            json!({ "wait": "idle" }),
            json!({ "expect": { "/drawn/left": "direct", "/errors": 0 } }),
        ]);
    }
    steps.extend([
        json!({ "drop": "cornell" }),
        json!({ "until": { "/scene/spec": "cornell" } }),
        json!({ "wait": "idle" }),
        json!({ "print": ["/resident", "/frames"] }),
    ]);
    steps
}

#[test]
#[ignore = "takes as long as it is asked to"]
fn tour() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    lively(dir.path());
    let seconds = std::env::var("SECONDS_LONG").ok().and_then(|s| s.parse().ok()).unwrap_or(120.0);
    let start = std::time::Instant::now();
    let (mut steps, mut all) = (1, Vec::new());
    // A first session tells how long a round takes.
    while all.len() < 3 || start.elapsed().as_secs_f64() < seconds {
        let mut script = vec![json!({ "wait": "loaded" }), json!({ "wait": "idle" })];
        (0..steps + 2).for_each(|_| script.extend(round()));
        let began = std::time::Instant::now();
        let out = session(&display, dir.path(), json!(script), &["cornell", "--method", "direct", "--size", "240x180"]);
        succeeds(&out);
        let resident: Vec<f64> = printed(&out).iter().filter_map(|v| v["/resident"].as_f64()).collect();
        println!("resident MB: {:?}", resident.iter().map(|v| (v / 1e6) as u64).collect::<Vec<_>>());
        // The first round builds every pipeline.
        let rounds = &resident[1..];
        let (least, most) = rounds.iter().fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(*v), b.max(*v)));
        assert!(rounds.is_empty() || most - least <= 100e6, "memory moves by {:.0} MB", (most - least) / 1e6);
        let took = began.elapsed().as_secs_f64() / f64::from(steps + 2);
        all.extend(resident);
        steps = ((seconds - start.elapsed().as_secs_f64()) / took).clamp(1.0, 400.0) as i32;
    }
}
