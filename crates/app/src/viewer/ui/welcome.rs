//! What is said to those who are new, and of what was added to their scene.

use super::{Facts, Memory};
use crate::viewer::state::{Action, State};
use egui::{Align2, Color32, RichText, Ui, Vec2};

/// A box over the picture.
fn card(ui: &Ui, name: &str, align: Align2, at: egui::Pos2, add: impl FnOnce(&mut Ui)) {
    let area = egui::Area::new(egui::Id::unique(name)).pivot(align).fixed_pos(at).fade_in(false);
    area.show(ui.ctx(), |ui| {
        ui.style_mut().visuals = egui::Visuals::dark();
        let frame = egui::Frame::new().fill(Color32::from_black_alpha(205)).corner_radius(5.0);
        frame.inner_margin(egui::Margin::symmetric(10, 6)).show(ui, add);
    });
}

/// Where there is no scene: how to get one. Once: how to look around. Where a sky was added: that.
pub(super) fn show(ui: &Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>, rect: egui::Rect) {
    if rect.width() < 220.0 || rect.height() < 120.0 {
        return;
    }
    if state.shown.is_none() && facts.jobs.is_empty() {
        card(ui, "empty", Align2::CENTER_CENTER, rect.center(), |ui| {
            ui.vertical_centered(|ui| {
                ui.label(RichText::new("Drop a .glb here, or").size(16.0));
                if ui.button("Open…").clicked() {
                    state.apply(Action::Browse(false));
                }
                if ui.button("Show the bundled interior").clicked() {
                    state.apply(Action::Open("interior".into()));
                }
            });
        });
        return;
    }
    let bottom = rect.center_bottom() - Vec2::new(0.0, 10.0);
    if state.shown.as_ref().is_some_and(|s| s.sky_added) {
        card(ui, "sky", Align2::CENTER_BOTTOM, bottom, |ui| {
            ui.horizontal(|ui| {
                ui.label("The file has no environment: a grey sky was added.");
                let response = ui.button("Remove it");
                memory.place("remove the sky", &response);
                if response.clicked() {
                    state.remove_sky();
                }
                if ui.button("Keep").clicked() {
                    state.keep_sky();
                }
            });
        });
    } else if !state.settings.greeted && state.shown.is_some() && !state.help {
        let text = if rect.width() > 560.0 {
            "Drag: orbit  ·  Right-drag: pan  ·  Wheel: zoom  ·  W A S D: move  ·  H: all controls"
        } else {
            "Drag: orbit · Wheel: zoom · H: all controls"
        };
        card(ui, "greeting", Align2::CENTER_BOTTOM, bottom, |ui| {
            ui.horizontal(|ui| {
                ui.label(text);
                let response = ui.button("Got it");
                memory.place("got it", &response);
                if response.clicked() {
                    state.settings.greeted = true;
                }
            });
        });
    }
}
