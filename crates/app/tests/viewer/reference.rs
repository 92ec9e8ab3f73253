//! The path tracer's side of the window, from the first coarse pixels to the numbers at its end.

use super::common;
use super::display::Display;
use super::session::{mean, printed, session, succeeds};
use bouncelight_scene::image_io::read_png;
use serde_json::json;
use std::path::Path;

/// How much neighbours differ on the right half of a picture without a panel, 0 to 255.
fn grain(path: &Path) -> f64 {
    let image = read_png(path).expect("a screenshot");
    let (w, c) = (image.width, image.channels);
    let at = |x: u32, y: u32| f64::from(image.pixels[((y * w + x) * c + 1) as usize]) * 255.0;
    let places = || (60..160).flat_map(move |y| (w / 2 + 20..w - 20).map(move |x| (x, y)));
    places().map(|(x, y)| (at(x, y) - at(x + 1, y)).abs()).sum::<f64>() / places().count() as f64
}

#[test]
fn the_reference_is_seen_at_once_and_leaves_nothing_behind() {
    let (Some(_), Some(display)) = (common::gpu(), Display::open()) else { return };
    let dir = tempfile::tempdir().unwrap();
    let at = "/reference/samples";
    let script = json!([
        { "wait": "loaded" }, { "key": "P" }, { "wait": "idle" }, { "screenshot": "raster.png" },
        // Dimmed until something has been traced; then a sixteenth of the pixels, then all of them.
        { "key": "X" }, { "wait": 3 }, { "expect": { at: 0, "/reference/texel": null } },
        { "screenshot": "dimmed.png" },
        { "until": { "/reference/texel": { "min": 1 } } },
        { "expect": { at: 0, "/reference/texel": 4, "/verdict": null } }, { "screenshot": "coarse.png" },
        { "wait": "samples:1" }, { "expect": { "/reference/texel": 1 } }, { "wait": "idle" },
        { "screenshot": "traced.png" },
        { "expect": { at: 4, "/reference/finished": true, "/verdict/by": ["direct", "reference"] } },
        // Four samples of a box are noise for the greater part, and its numbers are grey.
        { "expect": { "/verdict/noisy": true } }, { "save": { "psnr": "/verdict/psnr" } },
        // Denoised is what is seen, not what is measured.
        { "resize": [800, 500] }, { "key": "P" }, { "wait": 10 }, { "click": "denoise" }, { "wait": 4 }, { "key": "P" },
        { "resize": [340, 170] }, { "wait": 60 }, { "wait": "idle" },
        { "expect": { "/reference/denoised": true, at: 4, "/errors": 0 } }, { "screenshot": "denoised.png" },
        { "expect_saved": { "psnr": "/verdict/psnr" } },
        // Whoever leaves the split hears nothing of it any more, nor its old numbers when coming back.
        { "key": "P" }, { "until": { "/status": { "contains": "Reference: " } } }, { "key": "P" },
        { "until": { "/verdict/psnr": { "min": 1.0 } } }, { "key": "P" }, { "key": "X" }, { "wait": 4 },
        { "expect": { at: 0, "/verdict": null } }, { "print": ["/status"] },
        { "key": "X" }, { "wait": 3 }, { "expect": { at: 0, "/verdict": null } },
    ]);
    let args = ["cornell", "--method", "direct", "--size", "340x170"];
    let out = session(&display, dir.path(), script, &args);
    succeeds(&out);
    let light = |name: &str| mean(&dir.path().join(name), 180..330, 60..160).iter().sum::<f64>();
    let all = ["raster.png", "dimmed.png", "coarse.png", "traced.png", "denoised.png"].map(light);
    let [raster, dimmed, coarse, traced, denoised] = all;
    assert!(dimmed < 0.7 * raster, "{all:?}");
    assert!((coarse / traced - 1.0).abs() < 0.15 && (denoised / traced - 1.0).abs() < 0.1, "{all:?}");
    let grains = ["traced.png", "denoised.png"].map(|name| grain(&dir.path().join(name)));
    assert!(grains[1] < 0.6 * grains[0], "{grains:?}");
    let status = printed(&out).last().and_then(|v| v["/status"].as_str().map(String::from)).expect("it was printed");
    assert!(!status.contains("Reference"), "{status}");
}
