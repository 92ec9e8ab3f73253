//! What is drawn over the picture: names, the selected object's box, messages, work.

use super::{Facts, ORANGE};
use crate::viewer::choice::{Side, Source, View};
use crate::viewer::state::{Request, State};
use bouncelight::render::View as Eye;
use bouncelight::scene::bounds::posed_bounds;
use egui::{Align2, Color32, FontId, Pos2, Rect, Shape, Stroke, Ui, Vec2};
use glam::Vec3;

/// How long a message stays.
const MESSAGE_SECONDS: u64 = 12;

/// What a side shows, and where it is not what was chosen, why.
pub(super) fn name(state: &State, facts: &Facts<'_>, side: Side) -> String {
    let s = &state.settings;
    let asked = if side == Side::Left { s.left } else { s.right };
    let by = facts.by[side as usize].as_ref();
    match (asked, facts.reference) {
        (Source::Reference, Some(r)) if r.samples > 0 => format!("{}, {} samples", asked.title(), r.samples),
        (Source::Reference, Some(r)) => format!("{} ({})", asked.title(), r.stage),
        (Source::Reference, None) => format!("{} (waits until the view stops changing)", asked.title()),
        _ => match by.map(|by| (state.title(by.source), &by.why)) {
            Some((title, Some(why))) => format!("{title} ({why})"),
            Some((title, None)) => title,
            None => format!("building {}", state.title(asked)),
        },
    }
}

fn waits_for_reference(state: &State, facts: &Facts<'_>) -> bool {
    state.wants_reference() && facts.reference.is_none_or(|r| r.samples == 0)
}

/// Names of the sides, the channel on show.
pub(super) fn marks(ui: &Ui, state: &State, facts: &Facts<'_>, rect: Rect, timing: Option<Rect>) {
    let s = &state.settings;
    let painter = ui.painter().with_clip_rect(rect);
    let [left, right] = [Side::Left, Side::Right].map(|side| name(state, facts, side));
    if s.split && s.view.has_sides() {
        let line = rect.left() + rect.width() * s.line;
        // Below the timing overlay, or at the picture's other end where that leaves no room.
        let over =
            timing.filter(|t| t.top() < rect.top() + 50.0 && t.left() < line + 200.0 && t.right() > line - 200.0);
        let y = match over.map(|t| t.bottom() + 8.0) {
            None => rect.top() + 8.0,
            Some(y) if y < rect.center().y => y,
            Some(_) => rect.bottom() - 44.0,
        };
        // Reasons stand below the names, so that both fit beside the line.
        let lines = |name: &str| name.replacen(" (", "\n(", 1);
        label(&painter, Pos2::new(line - 8.0, y), Align2::RIGHT_TOP, &lines(&left), false);
        label(&painter, Pos2::new(line + 8.0, y), Align2::LEFT_TOP, &lines(&right), false);
    } else {
        let waits = facts.by[0].as_ref().is_some_and(|by| by.why.is_some());
        let text = match (s.view, facts.feature) {
            (View::Picture, _) => left,
            (View::Wireframe, _) => format!("wireframe over {left}"),
            (View::Feature, Some((name, [low, high]))) => format!("{name}: {low:.3} to {high:.3}"),
            (View::Layer, Some((name, [low, high]))) => format!("{name}; all {low:.3} to {high:.3}"),
            (View::Feature | View::Layer, None) if waits => format!("the network has not run yet: {left}"),
            (View::Feature | View::Layer, None) => "only `neural` has a network".into(),
            (View::Error, _) if waits_for_reference(state, facts) => {
                "error: waiting for the reference's first sample".into()
            }
            (View::Error, _) => format!("error: {left} against {right}, bright at 0.25"),
            (view, _) => view.doc().to_string(),
        };
        let size = painter.layout_no_wrap(text.clone(), FontId::proportional(13.0), Color32::WHITE).size();
        label(&painter, corner(rect, timing, size), Align2::LEFT_TOP, &text, false);
    }
}

/// Where a name of `size` stands: in the picture's corner, or below the timing overlay where that is in its way, or at
/// the other end where that reaches far down.
fn corner(rect: Rect, timing: Option<Rect>, size: Vec2) -> Pos2 {
    let at = rect.left_top() + Vec2::splat(8.0);
    match timing.filter(|t| t.intersects(Rect::from_min_size(at, size).expand(6.0))) {
        None => at,
        Some(t) if t.bottom() < rect.center().y => Pos2::new(at.x, t.bottom() + 8.0),
        Some(_) => Pos2::new(at.x, rect.bottom() - size.y - 10.0),
    }
}

/// Text on a dark ground, so that it is read on any picture.
pub(super) fn label(painter: &egui::Painter, at: Pos2, align: Align2, text: &str, error: bool) -> Rect {
    let galley = painter.layout_no_wrap(text.into(), FontId::proportional(13.0), Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    let ground = if error { Color32::from_rgb(0x8a, 0x2c, 0x00) } else { Color32::from_black_alpha(190) };
    painter.rect_filled(rect.expand2(Vec2::new(5.0, 2.0)), 4.0, ground);
    painter.galley(rect.min, galley, Color32::WHITE);
    rect.expand(3.0)
}

/// The edges of the selected object's box, in a picture at `rect` of `density` pixels a point.
pub fn outline(state: &State, rect: Rect, density: f32) -> Vec<Shape> {
    let Some((object, shown)) = state.selected.zip(state.shown.as_ref()) else { return Vec::new() };
    let found = shown.scene.instances.get(object).and_then(|i| posed_bounds(i, &shown.scene));
    let Some((low, high)) = found else { return Vec::new() };
    let eye = Eye::new(&state.navigator.camera(&shown.scene, state.size), state.size, [0.0; 2]);
    let clip = glam::Mat4::from_cols_array_2d(&eye.clip_from_world);
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        let p = clip * Vec3::new(pick(0), pick(1), pick(2)).extend(1.0);
        let ndc = p.truncate() / p.w;
        let size = Vec2::new(state.size[0] as f32, state.size[1] as f32) / density;
        let place = rect.min + Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size;
        (p.w > eye.near).then_some(place)
    };
    let mut shapes = Vec::new();
    for i in 0..8usize {
        for axis in 0..3 {
            let j = i | 1 << axis;
            if let (true, Some(a), Some(b)) = (j != i, corner(i), corner(j)) {
                shapes.push(Shape::line_segment([a, b], Stroke::new(3.0, Color32::from_black_alpha(160))));
                shapes.push(Shape::line_segment([a, b], Stroke::new(1.5, ORANGE)));
            }
        }
    }
    shapes
}

pub(super) fn messages(ui: &Ui, state: &mut State, rect: Rect) {
    state.messages.retain(|m| m.error || m.at.elapsed().as_secs() < MESSAGE_SECONDS);
    let painter = ui.painter().with_clip_rect(rect);
    let mut at = rect.left_bottom() + Vec2::new(8.0, -8.0);
    for message in state.messages.iter().rev() {
        let text = wrapped(&message.text, (rect.width() / 7.0) as usize);
        at.y = label(&painter, at, Align2::LEFT_BOTTOM, &text, message.error).top() - 4.0;
        if !message.error {
            let left = MESSAGE_SECONDS.saturating_sub(message.at.elapsed().as_secs());
            ui.ctx().request_repaint_after(std::time::Duration::from_secs(left + 1));
        }
    }
}

/// Lines of at most `most` letters.
fn wrapped(text: &str, most: usize) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let mut length = 0;
        for word in line.split(' ') {
            if length > 0 && length + word.chars().count() > most.max(20) {
                out.push('\n');
                length = 0;
            } else if length > 0 {
                out.push(' ');
            }
            out.push_str(word);
            length += word.chars().count() + 1;
        }
        out.push('\n');
    }
    out.trim_end().into()
}

/// What is at work, how far, and the way to stop it.
pub(super) fn jobs(ui: &Ui, state: &mut State, facts: &Facts<'_>, rect: Rect) {
    if facts.jobs.is_empty() {
        return;
    }
    let area = egui::Area::new(egui::Id::unique("jobs")).fixed_pos(rect.center_top() + Vec2::new(-140.0, 40.0));
    area.show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_width(280.0);
            for job in facts.jobs {
                let (stage, share) = job.progress.read();
                let seconds = job.started.elapsed().as_secs();
                ui.horizontal(|ui| {
                    ui.add(egui::Label::new(format!("{stage} ({seconds} s)")).truncate());
                });
                match share {
                    Some(share) => ui.add(egui::ProgressBar::new(share).desired_height(6.0)),
                    // A wheel that turns would lay the overlay out sixty times a second.
                    None => ui.label("…"),
                };
            }
            if ui.button("Cancel (Esc)").clicked() {
                state.requests.push(Request::Cancel);
            }
        });
    });
    ui.ctx().request_repaint_after(std::time::Duration::from_millis(200));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_never_lies_under_the_timing_overlay() {
        let rect = Rect::from_min_size(Pos2::new(0.0, 22.0), Vec2::new(660.0, 490.0));
        let (short, long) = (Vec2::new(60.0, 15.0), Vec2::new(440.0, 15.0));
        let sums = Rect::from_min_size(Pos2::new(226.0, 30.0), Vec2::new(426.0, 30.0));
        let whole = sums.with_max_y(480.0);
        assert_eq!(corner(rect, Some(sums), short), corner(rect, None, long));
        for overlay in [sums, whole] {
            let name = Rect::from_min_size(corner(rect, Some(overlay), long), long);
            assert!(rect.contains_rect(name));
            assert!(!overlay.intersects(name), "{name}");
        }
    }
}
