//! What the colours of the error view mean, and the error under the pointer.

use super::Facts;
use super::marks::label;
use crate::viewer::judge::Verdict;
use crate::viewer::show::FULL_ERROR;
use crate::viewer::state::State;
use bouncelight_lab::metrics::heat_color;
use egui::{Align2, Color32, Mesh, Pos2, Rect, Shape, Stroke, Ui, Vec2};

const SIZE: Vec2 = Vec2::new(180.0, 12.0);
const STEPS: usize = 24;

/// The bar in the corner, and what the pointer is over.
pub(super) fn show(ui: &Ui, state: &State, facts: &Facts<'_>, rect: Rect) {
    if rect.width() < SIZE.x + 90.0 || rect.height() < 80.0 {
        return;
    }
    let painter = ui.painter().with_clip_rect(rect);
    let at = rect.right_bottom() - SIZE - Vec2::new(14.0, 26.0);
    let bar = Rect::from_min_size(at, SIZE);
    painter.rect_filled(bar.expand2(Vec2::new(10.0, 22.0)), 4.0, Color32::from_black_alpha(200));
    let mut mesh = Mesh::default();
    for i in 0..STEPS {
        let [r, g, b] = heat_color((i as f32 + 0.5) / STEPS as f32);
        let step = SIZE.x / STEPS as f32;
        let left = bar.left() + i as f32 * step;
        let part = Rect::from_x_y_ranges(left..=left + step, bar.y_range());
        mesh.add_colored_rect(part, Color32::from_rgb(r, g, b));
    }
    painter.add(Shape::mesh(mesh));
    painter.rect_stroke(bar, 0.0, Stroke::new(1.0, Color32::from_white_alpha(120)), egui::StrokeKind::Outside);
    let font = egui::FontId::proportional(11.0);
    let ticks = [(0.0, Align2::LEFT_TOP), (0.5, Align2::CENTER_TOP), (1.0, Align2::RIGHT_TOP)];
    for (share, align) in ticks {
        let value = share * FULL_ERROR;
        let text = if share == 1.0 { format!("≥ {value:.2}") } else { format!("{value:.3}") };
        let place = Pos2::new(bar.left() + share * SIZE.x, bar.bottom() + 4.0);
        painter.text(place, align, text, font.clone(), Color32::WHITE);
    }
    let mean = facts.verdict.as_ref().map_or(String::new(), |v| format!(" (mean {:.4})", v.mae));
    let title = format!("|left − right|, display{mean}");
    painter.text(bar.left_top() - Vec2::new(0.0, 4.0), Align2::LEFT_BOTTOM, title, font, Color32::WHITE);
    let pointer = ui.input(|i| i.pointer.hover_pos()).filter(|p| rect.contains(*p));
    let density = ui.ctx().pixels_per_point();
    if let (Some(p), Some(verdict)) = (pointer, &facts.verdict)
        && let Some(value) = under(verdict, state.size, (p - rect.min) * density)
    {
        let share = (value / FULL_ERROR).clamp(0.0, 1.0);
        let x = bar.left() + share * SIZE.x;
        painter.vline(x, bar.expand(3.0).y_range(), Stroke::new(2.0, Color32::WHITE));
        label(&painter, p + Vec2::new(14.0, 14.0), Align2::LEFT_TOP, &format!("{value:.4}"), false);
    }
}

/// The error of the pixel at a place of the picture.
fn under(verdict: &Verdict, size: [u32; 2], at: Vec2) -> Option<f32> {
    let [w, h] = size.map(|n| n as usize);
    let (x, y) = (at.x as usize, at.y as usize);
    (verdict.map.len() == w * h && x < w && y < h).then(|| verdict.map[y * w + x])
}
