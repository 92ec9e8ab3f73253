//! Where the time and the memory go.

use super::table::{Line, table};
use super::{BLUE, Facts, Memory, ORANGE, SKY};
use crate::render::DrawnCount;
use crate::viewer::state::State;
use crate::viewer::stats::{CURVE, Row, Spread, Track};
use egui::{Align2, FontId, Pos2, RichText, Sense, Shape, Stroke, Ui, Vec2};

/// Passes, curve, CPU, and what the overlay itself costs.
pub fn times(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    let times = facts.times;
    let main = if facts.timestamps { &times.gpu } else { &times.wall };
    curve(ui, main, &times.cpu, facts);
    if !facts.timestamps {
        let text = "This adapter has no GPU timestamps. Shown instead: time from recording until the device is idle.";
        ui.label(RichText::new(text).color(ui.visuals().warn_fg_color));
    }
    let count = main.spread().map_or(0, |s| s.count);
    ui.label(RichText::new(format!("ms; frames drawn in the last two seconds: {count}")).weak());
    let lines = lines(facts);
    table(ui, ["median", "p95"], lines.len(), |i| lines[i].clone());
    let drawn = drawn(&facts.drawn);
    table(ui, ["drawn", "left out"], drawn.len(), |i| drawn[i].clone());
    ui.horizontal(|ui| {
        let doc =
            "mean change of display values from one frame to the next of a view that stands still; waits for the GPU";
        let response = ui.checkbox(&mut state.settings.flicker, "flicker meter").on_hover_text(doc);
        memory.place("flicker meter", &response);
        match facts.flicker.filter(|_| state.settings.flicker) {
            Some(flicker) => ui.label(format!("{:.2} of 255 between frames", 255.0 * flicker)),
            None if state.settings.flicker && state.settings.samples == 1 => {
                ui.label("needs more than 1 frame at rest")
            }
            None => ui.label(""),
        };
    });
}

/// Sums, CPU, passes, network layers.
fn lines<'a>(facts: &Facts<'a>) -> Vec<Line<'a>> {
    let times = facts.times;
    let line = |name, spread: Option<Spread>, strong| {
        let values = spread.map_or(["–".into(), "–".into()], |s| [number(s.median), number(s.p95)]);
        Line::new(name, values, strong)
    };
    let (name, main) =
        if facts.timestamps { ("GPU, all passes", &times.gpu) } else { ("frame, waited for", &times.wall) };
    let mut lines = vec![
        line(name, main.spread(), true),
        line("CPU, frame", times.cpu.spread(), true),
        line("CPU, this overlay", times.overlay.spread(), true),
    ];
    let (layers, passes): (Vec<&Row>, Vec<&Row>) = times.passes.iter().partition(|r| r.name.starts_with("net."));
    lines.extend(passes.iter().map(|r| line(&r.name, r.track.spread(), false)));
    if !layers.is_empty() {
        let all: f64 = layers.iter().filter_map(|r| r.track.spread()).map(|s| s.median).sum();
        lines.push(Line::new("network, all layers", [number(all), String::new()], true));
        lines.extend(layers.iter().map(|r| line(&r.name, r.track.spread(), false)));
    }
    lines
}

/// Triangles, draw calls and shadow maps of the last frame.
fn drawn(drawn: &DrawnCount) -> [Line<'static>; 5] {
    let count = |n: u64| match n {
        0..10_000 => n.to_string(),
        10_000..10_000_000 => format!("{:.1} k", n as f64 / 1e3),
        _ => format!("{:.1} M", n as f64 / 1e6),
    };
    let [camera, shadows] = [&drawn.camera, &drawn.shadows];
    let line = |name, drawn: u64, other: Option<u64>| {
        Line::new(name, [count(drawn), other.map(count).unwrap_or_default()], false)
    };
    [
        line("triangles, camera", camera.triangles, Some(camera.culled)),
        line("draw calls, camera", camera.draws.into(), None),
        line("shadow maps; kept", drawn.maps.into(), Some(drawn.maps_kept.into())),
        line("triangles, shadows", shadows.triangles, Some(shadows.culled)),
        line("draw calls, shadows", shadows.draws.into(), None),
    ]
}

/// Scrolling curves of GPU and CPU time.
fn curve(ui: &mut Ui, gpu: &Track, cpu: &Track, facts: &Facts<'_>) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 70.0), Sense::hover());
    let painter = ui.painter().with_clip_rect(rect);
    let visuals = ui.visuals();
    painter.rect_filled(rect, 2.0, visuals.extreme_bg_color);
    let most = gpu.curve().chain(cpu.curve()).fold(0.0f32, f32::max);
    let top = nice(most.max(0.1));
    let font = FontId::proportional(11.0);
    for share in [0.5, 1.0] {
        let y = rect.bottom() - share * (rect.height() - 12.0);
        painter.hline(rect.x_range(), y, Stroke::new(0.5, visuals.weak_text_color()));
        painter.text(
            Pos2::new(rect.left() + 2.0, y),
            Align2::LEFT_BOTTOM,
            format!("{} ms", top * share),
            font.clone(),
            visuals.weak_text_color(),
        );
    }
    let dark = visuals.dark_mode;
    for (track, colour, dashed) in [(cpu, ORANGE, true), (gpu, if dark { SKY } else { BLUE }, false)] {
        let n = track.curve().len();
        let points: Vec<Pos2> = track
            .curve()
            .enumerate()
            .map(|(i, ms)| {
                let x = rect.right() - (n - 1 - i) as f32 * rect.width() / CURVE as f32;
                Pos2::new(x, rect.bottom() - (ms / top).min(1.0) * (rect.height() - 12.0))
            })
            .collect();
        if dashed {
            // Told apart without colour, too.
            painter.extend(Shape::dashed_line(&points, Stroke::new(1.2, colour), 4.0, 3.0));
        } else {
            painter.line(points, Stroke::new(1.5, colour));
        }
    }
    let name = if facts.timestamps { "GPU ——   CPU – –" } else { "frame ——   CPU – –" };
    painter.text(rect.right_top() + Vec2::new(-4.0, 1.0), Align2::RIGHT_TOP, name, font, visuals.text_color());
}

/// Four digits that count, no more than three of them behind the point.
pub(super) fn number(v: f64) -> String {
    let places = if v < 10.0 { 3 } else { 3 - (v.log10() as usize).min(3) };
    format!("{v:.places$}")
}

/// 1, 2 or 5 times a power of ten, not below `v`.
fn nice(v: f32) -> f32 {
    let power = 10f32.powf(v.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|n| n * power).into_iter().find(|n| *n >= v).unwrap_or(v)
}

/// GPU memory by owner.
pub fn memory(ui: &mut Ui, facts: &Facts<'_>) {
    let all: u64 = facts.memory.iter().map(|(_, b)| b).sum();
    let megabytes = |b: u64| format!("{:.1}", b as f64 / 1e6);
    let mut rows: Vec<_> = facts.memory.iter().collect();
    rows.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    table(ui, ["", "MB"], rows.len() + 1, |i| match i.checked_sub(1) {
        Some(i) => Line::new(&rows[i].0, [String::new(), megabytes(rows[i].1)], false),
        None => Line::new("all", [String::new(), megabytes(all)], true),
    });
}
