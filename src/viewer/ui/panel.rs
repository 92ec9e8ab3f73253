//! The panel's controls.

use super::{Facts, Memory, frontier, light, source_box, times};
use crate::render::{Backdrop, tonemap_curve::Tonemap};
use crate::viewer::choice::{Side, Source, View};
use crate::viewer::film::Film;
use crate::viewer::navigate::Preset;
use crate::viewer::state::{Action, NO_LINES, State};
use egui::{RichText, Ui};

/// All of it, from top to bottom.
pub fn show(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    let mut room = |ui: &mut Ui, title: &str, open: bool, add: &mut dyn FnMut(&mut Ui, &mut Memory)| {
        let header = egui::CollapsingHeader::new(RichText::new(title).strong()).default_open(open);
        let shown = header.show(ui, |ui| add(ui, memory));
        memory.place(title, &shown.header_response);
    };
    room(ui, "Scene", true, &mut |ui, memory| scene(ui, state, memory));
    room(ui, "Method", true, &mut |ui, memory| method(ui, state, memory, facts));
    room(ui, "Picture", true, &mut |ui, _| picture(ui, state));
    room(ui, "Camera", false, &mut |ui, _| camera(ui, state));
    room(ui, "Light", false, &mut |ui, _| light::lights(ui, state));
    room(ui, "Objects", false, &mut |ui, _| light::objects(ui, state));
    room(ui, "Times", false, &mut |ui, memory| times::times(ui, state, memory, facts));
    room(ui, "Speed and accuracy", false, &mut |ui, memory| frontier::frontier(ui, state, memory, facts));
    room(ui, "GPU memory", false, &mut |ui, _| times::memory(ui, facts));
    room(ui, "Window", false, &mut |ui, _| window(ui, state));
}

fn scene(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    match &state.shown {
        Some(shown) => {
            let s = &shown.scene;
            let triangles: usize =
                s.instances.iter().filter_map(|i| Some(s.meshes.get(i.mesh)?.indices.len() / 3)).sum();
            ui.add(egui::Label::new(RichText::new(&shown.spec).strong()).truncate());
            ui.label(format!("{} objects, {triangles} triangles, {} lights", s.instances.len(), s.lights.len()));
        }
        None => {
            ui.label("no scene yet");
        }
    }
    if let Some(shown) = &state.shown {
        let (names, variant, pose) = (shown.scene.variants.clone(), shown.variant, shown.pose);
        let ends = shown.original.rig.as_ref().map(|r| r.animations.iter().map(|a| (a.name.clone(), a.end)).collect());
        if !names.is_empty() {
            variants(ui, state, &names, variant);
        }
        if let Some(ends) = ends {
            animation(ui, state, ends, pose);
        }
    }
    ui.horizontal(|ui| {
        let hint = "file, interior, home:7";
        let field = ui.add(egui::TextEdit::singleline(&mut memory.path).hint_text(hint).desired_width(170.0));
        if ui.button("…").on_hover_text("choose a file (Ctrl O)").clicked() {
            state.apply(Action::Browse(false));
        }
        let enter = field.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter));
        if (ui.button("Open").clicked() || enter) && !memory.path.trim().is_empty() {
            state.apply(Action::Open(memory.path.trim().into()));
        }
    });
    let recent = state.settings.recent.clone();
    if recent.len() > 1 {
        egui::ComboBox::from_id_salt("recent").selected_text("recent").width(200.0).show_ui(ui, |ui| {
            for spec in recent {
                if ui.selectable_label(false, &spec).clicked() {
                    state.apply(Action::Open(spec));
                }
            }
        });
    }
}

fn variants(ui: &mut Ui, state: &mut State, names: &[String], now: Option<usize>) {
    let text = now.map_or("materials: the file's", |n| &names[n]);
    egui::ComboBox::from_id_salt("variant").selected_text(text).width(240.0).truncate().show_ui(ui, |ui| {
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

fn animation(ui: &mut Ui, state: &mut State, all: Vec<(String, f32)>, pose: Option<(usize, f32)>) {
    let (now, mut time) = pose.unwrap_or_default();
    ui.horizontal(|ui| {
        let text = if state.animated.is_some() { "Pause (I)" } else { "Play (I)" };
        if ui.button(text).clicked() {
            state.apply(Action::Animate);
        }
        let name = all.get(now).map_or("", |a| &a.0);
        egui::ComboBox::from_id_salt("animation").selected_text(name).width(150.0).truncate().show_ui(ui, |ui| {
            for (n, (name, _)) in all.iter().enumerate() {
                if ui.selectable_label(n == now, name).clicked() {
                    state.apply(Action::Pose(Some((n, 0.0))));
                }
            }
        });
    });
    let end = all.get(now).map_or(0.0, |a| a.1);
    if ui.add(egui::Slider::new(&mut time, 0.0..=end).suffix(" s").max_decimals(2)).changed() {
        state.apply(Action::Pose(Some((now, time))));
    }
    ui.horizontal(|ui| {
        let mut playback = state.playback;
        let speed = egui::DragValue::new(&mut playback.speed).range(0.05..=8.0).speed(0.01).prefix("speed × ");
        ui.add(speed).on_hover_text("seconds of the animation a second");
        ui.checkbox(&mut playback.again, "loop");
        if playback != state.playback {
            state.apply(Action::Playback(playback));
        }
        if ui.add_enabled(state.shown.as_ref().is_some_and(|s| s.pose.is_some()), egui::Button::new("Rest")).clicked() {
            state.apply(Action::Pose(None));
        }
    });
}

fn method(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    egui::Grid::new("method").num_columns(2).show(ui, |ui| {
        ui.label("Left");
        source_box(ui, "left", state, Side::Left);
        ui.end_row();
        let mut split = state.settings.split;
        if ui.checkbox(&mut split, "Split").changed() {
            state.apply(Action::Split);
        }
        source_box(ui, "right", state, Side::Right);
        ui.end_row();
        ui.label("Show");
        let mut view = state.settings.view;
        egui::ComboBox::from_id_salt("view").selected_text(view.name()).width(130.0).show_ui(ui, |ui| {
            for v in View::ALL {
                let can = v != View::Wireframe || !state.no_lines;
                ui.add_enabled_ui(can, |ui| {
                    let entry = ui.selectable_value(&mut view, v, v.name());
                    entry.on_hover_text(v.doc()).on_disabled_hover_text(NO_LINES);
                });
            }
        });
        if view != state.settings.view {
            state.apply(Action::View(view));
        }
        ui.end_row();
    });
    if let Some((method, why)) = facts.instead {
        let asked = state.settings.left.name();
        ui.label(RichText::new(format!("`{method}` draws in the place of `{asked}`: {why}")).color(super::ORANGE));
    }
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
        egui::ComboBox::from_id_salt("layer").selected_text(text(now)).width(240.0).show_ui(ui, |ui| {
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
        reference(ui, state, facts);
    }
    if let Some(v) = facts.verdict {
        let (left, right) = (state.settings.left.name(), state.settings.right.name());
        ui.label(RichText::new(format!("{left} against {right}")).strong());
        egui::Grid::new("verdict").num_columns(4).show(ui, |ui| {
            for (name, value) in [
                ("PSNR", format!("{:.2} dB", v.psnr)),
                ("SSIM", format!("{:.4}", v.ssim)),
                ("MAE", format!("{:.4}", v.mae)),
                ("relMSE", format!("{:.4}", v.rel_mse)),
                ("bias", format!("{:+.2} %", 100.0 * v.bias)),
            ] {
                ui.label(RichText::new(name).weak());
                ui.label(value);
                if ["SSIM", "relMSE"].contains(&name) {
                    ui.end_row();
                }
            }
        });
    }
}

/// Which network: the one that comes with the program, or a file.
fn weights(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    let now = state.settings.weights.clone();
    let text = now.as_ref().map_or("weights: default".into(), |p| format!("weights: {}", p.display()));
    ui.horizontal(|ui| {
        ui.add(egui::Label::new(text).truncate());
        if now.is_some() && ui.button("Default").clicked() {
            state.apply(Action::Weights(None));
        }
    });
    ui.horizontal(|ui| {
        ui.add(egui::TextEdit::singleline(&mut memory.weights).hint_text("weights.safetensors").desired_width(200.0));
        if ui.button("Use").clicked() && !memory.weights.trim().is_empty() {
            state.apply(Action::Weights(Some(memory.weights.trim().into())));
        }
    });
}

fn reference(ui: &mut Ui, state: &mut State, facts: &Facts<'_>) {
    ui.horizontal(|ui| {
        ui.label("Reference up to");
        ui.add(egui::DragValue::new(&mut state.settings.spp).range(1..=65_536).suffix(" samples"));
    });
    if let Some(r) = facts.reference {
        let noise = r
            .noise
            .filter(|n| n.is_finite())
            .map_or(String::new(), |n| format!(", noise of a pixel {:.1} %", 100.0 * n));
        let coarse = if r.texel > 1 { format!(", at 1/{} of the resolution", r.texel) } else { String::new() };
        let stage = if r.finished { "finished" } else { r.stage };
        ui.add(egui::ProgressBar::new(r.share as f32).desired_height(6.0));
        ui.label(format!("{stage}: {} samples{noise}{coarse}", r.samples));
    }
}

fn picture(ui: &mut Ui, state: &mut State) {
    egui::Grid::new("picture").num_columns(2).show(ui, |ui| {
        ui.label("Exposure");
        let mut ev = state.stops();
        ui.horizontal(|ui| {
            ui.spacing_mut().slider_width = 70.0;
            if ui.add(egui::Slider::new(&mut ev, -8.0..=8.0).suffix(" EV").max_decimals(2)).changed() {
                state.apply(Action::Exposure(ev));
            }
            let mut auto = state.auto_exposure;
            let told = "measured whenever the picture comes to rest after a change of the scene (Shift .)";
            if ui.checkbox(&mut auto, "auto").on_hover_text(told).changed() {
                state.apply(Action::AutoExposure);
            }
        });
        ui.end_row();
        ui.label("Tonemap");
        let mut kind = state.settings.tonemap;
        egui::ComboBox::from_id_salt("tonemap").selected_text(kind.name()).show_ui(ui, |ui| {
            for t in Tonemap::ALL {
                ui.selectable_value(&mut kind, t, t.name());
            }
        });
        if kind != state.settings.tonemap {
            state.apply(Action::Tonemap(Some(kind)));
        }
        ui.end_row();
        ui.label("Backdrop");
        let mut backdrop = state.settings.backdrop;
        egui::ComboBox::from_id_salt("backdrop").selected_text(backdrop.name()).show_ui(ui, |ui| {
            for b in Backdrop::ALL {
                ui.selectable_value(&mut backdrop, b, b.name());
            }
        });
        if backdrop != state.settings.backdrop {
            state.apply(Action::Backdrop(backdrop));
        }
        ui.end_row();
        ui.label("Average");
        let mut samples = state.settings.samples;
        let drag = egui::DragValue::new(&mut samples).range(1..=4096).suffix(" frames at rest");
        if ui.add(drag).on_hover_text("frames averaged while nothing moves: smooth edges, soft shadows").changed() {
            state.apply(Action::Samples(samples));
        }
        ui.end_row();
    });
    let mut coarse = state.settings.coarse;
    let told = "where a frame takes more than 50 ms (Z)";
    if ui.checkbox(&mut coarse, "half the resolution while moving").on_hover_text(told).changed() {
        state.apply(Action::Coarse);
    }
    ui.horizontal_wrapped(|ui| {
        if ui.button("PNG (F12)").clicked() {
            state.apply(Action::Capture { exr: false });
        }
        if ui.button("EXR (Shift F12)").clicked() {
            state.apply(Action::Capture { exr: true });
        }
        if ui.button("Copy as command (K)").clicked() {
            state.apply(Action::CopyCommand);
        }
    });
}

fn camera(ui: &mut Ui, state: &mut State) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("Fit").clicked() {
            state.apply(Action::Fit);
        }
        for preset in Preset::ALL {
            if ui.button(preset.name()).clicked() {
                state.apply(Action::Preset(preset));
            }
        }
    });
    let cameras: Vec<String> = state.shown.iter().flat_map(|s| &s.scene.cameras).map(|c| c.name.clone()).collect();
    let now =
        state.navigator.file_camera.map_or("moved".into(), |n| format!("{n}: {}", cameras.get(n).map_or("", |c| c)));
    egui::ComboBox::from_id_salt("camera").selected_text(now).width(200.0).show_ui(ui, |ui| {
        for (n, name) in cameras.iter().enumerate() {
            if ui.selectable_label(state.navigator.file_camera == Some(n), format!("{n}: {name}")).clicked() {
                state.apply(Action::Camera(n));
            }
        }
    });
    ui.horizontal(|ui| {
        let mut fly = state.navigator.fly;
        ui.selectable_value(&mut fly, false, "orbit");
        ui.selectable_value(&mut fly, true, "fly");
        state.navigator.fly = fly;
        let (least, most) = (1e-3 * state.navigator.scale, 1e5 * state.navigator.scale);
        let drag = f64::from(0.02 * state.navigator.scale);
        let speed = &mut state.navigator.speed;
        ui.add(egui::DragValue::new(speed).range(least..=most).speed(drag).max_decimals(6).suffix(" m/s"));
    });
    let mut long = state.navigator.is_long();
    let told = "a lens of 2° from far away, so that parallels stay nearly parallel (O)";
    if ui.checkbox(&mut long, "long lens").on_hover_text(told).changed() {
        state.apply(Action::LongLens);
    }
    let mut fov = state.navigator.fov;
    if ui.add(egui::Slider::new(&mut fov, 1.0..=150.0).text("field of view").suffix("°")).changed() {
        state.navigator.fov = fov;
        state.navigator.file_camera = None;
    }
    ui.horizontal(|ui| {
        let records = matches!(state.film, Film::Records(_));
        if ui.button(if records { "Stop recording (R)" } else { "Record a path (R)" }).clicked() {
            state.apply(Action::Record);
        }
        let plays = matches!(state.film, Film::Plays { .. });
        let button = egui::Button::new(if plays { "Stop (Y)" } else { "Play (Y)" });
        if ui.add_enabled(state.path.is_some(), button).clicked() {
            state.apply(Action::Play);
        }
    });
    let e = state.navigator.eye;
    ui.label(RichText::new(format!("eye {:.2}, {:.2}, {:.2}", e.x, e.y, e.z)).weak());
}

fn window(ui: &mut Ui, state: &mut State) {
    ui.horizontal(|ui| {
        ui.selectable_value(&mut state.settings.dark, true, "dark");
        ui.selectable_value(&mut state.settings.dark, false, "light");
    });
    let mut zoom = state.settings.zoom;
    let drag =
        egui::DragValue::new(&mut zoom).range(0.5..=4.0).speed(0.02).prefix("text × ").update_while_editing(false);
    if ui.add(drag).changed() {
        state.settings.zoom = zoom;
    }
    let mut full = state.full_screen;
    if ui.checkbox(&mut full, "full screen (F11)").changed() {
        state.apply(Action::FullScreen);
    }
    let mut measure = state.measure;
    if ui.checkbox(&mut measure, "draw without end, to measure (B)").changed() {
        state.apply(Action::Measure);
    }
}
