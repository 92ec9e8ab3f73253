//! What accuracy costs: a dot for each method that was drawn, and a click on it chooses the method.

use super::times::number;
use super::{BLUE, Facts, Memory, SKY, VERMILLION};
use crate::viewer::choice::{Side, Source};
use crate::viewer::state::{Action, State};
use egui::{Align2, FontId, Pos2, Rect, RichText, Sense, Stroke, Ui, Vec2};

/// Where a name of `size` stands beside the dot at `p`: the first of four places that nothing else
/// has.
fn free_place(p: Pos2, size: Vec2, taken: &[Rect], within: Rect) -> Rect {
    let sides = [
        (Align2::CENTER_BOTTOM, Vec2::new(0.0, -7.0)),
        (Align2::CENTER_TOP, Vec2::new(0.0, 7.0)),
        (Align2::LEFT_CENTER, Vec2::new(9.0, 0.0)),
        (Align2::RIGHT_CENTER, Vec2::new(-9.0, 0.0)),
    ];
    let places = sides.map(|(align, by)| align.anchor_size(p + by, size));
    let free = |r: &&Rect| within.contains_rect(**r) && !taken.iter().any(|t| t.intersects(**r));
    *places.iter().find(free).unwrap_or(&places[0])
}

/// A method in the plot.
struct Dot {
    source: Source,
    ms: f64,
    /// Per cent.
    error: f64,
    at: Pos2,
}

/// The dot that a hand at `p` means: reaches overlap where methods take the same time, and the
/// nearest dot counts.
fn meant(dots: &[Dot], p: Pos2) -> Option<&Dot> {
    dots.iter().min_by(|a, b| a.at.distance_sq(p).total_cmp(&b.at.distance_sq(p)))
}

/// Error against time: what was measured here across, what docs/results/accuracy.md has up. A dot chooses
/// its method.
pub fn frontier(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), 150.0), Sense::hover());
    let visuals = ui.visuals().clone();
    ui.painter().rect_filled(rect, 2.0, visuals.extreme_bg_color);
    let plot = Rect::from_min_max(rect.min + Vec2::new(34.0, 10.0), rect.max - Vec2::new(14.0, 24.0));
    let most = facts.measured.values().copied().fold(1.0, f64::max);
    let least = facts.measured.values().copied().fold(most, f64::min).max(1e-3);
    let (low, high) = (0.6 * least, 1.7 * most);
    let at = |ms: f64, error: f64| {
        let x = (ms.max(low) / low).ln() / (high / low).ln();
        let y = (error / 3.0).ln() / (130.0f64 / 3.0).ln();
        Pos2::new(plot.left() + x as f32 * plot.width(), plot.bottom() - y as f32 * plot.height())
    };
    let font = FontId::proportional(11.0);
    let weak = visuals.text_color();
    for error in [3.0, 10.0, 30.0, 100.0] {
        let y = at(low, error).y;
        ui.painter().hline(plot.x_range(), y, Stroke::new(0.5, weak));
        ui.painter().text(
            Pos2::new(plot.left() - 4.0, y),
            Align2::RIGHT_CENTER,
            format!("{error} %"),
            font.clone(),
            weak,
        );
    }
    let ticks = [(low, Align2::LEFT_TOP), ((low * high).sqrt(), Align2::CENTER_TOP), (high, Align2::RIGHT_TOP)];
    for (ms, align) in ticks {
        let text = format!("{} ms", number(ms));
        ui.painter().text(at(ms, 3.0) + Vec2::new(0.0, 3.0), align, text, font.clone(), weak);
    }
    let dots: Vec<Dot> = Source::ALL
        .iter()
        .filter_map(|&source| {
            let (ms, error) = (*facts.measured.get(&(source as usize))?, source.judged()?);
            Some(Dot { source, ms, error, at: at(ms, error) })
        })
        .collect();
    let mut taken: Vec<Rect> = dots.iter().map(|d| Rect::from_center_size(d.at, Vec2::splat(12.0))).collect();
    let responses: Vec<egui::Response> = dots
        .iter()
        .map(|d| {
            let reach = Rect::from_center_size(d.at, Vec2::splat(16.0));
            ui.interact(reach, ui.scope_id().with(d.source.name()), Sense::click())
        })
        .collect();
    let hovered = responses.iter().find_map(|r| meant(&dots, r.hover_pos().filter(|_| r.hovered())?)).map(|d| d.source);
    for (&Dot { source, at: p, .. }, response) in dots.iter().zip(responses) {
        memory.place(&format!("dot {}", source.name()), &response);
        let now = source == state.settings.left;
        let colour = if now {
            VERMILLION
        } else if visuals.dark_mode {
            SKY
        } else {
            BLUE
        };
        ui.painter().circle_filled(p, if now { 6.0 } else { 4.5 }, colour);
        if response.has_focus() || hovered == Some(source) {
            ui.painter().circle_stroke(p, 8.0, Stroke::new(1.5, visuals.text_color()));
        }
        let text = if now { visuals.strong_text_color() } else { visuals.text_color() };
        let galley = ui.painter().layout_no_wrap(source.title().into(), font.clone(), text);
        let name = free_place(p, galley.size(), &taken, rect);
        taken.push(name);
        ui.painter().rect_filled(name, 2.0, visuals.extreme_bg_color);
        ui.painter().galley(name.min, galley, text);
        let clicked = response.interact_pointer_pos().and_then(|p| meant(&dots, p)).map_or(source, |d| d.source);
        let told = dots.iter().find(|d| hovered == Some(d.source));
        let text =
            told.map_or(String::new(), |d| format!("{}: {:.2} ms here, {} % there", d.source.title(), d.ms, d.error));
        if response.on_hover_text(text).clicked() {
            state.apply(Action::Source(Side::Left, clicked));
        }
    }
    ui.horizontal(|ui| {
        let text = match facts.touring {
            Some(source) => format!("Stop ({} …)", source.title()),
            None => "Measure all".into(),
        };
        let told = "Every method draws this view for 32 frames, one after the other";
        let response = ui.button(text).on_hover_text(told);
        memory.place("measure all", &response);
        if response.clicked() {
            state.apply(Action::MeasureAll);
        }
        let missing = Source::ALL.iter().filter(|s| s.judged().is_some());
        let missing = missing.filter(|s| !facts.measured.contains_key(&(**s as usize))).count();
        ui.label(
            RichText::new(if missing > 0 { format!("{missing} not measured here yet") } else { String::new() }).weak(),
        );
    });
    ui.label(
        RichText::new(
            "Across: GPU ms measured in this window, of this scene and size, at least 8 frames. Up: mean error of \
            indirect light on five judged rooms (docs/results/accuracy.md), not measured here.",
        )
        .small(),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::frames::Times;
    use egui::{Event, PointerButton};
    use std::collections::BTreeMap;

    /// The method on the left after a click on the dot `name`, where `measured` has been drawn.
    fn chosen(measured: &[(Source, f64)], name: &str) -> Source {
        let measured: BTreeMap<usize, f64> = measured.iter().map(|(s, ms)| (*s as usize, *ms)).collect();
        let (context, times) = (egui::Context::default(), Times::default());
        let (mut state, mut memory) = (State::new(Default::default()), Memory::default());
        let frame = |events: Vec<Event>, memory: &mut Memory, state: &mut State| {
            let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(300.0, 400.0)));
            let input = egui::RawInput { screen_rect, events, focused: true, ..Default::default() };
            let facts = Facts::bare(&times, &measured);
            context.run_ui(input, |ui| frontier(ui, state, memory, &facts)).textures_delta.clear();
        };
        frame(vec![], &mut memory, &mut state);
        let [x, y] = memory.places[&format!("dot {name}")];
        let pos = Pos2::new(x, y);
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Default::default(),
        };
        for event in [Event::PointerMoved(pos), button(true), button(false)] {
            frame(vec![event], &mut memory, &mut state);
        }
        state.settings.left
    }

    #[test]
    fn a_dot_can_be_hit_beside_another_of_the_same_time() {
        for ssgi in [300.0, 299.0, 301.0, 500.0] {
            let measured = [(Source::Ambient, 300.0), (Source::Ssgi, ssgi), (Source::Direct, 300.1)];
            for source in measured.map(|m| m.0) {
                assert_eq!(chosen(&measured, source.name()), source, "ssgi takes {ssgi} ms");
            }
        }
    }
}
