//! Passes in their groups, with a bar and a share each.

use super::{COLOURS, TEXT, WARN, WEAK, ms, right};
use crate::viewer::frames::{Group, Row, doc, is_layer};
use crate::viewer::state::State;
use crate::viewer::stats::Spread;
use crate::viewer::ui::{Facts, Memory};
use egui::text::{LayoutJob, TextFormat, TextWrapping};
use egui::{Align2, Color32, FontId, Mesh, Pos2, Rect, Sense, Stroke, Ui, Vec2};

const HEIGHT: f32 = 16.0;
/// Heights of the head and of the rule above the last lines.
const HEAD: f32 = 14.0;
const RULE: f32 = 3.0;
/// Right edges of the numbers, from the right, points: median, 95th percentile, share.
const EDGES: [f32; 3] = [96.0, 44.0, 0.0];

/// A line of the list.
struct Line<'a> {
    name: &'a str,
    /// What stands weakly behind the name.
    note: String,
    spread: Option<Spread>,
    /// Of the renderer's sum; none for what is no part of it.
    share: Option<f64>,
    colour: Color32,
    strong: bool,
    indent: f32,
    /// It can be unfolded, and is.
    open: Option<bool>,
    slowest: bool,
}

/// Most of `room` that cuts no row in two.
pub fn whole(room: f32) -> f32 {
    let other = HEAD + RULE;
    other + ((room - other) / HEIGHT).floor().max(1.0) * HEIGHT
}

/// All groups that draw, the sum at the end.
pub fn rows(ui: &mut Ui, state: &mut State, memory: &mut Memory, facts: &Facts<'_>) {
    ui.spacing_mut().item_spacing.y = 0.0;
    let now = &facts.times.now;
    head(ui);
    let all = now.gpu.spread();
    let share = |s: Option<Spread>| Some(s?.median / all?.median.max(1e-9));
    let slowest = facts.times.slowest();
    let (name, whole) =
        if facts.timestamps { ("GPU, all passes", all) } else { ("Frame, waited for", now.wall.spread()) };
    paint(ui, &sum(name, whole), Sense::hover());
    for group in Group::ALL {
        let passes: Vec<&Row> = now.passes.iter().filter(|row| row.group == group).collect();
        if passes.is_empty() {
            continue;
        }
        let own = group == Group::Viewer;
        let sum = now.groups[group as usize].spread();
        let open = state.settings.timing.unfolded[group as usize];
        let note = match (own, passes.iter().filter(|p| is_layer(&p.name)).count()) {
            (true, _) => "not in the sum".into(),
            (_, 0) => String::new(),
            (_, layers) => format!("{layers} layers"),
        };
        let line = Line {
            name: group.title(),
            note,
            spread: sum,
            share: share(sum).filter(|_| !own),
            colour: COLOURS[group as usize],
            strong: true,
            indent: 0.0,
            open: Some(open),
            // Where its layers are folded away.
            slowest: !open && passes.iter().any(|p| Some(p.name.as_str()) == slowest),
        };
        let response = paint(ui, &line, Sense::click());
        memory.place(&format!("timing: {}", group.title()), &response);
        if response.clicked() {
            state.settings.timing.unfolded[group as usize] = !open;
        }
        if !open {
            continue;
        }
        for row in passes {
            let spread = row.track.spread();
            let line = Line {
                name: &row.name,
                note: String::new(),
                spread,
                share: share(spread).filter(|_| !own),
                colour: COLOURS[group as usize].gamma_multiply(0.75),
                strong: false,
                indent: 12.0,
                open: None,
                slowest: Some(row.name.as_str()) == slowest,
            };
            paint(ui, &line, Sense::hover());
        }
    }
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), RULE), Sense::hover());
    ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(0.5, WEAK));
    paint(ui, &sum("CPU", now.cpu.spread()), Sense::hover());
    paint(ui, &sum("Frame to frame", now.interval.spread()), Sense::hover());
}

/// A line of no group.
fn sum(name: &str, spread: Option<Spread>) -> Line<'_> {
    Line {
        name,
        note: String::new(),
        spread,
        share: None,
        colour: Color32::TRANSPARENT,
        strong: true,
        indent: 12.0,
        open: None,
        slowest: false,
    }
}

fn head(ui: &mut Ui) {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), HEAD), Sense::hover());
    for (edge, name) in EDGES.into_iter().zip(["median ms", "p95", "share"]) {
        let at = Pos2::new(rect.right() - edge, rect.center().y);
        ui.painter().text(at, Align2::RIGHT_CENTER, name, FontId::proportional(10.5), WEAK);
    }
    response.on_hover_text(
        "median and 95th percentile over the last two seconds, or the last 32 frames where these are slow; \
        no percentile stands on fewer than 20 frames; share of the renderer's sum",
    );
}

/// A share, with a digit behind the point where it is small.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 9.95 { format!("{percent:.1} %") } else { format!("{percent:.0} %") }
}

fn paint(ui: &mut Ui, line: &Line<'_>, sense: Sense) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), HEIGHT), sense);
    if !ui.is_rect_visible(rect) {
        return response;
    }
    // With one clip for all rows they are one draw call.
    let painter = ui.painter();
    let y = rect.center().y;
    if sense.senses_click() && (response.hovered() || response.has_focus()) {
        painter.rect_filled(rect, 2.0, Color32::from_white_alpha(22));
    }
    let mut x = rect.left() + line.indent;
    if let Some(open) = line.open {
        let c = Pos2::new(x + 4.0, y);
        let points = if open {
            vec![c + Vec2::new(-3.5, -2.0), c + Vec2::new(3.5, -2.0), c + Vec2::new(0.0, 3.0)]
        } else {
            vec![c + Vec2::new(-2.0, -3.5), c + Vec2::new(3.0, 0.0), c + Vec2::new(-2.0, 3.5)]
        };
        painter.add(egui::Shape::convex_polygon(points, line.colour, Stroke::NONE));
        x += 12.0;
    }
    // Names end where bars begin, and these where numbers do.
    let (bar_left, bar_right) = (rect.left() + 0.4 * rect.width(), rect.right() - EDGES[0] - 56.0);
    let colour = if line.strong { TEXT } else { Color32::from_gray(0xd4) };
    let size = if line.strong { 12.5 } else { 12.0 };
    let note = if line.slowest { "slowest" } else { &line.note };
    let tint = if line.slowest { WARN } else { WEAK };
    for (text, size, colour) in [(line.name, size, colour), (note, 10.5, tint)] {
        let room = bar_left - 4.0 - x;
        if text.is_empty() || room < 12.0 {
            continue;
        }
        let mut job = LayoutJob::single_section(text.into(), TextFormat::simple(FontId::proportional(size), colour));
        job.wrap = TextWrapping::truncate_at_width(room);
        let galley = painter.layout_job(job);
        let place = Align2::LEFT_CENTER.anchor_size(Pos2::new(x, y), galley.size());
        x = place.right() + 6.0;
        painter.galley(place.min, galley, colour);
    }
    if let Some(share) = line.share {
        let all = Rect::from_x_y_ranges(bar_left..=bar_right, y - 4.0..=y + 4.0);
        let mut bar = all;
        bar.set_width((all.width() * share.clamp(0.0, 1.0) as f32).max(1.0));
        let mut mesh = Mesh::default();
        mesh.add_colored_rect(all, Color32::from_white_alpha(14));
        mesh.add_colored_rect(bar, line.colour);
        painter.add(egui::Shape::mesh(mesh));
        if line.slowest {
            painter.rect_stroke(bar, 0.0, Stroke::new(1.0, WARN), egui::StrokeKind::Outside);
        }
        right(ui, Pos2::new(rect.right(), y), &percent(share), 11.5, colour);
    }
    let number = |v: Option<f64>| v.map_or("–".into(), |v| if v < 10.0 { format!("{v:.3}") } else { ms(v) });
    let (median, p95) = (number(line.spread.map(|s| s.median)), number(line.spread.and_then(|s| s.p95)));
    right(ui, Pos2::new(rect.right() - EDGES[0], y), &median, 11.5, colour);
    right(ui, Pos2::new(rect.right() - EDGES[1], y), &p95, 11.5, WEAK);
    match line.spread {
        Some(s) if response.hovered() => {
            let what = doc(line.name);
            let stop = if what.is_empty() { "" } else { "\n" };
            response
                .on_hover_text(format!("{what}{stop}{}: {:.3} ms, median of {} frames", line.name, s.median, s.count))
        }
        _ => response,
    }
}
