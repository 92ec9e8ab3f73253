//! The help page: every key, what it does, and how things stand.

use crate::viewer::keys::{self, BINDINGS, With};
use crate::viewer::state::{Action, State};
use egui::{RichText, Ui};

/// What hands do that is no single key.
const HANDS: [(&str, &str); 9] = [
    ("drag", "orbit, or turn the head (G)"),
    ("right or middle drag", "slide"),
    ("wheel", "nearer, farther; flying: speed"),
    ("W A S D Q E", "fly, down, up; Shift: four times as fast"),
    ("arrows", "orbit; move the selected object"),
    ("click", "select an object"),
    ("Shift + drag", "move the object"),
    ("Ctrl + drag", "turn the sun"),
    ("drop a file", "scene, surroundings (.hdr, .exr), weights"),
];

/// Draws the page over the picture.
pub fn show(ui: &Ui, state: &mut State) {
    let mut open = true;
    let size = ui.ctx().content_rect().size();
    egui::Window::new("Keys and hands")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO)
        .show(ui.ctx(), |ui| {
            ui.set_min_width((size.x - 60.0).clamp(100.0, 800.0));
            egui::ScrollArea::both()
                .max_height(size.y - 90.0)
                .min_scrolled_height(size.y - 90.0)
                .max_width(size.x - 60.0)
                .show(ui, |ui| {
                    ui.horizontal_top(|ui| {
                        let half = (BINDINGS.len() + HANDS.len()).div_ceil(2);
                        for (i, part) in BINDINGS.chunks(half).enumerate() {
                            egui::Grid::new(("keys", i)).striped(true).num_columns(3).show(ui, |ui| {
                                for binding in part {
                                    let with = ["", "Shift + ", "Ctrl + "][match binding.with {
                                        With::Nothing => 0,
                                        With::Shift => 1,
                                        With::Ctrl => 2,
                                    }];
                                    ui.label(RichText::new(format!("{with}{}", binding.key.symbol_or_name())).strong());
                                    ui.label(binding.doc);
                                    ui.label(RichText::new(keys::current(binding, state)).italics());
                                    ui.end_row();
                                }
                                if i == 1 {
                                    for (hand, doc) in HANDS {
                                        ui.label(RichText::new(hand).strong());
                                        ui.label(doc);
                                        ui.label("");
                                        ui.end_row();
                                    }
                                }
                            });
                            ui.add_space(12.0);
                        }
                    });
                    ui.label(
                        "Tab goes from control to control, Space presses, arrows change numbers; Ctrl + and \
                    Ctrl − scale the text.",
                    );
                });
        });
    if !open {
        state.apply(Action::Help);
    }
}
