//! The overlay: panels around the picture, marks on it, and what hands do over it. It draws with
//! egui and changes nothing but the [`State`], so tests run it without a window.

mod camera;
mod frontier;
pub mod gizmo;
mod heat;
mod help;
pub mod input;
mod light;
pub mod marks;
mod panel;
mod table;
mod times;
mod timing;
mod welcome;
mod widgets;

use super::choice::{Side, Source, View};
use super::frames::Times;
use super::jobs::Job;
use super::judge::Verdict;
use super::stage::DrawnBy;
use super::state::{Action, State};
use super::stats::Track;
use bouncelight::render::DrawnCount;
use egui::{Color32, Pos2, Rect, Sense, Ui};
use std::collections::BTreeMap;

/// Okabe and Ito's colours, which the colour-blind tell apart, too.
pub const BLUE: Color32 = Color32::from_rgb(0x00, 0x72, 0xb2);
pub const SKY: Color32 = Color32::from_rgb(0x56, 0xb4, 0xe9);
pub const ORANGE: Color32 = Color32::from_rgb(0xe6, 0x9f, 0x00);
pub const VERMILLION: Color32 = Color32::from_rgb(0xd5, 0x5e, 0x00);

/// What the overlay tells of the world outside.
pub struct Facts<'a> {
    pub adapter: &'a str,
    pub software: bool,
    pub timestamps: bool,
    pub times: &'a Times,
    pub memory: &'a [(String, u64)],
    pub jobs: &'a [Job],
    pub reference: Option<ReferenceFacts>,
    pub verdict: Option<Verdict>,
    /// Median GPU time of methods drawn in this session, milliseconds.
    pub measured: &'a BTreeMap<usize, f64>,
    /// Frames drawn of the still view, and how many there will be.
    pub still: [u32; 2],
    pub feature: Option<(&'a str, [f32; 2])>,
    /// Names of the network's layers.
    pub layers: &'a [&'a str],
    pub flicker: Option<f64>,
    /// What is drawn on each side, and why it is not what was chosen.
    pub by: [Option<DrawnBy>; 2],
    /// Draw calls, triangles and shadow maps of the left side's last frame.
    pub drawn: DrawnCount,
    /// Frames follow each other.
    pub live: bool,
    /// The method that is being measured, while all are.
    pub touring: Option<Source>,
    /// Bytes of memory that the process holds, where the system tells.
    pub resident: Option<u64>,
}

#[cfg(test)]
impl<'a> Facts<'a> {
    /// Of a window that knows next to nothing.
    fn bare(times: &'a Times, measured: &'a BTreeMap<usize, f64>) -> Self {
        Facts {
            adapter: "none",
            software: true,
            timestamps: false,
            times,
            memory: &[],
            jobs: &[],
            reference: None,
            verdict: None,
            measured,
            still: [1, 1],
            feature: None,
            layers: &[],
            flicker: None,
            by: [None, None],
            drawn: DrawnCount::default(),
            live: false,
            touring: None,
            resident: None,
        }
    }
}

/// How far the live reference is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceFacts {
    pub stage: &'static str,
    pub samples: u32,
    pub share: f64,
    pub noise: Option<f64>,
    pub texel: u32,
    pub finished: bool,
}

/// What the overlay remembers that is nobody else's business.
#[derive(Debug, Default)]
pub struct Memory {
    path: String,
    weights: String,
    /// Objects whose names hold this are listed.
    search: String,
    /// Where named things of the panel are seen, points; for scripts.
    pub places: BTreeMap<String, [f32; 2]>,
    /// The status line; for scripts.
    pub status: String,
    /// The drag over the picture that is under way.
    pub drag: Option<input::Drag>,
    /// Where the pointer was last.
    pointer: Option<Pos2>,
    timing: timing::Look,
}

impl Memory {
    /// Remembers where `name` is, if it is to be seen.
    fn place(&mut self, name: &str, response: &egui::Response) {
        let middle = response.rect.center();
        if response.rect.is_positive() && response.ctx.content_rect().contains(middle) {
            self.places.insert(name.into(), [middle.x, middle.y]);
        }
    }
}

/// Draws the overlay and lets hands act on `state`. Returns the picture's place, points.
pub fn show(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) -> Rect {
    memory.places.clear();
    input::keyboard(ui, state);
    if state.settings.panel {
        if facts.software {
            banner(ui, facts);
        }
        egui::Panel::bottom("status").resizable(false).show(ui, |ui| status(ui, state, memory, facts));
        side(ui, state, memory, facts);
    }
    let mut rect = ui.available_rect_before_wrap();
    if state.settings.panel {
        // Not what the panel's contents would like: then each that is opened would change the picture's size.
        rect.max.x = ui.max_rect().right() - panel_width(ui, state);
    }
    let rect = pixel_aligned(rect, ui.ctx().pixels_per_point());
    let response = ui.interact(rect, ui.scope_id().with("picture"), Sense::click_and_drag());
    input::pointer(ui, state, memory, &response, rect);
    if state.settings.view == View::Error && facts.reference.is_none_or(|r| r.samples > 0) {
        heat::show(ui, state, facts, rect);
    }
    welcome::show(ui, state, memory, facts, rect);
    timing::show(ui, state, memory, facts, rect);
    marks::marks(ui, state, facts, rect, memory.timing.seen);
    marks::messages(ui, state, rect);
    marks::jobs(ui, state, facts, rect);
    if state.help {
        help::show(ui, state);
    }
    rect
}

/// Width of the panel in this window, points.
fn panel_width(ui: &Ui, state: &State) -> f32 {
    state.settings.panel_width.min(0.6 * ui.max_rect().width()).round()
}

/// The panel at the right, whose edge can be dragged.
fn side(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    let height = ui.available_height();
    let width = panel_width(ui, state);
    let edge = ui.max_rect().right() - width;
    let rows = ui.available_rect_before_wrap().y_range();
    egui::Panel::right("panel").resizable(false).exact_size(width).show(ui, |ui| {
        let inner = ui.available_width();
        egui::ScrollArea::vertical().max_height(height).auto_shrink([false; 2]).show(ui, |ui| {
            // The scroll bar lies over what it scrolls.
            ui.set_max_width(inner - 10.0);
            panel::show(ui, state, memory, facts);
        });
    });
    let handle = Rect::from_x_y_ranges(edge - 3.0..=edge + 3.0, rows);
    let response = ui.interact(handle, ui.scope_id().with("panel's edge"), Sense::drag());
    memory.place("panel's edge", &response);
    if response.hovered() || response.dragged() {
        ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
        let colour = ui.visuals().widgets.hovered.fg_stroke;
        ui.painter().vline(edge, rows, colour);
    }
    if response.dragged()
        && let Some(p) = response.interact_pointer_pos()
    {
        state.settings.panel_width = (ui.max_rect().right() - p.x).clamp(220.0, 800.0);
    }
}

/// Edges on whole pixels, so that the picture is drawn texel by texel.
fn pixel_aligned(rect: Rect, density: f32) -> Rect {
    let whole = |v: f32| (v * density).round() / density;
    let low = Pos2::new(whole(rect.left()), whole(rect.top()));
    Rect::from_min_max(low, Pos2::new(whole(rect.right()).max(low.x), whole(rect.bottom()).max(low.y)))
}

/// Says plainly that numbers are not a GPU's.
fn banner(ui: &mut Ui, facts: &Facts<'_>) {
    let frame = egui::Frame::new().fill(ORANGE).inner_margin(egui::Margin::symmetric(8, 3));
    egui::Panel::top("banner").resizable(false).frame(frame).show(ui, |ui| {
        let text =
            format!("Software rendering ({}): images are correct, timings are not representative.", facts.adapter);
        ui.add(egui::Label::new(egui::RichText::new(text).color(Color32::BLACK)).truncate());
    });
}

fn status(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    ui.horizontal(|ui| {
        let [w, h] = state.size;
        let mut text = format!("{w}×{h}");
        // The overlay tells more of it.
        if !state.settings.timing.shown {
            let ms = |track: &Track| track.median().map_or("–".into(), |v| format!("{v:.2}"));
            let times = &facts.times.now;
            let (name, main) = if facts.timestamps { ("GPU", &times.gpu) } else { ("frame, waited for,", &times.wall) };
            text += &format!("  ·  {name} {} ms  ·  CPU {} ms", ms(main), ms(&times.cpu));
        }
        let [still, all] = facts.still;
        text += &match all {
            _ if still < all => format!("  ·  Accumulating {still} of {all}"),
            1 => "  ·  1 frame".into(),
            _ => format!("  ·  {all} frames accumulated"),
        };
        if let Some(r) = facts.reference {
            text += &format!("  ·  Reference: {} of {} samples", r.samples, state.settings.spp);
        }
        if ui.button("Help (H)").clicked() {
            state.apply(Action::Help);
        }
        memory.status.clone_from(&text);
        ui.add(egui::Label::new(text).truncate());
    });
}

/// A combination box for one side's source.
fn source_box(ui: &mut Ui, id: &str, state: &mut State, side: Side) {
    let now = if side == Side::Left { state.settings.left } else { state.settings.right };
    let mut chosen = now;
    egui::ComboBox::from_id_salt(id).selected_text(now.title()).width(widgets::wide(ui)).show_ui(ui, |ui| {
        for &source in Source::ALL {
            ui.selectable_value(&mut chosen, source, source.title()).on_hover_text(source.doc());
        }
    });
    if chosen != now {
        state.apply(Action::Source(side, chosen));
    }
}

#[cfg(test)]
mod tests;
