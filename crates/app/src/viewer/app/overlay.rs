//! The overlay beside the picture's frames. It is laid out when hands, news or the clock ask for
//! it, and drawn again as it was in between: a picture that moves needs no new panels, and nobody
//! reads numbers that change more than four times a second.

use super::App;
use crate::viewer::choice::Side;
use crate::viewer::film::Film;
use crate::viewer::jobs::Kind;
use crate::viewer::stage::{DrawnBy, Stage};
use crate::viewer::state::State;
use crate::viewer::ui::{self, gizmo, input, marks};
use egui::{ClippedPrimitive, Event, Rect, epaint::ClippedShape};
use std::time::{Duration, Instant};

/// Numbers are brought up to date while frames are drawn after this time …
const PERIOD: Duration = Duration::from_millis(250);
/// … and so many frames, so that the overlay stays cheap where these are slow, …
const FRAMES: u32 = 8;
/// … but no later than this.
const LATEST: Duration = Duration::from_secs(2);

/// The overlay as it was laid out last.
pub struct Overlay {
    pub egui: egui::Context,
    pub memory: ui::Memory,
    zoomed: f32,
    /// Events of hands that have moved the camera, but that egui has not heard.
    pending: Vec<Event>,
    pub jobs: Vec<ClippedPrimitive>,
    /// As many of them at the beginning are the selected object's box, which follows every frame.
    outline: usize,
    /// `jobs` are not on the GPU yet.
    pub changed: bool,
    /// Textures to let go of once `jobs` are drawn.
    pub freed: Vec<egui::TextureId>,
    /// The picture's place, points.
    pub place: Rect,
    /// Pixels a point.
    pub density: f32,
    size: [u32; 2],
    laid_out: Option<Instant>,
    /// Numbers have changed since.
    stale: bool,
    /// When egui wants to be asked again without any hand.
    due: Option<Instant>,
    /// Frames drawn since it was laid out.
    frames: u32,
    flew: Option<Instant>,
    pub layouts: u64,
}

impl Overlay {
    /// With text of `zoom` times the usual size.
    pub fn new(zoom: f32) -> Self {
        let egui = egui::Context::default();
        egui.set_zoom_factor(zoom);
        Self {
            egui,
            memory: ui::Memory::default(),
            zoomed: zoom,
            pending: Vec::new(),
            jobs: Vec::new(),
            outline: 0,
            changed: true,
            freed: Vec::new(),
            place: Rect::NOTHING,
            density: 1.0,
            size: [0; 2],
            laid_out: None,
            stale: false,
            due: None,
            frames: 0,
            flew: None,
            layouts: 0,
        }
    }

    /// For a new device: everything is uploaded anew, and what hands have opened stays open.
    pub fn renewed(self, zoom: f32) -> Self {
        let fresh = Self::new(zoom);
        let memory = self.egui.memory(Clone::clone);
        fresh.egui.memory_mut(|m| *m = memory);
        Self { memory: self.memory, layouts: self.layouts, ..fresh }
    }

    /// Numbers have changed; they are shown soon.
    pub fn outdate(&mut self) {
        self.stale = true;
    }

    /// When it has to be laid out without any hand, even if nothing else is drawn.
    pub fn due(&self) -> Option<Instant> {
        let numbers = self.laid_out.filter(|_| self.stale).map(|t| t + PERIOD);
        [numbers, self.due].into_iter().flatten().min()
    }

    /// True where a frame may be drawn with it as it is.
    fn is_fresh(&self, now: Instant) -> bool {
        let age = self.laid_out.map_or(Duration::MAX, |t| now.duration_since(t));
        (age < PERIOD || (self.frames < FRAMES && age < LATEST)) && self.due.is_none_or(|t| t > now)
    }

    /// Keeps events until egui hears them.
    pub fn defer(&mut self, events: &mut Vec<Event>) {
        self.pending.append(events);
    }

    /// True while numbers wait to be shown.
    #[cfg(feature = "script")]
    pub fn is_stale(&self) -> bool {
        self.stale
    }

    /// Draws the selected object's box where it is now.
    fn outline(&mut self, state: &State) {
        let mut shapes = marks::outline(state, self.place, self.density);
        let text = |at, align, text: &str, colour| {
            let font = egui::FontId::proportional(12.0);
            self.egui.fonts_mut(|fonts| egui::Shape::text(fonts, at, align, text, font, colour))
        };
        shapes.extend(gizmo::shapes(state, self.place, self.density, &text));
        if self.outline == 0 && shapes.is_empty() {
            return;
        }
        let clipped = shapes.into_iter().map(|shape| ClippedShape::new(self.place, shape)).collect();
        let jobs = self.egui.tessellate(clipped, self.density);
        let count = jobs.len();
        self.jobs.splice(0..self.outline, jobs);
        (self.outline, self.changed) = (count, true);
    }

    /// True for what only moves the camera or what a drag has hold of.
    fn is_motion(&self, event: &Event) -> bool {
        match event {
            Event::PointerMoved(_) | Event::MouseMoved(_) => self.memory.drag.is_some(),
            Event::Key { key, pressed: true, .. } => {
                input::FLY.contains(key)
                    && self.egui.input(|i| i.key_down(*key))
                    && !self.egui.egui_wants_keyboard_input()
            }
            Event::Text(text) => {
                let flies = |c: char| "wasdqe".contains(c.to_ascii_lowercase());
                self.egui.input(|i| input::FLY.iter().any(|k| i.key_down(*k)))
                    && text.chars().all(flies)
                    && !self.egui.egui_wants_keyboard_input()
            }
            _ => false,
        }
    }
}

impl App {
    /// Lets hands act and brings the overlay up to date, if that is due. `anew`: something has
    /// changed that it shows. Returns the time it took.
    pub(super) fn overlay(&mut self, anew: bool) -> Duration {
        let started = Instant::now();
        let Some(screen) = &self.screen else { return Duration::ZERO };
        let scripted = self.script.is_some();
        let (o, size) = (&self.overlay, screen.size());
        let heard = if scripted { &self.scripted } else { &screen.input.egui_input().events };
        let still = heard.iter().all(|e| o.is_motion(e));
        let same = o.size == size && o.zoomed == self.state.settings.zoom && self.screenshot.is_none();
        if anew || !still || !o.is_fresh(started) || !same {
            self.lay_out(size);
        } else {
            // Hands that only move the camera are heard here.
            let at = heard.iter().rev().find_map(|e| if let Event::PointerMoved(p) = e { Some(*p) } else { None });
            if let Some(at) = at {
                input::drag(&mut self.state, &mut self.overlay.memory, at, self.overlay.place);
            }
            if scripted {
                self.overlay.defer(&mut self.scripted);
            }
            self.overlay.frames += 1;
        }
        self.fly(started);
        self.overlay.outline(&self.state);
        started.elapsed()
    }

    fn lay_out(&mut self, size: [u32; 2]) {
        let Some(screen) = &mut self.screen else { return };
        let mut raw = screen.take_input();
        let mut events = std::mem::take(&mut self.overlay.pending);
        events.append(&mut self.scripted);
        if self.script.is_some() {
            // Whatever the real mouse does is not part of the script.
            raw.events = events;
            raw.focused = true;
        } else {
            raw.events.append(&mut events);
        }
        let egui = self.overlay.egui.clone();
        egui.set_theme(if self.state.settings.dark { egui::Theme::Dark } else { egui::Theme::Light });
        if self.state.settings.zoom != self.overlay.zoomed {
            egui.set_zoom_factor(self.state.settings.zoom);
        } else {
            // Ctrl and + or −, which egui hears itself.
            self.state.settings.zoom = egui.zoom_factor();
        }
        self.meter.ask_memory(Instant::now());
        let mut place = Rect::NOTHING;
        let mut output = egui.run_ui(raw, |ui| place = self.show(ui));
        let textures = std::mem::take(&mut output.textures_delta.set);
        let freed = std::mem::take(&mut output.textures_delta.free);
        let o = &mut self.overlay;
        o.zoomed = self.state.settings.zoom;
        o.density = output.pixels_per_point;
        o.jobs = egui.tessellate(output.shapes, o.density);
        o.outline = 0;
        o.changed = true;
        (o.place, o.size, o.stale) = (place, size, false);
        o.freed.extend(freed);
        o.layouts += 1;
        o.frames = 0;
        let now = Instant::now();
        o.laid_out = Some(now);
        let delay = output.viewport_output.get(&egui::ViewportId::ROOT).map_or(Duration::MAX, |v| v.repaint_delay);
        o.due = (delay < Duration::from_secs(3600)).then(|| now + delay);
        let density = o.density;
        self.state.resize([place.width(), place.height()].map(|n| ((n * density).round() as u32).max(1)));
        let (Some(screen), Some(stage)) = (&mut self.screen, &self.stage) else { return };
        screen.input.handle_platform_output(&screen.window, output.platform_output);
        for (id, deltas) in &textures {
            deltas.iter().for_each(|d| screen.painter.update_texture(&stage.gpu.device, &stage.gpu.queue, *id, d));
        }
    }

    /// The overlay's layout, with what it tells.
    fn show(&mut self, ui: &mut egui::Ui) -> Rect {
        let Some(stage) = &self.stage else { return Rect::NOTHING };
        // Other scenes and sizes take other times.
        let run = &self.meter.times.run;
        let here = self.meter.measured.iter().filter(|(_, m)| (&m.run.scene, m.run.size) == (&run.scene, run.size));
        let measured = here.map(|(source, m)| (*source, m.ms)).collect();
        let by = [Side::Left, Side::Right].map(|side| self.drawn_by(stage, side));
        let facts = ui::Facts {
            adapter: &stage.gpu.info.name,
            software: stage.gpu.is_software(),
            timestamps: self.screen.as_ref().is_some_and(|s| s.profiler.is_some()),
            times: &self.meter.times,
            memory: &self.meter.memory,
            jobs: &self.jobs,
            reference: self.tracing.facts,
            verdict: self.tracing.verdict.clone(),
            measured: &measured,
            still: [stage.still(), stage.frames(&self.state)],
            feature: stage.feature(),
            layers: &stage.layers(),
            flicker: self.meter.flicker,
            by,
            drawn: stage.drawn(),
            live: self.is_live(),
            touring: self.touring(),
            resident: self.meter.resident,
        };
        ui::show(ui, &mut self.state, &mut self.overlay.memory, &facts)
    }

    /// True while frames follow each other without any hand.
    fn is_live(&self) -> bool {
        let converging = self.stage.as_ref().is_some_and(|s| s.is_converging(&self.state));
        let moves = self.state.animated.is_some() || matches!(self.state.film, Film::Plays { .. });
        converging || moves || self.state.measure || self.overlay.flew.is_some()
    }

    /// What a side shows, and how far the work is that its method waits for.
    fn drawn_by(&self, stage: &Stage, side: Side) -> Option<DrawnBy> {
        let mut by = stage.drawn_by(&self.state, side)?;
        let job = self.jobs.iter().find(|j| j.kind == Kind::Rays);
        if let (Some(why), Some(job)) = (&mut by.why, job)
            && why.starts_with("building BVH")
            && let Some((_, count)) = job.progress.read().0.split_once(": ")
        {
            *why += &format!(", {count}");
        }
        Some(by)
    }

    /// Held keys fly, as long as frames are drawn one after the other.
    fn fly(&mut self, now: Instant) {
        self.again |= self.state.roll(now);
        let seconds = self.overlay.flew.map_or(1.0 / 60.0, |t| now.duration_since(t).as_secs_f32().min(0.1));
        let flies = input::fly(&self.overlay.egui, &mut self.state, seconds);
        self.overlay.flew = flies.then_some(now);
        self.again |= flies;
    }
}
