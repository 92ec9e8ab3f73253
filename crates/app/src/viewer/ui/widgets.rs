//! Widgets of the panel: buttons, boxes and lists that ask the state for something, numbers that hands
//! change. A plain widget also clamps a number that it only shows, and counts that as a change; these
//! leave a value alone until somebody drags, types or presses an arrow.

use crate::viewer::state::{Action, State};
use egui::emath::Numeric;
use egui::{DragValue, Slider, SliderClamping, Ui};
use std::ops::RangeInclusive;

/// A button that asks for `action`.
pub fn press(ui: &mut Ui, state: &mut State, text: &str, told: &str, action: Action) {
    if ui.button(text).on_hover_text(told).clicked() {
        state.apply(action);
    }
}

/// A box for what is `on` or off, which `action` changes.
pub fn tick(ui: &mut Ui, mut on: bool, state: &mut State, text: &str, told: &str, action: Action) {
    if ui.checkbox(&mut on, text).on_hover_text(told).changed() {
        state.apply(action);
    }
}

/// A list of which `now` is chosen; another one that a hand takes.
pub fn choose<T: Copy + PartialEq>(ui: &mut Ui, id: &str, now: T, all: &[T], name: fn(T) -> &'static str) -> Option<T> {
    let mut chosen = now;
    egui::ComboBox::from_id_salt(id).selected_text(name(now)).width(wide(ui)).show_ui(ui, |ui| {
        for &one in all {
            ui.selectable_value(&mut chosen, one, name(one));
        }
    });
    (chosen != now).then_some(chosen)
}

/// A number to drag or type.
pub fn drag<N: Numeric>(value: &mut N, range: RangeInclusive<N>) -> DragValue<'_> {
    DragValue::new(value).range(range).clamp_existing_to_range(false)
}

/// A slider.
pub fn slider<N: Numeric>(value: &mut N, range: RangeInclusive<N>) -> Slider<'_> {
    Slider::new(value, range).clamping(SliderClamping::Edits)
}

/// Width of a list that takes the rest of the line, its arrow included.
pub fn wide(ui: &Ui) -> f32 {
    (ui.available_width() - 12.0).max(60.0)
}
