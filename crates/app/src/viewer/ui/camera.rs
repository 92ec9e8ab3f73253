//! The panel's sections for how one looks: picture, camera, animation, window.

use super::widgets::{choose, drag, press, slider, tick, wide};
use super::{Facts, Memory};
use crate::viewer::film::Film;
use crate::viewer::navigate::Preset;
use crate::viewer::state::{Action, State};
use bouncelight::render::{Backdrop, tonemap_curve::Tonemap};
use egui::{RichText, Ui};

pub(super) fn picture(ui: &mut Ui, state: &mut State, facts: &Facts<'_>) {
    egui::Grid::new("picture").num_columns(2).show(ui, |ui| {
        ui.label("Exposure").on_hover_text("In stops (EV): darker , and brighter .");
        let mut ev = state.stops();
        ui.horizontal(|ui| {
            ui.spacing_mut().slider_width = (ui.available_width() - 130.0).clamp(30.0, 200.0);
            if ui.add(slider(&mut ev, -8.0..=8.0).suffix(" EV").max_decimals(2)).changed() {
                state.apply(Action::Exposure(ev));
            }
            let told = "Measured when accumulation ends after a change of the scene (Shift .)";
            tick(ui, state.auto_exposure, state, "Auto", told, Action::AutoExposure);
        });
        ui.end_row();
        ui.label("Tonemap").on_hover_text("How radiance becomes what a screen can show (T)");
        let kind = choose(ui, "tonemap", state.settings.tonemap, &Tonemap::ALL, |t| t.name());
        kind.into_iter().for_each(|kind| state.apply(Action::Tonemap(Some(kind))));
        ui.end_row();
        ui.label("Background").on_hover_text("The environment where nothing is hit; it lights the scene in any case");
        let backdrop = choose(ui, "backdrop", state.settings.backdrop, &Backdrop::ALL, |b| b.name());
        backdrop.into_iter().for_each(|backdrop| state.apply(Action::Backdrop(backdrop)));
        ui.end_row();
        ui.label("Accumulate");
        let mut samples = state.settings.samples;
        let words = if samples == 1 { " frame when still" } else { " frames when still" };
        let field = drag(&mut samples, 1..=4096).suffix(words);
        let told = "Frames averaged while nothing moves: smooth edges, soft shadows. A method with a history settles \
            for 31 frames before.";
        if ui.add(field).on_hover_text(told).changed() {
            state.apply(Action::Samples(samples));
        }
        ui.end_row();
    });
    let [still, all] = facts.still;
    ui.add(egui::ProgressBar::new(still as f32 / all.max(1) as f32).desired_height(4.0));
    let told =
        "Every second pixel of each row and column while the view moves, where a frame takes more than 50 ms (Z)";
    tick(ui, state.settings.coarse, state, "Half resolution while moving", told, Action::Coarse);
    ui.horizontal_wrapped(|ui| {
        let told = "Write what is seen on the left, without the panel (F12)";
        press(ui, state, "PNG", told, Action::Capture { exr: false });
        let told = "The same as radiance, with Blender's layers (Shift F12)";
        press(ui, state, "EXR", told, Action::Capture { exr: true });
        let told = "Copy the `bouncelight render` line that draws this very view (K)";
        press(ui, state, "Copy as command", told, Action::CopyCommand);
    });
}

pub(super) fn animation(
    ui: &mut Ui,
    state: &mut State,
    memory: &mut Memory,
    all: Vec<(String, f32)>,
    pose: Option<(usize, f32)>,
) {
    let (now, mut time) = pose.unwrap_or_default();
    ui.horizontal(|ui| {
        let text = if state.animated.is_some() { "Pause" } else { "Play" };
        let button = egui::Button::new(text).min_size(egui::Vec2::new(48.0, 0.0));
        if ui.add(button).on_hover_text("Play or pause the animation (I)").clicked() {
            state.apply(Action::Animate);
        }
        let name = all.get(now).map_or("", |a| &a.0);
        egui::ComboBox::from_id_salt("animation").selected_text(name).width(wide(ui)).truncate().show_ui(ui, |ui| {
            for (n, (name, _)) in all.iter().enumerate() {
                if ui.selectable_label(n == now, name).clicked() {
                    state.apply(Action::Pose(Some((n, 0.0))));
                }
            }
        });
    });
    let end = all.get(now).map_or(0.0, |a| a.1);
    ui.spacing_mut().slider_width = (ui.available_width() - 70.0).max(40.0);
    let response = ui.add(slider(&mut time, 0.0..=end).suffix(" s").fixed_decimals(2));
    memory.place("animation time", &response);
    if response.changed() {
        state.apply(Action::Pose(Some((now, time))));
    }
    ui.horizontal(|ui| {
        let mut playback = state.playback;
        let speed = drag(&mut playback.speed, 0.05..=8.0).speed(0.01).prefix("Speed × ");
        ui.add(speed).on_hover_text("Seconds of the animation a second");
        ui.checkbox(&mut playback.again, "Loop");
        if playback != state.playback {
            state.apply(Action::Playback(playback));
        }
        let posed = state.shown.as_ref().is_some_and(|s| s.pose.is_some());
        let told = "Objects as the file places them without any animation";
        if ui.add_enabled(posed, egui::Button::new("Reset pose")).on_hover_text(told).clicked() {
            state.apply(Action::Pose(None));
        }
    });
}

pub(super) fn camera(ui: &mut Ui, state: &mut State) {
    ui.horizontal_wrapped(|ui| {
        press(ui, state, "Fit", "All of the scene in view (F)", Action::Fit);
        for preset in Preset::ALL {
            let told = "The whole scene from this side (V: the next one)";
            press(ui, state, preset.title(), told, Action::Preset(preset));
        }
    });
    let cameras: Vec<String> = state.shown.iter().flat_map(|s| &s.scene.cameras).map(|c| c.name.clone()).collect();
    let now = state
        .navigator
        .file_camera
        .map_or("Free camera".into(), |n| format!("{n}: {}", cameras.get(n).map_or("", |c| c)));
    egui::ComboBox::from_id_salt("camera").selected_text(now).width(wide(ui)).truncate().show_ui(ui, |ui| {
        for (n, name) in cameras.iter().enumerate() {
            if ui.selectable_label(state.navigator.file_camera == Some(n), format!("{n}: {name}")).clicked() {
                state.apply(Action::Camera(n));
            }
        }
    });
    ui.horizontal(|ui| {
        let mut fly = state.navigator.fly;
        ui.selectable_value(&mut fly, false, "Orbit").on_hover_text("Drags turn around what is looked at (G)");
        ui.selectable_value(&mut fly, true, "Look around").on_hover_text("Drags turn the head; W A S D move (G)");
        state.navigator.fly = fly;
        let (least, most) = (1e-3 * state.navigator.scale, 1e5 * state.navigator.scale);
        let step = f64::from(0.02 * state.navigator.scale);
        let speed = &mut state.navigator.speed;
        ui.add(drag(speed, least..=most).speed(step).max_decimals(6).suffix(" m/s"))
            .on_hover_text("How fast W A S D Q E move; the wheel changes it while looking around");
    });
    let told = "A lens of 2° from far away, through which parallels stay nearly parallel (O)";
    tick(ui, state.navigator.is_long(), state, "Near-orthographic", told, Action::LongLens);
    let mut fov = state.navigator.fov;
    ui.spacing_mut().slider_width = (ui.available_width() - 150.0).max(40.0);
    let field = slider(&mut fov, 1.0..=150.0).text("Field of view").suffix("°").max_decimals(1);
    if ui.add(field).on_hover_text("From bottom to top").changed() {
        state.navigator.fov = fov;
        state.navigator.file_camera = None;
    }
    ui.horizontal(|ui| {
        let records = matches!(state.film, Film::Records(_));
        let told = "Record how the camera is moved until this is pressed again, and write it to a file (R)";
        press(ui, state, if records { "Stop recording" } else { "Record path" }, told, Action::Record);
        let plays = matches!(state.film, Film::Plays { .. });
        let button = egui::Button::new(if plays { "Stop" } else { "Play path" });
        if ui.add_enabled(state.path.is_some(), button).on_hover_text("Play the recorded or dropped path (Y)").clicked()
        {
            state.apply(Action::Play);
        }
    });
    let e = state.navigator.eye;
    ui.label(RichText::new(format!("Position {:.2}, {:.2}, {:.2}", e.x, e.y, e.z)).weak());
}

pub(super) fn window(ui: &mut Ui, state: &mut State) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut state.settings.dark, true, "Dark");
        ui.selectable_value(&mut state.settings.dark, false, "Light");
        let mut zoom = state.settings.zoom;
        let field = drag(&mut zoom, 0.5..=4.0).speed(0.02).prefix("UI scale ").update_while_editing(false);
        if ui.add(field).on_hover_text("Ctrl + and Ctrl −").changed() {
            state.settings.zoom = zoom;
        }
    });
    tick(ui, state.full_screen, state, "Full screen", "F11", Action::FullScreen);
    let told = "Draw frame after frame, also where nothing changes; the live reference pauses meanwhile (B)";
    tick(ui, state.measure, state, "Continuous rendering (benchmark)", told, Action::Measure);
}
