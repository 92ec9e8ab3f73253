//! The chart as SVG and PNG: error up, time across, once as measured here and once as projected for
//! a GTX 1050.
//!
//! Marks differ in shape as well as in colour (Okabe and Ito's palette), names stand beside them in
//! black, and nothing is shown by colour alone, so that the chart can be read in print and by the
//! colour-blind.

mod canvas;

use super::{
    ChartError, Kind, Metric, Record,
    published::{PRINTED_L1, PRINTED_MS},
    summary::{Bars, Clock, Row, rows},
};
use crate::{
    image_io::{self, Metadata},
    study::projection::{EFFICIENCY, GTX_1050},
};
use canvas::Canvas;
use plotters::{
    prelude::{BitMapBackend, IntoDrawingArea, RGBColor, SVGBackend},
    style::{FontStyle, register_font},
};
use std::path::Path;

const SIZE: [f64; 2] = [1280.0, 660.0];
const INK: RGBColor = RGBColor(30, 30, 30);
const GREY: RGBColor = RGBColor(90, 90, 90);
const FAINT: RGBColor = RGBColor(225, 225, 225);
const STEPS: RGBColor = RGBColor(190, 190, 190);
/// Okabe and Ito, without yellow, which is too pale on paper.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// Something at a place.
struct Mark {
    name: String,
    /// Number of its colour and shape.
    style: usize,
    x: f64,
    y: Bars,
    /// Its first frame after a cut.
    cold: Option<(f64, f64)>,
}

/// One pair of axes.
struct Panel {
    title: String,
    across: String,
    marks: Vec<Mark>,
    /// Paths: count, milliseconds, error.
    curve: Vec<(u32, f64, f64)>,
    /// Cheapest first.
    frontier: Vec<(f64, f64)>,
    /// Upright lines with their words.
    lines: Vec<(f64, String)>,
    /// Crosses with their words: the paper's.
    printed: Vec<(f64, f64, String)>,
    /// The references' noise.
    floor: Option<f64>,
}

/// Writes the chart to `svg` and `png`.
///
/// # Errors
/// Nothing that can be drawn; a file that cannot be written.
pub fn write(record: &Record, metric: Metric, svg: &Path, png: &Path) -> Result<(), ChartError> {
    let panels = panels(record, metric);
    if panels.iter().all(|p| p.marks.is_empty()) {
        return Err(ChartError::Plot("nothing was measured in every scene".into()));
    }
    let _ = register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    let words = words(record);
    let mut text = String::new();
    {
        let backend = SVGBackend::with_string(&mut text, (SIZE[0] as u32, SIZE[1] as u32));
        Canvas { area: backend.into_drawing_area(), scale: 1.0 }.chart(record, metric, &panels)?;
    }
    let told: String = words.iter().map(|(k, v)| format!("{k}: {v}\n")).collect();
    let escaped = told.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let text = text.replacen('\n', &format!("\n<desc>{escaped}</desc>\n"), 1);
    image_io::write_whole(svg, text.as_bytes())?;
    // Twice as fine, for print.
    let [width, height] = SIZE.map(|n| 2 * n as u32);
    let mut bytes = vec![255; 3 * (width * height) as usize];
    {
        let backend = BitMapBackend::with_buffer(&mut bytes, (width, height));
        Canvas { area: backend.into_drawing_area(), scale: 2.0 }.chart(record, metric, &panels)?;
    }
    Ok(image_io::write_png(png, width, height, &bytes, &words)?)
}

/// What travels with the picture.
fn words(record: &Record) -> Metadata {
    let p = &record.provenance;
    let weights: Vec<String> =
        record.entries.iter().filter_map(|e| Some(format!("{} {}", e.name, e.weights.as_ref()?))).collect();
    [
        ("Software", format!("bouncelight {}", p.version)),
        ("Command", p.command.clone()),
        ("Commit", p.commit.clone()),
        ("Date", p.date.clone()),
        ("Adapter", record.device.sentence()),
        ("Weights", weights.join(", ")),
        (
            "Projection",
            format!("{} at {:.0} % of its peaks, by count; never measured", GTX_1050.name, EFFICIENCY * 100.0),
        ),
    ]
    .map(|(k, v)| (k.to_owned(), v))
    .into()
}

fn panels(record: &Record, metric: Metric) -> [Panel; 2] {
    let rows = rows(record, metric);
    let noise: Vec<f64> = record.scenes.iter().filter_map(|s| s.noise.map(|n| n[1])).collect();
    let floor = (metric == Metric::Light && !noise.is_empty())
        .then(|| noise.iter().sum::<f64>() / noise.len() as f64 * std::f64::consts::FRAC_2_PI.sqrt());
    let drawn: Vec<(usize, &Row)> = rows.iter().filter(|r| r.kind != Kind::Paths && r.whole).enumerate().collect();
    let marks = |time: &dyn Fn(&Row) -> Option<f64>, cold: &dyn Fn(&Row) -> Option<f64>| -> Vec<Mark> {
        let mark = |(style, row): &(usize, &Row)| {
            let x = time(row)?;
            let cold = row.cold.and_then(|y| Some((cold(row)?, y.mean)));
            Some(Mark { name: row.name.clone(), style: *style, x, y: row.error?, cold })
        };
        drawn.iter().filter_map(mark).collect()
    };
    let frontier = |best: &dyn Fn(&Row) -> bool, time: &dyn Fn(&Row) -> Option<f64>| -> Vec<(f64, f64)> {
        let mut points: Vec<_> =
            drawn.iter().filter(|r| best(r.1)).filter_map(|r| Some((time(r.1)?, r.1.error?.mean))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let mean = |b: Option<Bars>| b.map(|b| b.mean);
    let curve = rows
        .iter()
        .filter(|r| r.kind == Kind::Paths && r.whole)
        .filter_map(|r| Some((r.paths?, r.ms?.mean, r.error?.mean)))
        .collect();
    let clock = Clock::of(record);
    let mut measured = Panel {
        title: format!("Measured: {}", record.device.sentence()),
        across: clock.title().into(),
        marks: marks(&|r| mean(r.ms), &|r| mean(r.cold_ms)),
        curve,
        frontier: frontier(&|r| r.best, &|r| mean(r.ms)),
        lines: Vec::new(),
        printed: Vec::new(),
        floor,
    };
    let mut projected = Panel {
        title: format!("PROJECTED, NOT MEASURED: {} at {:.0} % of its peaks", GTX_1050.name, EFFICIENCY * 100.0),
        across: "light's own passes by count, ms (the rasteriser is not in it; nobody has run it there)".into(),
        marks: marks(&|r| r.projected_ms, &|r| r.projected_ms),
        curve: Vec::new(),
        frontier: frontier(&|r| r.best_projected, &|r| r.projected_ms),
        lines: Vec::new(),
        printed: Vec::new(),
        floor,
    };
    if let Some(generator) = &record.generator {
        let own = "the paper's generator";
        let here = generator.wall_ms.map(|s| s.median);
        // Without a count there is no projection.
        let there = Some(generator.projected_ms()).filter(|ms| *ms > 0.0);
        if metric == Metric::L1 {
            let words = |how: &str| format!("{own}, {how}; L1 as printed");
            measured.printed.extend(here.map(|ms| (ms, PRINTED_L1, words("run here"))));
            projected.printed.extend(there.map(|ms| (ms, PRINTED_L1, words("projected"))));
        } else {
            let words = |how: &str| format!("{own}, {how}: its {} was never printed", metric.name());
            measured.lines.extend(here.map(|ms| (ms, words("run here"))));
            projected.lines.extend(there.map(|ms| (ms, words("projected"))));
        }
    }
    if metric == Metric::L1 {
        projected.printed.push((PRINTED_MS, PRINTED_L1, "the paper, as printed (time without waiting)".into()));
    }
    [measured, projected]
}

fn failed<E: std::error::Error + Send + Sync>(error: plotters::drawing::DrawingAreaErrorKind<E>) -> ChartError {
    ChartError::Plot(error.to_string())
}
