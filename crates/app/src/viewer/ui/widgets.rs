//! Widgets of the panel: numbers that hands change, and how wide lists are. A plain widget also
//! clamps what it only shows, and counts that as a change; these leave a value alone until somebody
//! drags, types or presses an arrow.

use egui::emath::Numeric;
use egui::{DragValue, Slider, SliderClamping, Ui};
use std::ops::RangeInclusive;

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
