//! Axes, marks and words, drawn with any backend.

use super::{COLOURS, FAINT, GREY, INK, Panel, STEPS, failed};
use crate::study::chart::{ChartError, Metric, Record};
use plotters::{
    coord::Shift,
    element::{Circle, PathElement, Polygon, Rectangle, Text},
    prelude::{DrawingArea, DrawingBackend, RGBColor, WHITE},
    style::{
        Color, FontDesc, FontFamily, FontStyle, FontTransform, ShapeStyle,
        text_anchor::{HPos, Pos, VPos},
    },
};

/// Least and most of some values on a logarithmic axis, with room around them.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) =
        values.filter(|v| v.is_finite() && *v > 0.0).fold((f64::MAX, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
    if high == 0.0 { (0.1, 10.0) } else { (low / 1.5, high * 1.9) }
}

/// 1, 2 and 5 times the powers of ten in a range; only powers in a long one.
fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let decades = (high / low).log10();
    let multiples: &[f64] = if decades > 3.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let first = low.log10().floor() as i32;
    let all = (first..=first + 12).flat_map(|e| multiples.iter().map(move |m| m * 10f64.powi(e)));
    all.filter(|t| (low..=high).contains(t)).collect()
}

fn number(v: f64) -> String {
    match v {
        v if v >= 1000.0 => format!("{:.0}k", v / 1000.0),
        v if v >= 1.0 => format!("{v:.0}"),
        v => {
            let text = format!("{v:.4}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
    }
}

/// A picture in the making; lengths are those of the SVG.
pub(super) struct Canvas<D: DrawingBackend> {
    pub area: DrawingArea<D, Shift>,
    pub scale: f64,
}

/// A box, left, top, right, bottom.
type Box4 = [f64; 4];

impl<D: DrawingBackend> Canvas<D> {
    fn px(&self, p: (f64, f64)) -> (i32, i32) {
        ((p.0 * self.scale).round() as i32, (p.1 * self.scale).round() as i32)
    }

    fn stroke(&self, colour: RGBColor, width: f64) -> ShapeStyle {
        colour.stroke_width((width * self.scale).round().max(1.0) as u32)
    }

    fn line(&self, points: &[(f64, f64)], colour: RGBColor, width: f64) -> Result<(), ChartError> {
        let points: Vec<_> = points.iter().map(|p| self.px(*p)).collect();
        self.area.draw(&PathElement::new(points, self.stroke(colour, width))).map_err(failed)
    }

    fn dashed(&self, (a, b): ((f64, f64), (f64, f64)), colour: RGBColor, dash: f64) -> Result<(), ChartError> {
        let length = (b.0 - a.0).hypot(b.1 - a.1).max(1e-9);
        let at = |d: f64| (a.0 + (b.0 - a.0) * d / length, a.1 + (b.1 - a.1) * d / length);
        let mut d = 0.0;
        while d < length {
            self.line(&[at(d), at((d + dash).min(length))], colour, 1.2)?;
            d += 2.0 * dash;
        }
        Ok(())
    }

    fn text(
        &self,
        words: &str,
        at: (f64, f64),
        size: f64,
        pos: Pos,
        colour: RGBColor,
        up: bool,
    ) -> Result<(), ChartError> {
        let font = FontDesc::new(FontFamily::SansSerif, size * self.scale, FontStyle::Normal);
        let font = if up { font.transform(FontTransform::Rotate270) } else { font };
        self.area.draw(&Text::new(words.to_owned(), self.px(at), font.color(&colour).pos(pos))).map_err(failed)
    }

    /// A mark of number `style`, full or hollow.
    fn mark(&self, style: usize, at: (f64, f64), full: bool) -> Result<(), ChartError> {
        let colour = COLOURS[style % COLOURS.len()];
        let r = 5.5;
        let corner = |dx: f64, dy: f64| (at.0 + r * dx, at.1 + r * dy);
        let shape: Vec<(f64, f64)> = match style % 5 {
            0 => Vec::new(),
            1 => vec![corner(-0.9, -0.9), corner(0.9, -0.9), corner(0.9, 0.9), corner(-0.9, 0.9)],
            2 => vec![corner(0.0, -1.2), corner(1.1, 0.8), corner(-1.1, 0.8)],
            3 => vec![corner(0.0, -1.3), corner(1.3, 0.0), corner(0.0, 1.3), corner(-1.3, 0.0)],
            _ => vec![corner(0.0, 1.2), corner(1.1, -0.8), corner(-1.1, -0.8)],
        };
        let inside = if full { colour.filled() } else { WHITE.filled() };
        if shape.is_empty() {
            let radius = (r * self.scale).round() as i32;
            self.area.draw(&Circle::new(self.px(at), radius, inside)).map_err(failed)?;
            return self.area.draw(&Circle::new(self.px(at), radius, self.stroke(colour, 1.5))).map_err(failed);
        }
        let points: Vec<_> = shape.iter().map(|p| self.px(*p)).collect();
        self.area.draw(&Polygon::new(points, inside)).map_err(failed)?;
        self.line(&[shape.as_slice(), &shape[..1]].concat(), colour, 1.5)
    }

    pub fn chart(&self, record: &Record, metric: Metric, panels: &[Panel; 2]) -> Result<(), ChartError> {
        self.area.fill(&WHITE).map_err(failed)?;
        let left_top = Pos::new(HPos::Left, VPos::Top);
        let [w, h] = record.size;
        let scenes: Vec<&str> = record.scenes.iter().filter(|s| s.failed.is_none()).map(|s| s.name.as_str()).collect();
        let words = format!("Error against time at {w}×{h}, mean of {} scenes: {}", scenes.len(), scenes.join(", "));
        self.text(&words, (20.0, 12.0), 17.0, left_top, INK, false)?;
        let key = "full: settled (32 frames)   hollow: the first frame after a cut   bars: best and worst scene   \
                   grey steps: nothing in a frame is faster and nearer   dashed: paths traced, a pixel";
        self.text(key, (20.0, 36.0), 12.5, left_top, GREY, false)?;
        let scale = if metric == Metric::Light { 100.0 } else { 1.0 };
        let ys = panels.iter().flat_map(|p| {
            let marks = p.marks.iter().flat_map(|m| [m.y.low, m.y.mean, m.y.high, m.cold.map_or(m.y.mean, |c| c.1)]);
            let curve = p.curve.iter().map(|c| c.2).chain(p.printed.iter().map(|c| c.1)).chain(p.floor);
            marks.chain(curve).collect::<Vec<_>>()
        });
        let up = range(ys.map(|y| y * scale));
        let widths = [(78.0, 690.0), (760.0, 1262.0)];
        for (panel, (left, right)) in panels.iter().zip(widths) {
            self.panel(panel, [left, 88.0, right, 590.0], up, scale)?;
        }
        let middle = Pos::new(HPos::Center, VPos::Center);
        self.text(metric.title(), (24.0, 339.0), 14.0, middle, INK, true)?;
        let p = &record.provenance;
        let from = format!("bouncelight {} · commit {} · {} · {}", p.version, p.commit, p.date, record.device.driver);
        self.text(&from, (20.0, 640.0), 11.0, left_top, GREY, false)?;
        self.area.present().map_err(failed)
    }

    fn panel(&self, panel: &Panel, frame: Box4, up: (f64, f64), scale: f64) -> Result<(), ChartError> {
        let [left, top, right, bottom] = frame;
        let xs = panel.marks.iter().flat_map(|m| [m.x, m.cold.map_or(m.x, |c| c.0)]);
        let xs = xs.chain(panel.curve.iter().map(|c| c.1)).chain(panel.lines.iter().map(|l| l.0));
        let across = range(xs.chain(panel.printed.iter().map(|p| p.0)));
        let share = |v: f64, (low, high): (f64, f64)| (v.max(low) / low).ln() / (high / low).ln();
        let place = |x: f64, y: f64| {
            // What takes no time stands at the axis, where a logarithm has no place for it.
            let across = if x > 0.0 { left + share(x, across) * (right - left) } else { left + 9.0 };
            (across, bottom - share(y * scale, up) * (bottom - top))
        };
        let centre = |v| Pos::new(HPos::Center, v);
        for x in ticks(across) {
            let at = place(x, 0.0).0;
            self.line(&[(at, top), (at, bottom)], FAINT, 1.0)?;
            self.text(&number(x), (at, bottom + 6.0), 12.0, centre(VPos::Top), INK, false)?;
        }
        for y in ticks(up) {
            let at = place(1.0, y / scale).1;
            self.line(&[(left, at), (right, at)], FAINT, 1.0)?;
            self.text(&number(y), (left - 6.0, at), 12.0, Pos::new(HPos::Right, VPos::Center), INK, false)?;
        }
        let corners = [self.px((left, top)), self.px((right, bottom))];
        self.area.draw(&Rectangle::new(corners, self.stroke(GREY, 1.0))).map_err(failed)?;
        self.text(&panel.title, (left, top - 8.0), 14.0, Pos::new(HPos::Left, VPos::Bottom), INK, false)?;
        self.text(&panel.across, ((left + right) / 2.0, bottom + 24.0), 13.0, centre(VPos::Top), INK, false)?;

        let mut names = Names { frame, taken: Vec::new() };
        if let Some(floor) = panel.floor {
            let at = place(1.0, floor).1;
            self.dashed(((left, at), (right, at)), GREY, 2.0)?;
            let words = "noise of the references";
            let pos = Pos::new(HPos::Left, VPos::Bottom);
            self.text(words, (left + 5.0, at - 2.0), 11.0, pos, GREY, false)?;
            names.taken.push([left, at - 16.0, left + 140.0, at + 2.0]);
        }
        for (x, words) in &panel.lines {
            let at = place(*x, 1.0).0;
            self.dashed(((at, top), (at, bottom)), GREY, 6.0)?;
            // Beside the line, read upwards, up to its upper end.
            let (inside, pos) = if at - 18.0 > left { (at - 4.0, VPos::Bottom) } else { (at + 4.0, VPos::Top) };
            self.text(words, (inside, top + 8.0), 11.0, Pos::new(HPos::Right, pos), GREY, true)?;
            names.taken.push([at - 18.0, top, at + 2.0, top + 330.0]);
        }
        if let Some(first) = panel.frontier.first() {
            let mut steps = vec![(place(first.0, first.1).0, top), place(first.0, first.1)];
            for pair in panel.frontier.windows(2) {
                steps.push(place(pair[1].0, pair[0].1));
                steps.push(place(pair[1].0, pair[1].1));
            }
            steps.push((right, steps.last().map_or(bottom, |p| p.1)));
            self.line(&steps, STEPS, 3.0)?;
        }
        let curve: Vec<_> = panel.curve.iter().map(|c| (c.0, place(c.1, c.2))).collect();
        for pair in curve.windows(2) {
            self.dashed((pair[0].1, pair[1].1), INK, 5.0)?;
        }
        for mark in &panel.marks {
            names.taken.extend([Some((mark.x, mark.y.mean)), mark.cold].into_iter().flatten().map(|(x, y)| {
                let p = place(x, y);
                [p.0 - 7.0, p.1 - 7.0, p.0 + 7.0, p.1 + 7.0]
            }));
            let (high, low) = (place(mark.x, mark.y.high), place(mark.x, mark.y.low));
            names.taken.push([high.0 - 3.0, high.1, low.0 + 3.0, low.1]);
        }
        for (count, at) in &curve {
            let dot = Circle::new(self.px(*at), (3.0 * self.scale) as i32, INK.filled());
            self.area.draw(&dot).map_err(failed)?;
            names.taken.push([at.0 - 4.0, at.1 - 4.0, at.0 + 4.0, at.1 + 4.0]);
            let words = if *count == 1 { "1 path".to_owned() } else { count.to_string() };
            self.name(&mut names, &words, *at, 11.0)?;
        }
        for mark in &panel.marks {
            let at = place(mark.x, mark.y.mean);
            let colour = COLOURS[mark.style % COLOURS.len()];
            let (high, low) = (place(mark.x, mark.y.high), place(mark.x, mark.y.low));
            self.line(&[high, low], colour, 1.0)?;
            for end in [high, low] {
                self.line(&[(end.0 - 3.0, end.1), (end.0 + 3.0, end.1)], colour, 1.0)?;
            }
            if let Some((x, y)) = mark.cold {
                let cold = place(x, y);
                self.line(&[at, cold], colour, 2.0)?;
                self.mark(mark.style, cold, false)?;
            }
            self.mark(mark.style, at, true)?;
        }
        for (x, y, words) in &panel.printed {
            let at = place(*x, *y);
            self.line(&[(at.0 - 6.0, at.1 - 6.0), (at.0 + 6.0, at.1 + 6.0)], INK, 2.0)?;
            self.line(&[(at.0 - 6.0, at.1 + 6.0), (at.0 + 6.0, at.1 - 6.0)], INK, 2.0)?;
            names.taken.push([at.0 - 7.0, at.1 - 7.0, at.0 + 7.0, at.1 + 7.0]);
            self.name(&mut names, words, at, 11.0)?;
        }
        for mark in &panel.marks {
            let free = if mark.x > 0.0 { mark.name.clone() } else { format!("{} (0 ms)", mark.name) };
            self.name(&mut names, &free, place(mark.x, mark.y.mean), 13.0)?;
        }
        Ok(())
    }

    /// Words beside a place, where they cover nothing that is there already.
    fn name(&self, names: &mut Names, words: &str, at: (f64, f64), size: f64) -> Result<(), ChartError> {
        let (width, height) = (0.54 * size * words.chars().count() as f64, 1.15 * size);
        let corner = names.place(at, (width, height));
        let pos = Pos::new(HPos::Left, VPos::Top);
        self.text(words, corner, size, pos, INK, false)
    }
}

/// Where words stand already.
struct Names {
    frame: Box4,
    taken: Vec<Box4>,
}

impl Names {
    /// Left upper corner of a box of this size near `at`.
    fn place(&mut self, at: (f64, f64), (w, h): (f64, f64)) -> (f64, f64) {
        let offsets = [9.0, 22.0, 38.0].into_iter().flat_map(|d| {
            let (right, left, mid) = (at.0 + d, at.0 - d - w, at.0 - w / 2.0);
            let (above, below, level) = (at.1 - d - h + 3.0, at.1 + d - 3.0, at.1 - h / 2.0);
            [
                (right, level),
                (right, above),
                (right, below),
                (left, level),
                (left, above),
                (left, below),
                (mid, above),
                (mid, below),
            ]
        });
        let boxed = |(x, y): (f64, f64)| [x, y, x + w, y + h];
        let [left, top, right, bottom] = self.frame;
        let inside = |b: &Box4| b[0] >= left && b[1] >= top && b[2] <= right && b[3] <= bottom;
        let apart = |a: &Box4, b: &Box4| a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
        let free = |p: &(f64, f64)| inside(&boxed(*p)) && self.taken.iter().all(|t| apart(t, &boxed(*p)));
        let all: Vec<(f64, f64)> = offsets.collect();
        let within = |p: &&(f64, f64)| inside(&boxed(**p));
        let found = all.iter().find(|p| free(p)).or_else(|| all.iter().find(within)).copied().unwrap_or(all[0]);
        self.taken.push(boxed(found));
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_ticks() {
        assert_eq!(ticks((0.9, 11.0)), [1.0, 2.0, 5.0, 10.0]);
        assert_eq!(ticks((0.5, 50_000.0)), [1.0, 10.0, 100.0, 1000.0, 10_000.0]);
        assert_eq!(range(std::iter::empty()), (0.1, 10.0));
        assert_eq!((number(20_000.0), number(0.05), number(5.0)), ("20k".into(), "0.05".into(), "5".into()));
    }

    #[test]
    fn names_do_not_cover_each_other() {
        let mut names = Names { frame: [0.0, 0.0, 400.0, 400.0], taken: Vec::new() };
        let boxes: Vec<Box4> = (0..6)
            .map(|_| {
                let (x, y) = names.place((200.0, 200.0), (60.0, 15.0));
                [x, y, x + 60.0, y + 15.0]
            })
            .collect();
        for (i, a) in boxes.iter().enumerate() {
            for b in &boxes[i + 1..] {
                assert!(a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1], "{a:?} {b:?}");
            }
        }
        // A place at the rim: words stay inside.
        let (x, y) = names.place((399.0, 1.0), (60.0, 15.0));
        assert!(x >= 0.0 && x + 60.0 <= 400.0 && y >= 0.0);
    }
}
