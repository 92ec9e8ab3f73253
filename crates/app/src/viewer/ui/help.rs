//! The help page: what hands do first, then every key in groups, with how things stand.

use crate::viewer::keys::{self, BINDINGS, Binding, Topic, With};
use crate::viewer::state::{Action, State};
use egui::{RichText, Ui, Vec2};

/// What hands do that is no single key.
const HANDS: [(&str, &str); 9] = [
    ("Drag", "orbit, or look around (G)"),
    ("Right or middle drag", "pan"),
    ("Wheel", "zoom; while looking around: speed"),
    ("W A S D, Q E", "move, down and up; Shift: faster"),
    ("Arrows", "orbit; move the selected object"),
    ("Click", "select an object"),
    ("Shift + drag", "move the object"),
    ("Ctrl + drag", "turn the sun"),
    ("Drop a file", "scene, environment, weights, path"),
];

/// Width of a column, points.
const COLUMN: f32 = 290.0;

/// A group of the page: its name and rows of key, what it does, how that stands.
type Block = (&'static str, Vec<[String; 3]>);

fn name(binding: &Binding) -> String {
    let with = match binding.with {
        With::Nothing => "",
        With::Shift => "Shift + ",
        With::Ctrl => "Ctrl + ",
    };
    format!("{with}{}", binding.key.symbol_or_name())
}

fn blocks(state: &State) -> Vec<Block> {
    let mut all: Vec<Block> = vec![("Navigation", HANDS.map(|(k, d)| [k.into(), d.into(), String::new()]).into())];
    for topic in Topic::ALL {
        let of = BINDINGS.iter().filter(|b| keys::topic(b, state) == topic);
        let rows: Vec<_> = of.map(|b| [name(b), b.doc.into(), keys::current(b, state)]).collect();
        match topic {
            Topic::Navigation => all[0].1.extend(rows),
            topic => all.push((topic.title(), rows)),
        }
    }
    all
}

/// Blocks in columns of about the same height, in their order.
fn columns(blocks: Vec<Block>, count: usize) -> Vec<Vec<Block>> {
    let height = |b: &Block| b.1.len() + 2;
    let all: usize = blocks.iter().map(height).sum();
    let mut columns: Vec<Vec<Block>> = vec![Vec::new(); count];
    let (mut at, mut before) = (0, 0);
    for block in blocks {
        let own = height(&block);
        // Into the next column where more than two fifths of it would be below the column's end.
        if before + 3 * own / 5 > (at + 1) * all / count && at + 1 < count {
            at += 1;
        }
        before += own;
        columns[at].push(block);
    }
    columns
}

/// Draws the page over the picture.
pub fn show(ui: &Ui, state: &mut State) {
    let mut open = true;
    let size = ui.ctx().content_rect().size();
    let inner = (size.x - 60.0).max(100.0);
    let count = ((inner / COLUMN) as usize).clamp(1, 3);
    let width = (inner / count as f32).min(1.15 * COLUMN);
    egui::Window::new("Controls")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO)
        .show(ui.ctx(), |ui| {
            let room = (size.y - 90.0).max(60.0);
            egui::ScrollArea::vertical().max_height(room).min_scrolled_height(room).show(ui, |ui| {
                ui.horizontal_top(|ui| {
                    for column in columns(blocks(state), count) {
                        ui.allocate_ui(Vec2::new(width - 12.0, 0.0), |ui| {
                            ui.vertical(|ui| {
                                ui.set_width(width - 12.0);
                                column.iter().for_each(|block| show_block(ui, block));
                            });
                        });
                    }
                });
                let told = "Tab goes from control to control, Space presses, arrows change numbers; Ctrl + and Ctrl − \
                    scale the interface.";
                ui.set_max_width(count as f32 * width);
                ui.label(RichText::new(told).weak());
            });
        });
    if !open {
        state.apply(Action::Help);
    }
}

fn show_block(ui: &mut Ui, (title, rows): &Block) {
    ui.label(RichText::new(*title).strong().size(14.0));
    // As high as text, not as buttons.
    ui.spacing_mut().interact_size.y = 14.0;
    egui::Grid::new(*title).striped(true).num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        for [key, doc, now] in rows {
            ui.label(RichText::new(key).strong().size(12.0));
            ui.horizontal(|ui| {
                ui.spacing_mut().item_spacing.x = 6.0;
                let text = RichText::new(doc).size(12.0);
                ui.label(text);
                if !now.is_empty() {
                    ui.label(RichText::new(now).italics().weak().size(12.0));
                }
            });
            ui.end_row();
        }
    });
    ui.add_space(8.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_stands_on_the_page_once_and_columns_are_even() {
        let state = State::new(Default::default());
        let all: usize = blocks(&state).iter().map(|b| b.1.len()).sum();
        assert_eq!(all, BINDINGS.len() + HANDS.len());
        assert_eq!(blocks(&state)[0].0, "Navigation");
        for count in 1..=3 {
            let columns = columns(blocks(&state), count);
            let heights: Vec<usize> = columns.iter().map(|c| c.iter().map(|b| b.1.len() + 2).sum()).collect();
            let (least, most) = (heights.iter().min().unwrap(), heights.iter().max().unwrap());
            assert!(most - least <= 20, "{heights:?}");
        }
    }
}
