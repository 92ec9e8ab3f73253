//! The overlay: panels around the picture, marks on it, and what hands do over it. It draws with egui and changes nothing but
//! the [`State`], so tests run it without a window.

mod help;
mod light;
mod panel;
mod times;

use super::choice::{Side, Source, View};
use super::jobs::Job;
use super::judge::Verdict;
use super::pick;
use super::state::{Action, State};
use super::stats::Times;
use super::{keys, navigate::Navigator};
use crate::render::View as Eye;
use crate::scene::bounds::instance_bounds;
use egui::{Align2, Color32, FontId, PointerButton, Pos2, Rect, Sense, Stroke, Ui, Vec2};
use glam::Vec3;
use std::collections::BTreeMap;

/// Okabe and Ito's colours, which the colour-blind tell apart, too.
pub const BLUE: Color32 = Color32::from_rgb(0x00, 0x72, 0xb2);
pub const SKY: Color32 = Color32::from_rgb(0x56, 0xb4, 0xe9);
pub const ORANGE: Color32 = Color32::from_rgb(0xe6, 0x9f, 0x00);
pub const VERMILLION: Color32 = Color32::from_rgb(0xd5, 0x5e, 0x00);

/// Width of the panel, points.
const PANEL: f32 = 300.0;
/// Distance from the line in which it is grabbed, points.
const GRAB: f32 = 7.0;
/// How long a message stays.
const MESSAGE_SECONDS: u64 = 12;

/// What the overlay tells of the world outside.
pub struct Facts<'a> {
    pub adapter: &'a str,
    pub software: bool,
    pub timestamps: bool,
    pub times: &'a Times,
    pub memory: &'a [(String, u64)],
    pub jobs: &'a [Job],
    pub reference: Option<ReferenceFacts>,
    pub verdict: Option<Verdict>,
    /// Median GPU time of methods drawn in this session, milliseconds.
    pub measured: &'a BTreeMap<usize, f64>,
    pub still: u32,
    pub feature: Option<(&'a str, [f32; 2])>,
    pub flicker: Option<f64>,
}

/// How far the live reference is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceFacts {
    pub stage: &'static str,
    pub samples: u32,
    pub share: f64,
    pub noise: Option<f64>,
    pub texel: u32,
    pub finished: bool,
}

/// What a drag over the picture does, decided where it began.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Grip {
    #[default]
    View,
    Line,
    Sun,
    Object,
}

/// What the overlay remembers that is nobody else's business.
#[derive(Debug, Default)]
pub struct Memory {
    path: String,
    weights: String,
    grip: Grip,
    /// The window was left to others and its wheel rests.
    pub picture: Option<Rect>,
}

/// Draws the overlay and lets hands act on `state`. Returns the picture's place, points.
pub fn show(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) -> Rect {
    keyboard(ui, state);
    if state.settings.panel {
        if facts.software {
            banner(ui, facts);
        }
        egui::Panel::bottom("status").resizable(false).show(ui, |ui| status(ui, state, facts));
        let height = ui.available_height();
        egui::Panel::right("panel").resizable(false).exact_size(PANEL.min(0.6 * ui.available_width())).show(ui, |ui| {
            egui::ScrollArea::vertical().max_height(height).auto_shrink([false; 2]).show(ui, |ui| {
                panel::show(ui, state, memory, facts);
            });
        });
    }
    let rect = ui.available_rect_before_wrap();
    let rect = pixel_aligned(rect, ui.ctx().pixels_per_point());
    memory.picture = Some(rect);
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
    hands(ui, state, memory, &response, rect);
    marks(ui, state, facts, rect);
    messages(ui, state, rect);
    jobs(ui, state, facts, rect);
    if state.help {
        help::show(ui, state);
    }
    rect
}

/// Edges on whole pixels, so that the picture is drawn texel by texel.
fn pixel_aligned(rect: Rect, density: f32) -> Rect {
    let whole = |v: f32| (v * density).round() / density;
    let low = Pos2::new(whole(rect.left()), whole(rect.top()));
    Rect::from_min_max(low, Pos2::new(whole(rect.right()).max(low.x), whole(rect.bottom()).max(low.y)))
}

fn keyboard(ui: &Ui, state: &mut State) {
    if ui.ctx().egui_wants_keyboard_input() {
        return;
    }
    let events = ui.input(|i| i.events.clone());
    for event in events {
        let egui::Event::Key { key, pressed: true, repeat, modifiers, .. } = event else { continue };
        if let Some([x, y]) = keys::arrow(key) {
            match state.selected {
                Some(_) => state.apply(Action::Move(nudge(&state.navigator, x, y))),
                None if state.navigator.fly => state.navigator.look(-10.0 * x, -10.0 * y),
                None => state.navigator.orbit(10.0 * x, 10.0 * y),
            }
        } else if !repeat && let Some(action) = keys::action(key, modifiers, state) {
            state.apply(action);
        }
    }
    fly(ui, state);
}

/// A step of a selected object over the floor, along the axes that are nearest to the picture's.
fn nudge(navigator: &Navigator, x: f32, y: f32) -> Vec3 {
    let [right, _, forward] = navigator.axes();
    let step = 0.02 * navigator.eye.distance(navigator.target);
    let flat = |v: Vec3| Vec3::new(v.x, 0.0, v.z).normalize_or(Vec3::X);
    (flat(right) * x - flat(forward) * y) * step
}

/// Held keys fly.
fn fly(ui: &Ui, state: &mut State) {
    use egui::Key;
    let (direction, seconds, fast) = ui.input(|i| {
        if i.modifiers.ctrl || i.modifiers.command {
            return (Vec3::ZERO, 0.0, false);
        }
        let axis = |plus, minus| f32::from(i8::from(i.key_down(plus)) - i8::from(i.key_down(minus)));
        let direction = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        (direction, i.stable_dt.min(0.1), i.modifiers.shift)
    });
    if direction != Vec3::ZERO {
        state.navigator.fly(direction, if fast { 4.0 * seconds } else { seconds });
        ui.ctx().request_repaint();
    }
}

/// Drags, clicks and the wheel over the picture.
fn hands(ui: &Ui, state: &mut State, memory: &mut Memory, response: &egui::Response, rect: Rect) {
    let modifiers = ui.input(|i| i.modifiers);
    let line = rect.left() + rect.width() * state.settings.line;
    let on_line = |p: Pos2| state.settings.split && state.settings.view.has_sides() && (p.x - line).abs() < GRAB;
    if let Some(p) = response.hover_pos()
        && on_line(p)
    {
        ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
    }
    if response.drag_started() {
        response.surrender_focus();
        let origin = ui.input(|i| i.pointer.press_origin()).unwrap_or(rect.center());
        memory.grip = match () {
            () if on_line(origin) => Grip::Line,
            () if modifiers.ctrl || modifiers.command => Grip::Sun,
            () if modifiers.shift => {
                if state.selected.is_none() {
                    state.selected = object_at(ui, state, origin, rect);
                }
                Grip::Object
            }
            () => Grip::View,
        };
    }
    let d = response.drag_delta();
    if response.dragged() && d != Vec2::ZERO {
        let primary = response.dragged_by(PointerButton::Primary);
        match memory.grip {
            Grip::Line => state.apply(Action::MoveSplit(d.x / rect.width().max(1.0))),
            Grip::Sun => state.apply(Action::TurnSun { dx: d.x, dy: d.y }),
            Grip::Object => drag_object(state, d, rect),
            Grip::View if !primary => state.navigator.pan(d.x, d.y, rect.height()),
            Grip::View if state.navigator.fly => state.navigator.look(-d.x, -d.y),
            Grip::View => state.navigator.orbit(d.x, d.y),
        }
    }
    if response.clicked() {
        ui.ctx().memory_mut(|m| m.stop_text_input());
        if let Some(p) = response.interact_pointer_pos() {
            state.apply(Action::Select(object_at(ui, state, p, rect)));
        }
    }
    if response.hovered() {
        let notches = ui.input(|i| wheel(&i.events));
        if notches != 0.0 && state.navigator.fly {
            state.navigator.faster(notches);
            let text = format!("speed {:.2} m/s", state.navigator.speed);
            state.messages.retain(|m| !m.text.starts_with("speed "));
            state.tell(text, false);
        } else if notches != 0.0 {
            state.navigator.dolly(notches);
        }
    }
}

/// Notches that a wheel was turned; a touchpad's points count a fiftieth.
fn wheel(events: &[egui::Event]) -> f32 {
    let notches = events.iter().map(|e| match e {
        egui::Event::MouseWheel { unit: egui::MouseWheelUnit::Point, delta, .. } => delta.y / 50.0,
        egui::Event::MouseWheel { delta, .. } => delta.y,
        _ => 0.0,
    });
    notches.sum()
}

/// The object under a place of the window.
fn object_at(ui: &Ui, state: &State, p: Pos2, rect: Rect) -> Option<usize> {
    let shown = state.shown.as_ref()?;
    let eye = Eye::new(&state.navigator.camera(&shown.scene), state.size, [0.0; 2]);
    let density = ui.ctx().pixels_per_point();
    let (origin, direction) = pick::ray(&eye, [(p.x - rect.left()) * density, (p.y - rect.top()) * density]);
    pick::pick(&shown.scene, origin, direction).map(|(object, _)| object)
}

/// Moves the selected object with the pointer, parallel to the picture.
fn drag_object(state: &mut State, d: Vec2, rect: Rect) {
    let Some((object, shown)) = state.selected.zip(state.shown.as_ref()) else { return };
    let Some(instance) = shown.scene.instances.get(object) else { return };
    let Some((low, high)) = shown.scene.meshes.get(instance.mesh).and_then(|m| instance_bounds(instance, m)) else {
        return;
    };
    let middle = 0.5 * (Vec3::from(low) + Vec3::from(high));
    let [right, up, forward] = state.navigator.axes();
    let distance = (middle - state.navigator.eye).dot(forward).max(1e-3);
    let metres = 2.0 * (0.5 * state.navigator.fov.to_radians()).tan() * distance / rect.height().max(1.0);
    state.apply(Action::Move((right * d.x - up * d.y) * metres));
}

/// Names of the sides, the selected object's box, the channel on show.
fn marks(ui: &Ui, state: &State, facts: &Facts<'_>, rect: Rect) {
    let s = &state.settings;
    let painter = ui.painter().with_clip_rect(rect);
    if s.split && s.view.has_sides() {
        let line = rect.left() + rect.width() * s.line;
        let name = |source: Source| match (source, facts.reference) {
            (Source::Reference, Some(r)) => format!("reference {}", r.samples),
            (source, _) => source.name().into(),
        };
        let y = rect.top() + 8.0;
        label(&painter, Pos2::new(line - 8.0, y), Align2::RIGHT_TOP, &name(s.left), false);
        label(&painter, Pos2::new(line + 8.0, y), Align2::LEFT_TOP, &name(s.right), false);
    } else {
        let text = match (s.view, facts.feature) {
            (View::Picture, _) => s.left.name().to_string(),
            (View::Feature, Some((name, [low, high]))) => format!("network input `{name}`: {low:.3} to {high:.3}"),
            (View::Error, _) => format!("error: {} against {}, bright at 0.25", s.left.name(), s.right.name()),
            (view, _) => view.doc().to_string(),
        };
        label(&painter, rect.left_top() + Vec2::splat(8.0), Align2::LEFT_TOP, &text, false);
    }
    if let Some(object) = state.selected {
        outline(ui, &painter, state, object, rect);
    }
}

/// Text on a dark ground, so that it is read on any picture.
fn label(painter: &egui::Painter, at: Pos2, align: Align2, text: &str, error: bool) -> Rect {
    let galley = painter.layout_no_wrap(text.into(), FontId::proportional(13.0), Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    let ground = if error { Color32::from_rgb(0x8a, 0x2c, 0x00) } else { Color32::from_black_alpha(190) };
    painter.rect_filled(rect.expand2(Vec2::new(5.0, 2.0)), 4.0, ground);
    painter.galley(rect.min, galley, Color32::WHITE);
    rect.expand(3.0)
}

/// The edges of an object's box.
fn outline(ui: &Ui, painter: &egui::Painter, state: &State, object: usize, rect: Rect) {
    let Some(shown) = &state.shown else { return };
    let Some(instance) = shown.scene.instances.get(object) else { return };
    let Some((low, high)) = shown.scene.meshes.get(instance.mesh).and_then(|m| instance_bounds(instance, m)) else {
        return;
    };
    let eye = Eye::new(&state.navigator.camera(&shown.scene), state.size, [0.0; 2]);
    let clip = glam::Mat4::from_cols_array_2d(&eye.clip_from_world);
    let density = ui.ctx().pixels_per_point();
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        let p = clip * Vec3::new(pick(0), pick(1), pick(2)).extend(1.0);
        let ndc = p.truncate() / p.w;
        let size = Vec2::new(state.size[0] as f32, state.size[1] as f32) / density;
        let place = rect.min + Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size;
        (p.w > eye.near).then_some(place)
    };
    for i in 0..8usize {
        for axis in 0..3 {
            let j = i | 1 << axis;
            if let (true, Some(a), Some(b)) = (j != i, corner(i), corner(j)) {
                painter.line_segment([a, b], Stroke::new(3.0, Color32::from_black_alpha(160)));
                painter.line_segment([a, b], Stroke::new(1.5, ORANGE));
            }
        }
    }
}

fn messages(ui: &Ui, state: &mut State, rect: Rect) {
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
fn jobs(ui: &Ui, state: &mut State, facts: &Facts<'_>, rect: Rect) {
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
                    None => ui.add(egui::Spinner::new().size(12.0)),
                };
            }
            if ui.button("Cancel (Esc)").clicked() {
                state.requests.push(super::state::Request::Cancel);
            }
        });
    });
    ui.ctx().request_repaint_after(std::time::Duration::from_millis(200));
}

/// Says plainly that numbers are not a GPU's.
fn banner(ui: &mut Ui, facts: &Facts<'_>) {
    let frame = egui::Frame::new().fill(ORANGE).inner_margin(egui::Margin::symmetric(8, 3));
    egui::Panel::top("banner").resizable(false).frame(frame).show(ui, |ui| {
        let text = format!(
            "Software rendering on the CPU ({}): pictures are right, times say nothing about a GPU.",
            facts.adapter
        );
        ui.add(egui::Label::new(egui::RichText::new(text).color(Color32::BLACK)).truncate());
    });
}

fn status(ui: &mut Ui, state: &mut State, facts: &Facts<'_>) {
    ui.horizontal(|ui| {
        let ms = |track: &super::stats::Track| track.spread().map_or("–".into(), |s| format!("{:.2}", s.median));
        let times = facts.times;
        let gpu = if facts.timestamps {
            format!("GPU {} ms", ms(&times.gpu))
        } else {
            format!("frame {} ms (no GPU timestamps; waited for)", ms(&times.wall))
        };
        let mut text = format!(
            "{}×{}  ·  {gpu}  ·  CPU {} ms, overlay {} ms",
            state.size[0],
            state.size[1],
            ms(&times.cpu),
            ms(&times.overlay)
        );
        text += &format!("  ·  {} of {} frames averaged", facts.still, state.settings.samples);
        if let Some(r) = facts.reference {
            text += &format!("  ·  reference {} of {}", r.samples, state.settings.spp);
        }
        if ui.button("Help (H)").clicked() {
            state.apply(Action::Help);
        }
        ui.add(egui::Label::new(text).truncate());
    });
}

/// A combination box for one side's source.
fn source_box(ui: &mut Ui, id: &str, state: &mut State, side: Side) {
    let now = if side == Side::Left { state.settings.left } else { state.settings.right };
    let mut chosen = now;
    egui::ComboBox::from_id_salt(id).selected_text(now.name()).width(130.0).show_ui(ui, |ui| {
        for source in Source::ALL {
            ui.selectable_value(&mut chosen, source, source.name()).on_hover_text(source.doc());
        }
    });
    if chosen != now {
        state.apply(Action::Source(side, chosen));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// Runs the overlay without any window, one frame for each list of events.
    fn run(state: &mut State, frames: Vec<Vec<egui::Event>>) -> Rect {
        let (context, mut memory) = (egui::Context::default(), Memory::default());
        let (times, measured) = (Times::default(), BTreeMap::new());
        let mut place = Rect::NOTHING;
        for events in frames {
            let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 500.0)));
            let input = egui::RawInput { screen_rect, events, focused: true, ..Default::default() };
            let facts = Facts {
                adapter: "none",
                software: true,
                timestamps: false,
                times: &times,
                memory: &[],
                jobs: &[],
                reference: None,
                verdict: None,
                measured: &measured,
                still: 1,
                feature: None,
                flicker: None,
            };
            let mut output = context.run_ui(input, |ui| place = show(ui, state, &mut memory, &facts));
            output.textures_delta.clear();
        }
        place
    }

    fn state() -> State {
        let mut state = State::new(Default::default());
        state.show("cornell".into(), Arc::new(crate::scene::bundled::scene("cornell").expect("bundled")));
        state
    }

    fn press(key: egui::Key) -> egui::Event {
        egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers: Default::default() }
    }

    fn button(pos: Pos2, pressed: bool) -> egui::Event {
        egui::Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Default::default() }
    }

    #[test]
    fn the_panel_leaves_the_rest_to_the_picture() {
        let mut state = state();
        let place = run(&mut state, vec![vec![], vec![]]);
        assert_eq!((place.left(), place.right()), (0.0, 500.0));
        assert!(place.top() > 10.0 && place.bottom() < 490.0, "banner and status: {place}");
        state.apply(Action::Panel);
        assert_eq!(run(&mut state, vec![vec![], vec![]]), Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 500.0)));
    }

    #[test]
    fn hands_over_the_picture_move_the_camera_and_over_the_panel_they_do_not() {
        let drag = |from: Pos2| {
            let to = from + Vec2::new(30.0, 0.0);
            vec![
                vec![egui::Event::PointerMoved(from)],
                vec![button(from, true)],
                vec![egui::Event::PointerMoved(to)],
                vec![button(to, false)],
            ]
        };
        let mut state = state();
        let eye = state.navigator.eye;
        run(&mut state, drag(Pos2::new(700.0, 420.0)));
        assert_eq!(state.navigator.eye, eye, "the panel is no picture");
        run(&mut state, drag(Pos2::new(200.0, 200.0)));
        assert_ne!(state.navigator.eye, eye);
        // The line is nearer than the camera to a hand that grabs it.
        state.settings.split = true;
        let (eye, line) = (state.navigator.eye, state.settings.line);
        run(&mut state, drag(Pos2::new(250.0, 200.0)));
        assert_eq!(state.navigator.eye, eye);
        assert!((state.settings.line - line - 30.0 / 500.0).abs() < 1e-3, "{}", state.settings.line);
    }

    #[test]
    fn keys_reach_the_state_but_not_while_somebody_types() {
        let mut state = state();
        run(&mut state, vec![vec![press(egui::Key::Num4)], vec![press(egui::Key::H)]]);
        assert_eq!((state.settings.view, state.help), (View::Depth, true));
        state.apply(Action::Escape);
        // Tab goes to the first control; from then on letters are its own.
        let mut tabbed = vec![vec![]];
        tabbed.extend((0..3).map(|_| vec![press(egui::Key::Tab)]));
        tabbed.push(vec![press(egui::Key::Num1)]);
        run(&mut state, tabbed);
        assert_eq!(state.settings.view, View::Depth);
    }
}
