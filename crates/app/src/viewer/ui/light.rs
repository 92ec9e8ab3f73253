//! Lights and objects: listed, and changed in place.

use super::widgets::{drag, press, slider};
use super::{Memory, ORANGE, SKY};
use crate::viewer::state::{Action, State, angles, from_angles};
use bouncelight::scene::LightKind;
use bouncelight_scene::edit::{LightEdit, NewLight};
use egui::{Color32, RichText, Sense, Stroke, Ui, Vec2};
use glam::Vec3;

/// Sun, surroundings, and the list of lights.
pub fn lights(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    let Some(shown) = &state.shown else { return };
    let lights = shown.scene.lights.clone();
    let environment = shown.scene.environment.clone();
    let (own, turn) = (lights.len() - shown.added, shown.sky.as_ref().map(|s| s.1));
    if let Some(sun) = state.sun()
        && let LightKind::Directional { direction, .. } = lights[sun].kind
        && let Some(direction) = sky_disc(ui, direction)
    {
        state.apply(Action::Light(LightEdit { light: sun, direction: Some(direction), ..LightEdit::default() }));
    }
    for (i, light) in lights.iter().enumerate() {
        let kind = match light.kind {
            LightKind::Directional { .. } => "sun",
            LightKind::Point { .. } => "point",
            LightKind::Spot { .. } => "spot",
        };
        let name = if light.name.is_empty() { kind.to_string() } else { format!("{} ({kind})", light.name) };
        let header = egui::CollapsingHeader::new(format!("{i}: {name}")).id_salt(("light", i)).default_open(i == 0);
        let shown = header.show(ui, |ui| {
            if light.is_emissive_proxy {
                ui.label(
                    RichText::new(
                        "an emissive proxy: it replaces an emissive surface for methods that cannot see emission",
                    )
                    .weak(),
                );
            }
            if let Some(edit) = light_grid(ui, i, &LightEdit::of(i, light)) {
                state.apply(Action::Light(edit));
            }
            let told =
                if i >= own { "takes it away" } else { "switches it off: lights of the file keep their numbers" };
            press(ui, state, "Remove", told, Action::RemoveLight(i));
        });
        memory.place(&format!("light {i}"), &shown.header_response);
    }
    ui.horizontal(|ui| {
        ui.label("Add");
        for kind in NewLight::ALL {
            if ui.button(kind.name()).clicked() {
                state.apply(Action::AddLight(kind));
            }
        }
    });
    ui.separator();
    match &environment.image {
        Some(image) => {
            ui.add(egui::Label::new(format!("Environment: {}", image.name)).truncate());
            if let Some(mut turn) = turn {
                let slider = slider(&mut turn, -180.0..=180.0).suffix("°").text("rotation");
                if ui.add(slider).changed() {
                    state.apply(Action::TurnSky(turn));
                }
            }
        }
        None => {
            let mut grey = environment.radiance.iter().sum::<f32>() / 3.0;
            let slider = slider(&mut grey, 0.0..=10.0).logarithmic(true).smallest_positive(0.001);
            if ui.add(slider.text("Sky, W/(m²·sr)")).changed() {
                state.apply(Action::Sky(grey));
            }
        }
    }
    ui.horizontal(|ui| {
        press(ui, state, "Load environment…", "A lat-long picture: .hdr or .exr", Action::Browse(true));
        let told = "Lights, objects and environment as the file has them, and all rays (U)";
        press(ui, state, "Reset", told, Action::Reset);
    });
}

/// Controls of one light; the change if there was one.
fn light_grid(ui: &mut Ui, light: usize, now: &LightEdit) -> Option<LightEdit> {
    let none = LightEdit { light, ..LightEdit::default() };
    let mut edit = None;
    egui::Grid::new(("light", light)).num_columns(2).show(ui, |ui| {
        let is_sun = now.position.is_none();
        if let Some(mut strength) = now.strength {
            ui.label("Intensity").on_hover_text(if is_sun {
                "irradiance on a surface that faces it"
            } else {
                "radiant intensity"
            });
            let speed = 0.01 * f64::from(strength.max(0.01));
            let unit = if is_sun { " W/m²" } else { " W/sr" };
            if ui.add(drag(&mut strength, 0.0..=1e6).speed(speed).suffix(unit)).changed() {
                edit = Some(LightEdit { strength: Some(strength), ..none.clone() });
            }
            ui.end_row();
        }
        if let Some(mut color) = now.color {
            ui.label("Colour");
            if ui.color_edit_button_rgb(&mut color).changed() {
                edit = Some(LightEdit { color: Some(color), ..none.clone() });
            }
            ui.end_row();
        }
        if let Some(mut size) = now.size {
            ui.label(if is_sun { "Angular diameter" } else { "Radius" }).on_hover_text("larger is softer shadows");
            let mut shown = if is_sun { size.to_degrees() } else { size };
            let field = drag(&mut shown, 0.0..=if is_sun { 90.0 } else { 100.0 });
            let field = if is_sun { field.speed(0.05).suffix("°") } else { field.speed(0.002).suffix(" m") };
            if ui.add(field.max_decimals(3)).changed() {
                size = if is_sun { shown.to_radians() } else { shown };
                edit = Some(LightEdit { size: Some(size), ..none.clone() });
            }
            ui.end_row();
        }
        if let Some(direction) = now.direction {
            let [mut azimuth, mut height] = angles(direction).map(f32::to_degrees);
            ui.label("Direction").on_hover_text("where it comes from, clockwise from +Z seen from above");
            let a = ui.add(drag(&mut azimuth, -360.0..=360.0).speed(0.5).suffix("°").max_decimals(1));
            ui.end_row();
            ui.label("Elevation").on_hover_text("of where it comes from, above the horizon");
            let h = ui.add(drag(&mut height, -90.0..=90.0).speed(0.5).suffix("°").max_decimals(1));
            if a.changed() || h.changed() {
                let direction = from_angles([azimuth.to_radians(), height.to_radians()]);
                edit = Some(LightEdit { direction: Some(direction), ..none.clone() });
            }
            ui.end_row();
        }
        if let Some(mut position) = now.position {
            ui.label("Position");
            if three(ui, &mut position) {
                edit = Some(LightEdit { position: Some(position), ..none.clone() });
            }
            ui.end_row();
        }
    });
    edit
}

fn three(ui: &mut Ui, v: &mut [f32; 3]) -> bool {
    ui.horizontal(|ui| {
        let number = |ui: &mut Ui, v: &mut f32| ui.add(egui::DragValue::new(v).speed(0.01).max_decimals(3)).changed();
        v.iter_mut().fold(false, |any, v| number(ui, v) | any)
    })
    .inner
}

/// The sky from above: the middle is straight up, the rim the horizon. Dragging moves the sun; the
/// new direction of its light.
fn sky_disc(ui: &mut Ui, direction: [f32; 3]) -> Option<[f32; 3]> {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(120.0), Sense::click_and_drag());
    let (middle, radius) = (rect.center(), 0.5 * rect.width() - 8.0);
    let painter = ui.painter();
    let line = ui.visuals().weak_text_color();
    for share in [1.0, 2.0 / 3.0, 1.0 / 3.0] {
        painter.circle_stroke(middle, radius * share, Stroke::new(1.0, line));
    }
    let [azimuth, height] = angles(direction);
    let place = |azimuth: f32, height: f32| {
        let r = radius * (1.0 - height.max(0.0) / std::f32::consts::FRAC_PI_2);
        middle + r * Vec2::new(azimuth.sin(), azimuth.cos())
    };
    let sun = place(azimuth, height);
    painter.circle_filled(sun, 6.0, if height >= 0.0 { ORANGE } else { Color32::DARK_GRAY });
    painter.circle_stroke(sun, 6.0, Stroke::new(1.5, if response.has_focus() { SKY } else { line }));
    let response = response.on_hover_text("drag the sun: middle up, rim horizon, down is +Z");
    let place = response.interact_pointer_pos().filter(|_| response.is_pointer_button_down_on())?;
    let d: Vec2 = place - middle;
    let height = (1.0 - (d.length() / radius).min(1.0)) * std::f32::consts::FRAC_PI_2;
    let azimuth = if d.length() < 1e-3 { azimuth } else { d.x.atan2(d.y) };
    Some(from_angles([azimuth, height.max(0.01)]))
}

/// Objects, and where the selected one stands.
pub fn objects(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    let Some(shown) = &state.shown else { return };
    let names: Vec<String> = shown.scene.instances.iter().map(|i| i.name.clone()).collect();
    if let Some(object) = state.selected {
        let by = Vec3::from(shown.moved.get(&object).copied().unwrap_or_default());
        ui.label(RichText::new(format!("{object}: {}", names.get(object).map_or("", |n| n))).strong());
        let mut moved = by.to_array();
        ui.horizontal(|ui| {
            if ui.small_button("To floor").on_hover_text("Set down on what lies below (End)").clicked() {
                state.apply(Action::Floor);
            }
            ui.label("Offset").on_hover_text("from where the file has it, metres");
            if three(ui, &mut moved) {
                state.apply(Action::Move(Vec3::from(moved) - by));
            }
        });
    } else {
        ui.label(RichText::new("Click an object in the picture, or here").weak());
        ui.label("");
    }
    ui.add(egui::TextEdit::singleline(&mut memory.search).hint_text("search").desired_width(f32::INFINITY));
    let wanted = memory.search.trim().to_lowercase();
    let found: Vec<usize> = (0..names.len()).filter(|&i| names[i].to_lowercase().contains(&wanted)).collect();
    egui::ScrollArea::vertical().max_height(140.0).id_salt("objects").show_rows(ui, 18.0, found.len(), |ui, rows| {
        for &i in &found[rows] {
            let name = if names[i].is_empty() { "object" } else { &names[i] };
            if ui.selectable_label(state.selected == Some(i), format!("{i}: {name}")).clicked() {
                state.apply(Action::Select(Some(i)));
            }
        }
    });
}
