//! `docs/reports/conformance.md` and its contact sheet.

use super::draw::{Drawn, PAGE};
use super::studio::Feature;
use super::{BOUND, CONTROL};
use bouncelight::gpu::Gpu;
use std::fmt::Write;
use std::path::Path;

const SIZE: [u32; 2] = PAGE.size;
/// Features in a row of the sheet.
const ACROSS: usize = 5;
/// Space around a pair of pictures, and the line for its number, pixels.
const GAP: usize = 6;
const LINE: usize = 10;

pub fn write(docs: &Path, gpu: &Gpu, drawn: &[(Feature, Drawn)]) {
    sheet(&docs.join("images/conformance.jpg"), drawn);
    let mut text = format!(
        "# glTF, feature by feature

Made by

    cargo xtask conformance

on {}. Do not edit.

Each line is a small file that the tests make (`tests/reference/conformance`), with one feature in it, on a floor under a sun and a
sky. **Off** is how far the rasteriser's picture (`gather`, 32 frames, eight samples: what `render` draws) is from the
path tracer's ({} paths a pixel): the mean difference of display values, of 255, at {}×{} pixels; at most {BOUND}.
Where the same picture can be said without the feature, the path tracer draws *that* file (**equivalent**: coordinates moved by
hand, a dense accessor, vertex normals in the place of a map), so that what both would read wrongly shows; elsewhere both read
the same file, and the number says that they draw the same surface. **Without** is the control: the
rasteriser's picture of the file without the feature, or with another value of it, which must be off by at least {CONTROL}.

![Pairs: the rasteriser's picture left, the path tracer's right](../images/conformance.jpg)

*Pairs in the order of the table: the rasteriser's picture left, the path tracer's right.*

| | feature | the file | off | equivalent | without |
|---|---|---|---|---|---|
",
        gpu.sentence().trim_end_matches('.'),
        PAGE.paths,
        SIZE[0],
        SIZE[1],
    );
    for (i, (feature, drawn)) in drawn.iter().enumerate() {
        let equivalent = if feature.equivalent.is_some() { "yes" } else { "" };
        let (off, control) = (drawn.error(), drawn.control());
        let bold = if drawn.passes() { "" } else { "**" };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {bold}{off:.2}{bold} | {equivalent} | {control:.1} |",
            i + 1,
            feature.name,
            feature.says
        );
    }
    let mut warnings: Vec<String> = Vec::new();
    for (feature, drawn) in drawn {
        for line in drawn.warnings.iter().filter_map(|w| Some(w.split_once("made.glb: ")?.1)) {
            warnings.push(format!("- {}: {line}", feature.name));
        }
    }
    if !warnings.is_empty() {
        let _ = write!(text, "\nWhat the program says of these files:\n\n{}\n", warnings.join("\n"));
    }
    std::fs::write(docs.join("reports/conformance.md"), text).expect("the page can be written");
}

fn sheet(path: &Path, drawn: &[(Feature, Drawn)]) {
    let [w, h] = SIZE.map(|n| n as usize);
    let cell = [2 * w + GAP, h + LINE + GAP];
    let width = ACROSS * cell[0] + GAP;
    let height = drawn.len().div_ceil(ACROSS) * cell[1] + GAP;
    let mut rgb = vec![24u8; 3 * width * height];
    for (i, (_, drawn)) in drawn.iter().enumerate() {
        let (x, y) = (GAP + i % ACROSS * cell[0], GAP + i / ACROSS * cell[1]);
        for (n, letter) in (i + 1).to_string().chars().enumerate() {
            let rows = font8x8::UnicodeFonts::get(&font8x8::BASIC_FONTS, letter).unwrap_or_default();
            for (dy, row) in rows.into_iter().enumerate() {
                for dx in (0..8).filter(|dx| row >> dx & 1 == 1) {
                    let at = 3 * ((y + dy) * width + x + 8 * n + dx);
                    rgb[at..at + 3].fill(235);
                }
            }
        }
        for (picture, left) in [(&drawn.ours, x), (&drawn.traced, x + w)] {
            for row in 0..h {
                let at = 3 * ((y + LINE + row) * width + left);
                rgb[at..at + 3 * w].copy_from_slice(&picture[3 * row * w..3 * (row + 1) * w]);
            }
        }
    }
    let mut bytes = Vec::new();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 82)
        .encode(&rgb, width as u32, height as u32, image::ExtendedColorType::Rgb8)
        .expect("a picture");
    assert!(bytes.len() <= 400_000, "{} bytes", bytes.len());
    std::fs::write(path, bytes).expect("the sheet can be written");
}
