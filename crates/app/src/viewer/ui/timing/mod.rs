//! The timing overlay over the picture: sums and a sparkline, or everything that is known of where
//! the time goes. It lies on the picture, not in the panel, so that it is there in full screen, too.

mod graph;
mod rows;

use super::{Facts, Memory};
use crate::viewer::frames::Numbers;
use crate::viewer::state::{Action, State};
use crate::viewer::stats::Spread;
use egui::{Align, Align2, Color32, FontId, Layout, Pos2, Rect, RichText, Sense, Stroke, Ui, Vec2};

/// Colours of the groups of passes (Okabe and Ito's), in their order; the window's own is grey.
const COLOURS: [Color32; 6] = [
    Color32::from_rgb(0x56, 0xb4, 0xe9),
    Color32::from_rgb(0xe6, 0x9f, 0x00),
    Color32::from_rgb(0x2f, 0xc0, 0x96),
    Color32::from_rgb(0xdd, 0x8c, 0xbb),
    Color32::from_rgb(0xf0, 0xe4, 0x42),
    Color32::from_rgb(0x90, 0x90, 0x90),
];
const TEXT: Color32 = Color32::from_rgb(0xf2, 0xf2, 0xf2);
const WEAK: Color32 = Color32::from_rgb(0xb0, 0xb0, 0xb0);
const WARN: Color32 = Color32::from_rgb(0xff, 0xb4, 0x4c);
/// Width of the whole overlay, points.
const WIDTH: f32 = 384.0;
const RAYS: &str = "rays that the cells of a frame have sent, without those of the cache";
/// Edge of the signs that unfold and close it, points.
const SIGN: f32 = 16.0;

/// What the overlay remembers from one frame to the next.
#[derive(Debug, Default)]
pub struct Look {
    size: Vec2,
    /// Where it is, if it is to be seen.
    pub seen: Option<Rect>,
    /// Milliseconds at the graph's top, which follows the frames, but not each of them.
    top: f32,
}

/// Draws it over the picture at `rect`.
pub fn show(ui: &Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>, rect: Rect) {
    memory.timing.seen = None;
    if !state.settings.timing.shown || rect.width() < 120.0 || rect.height() < 60.0 {
        return;
    }
    let at = state.settings.timing.at;
    let from = |at: f32, low: f32, high: f32, size: f32| if at < 0.0 { high + at - size } else { low + at };
    let size = memory.timing.size;
    let place =
        Pos2::new(from(at[0], rect.left(), rect.right(), size.x), from(at[1], rect.top(), rect.bottom(), size.y));
    let area = egui::Area::new(egui::Id::unique("timing")).current_pos(place).movable(true).constrain_to(rect);
    let shown = area.fade_in(false).show(ui.ctx(), |ui| {
        ui.style_mut().visuals = egui::Visuals::dark();
        ui.style_mut().interaction.selectable_labels = false;
        let frame = egui::Frame::new().fill(Color32::from_black_alpha(205)).corner_radius(5.0);
        frame.inner_margin(egui::Margin::symmetric(8, 5)).show(ui, |ui| {
            ui.spacing_mut().item_spacing = Vec2::new(6.0, 3.0);
            if state.settings.timing.expanded {
                let most = (rect.width() - 16.0 - 16.0).max(60.0);
                ui.set_width(WIDTH.min(most));
                ui.set_max_height((rect.height() - 16.0).max(40.0));
                whole(ui, state, memory, facts, rect);
            } else {
                sums(ui, state, memory, facts, rect);
            }
        });
    });
    let response = shown.response;
    memory.timing.size = response.rect.size();
    memory.timing.seen = Some(response.rect);
    memory.place("timing", &response);
    if response.dragged() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::Grabbing);
        // It stays at the edge that it is near to when the window's size changes.
        let near = |low: f32, high: f32, from: f32, to: f32| {
            if low - from <= to - high { (low - from).max(0.0) } else { (high - to).min(-0.5) }
        };
        let r = response.rect;
        state.settings.timing.at = [
            near(r.left(), r.right(), rect.left(), rect.right()),
            near(r.top(), r.bottom(), rect.top(), rect.bottom()),
        ];
    }
}

/// Milliseconds, no more digits than are worth reading.
fn ms(v: f64) -> String {
    match v {
        v if v < 10.0 => format!("{v:.2}"),
        v if v < 100.0 => format!("{v:.1}"),
        v => format!("{v:.0}"),
    }
}

/// The GPU's part, or what stands for it.
fn main<'a>(facts: &Facts<'a>) -> (&'static str, &'a Numbers, Option<Spread>) {
    let now = &facts.times.now;
    if facts.timestamps { ("GPU", now, now.gpu.spread()) } else { ("frame", now, now.wall.spread()) }
}

fn text(ui: &mut Ui, text: impl Into<String>, size: f32, colour: Color32) -> egui::Response {
    ui.label(RichText::new(text).size(size).color(colour))
}

/// Frames a second; what was last known of them where none follow each other.
fn rate(ui: &mut Ui, facts: &Facts<'_>) {
    let interval = facts.times.now.interval.median();
    let fps = interval.map(|ms| 1e3 / ms.max(1e-3));
    let number = fps.map_or("–".into(), |fps| if fps < 99.95 { format!("{fps:.1}") } else { format!("{fps:.0}") });
    let told = if facts.live {
        "frames a second, from one frame to the next (median)"
    } else {
        "nothing changes, so nothing is drawn; this is the rate of the last frames that followed each other \
        (B: continuous rendering)"
    };
    text(ui, number, 17.0, if facts.live { TEXT } else { WEAK }).on_hover_text(told);
    text(ui, if facts.live { "fps" } else { "fps · at rest" }, 12.0, WEAK).on_hover_text(told);
}

fn sums(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>, rect: Rect) {
    ui.horizontal(|ui| {
        // What has no room goes, the least worth first.
        if rect.width() > 260.0 {
            rate(ui, facts);
        }
        pair(ui, facts, rect.width() > 340.0);
        if let Some(count) = rays(facts).filter(|_| rect.width() > 520.0) {
            text(ui, count, 17.0, TEXT).on_hover_text(RAYS);
            text(ui, "rays", 12.0, WEAK).on_hover_text(RAYS);
        }
        if rect.width() > 440.0 {
            graph::sparkline(ui, facts);
        }
        buttons(ui, state, memory);
    });
}

/// Rays a frame; none by methods that send none.
fn rays(facts: &Facts<'_>) -> Option<String> {
    let gathers = facts.by.iter().flatten().any(|by| by.source.gathers());
    let count = facts.times.now.rays.map(|n| crate::viewer::rays::count(n as f64));
    count.or(gathers.then(|| "–".into()))
}

/// GPU and CPU time.
fn pair(ui: &mut Ui, facts: &Facts<'_>, both: bool) {
    let (name, numbers, spread) = main(facts);
    let told = match spread {
        Some(s) => format!("the renderer's passes, without the viewer's own; median of {} frames", s.count),
        None => "no frame has been timed yet".into(),
    };
    text(ui, name, 12.0, WEAK).on_hover_text(&told);
    text(ui, spread.map_or("–".into(), |s| ms(s.median)), 17.0, if facts.software { WARN } else { TEXT })
        .on_hover_text(&told);
    text(ui, if both { "ms · CPU" } else { "ms" }, 12.0, WEAK);
    if !both {
        return;
    }
    let cpu = numbers.cpu.spread();
    let told = "from recording to submission, the overlay's own share included";
    text(ui, cpu.map_or("–".into(), |s| ms(s.median)), 17.0, TEXT).on_hover_text(told);
    text(ui, "ms", 12.0, WEAK);
}

/// Unfolds and closes; painted, so that no font has to know the signs.
fn buttons(ui: &mut Ui, state: &mut State, memory: &mut Memory) {
    let expanded = state.settings.timing.expanded;
    let mut sign = |ui: &mut Ui, name: &str, lines: &[[Vec2; 2]]| {
        let (rect, response) = ui.allocate_exact_size(Vec2::splat(SIGN), Sense::click());
        memory.place(name, &response);
        let colour = if response.hovered() || response.has_focus() { TEXT } else { WEAK };
        for [a, b] in lines {
            ui.painter().line_segment([rect.center() + *a, rect.center() + *b], Stroke::new(1.6, colour));
        }
        response
    };
    let up = if expanded { -1.0 } else { 1.0 };
    let v = |x: f32, y: f32| Vec2::new(x, y * up);
    let fold = [[v(-5.0, -2.5), v(0.0, 2.5)], [v(0.0, 2.5), v(5.0, -2.5)]];
    let told = if expanded { "sums alone (Shift F3)" } else { "passes and graph (Shift F3)" };
    if sign(ui, "timing: expand", &fold).on_hover_text(told).clicked() {
        state.apply(Action::ExpandTiming);
    }
    let cross = [[Vec2::splat(-4.0), Vec2::splat(4.0)], [Vec2::new(-4.0, 4.0), Vec2::new(4.0, -4.0)]];
    if sign(ui, "timing: close", &cross).on_hover_text("close (F3)").clicked() {
        state.apply(Action::Timing);
    }
}

fn whole(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>, rect: Rect) {
    ui.horizontal(|ui| {
        rate(ui, facts);
        pair(ui, facts, rect.width() > 360.0);
        // At the right, both.
        ui.add_space((ui.available_width() - 2.0 * SIGN - ui.spacing().item_spacing.x).max(0.0));
        buttons(ui, state, memory);
    });
    let run = &facts.times.run;
    let [w, h] = run.size;
    let count = main(facts).2.map_or(0, |s| s.count);
    let frames = if count == 1 { "frame" } else { "frames" };
    let rays = rays(facts).map_or(String::new(), |count| format!(" · {count} rays"));
    let of = format!("{} · {w}×{h}{rays} · {count} {frames}", run.method);
    let response = ui.add(egui::Label::new(RichText::new(of).size(12.0).color(WEAK)).truncate());
    response.on_hover_text(format!("medians of so many frames; {RAYS}"));
    if facts.software {
        let told = "Software rendering: images are correct, timings are not representative.";
        ui.add(egui::Label::new(RichText::new(told).size(12.0).color(WARN)).truncate());
    }
    if !facts.timestamps {
        let told = "This adapter has no GPU timestamps: a frame's time is from recording until the device is idle.";
        ui.add(egui::Label::new(RichText::new(told).size(12.0).color(WARN)).wrap());
    }
    graph::history(ui, memory, facts);
    let room = rows::whole((rect.height() - 16.0 - (ui.min_rect().height() + 44.0)).max(30.0));
    egui::ScrollArea::vertical().id_salt("passes").max_height(room).auto_shrink([false, true]).show(ui, |ui| {
        rows::rows(ui, state, memory, facts);
    });
    ui.horizontal(|ui| {
        let mut button = |ui: &mut Ui, name: &str, told: &str| {
            let response = ui.small_button(name).on_hover_text(told);
            memory.place(&format!("timing: {name}"), &response);
            response.clicked()
        };
        if button(ui, "Copy", "a table of these numbers with adapter, resolution and method, as Markdown") {
            state.apply(Action::CopyTimes);
        }
        if button(ui, "Save CSV", "two files: passes with their numbers, and the graph's frames one by one") {
            state.apply(Action::SaveTimes);
        }
        let measures = state.measure;
        if ui
            .selectable_label(measures, "Continuous (B)")
            .on_hover_text("draws frame after frame to measure; else a frame is drawn only when something changes")
            .clicked()
        {
            state.apply(Action::Measure);
        }
        let overlay = facts.times.overlay.spread().map_or("–".into(), |s| ms(s.mean));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let adapter = RichText::new(format!("UI {overlay} ms")).size(11.0).color(WEAK);
            ui.add(egui::Label::new(adapter).truncate())
                .on_hover_text("CPU time of this overlay and the panel, mean of all frames");
        });
    });
}

/// A number at the right of a place.
fn right(ui: &Ui, at: Pos2, text: &str, size: f32, colour: Color32) {
    ui.painter().text(at, Align2::RIGHT_CENTER, text, FontId::monospace(size), colour);
}
