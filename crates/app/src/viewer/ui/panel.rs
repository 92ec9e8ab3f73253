//! The panel's sections: scene, method, view.

use super::widgets::{drag, press, slider, tick, wide};
use super::{Facts, Memory, camera, frontier, light, marks, source_box, times};
use crate::viewer::choice::{Side, Source, View};
use crate::viewer::rays;
use crate::viewer::state::{Action, NO_LINES, State};
use egui::{RichText, Ui, Vec2};

/// All of it, from top to bottom.
pub fn show(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    let mut section = |ui: &mut Ui, title: &str, open: bool, add: &mut dyn FnMut(&mut Ui, &mut Memory)| {
        let header = egui::CollapsingHeader::new(RichText::new(title).strong()).default_open(open);
        let shown = header.show(ui, |ui| add(ui, memory));
        memory.place(title, &shown.header_response);
        shown.fully_open()
    };
    section(ui, "Scene", true, &mut |ui, memory| scene(ui, state, memory));
    section(ui, "Method", true, &mut |ui, memory| method(ui, state, memory, facts));
    section(ui, "View", true, &mut |ui, _| camera::picture(ui, state, facts));
    section(ui, "Camera", false, &mut |ui, _| camera::camera(ui, state));
    let lamps = section(ui, "Lights", false, &mut |ui, memory| light::lights(ui, state, memory));
    state.lamps = lamps;
    section(ui, "Objects", false, &mut |ui, memory| light::objects(ui, state, memory));
    section(ui, "Performance", false, &mut |ui, memory| times::times(ui, state, memory, facts));
    section(ui, "Speed and accuracy", false, &mut |ui, memory| frontier::frontier(ui, state, memory, facts));
    section(ui, "Memory", false, &mut |ui, _| times::memory(ui, facts));
    section(ui, "Window", false, &mut |ui, _| camera::window(ui, state));
}

/// A scene's name as it is read: the file's own, and the folder that it lies in.
fn split(spec: &str) -> (&str, Option<&str>) {
    match spec.rfind(['/', '\\']) {
        Some(at) if at + 1 < spec.len() => (&spec[at + 1..], Some(&spec[..=at])),
        _ => (spec, None),
    }
}

/// The end of a path, which tells more than its beginning.
fn tail(text: &str, letters: usize) -> String {
    let count = text.chars().count();
    if count <= letters {
        text.into()
    } else {
        format!("…{}", text.chars().skip(count - letters).collect::<String>())
    }
}

fn scene(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    match &state.shown {
        Some(shown) => {
            let s = &shown.scene;
            let triangles: usize =
                s.instances.iter().filter_map(|i| Some(s.meshes.get(i.mesh)?.indices.len() / 3)).sum();
            let (name, folder) = split(&shown.spec);
            ui.add(egui::Label::new(RichText::new(name).strong()).truncate()).on_hover_text(&shown.spec);
            if let Some(folder) = folder {
                ui.add(egui::Label::new(RichText::new(tail(folder, 40)).weak().small()).truncate())
                    .on_hover_text(&shown.spec);
            }
            let count = |n: usize, one: &str| format!("{n} {one}{}", if n == 1 { "" } else { "s" });
            let [objects, triangles, lights] =
                [count(s.instances.len(), "object"), count(triangles, "triangle"), count(s.lights.len(), "light")];
            ui.label(format!("{objects}, {triangles}, {lights}"));
            if let Some(size) = shown.extent {
                let [x, y, z] = size.map(length);
                let told = "width, height and depth; if the file's unit is another than the metre, start with --scale";
                ui.label(RichText::new(format!("{x} × {y} × {z}")).weak()).on_hover_text(told);
            }
        }
        None => {
            ui.label("No scene yet");
        }
    }
    if let Some(shown) = &state.shown {
        let (names, variant, pose) = (shown.scene.variants.clone(), shown.variant, shown.pose);
        let ends = shown.original.rig.as_ref().map(|r| r.animations.iter().map(|a| (a.name.clone(), a.end)).collect());
        if !names.is_empty() {
            variants(ui, state, &names, variant);
        }
        if let Some(ends) = ends {
            camera::animation(ui, state, memory, ends, pose);
        }
    }
    ui.horizontal(|ui| {
        let told = "Choose a file (Ctrl O), or drop one into the window";
        press(ui, state, "Open…", told, Action::Browse(false));
        let hint = "file, interior, home:7";
        let room = (ui.available_width() - 56.0).max(40.0);
        let field = ui.add(egui::TextEdit::singleline(&mut memory.path).hint_text(hint).desired_width(room));
        let enter = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        let told = "Load what the field names: a file, a bundled scene or home:N";
        if (ui.button("Load").on_hover_text(told).clicked() || enter) && !memory.path.trim().is_empty() {
            state.apply(Action::Open(memory.path.trim().into()));
        }
    });
    let recent = state.settings.recent.clone();
    if recent.len() > 1 {
        egui::ComboBox::from_id_salt("recent").selected_text("Recent files").width(wide(ui)).show_ui(ui, |ui| {
            for spec in recent {
                if ui.selectable_label(false, tail(&spec, 44)).on_hover_text(&spec).clicked() {
                    state.apply(Action::Open(spec));
                }
            }
        });
    }
}

/// A length in the unit that is read best.
fn length(metres: f32) -> String {
    match metres {
        m if m >= 1000.0 => format!("{:.2} km", m / 1000.0),
        m if m >= 1.0 => format!("{m:.2} m"),
        m if m >= 0.01 => format!("{:.1} cm", 100.0 * m),
        m => format!("{:.2} mm", 1000.0 * m),
    }
}

fn variants(ui: &mut Ui, state: &mut State, names: &[String], now: Option<usize>) {
    let text = now.map_or("Materials: the file's", |n| &names[n]);
    egui::ComboBox::from_id_salt("variant").selected_text(text).width(wide(ui)).truncate().show_ui(ui, |ui| {
        if ui.selectable_label(now.is_none(), "the file's").clicked() {
            state.apply(Action::Variant(None));
        }
        for (n, name) in names.iter().enumerate() {
            if ui.selectable_label(now == Some(n), name).clicked() {
                state.apply(Action::Variant(Some(n)));
            }
        }
    });
}

/// A place for what is told and goes again, always as high, so that nothing below it moves.
pub(super) fn notice(ui: &mut Ui, text: Option<(String, egui::Color32)>) {
    let height = 2.0 * ui.text_style_height(&egui::TextStyle::Small) + 2.0;
    let size = Vec2::new(ui.available_width(), height);
    let (rect, response) = ui.allocate_exact_size(size, egui::Sense::hover());
    let Some((text, colour)) = text else { return };
    let mut job =
        egui::text::LayoutJob::simple(text.clone(), egui::TextStyle::Small.resolve(ui.style()), colour, size.x);
    job.wrap.max_rows = 2;
    let galley = ui.painter().layout_job(job);
    ui.painter().galley(rect.min, galley, colour);
    response.on_hover_text(text);
}

fn method(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    egui::Grid::new("method").num_columns(2).show(ui, |ui| {
        ui.label("Left").on_hover_text("What draws the picture, or its left side where it is split (M: next)");
        source_box(ui, "left", state, Side::Left);
        ui.end_row();
        let told = "Two methods side by side; drag the line, or [ and ] (X)";
        tick(ui, state.settings.split, state, "Split", told, Action::Split);
        source_box(ui, "right", state, Side::Right);
        ui.end_row();
        ui.label("Show").on_hover_text("The picture, or what it is made of (keys 1 to 9 and 0)");
        let mut view = state.settings.view;
        egui::ComboBox::from_id_salt("view").selected_text(view.title()).width(wide(ui)).show_ui(ui, |ui| {
            for v in View::ALL {
                let can = v != View::Wireframe || !state.no_lines;
                ui.add_enabled_ui(can, |ui| {
                    let entry = ui.selectable_value(&mut view, v, v.title());
                    entry.on_hover_text(v.doc()).on_disabled_hover_text(NO_LINES);
                });
            }
        });
        if view != state.settings.view {
            state.apply(Action::View(view));
        }
        ui.end_row();
        let traces = state.sources().into_iter().any(Source::gathers);
        ui.add_enabled_ui(traces, |ui| ui.label("Rays a frame")).response.on_hover_text(RAYS);
        ui.add_enabled_ui(traces, |ui| rays(ui, state, memory));
        ui.end_row();
    });
    let sides = [Side::Left, Side::Right].into_iter().take(state.sources().len());
    let waits = sides.filter(|side| facts.by[*side as usize].as_ref().is_some_and(|by| by.why.is_some()));
    let told: Vec<String> = waits.map(|side| format!("Drawn by {}", marks::name(state, facts, side))).collect();
    notice(ui, (!told.is_empty()).then(|| (told.join("; "), super::ORANGE)));
    if state.settings.view == View::Feature {
        ui.horizontal(|ui| {
            let (less, more) = (ui.button("<").clicked(), ui.button(">").clicked());
            if less || more {
                state.apply(Action::Feature(if more { 1 } else { -1 }));
            }
            let name = facts.feature.map_or("", |f| f.0);
            ui.add(egui::Label::new(name).truncate());
        });
    }
    if state.settings.view == View::Layer && !facts.layers.is_empty() {
        let now = state.settings.layer as usize % facts.layers.len();
        let text = |i: usize| format!("{}: {}", i + 1, facts.layers[i]);
        egui::ComboBox::from_id_salt("layer").selected_text(text(now)).width(wide(ui)).show_ui(ui, |ui| {
            for i in 0..facts.layers.len() {
                if ui.selectable_label(i == now, text(i)).clicked() {
                    state.settings.layer = i as u32;
                }
            }
        });
    }
    if [state.settings.left, state.settings.right].contains(&Source::Neural) {
        weights(ui, state, memory);
    }
    if state.wants_reference() {
        reference(ui, state, memory, facts);
    }
    if state.sources().len() == 2 {
        verdict(ui, state, facts);
    }
}

const RAYS: &str = "Share of one ray for each 4×4 pixels that a frame sends, of methods that trace rays. Few: faster frames, but \
    noise, and light that follows changes slowly. The first 33 frames of a view always send all.";

/// A place for each share; what is between them stands where it is nearest.
fn rays(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    ui.horizontal(|ui| {
        let mut place = rays::nearest(state.settings.rays);
        ui.spacing_mut().slider_width = (ui.available_width() - 56.0).clamp(30.0, 200.0);
        let response = ui.add(slider(&mut place, 0..=rays::SHARES.len() - 1).show_value(false));
        memory.place("rays", &response);
        if response.changed() {
            state.apply(Action::Rays(rays::SHARES[place]));
        }
        ui.label(rays::share(state.settings.rays));
        response.on_hover_text(RAYS).on_disabled_hover_text(RAYS);
    });
}

/// How far apart both sides are; as high as ever while nobody knows.
fn verdict(ui: &mut Ui, state: &State, facts: &Facts<'_>) {
    let v = facts.verdict.as_ref();
    let [left, right] =
        v.map_or([state.settings.left, state.settings.right], |v| v.by).map(|source| state.title(source));
    ui.add(egui::Label::new(RichText::new(format!("{left} against {right}")).strong()).truncate());
    let noise = facts.reference.and_then(|r| r.noise).unwrap_or(0.0);
    let noisy = v.is_some_and(|v| v.is_noise(noise));
    egui::Grid::new("verdict").num_columns(4).show(ui, |ui| {
        let rows = [
            ("PSNR", v.map(|v| format!("{:.2} dB", v.psnr)), "peak signal to noise of display values; more is better"),
            ("SSIM", v.map(|v| format!("{:.4}", v.ssim)), "structural similarity of display values; 1 is equal"),
            ("MAE", v.map(|v| format!("{:.4}", v.mae)), "mean absolute difference of display values"),
            ("relMSE", v.map(|v| format!("{:.4}", v.rel_mse)), "relative squared error of radiance"),
            ("bias", v.map(|v| format!("{:+.2} %", 100.0 * v.bias)), "mean radiance of the left against the right"),
        ];
        for (i, (name, value, told)) in rows.into_iter().enumerate() {
            ui.label(RichText::new(name).weak()).on_hover_text(told);
            let value = RichText::new(value.unwrap_or("–".into()));
            ui.label(if noisy { value.weak() } else { value }).on_hover_text(told);
            if i % 2 == 1 {
                ui.end_row();
            }
        }
    });
    let told = "Most of this is still the reference's noise.";
    ui.label(RichText::new(if noisy { told } else { "" }).weak().small());
}

/// Which network: the one that comes with the program, or a file.
fn weights(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    let now = state.settings.weights.clone();
    let name = now.as_ref().map_or("shipped".into(), |p| tail(&p.display().to_string(), 32));
    ui.horizontal(|ui| {
        ui.add(egui::Label::new(format!("Weights: {name}")).truncate());
        if now.is_some() {
            press(ui, state, "Shipped", "Back to those that come with the program", Action::Weights(None));
        }
    });
    ui.horizontal(|ui| {
        let room = (ui.available_width() - 40.0).max(40.0);
        ui.add(egui::TextEdit::singleline(&mut memory.weights).hint_text("weights.safetensors").desired_width(room));
        if ui.button("Use").clicked() && !memory.weights.trim().is_empty() {
            state.apply(Action::Weights(Some(memory.weights.trim().into())));
        }
    });
}

/// How far the path tracer is, in three lines at any time.
fn reference(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    ui.horizontal(|ui| {
        ui.label("Reference up to");
        let told = "The path tracer stops after so many samples a pixel";
        ui.add(drag(&mut state.settings.spp, 1..=65_536).suffix(" samples")).on_hover_text(told);
        let told = "Denoise for display; metrics use the noisy picture";
        let response = ui.checkbox(&mut state.settings.denoise, "Denoise").on_hover_text(told);
        memory.place("denoise", &response);
    });
    let r = facts.reference;
    ui.add(egui::ProgressBar::new(r.map_or(0.0, |r| r.share) as f32).desired_height(6.0));
    let text = r.map_or("waits until the view stops changing".into(), |r| {
        let noise = r.noise.filter(|n| n.is_finite());
        let noise = noise.map_or(String::new(), |n| format!(", noise {:.1} %", 100.0 * n));
        let coarse = if r.texel > 1 { format!(", 1/{} resolution", r.texel) } else { String::new() };
        format!("{}: {} samples{noise}{coarse}", if r.finished { "finished" } else { r.stage }, r.samples)
    });
    let told = "noise: standard deviation of a pixel as a share of the picture's mean";
    ui.add(egui::Label::new(text).truncate()).on_hover_text(told);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_path_the_end_is_seen() {
        assert_eq!(split("/a/b/house.glb"), ("house.glb", Some("/a/b/")));
        assert_eq!((split("interior"), split("c:\\x\\y.obj").0), (("interior", None), "y.obj"));
        assert_eq!(tail("/home/somebody/scenes/house.glb", 10), "…/house.glb");
        assert_eq!(["3.00 m", "12.00 km", "4.0 cm"].map(String::from), [3.0, 12_000.0, 0.04].map(length));
    }
}
