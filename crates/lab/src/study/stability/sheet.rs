//! Contact sheets and short sequences, for what a number does not say.

use super::{Observation, StabilityError, Test};
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight_scene::image_io;
use font8x8::UnicodeFonts;
use std::path::Path;

/// A picture for the sheet.
#[derive(Debug, Clone)]
pub struct Moment {
    name: String,
    size: [usize; 2],
    /// Linear radiance.
    rgb: Vec<f32>,
}

impl Moment {
    pub(super) fn new(name: &str, look: &Observation) -> Self {
        Self { name: name.into(), size: look.size.map(|n| n as usize), rgb: look.rgb.clone() }
    }

    fn bytes(&self, gain: f32) -> Vec<u8> {
        Tonemap::Filmic.apply_to_bytes(&self.rgb.iter().map(|v| v * gain).collect::<Vec<_>>())
    }

    /// Mean of the light that there is.
    fn mean(&self) -> f32 {
        let lit: Vec<f32> = self.rgb.iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
        lit.iter().sum::<f32>() / lit.len().max(1) as f32
    }
}

/// One subject's pictures.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub name: String,
    pub verdict: String,
    pub moments: Vec<Moment>,
    pub rolls: Vec<Moment>,
}

/// All pictures of a test: a row a subject, the truth first.
#[derive(Debug, Clone)]
pub struct Sheet {
    title: String,
    rows: Vec<Row>,
    /// What radiance is multiplied by: the first picture that holds light decides, which is the
    /// truth's.
    gain: Option<f32>,
}

/// Height of a line of text, pixels.
const LINE: usize = 12;
/// Width of a letter, pixels.
const LETTER: usize = 8;
/// Space between pictures, pixels.
const GAP: usize = 4;
/// Pictures are enlarged to about this width, pixels.
const WIDE: usize = 256;
/// Mean radiance is shown as this.
const MIDDLE: f32 = 0.2;
/// Milliseconds of a frame of the short sequence.
const FRAME_MS: u16 = 150;

impl Sheet {
    pub(super) fn new(test: &Test) -> Self {
        Self { title: format!("{}: {}", test.name, test.question), rows: Vec::new(), gain: None }
    }

    pub(super) fn push(&mut self, row: Row) {
        if self.gain.is_none() {
            let mean = row.moments.iter().map(Moment::mean).find(|m| *m > 0.0);
            self.gain = mean.map(|m| MIDDLE / m);
        }
        self.rows.push(row);
    }

    /// Writes the contact sheet as PNG; nothing where no picture was kept.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<bool, StabilityError> {
        let Some(canvas) = self.paint() else { return Ok(false) };
        image_io::write_png(path, canvas.width as u32, canvas.height as u32, &canvas.rgb, &[])?;
        Ok(true)
    }

    /// Writes the short sequence as an animated PNG, all subjects side by side; nothing where a
    /// test has none.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_film(&self, path: &Path) -> Result<bool, StabilityError> {
        let frames: Vec<Canvas> = (0..).map_while(|i| self.frame(i)).collect();
        let Some(first) = frames.first().filter(|_| frames.len() > 1) else { return Ok(false) };
        let size = [first.width as u32, first.height as u32];
        let frames: Vec<&[u8]> = frames.iter().map(|c| c.rgb.as_slice()).collect();
        image_io::write_apng(path, size, &frames, FRAME_MS)?;
        Ok(true)
    }

    fn paint(&self) -> Option<Canvas> {
        let columns = self.rows.iter().map(|r| r.moments.len()).max().filter(|n| *n > 0)?;
        let size = self.rows.iter().flat_map(|r| &r.moments).map(|m| m.size).next()?;
        let shown = enlarged(size);
        let cell = [shown[0] + GAP, shown[1] + 2 * LINE];
        let mut canvas = Canvas::new(
            (columns * cell[0] + GAP).max(LETTER * (self.title.len() + 1)),
            self.rows.len() * cell[1] + 2 * LINE,
        );
        canvas.text(GAP, GAP, &self.title);
        for (r, row) in self.rows.iter().enumerate() {
            let y = 2 * LINE + r * cell[1];
            canvas.text(GAP, y, &format!("{}  {}", row.name, row.verdict));
            for (c, moment) in row.moments.iter().enumerate() {
                let x = GAP + c * cell[0];
                canvas.picture([x, y + LINE], shown, moment, self.gain.unwrap_or(1.0));
                canvas.label(x + 2, y + LINE + 2, &moment.name);
            }
        }
        Some(canvas)
    }

    /// Frame `i` of every subject that has one, side by side in rows of three.
    fn frame(&self, i: usize) -> Option<Canvas> {
        let rows: Vec<&Row> = self.rows.iter().filter(|r| !r.rolls.is_empty()).collect();
        let longest = rows.iter().map(|r| r.rolls.len()).max().filter(|n| i < *n)?;
        let size = rows.first()?.rolls[0].size;
        let shown = enlarged(size);
        let cell = [shown[0] + GAP, shown[1] + LINE + GAP];
        let mut canvas = Canvas::new(rows.len().min(3) * cell[0] + GAP, rows.len().div_ceil(3) * cell[1] + GAP);
        for (n, row) in rows.iter().enumerate() {
            let (x, y) = (GAP + n % 3 * cell[0], GAP + n / 3 * cell[1]);
            let moment = &row.rolls[i.min(row.rolls.len() - 1)];
            canvas.text(x, y, &format!("{} {}/{longest}", row.name, i + 1));
            canvas.picture([x, y + LINE], shown, moment, self.gain.unwrap_or(1.0));
        }
        Some(canvas)
    }
}

/// The last picture of each test and subject on one sheet: a row a subject, a column a test.
#[derive(Default)]
pub struct Overview(Vec<Sheet>);

impl Overview {
    /// Adds a test's column, if there are pictures of it.
    pub fn push(&mut self, sheet: &Sheet) {
        let last = |row: &Row| Row {
            moments: row.moments.last().cloned().into_iter().collect(),
            rolls: Vec::new(),
            ..row.clone()
        };
        let rows: Vec<Row> = sheet.rows.iter().map(last).filter(|row| !row.moments.is_empty()).collect();
        if !rows.is_empty() {
            self.0.push(Sheet { title: sheet.title.clone(), rows, gain: sheet.gain });
        }
    }

    /// Writes the sheet as PNG; nothing where there is one test at most.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<bool, StabilityError> {
        let Some(longest) = self.0.iter().max_by_key(|test| test.rows.len()).filter(|_| self.0.len() > 1) else {
            return Ok(false);
        };
        let names: Vec<&str> = longest.rows.iter().map(|row| row.name.as_str()).collect();
        let sizes: Vec<_> = self.0.iter().map(|test| enlarged(test.rows[0].moments[0].size)).collect();
        let height = sizes.iter().map(|size| size[1]).max().unwrap_or(0) + 2 * LINE;
        let wide = |size: &[usize; 2]| size[0].max(WIDE) + GAP;
        let mut canvas = Canvas::new(GAP + sizes.iter().map(wide).sum::<usize>(), LINE + names.len() * height);
        let mut x = GAP;
        for (test, size) in self.0.iter().zip(&sizes) {
            canvas.text(x, 2, test.title.split(':').next().unwrap_or_default());
            for (r, name) in names.iter().enumerate() {
                let Some(row) = test.rows.iter().find(|row| row.name == *name) else { continue };
                let y = LINE + r * height;
                let text: String = format!("{} {}", row.name, row.verdict).chars().take(size[0] / LETTER).collect();
                canvas.text(x, y, &text);
                canvas.picture([x, y + LINE], *size, &row.moments[0], test.gain.unwrap_or(1.0));
                canvas.label(x + 2, y + LINE + 2, &row.moments[0].name);
            }
            x += wide(size);
        }
        image_io::write_png(path, canvas.width as u32, canvas.height as u32, &canvas.rgb, &[])?;
        Ok(true)
    }
}

/// Size in which a picture is shown, pixels.
fn enlarged(size: [usize; 2]) -> [usize; 2] {
    let zoom = WIDE.div_ceil(size[0]).clamp(1, 4);
    size.map(|n| n * zoom)
}

/// RGB bytes that are painted on.
struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

const PAPER: [u8; 3] = [24; 3];
const INK: [u8; 3] = [235; 3];

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        Self { width, height, rgb: PAPER.repeat(width * height) }
    }

    fn put(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            let at = 3 * (y * self.width + x);
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Puts a picture into a rectangle: pixels are repeated where it is larger, averaged where it is smaller.
    fn picture(&mut self, [x, y]: [usize; 2], size: [usize; 2], moment: &Moment, gain: f32) {
        let bytes = moment.bytes(gain);
        let range = |at: usize, axis: usize| {
            let from = at * moment.size[axis] / size[axis];
            from..((at + 1) * moment.size[axis] / size[axis]).max(from + 1)
        };
        for (py, px) in (0..size[1]).flat_map(|py| (0..size[0]).map(move |px| (py, px))) {
            let (mut sum, mut count) = ([0u32; 3], 0);
            for (sy, sx) in range(py, 1).flat_map(|sy| range(px, 0).map(move |sx| (sy, sx))) {
                let at = 3 * (sy * moment.size[0] + sx);
                (0..3).for_each(|c| sum[c] += u32::from(bytes[at + c]));
                count += 1;
            }
            self.put(x + px, y + py, sum.map(|v| (v / count) as u8));
        }
    }

    /// Text on a picture: over a strip that makes it readable.
    fn label(&mut self, x: usize, y: usize, text: &str) {
        for (dx, dy) in (0..LETTER * text.chars().count() + 2).flat_map(|dx| (0..10).map(move |dy| (dx, dy))) {
            self.put((x + dx).saturating_sub(1), (y + dy).saturating_sub(1), PAPER);
        }
        self.text(x, y, text);
    }

    fn text(&mut self, x: usize, y: usize, text: &str) {
        for (i, letter) in text.chars().enumerate() {
            let rows = font8x8::BASIC_FONTS.get(letter).or_else(|| font8x8::LATIN_FONTS.get(letter));
            for (dy, row) in rows.unwrap_or_default().into_iter().enumerate() {
                for dx in (0..8).filter(|dx| row >> dx & 1 == 1) {
                    self.put(x + LETTER * i + dx, y + dy, INK);
                }
            }
        }
    }
}
