//! What hands do over the picture, and keys.

use super::{Memory, gizmo};
use crate::viewer::navigate::Navigator;
use crate::viewer::state::{Action, State};
use crate::viewer::{keys, pick};
use bouncelight::render::View as Eye;
use bouncelight::scene::bounds::posed_bounds;
use egui::{Key, PointerButton, Pos2, Rect, Ui, Vec2};
use glam::Vec3;

/// Distance from the line in which it is grabbed, points.
const GRAB: f32 = 7.0;

/// Keys that fly while they are held.
pub const FLY: [Key; 6] = [Key::W, Key::A, Key::S, Key::D, Key::Q, Key::E];

/// What a drag over the picture does, decided where it began.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Grip {
    View,
    Slide,
    Line,
    Sun,
    Object,
    /// An arrow of the selected object.
    Axis(usize),
}

/// A drag over the picture that has got as far as `at`.
#[derive(Debug)]
pub struct Drag {
    grip: Grip,
    at: Pos2,
}

pub(super) fn keyboard(ui: &Ui, state: &mut State) {
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
}

/// A step of a selected object over the floor, along the axes that are nearest to the picture's.
fn nudge(navigator: &Navigator, x: f32, y: f32) -> Vec3 {
    let [right, _, forward] = navigator.axes();
    let step = 0.02 * navigator.eye.distance(navigator.target);
    let flat = |v: Vec3| Vec3::new(v.x, 0.0, v.z).normalize_or(Vec3::X);
    (flat(right) * x - flat(forward) * y) * step
}

/// Held keys fly for `seconds`; true while they do.
pub fn fly(context: &egui::Context, state: &mut State, seconds: f32) -> bool {
    if context.egui_wants_keyboard_input() {
        return false;
    }
    let (direction, fast) = context.input(|i| {
        if i.modifiers.ctrl || i.modifiers.command {
            return (Vec3::ZERO, false);
        }
        let axis = |plus, minus| f32::from(i8::from(i.key_down(plus)) - i8::from(i.key_down(minus)));
        let direction = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        (direction, i.modifiers.shift)
    });
    if direction != Vec3::ZERO {
        state.navigator.fly(direction, if fast { 4.0 * seconds } else { seconds });
    }
    direction != Vec3::ZERO
}

/// A drag over the picture goes on to the place `to` of the window.
pub fn drag(state: &mut State, memory: &mut Memory, to: Pos2, rect: Rect) {
    let Some(drag) = &mut memory.drag else { return };
    let d = to - drag.at;
    drag.at = to;
    if d == Vec2::ZERO {
        return;
    }
    match drag.grip {
        Grip::Line => state.apply(Action::MoveSplit(d.x / rect.width().max(1.0))),
        Grip::Sun => state.apply(Action::TurnSun { dx: d.x, dy: d.y }),
        Grip::Object => drag_object(state, d, rect),
        Grip::Axis(axis) => gizmo::drag(state, axis, d, rect, state.size[1] as f32 / rect.height().max(1.0)),
        Grip::Slide => state.navigator.pan(d.x, d.y, rect.height()),
        Grip::View if state.navigator.fly => state.navigator.look(-d.x, -d.y),
        Grip::View => state.navigator.orbit(d.x, d.y),
    }
}

/// Drags, clicks and the wheel over the picture.
pub(super) fn pointer(ui: &Ui, state: &mut State, memory: &mut Memory, response: &egui::Response, rect: Rect) {
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
        state.settings.greeted = true;
        let origin = ui.input(|i| i.pointer.press_origin()).unwrap_or(rect.center());
        let (primary, density) = (response.dragged_by(PointerButton::Primary), ui.ctx().pixels_per_point());
        let grip = match () {
            () if on_line(origin) => Grip::Line,
            () if primary && let Some(axis) = gizmo::grabbed(state, origin, rect, density) => Grip::Axis(axis),
            () if modifiers.ctrl || modifiers.command => Grip::Sun,
            () if modifiers.shift => {
                if state.selected.is_none() {
                    state.settle();
                    state.selected = object_at(ui, state, origin, rect);
                }
                Grip::Object
            }
            () if !response.dragged_by(PointerButton::Primary) => Grip::Slide,
            () => Grip::View,
        };
        memory.drag = Some(Drag { grip, at: origin });
    }
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.dragged() || response.drag_stopped()) {
        drag(state, memory, at, rect);
    }
    if !response.dragged() {
        memory.drag = None;
    }
    if response.clicked() {
        ui.ctx().memory_mut(|m| m.stop_text_input());
        if let Some(p) = response.interact_pointer_pos() {
            state.settle();
            state.apply(Action::Select(object_at(ui, state, p, rect)));
        }
    }
    let notches = wheel(ui, memory, rect);
    if notches != 0.0 {
        if state.navigator.fly {
            state.navigator.faster(notches);
            let text = format!("speed {:.2} m/s", state.navigator.speed);
            state.messages.retain(|m| !m.text.starts_with("speed "));
            state.notify(text, false);
        } else {
            state.navigator.dolly(notches);
        }
    }
}

/// Notches that a wheel was turned over the picture; a touchpad's points count a fiftieth. Each
/// counts where the pointer was when it was turned: a slow frame hears of many places.
fn wheel(ui: &Ui, memory: &mut Memory, rect: Rect) -> f32 {
    let events = ui.input(|i| i.events.clone());
    let mut notches = 0.0;
    for event in &events {
        match event {
            egui::Event::PointerMoved(p) => memory.pointer = Some(*p),
            egui::Event::PointerGone => memory.pointer = None,
            egui::Event::MouseWheel { unit, delta, .. } => {
                let own = |p: &Pos2| rect.contains(*p) && ui.ctx().layer_id_at(*p) == Some(ui.layer_id());
                if memory.pointer.as_ref().is_some_and(own) {
                    notches += if *unit == egui::MouseWheelUnit::Point { delta.y / 50.0 } else { delta.y };
                }
            }
            _ => {}
        }
    }
    notches
}

/// The object under a place of the window.
fn object_at(ui: &Ui, state: &State, p: Pos2, rect: Rect) -> Option<usize> {
    let shown = state.shown.as_ref()?;
    let eye = Eye::new(&state.navigator.camera(&shown.scene, state.size), state.size, [0.0; 2]);
    let density = ui.ctx().pixels_per_point();
    let (origin, direction) = pick::ray(&eye, [(p.x - rect.left()) * density, (p.y - rect.top()) * density]);
    pick::pick(&shown.scene, origin, direction).map(|(object, _)| object)
}

/// Moves the selected object with the pointer, parallel to the picture.
fn drag_object(state: &mut State, d: Vec2, rect: Rect) {
    let Some((object, shown)) = state.selected.zip(state.shown.as_ref()) else { return };
    let Some(instance) = shown.scene.instances.get(object) else { return };
    let Some((low, high)) = posed_bounds(instance, &shown.scene) else { return };
    let middle = 0.5 * (Vec3::from(low) + Vec3::from(high));
    let [right, up, forward] = state.navigator.axes();
    let distance = (middle - state.navigator.eye).dot(forward).max(1e-3 * state.navigator.scale);
    let metres = 2.0 * (0.5 * state.navigator.fov.to_radians()).tan() * distance / rect.height().max(1.0);
    state.apply(Action::Move((right * d.x - up * d.y) * metres));
}
