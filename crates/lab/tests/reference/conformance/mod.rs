//! One feature of glTF a fixture, made here: what the rasteriser draws beside what the path tracer
//! draws. Where the same picture can be said without the feature (coordinates moved by hand, a
//! dense accessor, vertex normals in the place of a map), the path tracer draws that file, so that
//! a feature that both read wrongly shows. The control is the file without the feature, or with
//! another value of it: it must be farther off than any bound allows.
//!
//! `cargo xtask conformance` draws them larger and writes `docs/reports/conformance.md`.

mod draw;
mod geometry;
mod lights;
mod materials;
mod motion;
mod page;
mod studio;
mod textures;

use crate::common;
use draw::{Drawn, Painter};
use studio::Feature;

/// Mean difference of display values, of 255, that every feature stays below.
const BOUND: f64 = 3.5;
/// What the control is off by at least.
const CONTROL: f64 = 4.5;

fn features() -> Vec<Feature> {
    let groups = [geometry::features(), textures::features(), materials::features(), lights::features()];
    groups.into_iter().flatten().chain(motion::features()).collect()
}

/// Draws every feature that the variable `CONFORMANCE` allows (a part of its name).
fn draw(gpu: &bouncelight::gpu::Gpu, effort: draw::Effort) -> Vec<(Feature, Drawn)> {
    let mut painter = Painter::new(gpu, effort);
    let asked = std::env::var("CONFORMANCE").unwrap_or_default();
    let drawn = features().into_iter().filter(|f| f.name.contains(&asked)).map(|feature| {
        let drawn = painter.draw(&feature);
        println!("{:40} {:6.2} {:6.2}", feature.name, drawn.error(), drawn.control());
        (feature, drawn)
    });
    drawn.collect()
}

#[test]
fn features_are_drawn_as_the_path_tracer_draws_them() {
    let Some(gpu) = common::gpu() else { return };
    let drawn = draw(&gpu, draw::QUICK);
    let off = |(f, d): &(Feature, Drawn)| format!("{}: {:.2}, control {:.2}", f.name, d.error(), d.control());
    let bad: Vec<String> = drawn.iter().filter(|(_, d)| !d.passes()).map(off).collect();
    assert!(bad.is_empty(), "of 255, at most {BOUND}, the control at least {CONTROL}:\n{}", bad.join("\n"));
    if std::env::var_os("CONFORMANCE").is_none() {
        assert!(drawn.len() >= 40, "only {} features", drawn.len());
    }
}

/// Not a test: writes the page, where `CONFORMANCE_DOCS` names the folder.
#[test]
fn page() {
    let Some(folder) = std::env::var_os("CONFORMANCE_DOCS") else { return };
    let Some(gpu) = common::gpu() else { return };
    page::write(folder.as_ref(), &gpu, &draw(&gpu, draw::PAGE));
}
