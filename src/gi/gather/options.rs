//! The free numbers of `gather`.

use crate::numbers::SplitMix;
use std::str::FromStr;
use thiserror::Error;

/// How light is gathered. The numbers that are choices stand in the table of `docs/internals/constants.md`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Longest history of a cell at rest, frames (1 and more). Short: noise. Long: slow to follow
    /// changes that the host does not announce. In motion and after changes 128 at most
    /// (`MAX_HISTORY_DYNAMIC` in `accumulate.wgsl`).
    pub cell_frames: f32,
    /// Longest history of a cache entry, rays (1 and more). Short: noise between surfaces. Long:
    /// stale light.
    pub entry_frames: f32,
    /// Slots of the cache, a power of two from 64 to 1,048,576. Few: places without an entry.
    pub slots: u32,
    /// Size of an entry's cell over its distance from the eye, before it is rounded up to a power
    /// of two. Large: indirect light is averaged. Small: more entries and rays.
    pub entry_scale: f32,
    /// Cache updates in a first frame, 1 to 64. Few: dark first frames. Many: slow ones.
    pub first_updates: u32,
    /// Spatial filters.
    pub blur: bool,
    /// All frames of a mean count alike, and changes shorten none: to see what the method converges
    /// to.
    pub progressive: bool,
    /// Surfaces that rays hit have specular lobes. Off as in Cycles without "Reflective Caustics";
    /// light is missing then.
    pub caustics: bool,
    /// Rays of the picture's cells a frame, spent where histories are shortest. Up to 1: a share of one
    /// a cell, from the 34th frame of a view on (1: as many as cells ask for). Above:
    /// a number that holds from the first frame on, but for cells without a history, which send one.
    /// Few: noise, and light that follows changes slowly. Without effect where `progressive`.
    pub rays: f32,
    /// Less is done once neither camera nor scene has changed for
    /// [`FRAMES_TO_REST`](super::FRAMES_TO_REST) frames. Without jitter, and where all that moves is
    /// [told](crate::gi::Inputs::moves_with_world), three frames in four show the cells of the last
    /// one. Else frames send a fourth of the rays. Off: all frames take as long.
    pub rest: bool,
    /// Seed of the cells' rays: other noise, same light.
    pub seed: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            cell_frames: 1024.0,
            entry_frames: 8.0,
            slots: 1 << 16,
            entry_scale: 1.0 / 16.0,
            first_updates: 32,
            blur: true,
            progressive: false,
            caustics: true,
            rays: 1.0,
            rest: true,
            seed: 0,
        }
    }
}

impl Options {
    /// Cells forget nothing and nothing is blurred: for asking what the method converges to.
    /// (Entries that remember n rays take n / (1 − albedo) updates to forget the black they began with.)
    pub const PLAIN: Self = Self {
        cell_frames: 1e9,
        entry_frames: 8.0,
        slots: 1 << 16,
        entry_scale: 1.0 / 16.0,
        first_updates: 64,
        blur: false,
        progressive: true,
        caustics: true,
        rays: 1.0,
        rest: true,
        seed: 0,
    };
}

impl Options {
    /// The words that [`FromStr`] makes the same numbers of; none where all are gather's own.
    pub fn words(&self) -> Option<String> {
        let own = Self::default();
        let flag = |v: bool| f32::from(u8::from(v));
        let numbers = |o: &Self| {
            [
                ("cell_frames", o.cell_frames),
                ("entry_frames", o.entry_frames),
                ("slots", o.slots as f32),
                ("entry_scale", o.entry_scale),
                ("first_updates", o.first_updates as f32),
                ("blur", flag(o.blur)),
                ("progressive", flag(o.progressive)),
                ("caustics", flag(o.caustics)),
                ("rays", o.rays),
                ("rest", flag(o.rest)),
                ("seed", o.seed as f32),
            ]
        };
        let other = numbers(self).into_iter().zip(numbers(&own)).filter(|(ours, own)| ours != own);
        let words: Vec<String> = other.map(|((name, value), _)| format!("{name}={value}")).collect();
        (!words.is_empty()).then(|| words.join(","))
    }

    /// What the seed turns the lattice of cells' rays by, in 2⁻³² of a turn.
    pub(super) fn shift(&self) -> [u32; 2] {
        let mut numbers = SplitMix::new(self.seed.into());
        [(); 2].map(|()| if self.seed == 0 { 0 } else { (numbers.next() * (1 << 24) as f32) as u32 * 256 })
    }
}

/// Why a list of numbers cannot be read.
#[derive(Debug, Error, PartialEq)]
pub enum OptionsError {
    /// No such number.
    #[error(
        "`{0}` is none of: plain, cell_frames=N, entry_frames=N, slots=N, entry_scale=X, first_updates=N, \
         blur=0|1, progressive=0|1, caustics=0|1, rays=all|X|N, rest=0|1, seed=N"
    )]
    Unknown(String),
    /// A value that cannot be.
    #[error("`{0}`: {1}")]
    Value(String, &'static str),
}

/// Words between commas: `plain` ([`Options::PLAIN`]) or `name=value`, each over the ones before.
impl FromStr for Options {
    type Err = OptionsError;

    fn from_str(text: &str) -> Result<Self, OptionsError> {
        let mut options = Self::default();
        for word in text.split(',') {
            if word == "plain" {
                options = Self::PLAIN;
                continue;
            }
            let Some((name, value)) = word.split_once('=') else { return Err(OptionsError::Unknown(word.into())) };
            let wrong = |why| OptionsError::Value(word.into(), why);
            let value = if name == "rays" && value == "all" { "1" } else { value };
            let number: f32 = value.parse().map_err(|_| wrong("is no number"))?;
            let at_least_one = if number >= 1.0 { Ok(number) } else { Err(wrong("must be at least 1")) };
            match name {
                "cell_frames" => options.cell_frames = at_least_one?,
                "entry_frames" => options.entry_frames = at_least_one?,
                "first_updates" => options.first_updates = at_least_one?.min(64.0) as u32,
                "slots" if (64.0..=1_048_576.0).contains(&number) && (number as u32).is_power_of_two() => {
                    options.slots = number as u32;
                }
                "slots" => return Err(wrong("must be a power of two from 64 to 1048576")),
                "entry_scale" if number > 1e-4 && number <= 4.0 => options.entry_scale = number,
                "entry_scale" => return Err(wrong("must be above 0.0001 and at most 4")),
                "blur" => options.blur = number != 0.0,
                "progressive" => options.progressive = number != 0.0,
                "caustics" => options.caustics = number != 0.0,
                "rays" if number > 0.0 && number <= 16_777_216.0 => options.rays = number,
                "rays" => return Err(wrong("must be all, a share up to 1, or a number up to 16777216")),
                "rest" => options.rest = number != 0.0,
                // What a float counts exactly.
                "seed" if (0.0..=16_777_216.0).contains(&number) => options.seed = number as u32,
                "seed" => return Err(wrong("must be a whole number up to 16777216")),
                _ => return Err(OptionsError::Unknown(word.into())),
            }
        }
        Ok(options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_and_wrong_ones_named() {
        let read: Options = "plain,blur=1,slots=4096".parse().unwrap();
        assert_eq!(read, Options { blur: true, slots: 4096, ..Options::PLAIN });
        for options in [
            read,
            Options::PLAIN,
            Options { caustics: false, entry_scale: 0.1, rays: 0.5, rest: false, seed: 7, ..Default::default() },
        ] {
            assert_eq!(options.words().unwrap().parse(), Ok(options));
        }
        assert_eq!(Options::default().words(), None);
        assert_eq!("rays=all".parse(), Ok(Options::default()));
        for bad in [
            "",
            "ray=3",
            "rays=0",
            "rays=nan",
            "slots=1000",
            "cell_frames=0",
            "cell_frames=nan",
            "entry_scale=-1",
            "blur",
            "seed=-1",
        ] {
            let error = bad.parse::<Options>().unwrap_err().to_string();
            assert!(error.contains(bad), "{error}");
        }
    }
}
