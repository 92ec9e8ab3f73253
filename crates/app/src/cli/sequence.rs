//! Frames of a camera path or an animation: which ones, when, and what their files are called.

use super::args::usage;
use anyhow::Result;
use bouncelight_scene::path::CameraPath;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Flags that draw many pictures.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Sequence")]
pub struct SequenceFlags {
    /// Camera path, JSON of the viewer; --output needs `{frame}` or `{frame:04}` in its name.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["eye", "look_at", "camera", "reference"])]
    path: Option<PathBuf>,
    /// Frames of the path or the animation, A to B-1 [default: all of the path].
    #[arg(long, value_name = "A..B", conflicts_with = "reference", value_parser = parse_frames)]
    frames: Option<Range<u32>>,
    /// Time between frames, above 0, such as 1/24 [default: 1/60].
    #[arg(long, value_name = "SECONDS", value_parser = parse_step)]
    fixed_dt: Option<f64>,
}

/// Seconds from one frame to the next where nobody says.
const STEP: f64 = 1.0 / 60.0;

/// Most frames of one run.
const MOST: f64 = 1e6;

/// Frames, seen along a path or by the scene's own camera.
#[derive(Debug)]
pub struct Sequence {
    path: Option<CameraPath>,
    frames: Range<u32>,
    step: f64,
}

impl SequenceFlags {
    /// True where more than one picture is asked for.
    pub fn is_given(&self) -> bool {
        self.path.is_some() || self.frames.is_some()
    }

    /// The sequence that is asked for, if one is. `output` is the pattern of the files' names; the
    /// scene is `animated` or stands still.
    pub fn sequence(&self, output: &Path, animated: bool) -> Result<Option<Sequence>> {
        if !self.is_given() {
            let text = "--fixed-dt belongs to the frames of --path or --frames".to_owned();
            return if self.fixed_dt.is_some() { Err(usage(text)) } else { Ok(None) };
        }
        if name(output, 0) == name(output, 1) {
            let flag = if self.path.is_some() { "--path" } else { "--frames" };
            let text = format!("{}: with {flag} the name needs a `{{frame}}` or `{{frame:04}}`", output.display());
            return Err(usage(text));
        }
        let step = self.fixed_dt.unwrap_or(STEP);
        let Some(file) = &self.path else {
            let Some(frames) = self.frames.clone().filter(|_| animated) else {
                return Err(usage("--frames are those of a --path or an --animation".into()));
            };
            return Ok(Some(Sequence { path: None, frames, step }));
        };
        let path = CameraPath::load(file)?;
        let all = path.end() / step;
        if all > MOST {
            return Err(usage(format!("--fixed-dt {step} makes {all:.0} frames of {}", file.display())));
        }
        // Half a millionth of a frame forgives what rounding does to 1/60.
        let frames = self.frames.clone().unwrap_or(0..(all + 5e-7) as u32 + 1);
        Ok(Some(Sequence { path: Some(path), frames, step }))
    }
}

impl Sequence {
    /// Number, seconds since frame 0, and the path's camera of each frame.
    pub fn frames(&self) -> impl Iterator<Item = (u32, f64, Option<bouncelight::scene::Camera>)> + '_ {
        self.frames.clone().filter_map(|n| {
            let time = f64::from(n) * self.step;
            let camera = match &self.path {
                Some(path) => Some(path.at(time)?.camera()),
                None => None,
            };
            Some((n, time, camera))
        })
    }

    /// How many there are.
    pub fn count(&self) -> u64 {
        self.frames.len() as u64
    }
}

/// The name of frame `number`: `{frame}` or `{frame:04}` of `pattern` becomes its number, padded
/// with zeros.
pub fn name(pattern: &Path, number: u32) -> PathBuf {
    let text = pattern.to_string_lossy();
    let found = text.find("{frame").and_then(|start| Some((start, start + text[start..].find('}')?)));
    let Some((start, end)) = found else { return pattern.to_owned() };
    let format = &text[start + "{frame".len()..end];
    let width =
        if format.is_empty() { Some(0) } else { format.strip_prefix(':').and_then(|w| w.parse::<usize>().ok()) };
    match width.filter(|w| *w <= 32) {
        Some(width) => format!("{}{number:0width$}{}", &text[..start], &text[end + 1..]).into(),
        None => pattern.to_owned(),
    }
}

fn parse_frames(text: &str) -> Result<Range<u32>, String> {
    let (a, b) = text.split_once("..").ok_or("write it as A..B, such as 0..60")?;
    let number = |t: &str| t.parse::<u32>().map_err(|e| format!("{t}: {e}"));
    match (number(a)?, number(b)?) {
        (a, b) if a < b => Ok(a..b),
        _ => Err("B must be above A".into()),
    }
}

fn parse_step(text: &str) -> Result<f64, String> {
    let number = |t: &str| t.trim().parse::<f64>().map_err(|e| format!("{t}: {e}"));
    let step = match text.split_once('/') {
        Some((a, b)) => number(a)? / number(b)?,
        None => number(text)?,
    };
    if step.is_finite() && step > 0.0 { Ok(step) } else { Err("the time between frames must be above 0".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_hold_the_number() {
        let of = |pattern: &str, n| name(Path::new(pattern), n).to_string_lossy().into_owned();
        assert_eq!(of("out_{frame:04}.exr", 7), "out_0007.exr");
        assert_eq!((of("{frame}.png", 12), of("a{frame:2}.png", 3)), ("12.png".into(), "a03.png".into()));
        for plain in ["out.png", "{frame:x}.png", "{frame", "{frames}.png", "{frame:99}.png"] {
            assert_eq!(of(plain, 1), plain);
        }
    }

    #[test]
    fn frames_and_steps_are_read() {
        assert_eq!(parse_frames("3..5"), Ok(3..5));
        assert!(["", "3", "5..3", "1..1", "a..b"].iter().all(|t| parse_frames(t).is_err()));
        assert!((parse_step("1/24").unwrap() - 1.0 / 24.0).abs() < 1e-12);
        assert!(["0", "-1", "1/0", "x", "nan"].iter().all(|t| parse_step(t).is_err()));
    }
}
