//! Frames one after the other: a sparkline, and the stacked graph.

use super::{COLOURS, TEXT, WEAK, ms};
use crate::viewer::frames::{Frame, Group};
use crate::viewer::ui::{Facts, Memory};
use egui::{Align2, Color32, FontId, Mesh, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2};
use std::sync::Arc;

const HEIGHT: f32 = 92.0;
/// Frames a second that people aim for, and their milliseconds.
const AIMS: [(f32, &str); 2] = [(1e3 / 60.0, "16.7 ms"), (1e3 / 30.0, "33.3 ms")];
/// So many frames have room at least: a few of them need not be wide.
const LEAST: usize = 90;

/// The last frames' GPU time, a thin line for each.
pub fn sparkline(ui: &mut Ui, facts: &Facts<'_>) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(78.0, 18.0), Sense::hover());
    let frames: Vec<&Frame> = facts.times.history.iter().rev().take(78).collect();
    let most = frames.iter().map(|f| f.renderer()).fold(0.0f32, f32::max);
    let mut mesh = Mesh::default();
    for (i, frame) in frames.iter().enumerate() {
        let x = rect.right() - i as f32;
        let mut bottom = rect.bottom();
        for (colour, v) in stack(frame) {
            let top = bottom - v / most.max(1e-6) * rect.height();
            mesh.add_colored_rect(Rect::from_min_max(Pos2::new(x - 1.0, top), Pos2::new(x, bottom)), colour);
            bottom = top;
        }
    }
    ui.painter().rect_filled(rect, 2.0, Color32::from_white_alpha(14));
    ui.painter().add(Shape::mesh(mesh));
    response.on_hover_text(format!("the last {} frames, up to {} ms", frames.len(), ms(most.into())));
}

/// Colours and milliseconds of a frame's column, from below.
fn stack(frame: &Frame) -> impl Iterator<Item = (Color32, f32)> + '_ {
    let groups = Group::ALL.into_iter().filter(|g| *g != Group::Viewer);
    let groups = groups.map(|g| (COLOURS[g as usize], frame.groups[g as usize]));
    groups.chain([(COLOURS[0], frame.whole)]).filter(|(_, ms)| *ms > 0.0)
}

/// 1, 1.5, 2, 3 … times a power of ten, not below `v`.
fn nice(v: f32) -> f32 {
    let power = 10f32.powf(v.max(1e-3).log10().floor());
    let steps = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
    steps.map(|n| n * power).into_iter().find(|n| *n >= v).unwrap_or(v)
}

/// The scale's top after frames of up to `most`: up at once, down when much room is left.
fn follow(top: f32, most: f32) -> f32 {
    let wanted = nice(1.05 * most.max(0.05));
    if wanted > top || wanted < 0.6 * top { wanted } else { top }
}

/// All frames that are remembered, stacked by group, with marks where the method changed.
pub fn history(ui: &mut Ui, memory: &mut Memory, facts: &Facts<'_>) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), HEIGHT), Sense::hover());
    memory.place("timing: graph", &response);
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 2.0, Color32::from_white_alpha(14));
    let frames = &facts.times.history;
    let shown = frames.len().max(LEAST);
    let width = rect.width() / shown as f32;
    let first = shown - frames.len();
    let most = frames.iter().map(|f| f.renderer().max(f.cpu)).fold(0.0f32, f32::max);
    memory.timing.top = follow(memory.timing.top, most);
    let top = memory.timing.top;
    let plot = rect.height() - 3.0;
    let height = |ms: f32| (ms / top).min(1.0) * plot;
    let left = |i: usize| rect.left() + (first + i) as f32 * width;
    // One mesh for all: shapes of their own would be outlined one by one.
    let mut mesh = Mesh::default();
    mesh.reserve_vertices(16 * frames.len());
    mesh.reserve_triangles(8 * frames.len());
    let mut last: Option<f32> = None;
    for (i, frame) in frames.iter().enumerate() {
        let (mut bottom, mut sum) = (rect.bottom(), 0.0);
        for (colour, v) in stack(frame) {
            sum += v;
            let above = rect.bottom() - height(sum);
            mesh.add_colored_rect(Rect::from_x_y_ranges(left(i)..=left(i + 1), above..=bottom), colour);
            bottom = above;
        }
    }
    for (i, frame) in frames.iter().enumerate() {
        // Steps, as wide as a line is and as long as the rise.
        let now = rect.bottom() - height(frame.cpu);
        let before = last.replace(now).unwrap_or(now);
        mesh.add_colored_rect(Rect::from_x_y_ranges(left(i)..=left(i + 1), now..=now + 1.0), TEXT);
        if (now - before).abs() > 1.0 {
            let rise = now.min(before)..=now.max(before) + 1.0;
            mesh.add_colored_rect(Rect::from_x_y_ranges(left(i)..=left(i) + 1.0, rise), TEXT);
        }
    }
    painter.add(Shape::mesh(mesh));
    let font = FontId::proportional(10.0);
    let mut note = |at: Pos2, align: Align2, text: &str, colour: Color32| {
        let galley = painter.layout_no_wrap(text.into(), font.clone(), colour);
        let place = align.anchor_size(at, galley.size());
        painter.rect_filled(place.expand2(Vec2::new(2.0, 0.0)), 2.0, Color32::from_black_alpha(150));
        painter.galley(place.min, galley, colour);
    };
    for (aim, name) in AIMS {
        // On the ground it would be no line.
        if aim < 0.97 * top && aim > 0.03 * top {
            let y = rect.bottom() - height(aim);
            let line = [Pos2::new(rect.left(), y), Pos2::new(rect.right(), y)];
            painter.extend(Shape::dashed_line(&line, Stroke::new(1.0, Color32::from_white_alpha(150)), 6.0, 4.0));
            // Each has room for its name.
            if aim > 0.1 * top {
                note(Pos2::new(rect.right() - 3.0, y), Align2::RIGHT_CENTER, name, TEXT);
            }
        }
    }
    note(rect.left_top() + Vec2::new(4.0, 3.0), Align2::LEFT_TOP, &format!("{} ms", ms(top.into())), WEAK);
    note(rect.left_bottom() + Vec2::new(4.0, -3.0), Align2::LEFT_BOTTOM, "CPU: the line", TEXT);
    marks(&painter, rect, facts, &left, &mut note);
    let hovered = response.hover_pos().map(|p| ((p.x - rect.left()) / width) as usize);
    let Some((i, frame)) = hovered.and_then(|c| c.checked_sub(first)).and_then(|i| Some((i, frames.get(i)?))) else {
        return;
    };
    painter.rect_filled(
        Rect::from_x_y_ranges(left(i)..=left(i + 1).max(left(i) + 1.0), rect.y_range()),
        0.0,
        Color32::from_white_alpha(90),
    );
    response.on_hover_ui_at_pointer(|ui| values(ui, frame, frames.len() - 1 - i));
}

/// A line where frames begin to be drawn with something else, and what that is.
fn marks(
    painter: &egui::Painter,
    rect: Rect,
    facts: &Facts<'_>,
    left: &dyn Fn(usize) -> f32,
    note: &mut dyn FnMut(Pos2, Align2, &str, Color32),
) {
    let frames = &facts.times.history;
    let changes: Vec<usize> = (1..frames.len()).filter(|&i| !Arc::ptr_eq(&frames[i].run, &frames[i - 1].run)).collect();
    let mut free = rect.left() + 44.0;
    for &i in &changes {
        let (before, after) = (&frames[i - 1].run, &frames[i].run);
        let x = left(i);
        painter.vline(x, rect.y_range(), Stroke::new(1.0, TEXT));
        let name = match () {
            () if before.method != after.method => after.method.clone(),
            () if before.scene != after.scene => "scene".into(),
            () => format!("{}×{}", after.size[0], after.size[1]),
        };
        // Names do not lie over each other: one that has no room is told by the pointer.
        let width = 5.2 * name.chars().count() as f32 + 6.0;
        if x >= free && x + width < rect.right() {
            note(Pos2::new(x + 3.0, rect.top() + 3.0), Align2::LEFT_TOP, &name, TEXT);
            free = x + width;
        }
    }
}

/// What a frame took.
fn values(ui: &mut Ui, frame: &Frame, ago: usize) {
    let [w, h] = frame.run.size;
    let when = if ago == 0 { "the last frame".into() } else { format!("{ago} frames before the last") };
    ui.label(format!("{} · {w}×{h} · {when}", frame.run.method));
    egui::Grid::new("a frame").num_columns(2).spacing([12.0, 1.0]).show(ui, |ui| {
        let mut row = |name: &str, v: f32, colour: Color32| {
            ui.colored_label(colour, name);
            ui.monospace(format!("{v:.3} ms"));
            ui.end_row();
        };
        if frame.whole > 0.0 {
            row("frame, waited for", frame.whole, COLOURS[0]);
        } else {
            row("GPU", frame.renderer(), TEXT);
        }
        for group in Group::ALL {
            if frame.groups[group as usize] > 0.0 {
                row(group.title(), frame.groups[group as usize], COLOURS[group as usize]);
            }
        }
        row("CPU", frame.cpu, TEXT);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_follows_but_does_not_tremble() {
        let up = follow(5.0, 7.0);
        assert_eq!((up, follow(up, 5.0), follow(up, 2.0)), (8.0, 8.0, 3.0));
        assert!([0.0, 0.3, 16.7, 900.0].iter().all(|&v| nice(v) >= v));
    }
}
