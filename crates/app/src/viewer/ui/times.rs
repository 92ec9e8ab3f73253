//! Where the time and the memory go.

use super::table::{Line, table};
use super::widgets::tick;
use super::{Facts, Memory};
use crate::viewer::state::{Action, State};
use bouncelight::render::DrawnCount;
use egui::Ui;

/// What was drawn, and where the times are.
pub fn times(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    ui.horizontal(|ui| {
        let told = "passes, graph and sums over the picture";
        tick(ui, state.settings.timing.shown, state, "Timing overlay (F3)", told, Action::Timing);
        if ui.button("Passes (Shift F3)").clicked() {
            state.apply(Action::ExpandTiming);
        }
    });
    let drawn = drawn(&facts.drawn);
    table(ui, ["drawn", "culled"], drawn.len(), |i| drawn[i].clone());
    ui.horizontal(|ui| {
        let doc =
            "mean change of display values from one frame to the next of a view that stands still; waits for the GPU";
        let response = ui.checkbox(&mut state.settings.flicker, "Flicker meter").on_hover_text(doc);
        memory.place("flicker meter", &response);
        match facts.flicker.filter(|_| state.settings.flicker) {
            Some(flicker) => ui.label(format!("{:.2} of 255 between frames", 255.0 * flicker)),
            None if state.settings.flicker && state.settings.samples == 1 => {
                ui.label("needs more than 1 frame when still")
            }
            None => ui.label(""),
        };
    });
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
        line("Triangles, camera", camera.triangles, Some(camera.culled)),
        line("Draw calls, camera", camera.draws.into(), None),
        line("Shadow maps: new, kept", drawn.maps.into(), Some(drawn.maps_kept.into())),
        line("Triangles, shadows", shadows.triangles, Some(shadows.culled)),
        line("Draw calls, shadows", shadows.draws.into(), None),
    ]
}

/// Four digits that count, no more than three of them behind the point.
pub(super) fn number(v: f64) -> String {
    let places = if v < 10.0 { 3 } else { 3 - (v.log10() as usize).min(3) };
    format!("{v:.places$}")
}

/// GPU memory by owner.
pub fn memory(ui: &mut Ui, facts: &Facts<'_>) {
    let all: u64 = facts.memory.iter().map(|(_, b)| b).sum();
    let megabytes = |b: u64| format!("{:.1}", b as f64 / 1e6);
    let mut rows: Vec<_> = facts.memory.iter().collect();
    rows.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    let resident = facts.resident.map_or("–".into(), megabytes);
    table(ui, ["", "MB"], rows.len() + 2, |i| match i {
        0 => Line::new("GPU, all of it", [String::new(), megabytes(all)], true),
        1 => Line::new("process, resident", [String::new(), resident.clone()], true),
        i => Line::new(&rows[i - 2].0, [String::new(), megabytes(rows[i - 2].1)], false),
    });
}
