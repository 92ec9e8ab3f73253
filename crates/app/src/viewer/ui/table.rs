//! Tables of numbers, painted straight: no widget a cell, and only the rows that are seen. A
//! network has dozens of layers.

use egui::{Align2, FontId, Pos2, Rect, Sense, TextStyle, Ui, Vec2};

/// A line of a table: its name and its numbers, right-aligned.
#[derive(Debug, Clone, PartialEq)]
pub struct Line<'a> {
    pub name: &'a str,
    pub values: [String; 2],
    pub strong: bool,
}

impl<'a> Line<'a> {
    /// A line of one or two numbers.
    pub fn new(name: &'a str, values: [String; 2], strong: bool) -> Self {
        Self { name, values, strong }
    }
}

/// Width of a number, points.
const NUMBER: f32 = 54.0;

/// Paints `count` lines; `line` is only asked for those that are seen.
pub fn table<'a>(ui: &mut Ui, heads: [&str; 2], count: usize, line: impl Fn(usize) -> Line<'a>) {
    let height = ui.text_style_height(&TextStyle::Body) + 3.0;
    let size = Vec2::new(ui.available_width(), height * (count + 1) as f32);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let (body, numbers) = (TextStyle::Body.resolve(ui.style()), TextStyle::Monospace.resolve(ui.style()));
    let visuals = ui.visuals();
    let (weak, strong, plain) = (visuals.weak_text_color(), visuals.strong_text_color(), visuals.text_color());
    let clip = ui.clip_rect();
    let painter = ui.painter().with_clip_rect(clip.intersect(rect));
    let right = |column: usize| rect.right() - NUMBER * (1 - column) as f32 - 4.0;
    let top = |row: usize| rect.top() + row as f32 * height;
    let cell = |column: usize, row: usize, text: String, font: &FontId, colour| {
        painter.text(Pos2::new(right(column), top(row) + 1.0), Align2::RIGHT_TOP, text, font.clone(), colour);
    };
    for (column, head) in heads.into_iter().enumerate() {
        cell(column, 0, head.into(), &body, weak);
    }
    // Names end where numbers begin.
    let limit = Rect::from_min_max(rect.min, Pos2::new(right(0) - 40.0, rect.bottom()));
    let named = painter.with_clip_rect(painter.clip_rect().intersect(limit));
    let seen = |y: f32| ((y - rect.top()) / height).max(0.0) as usize;
    for row in seen(clip.top()).max(1)..(seen(clip.bottom()) + 1).min(count + 1) {
        let line = line(row - 1);
        if row % 2 == 1 {
            let stripe = Rect::from_min_size(Pos2::new(rect.left(), top(row)), Vec2::new(rect.width(), height));
            painter.rect_filled(stripe, 0.0, visuals.faint_bg_color);
        }
        let colour = if line.strong { strong } else { plain };
        named.text(Pos2::new(rect.left() + 2.0, top(row) + 1.0), Align2::LEFT_TOP, line.name, body.clone(), colour);
        for (column, value) in line.values.into_iter().enumerate() {
            cell(column, row, value, &numbers, colour);
        }
    }
    let over = response.hover_pos().map(|p| seen(p.y)).filter(|&row| row >= 1 && row <= count);
    if let Some(row) = over {
        let name = line(row - 1).name.to_owned();
        response.on_hover_text_at_pointer(name);
    }
}
