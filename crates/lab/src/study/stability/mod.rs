//! Where methods fail, as named tests: small scenes, short sequences, numbers with thresholds, the
//! path tracer's own number beside each.
//!
//! ```text
//!  tests/*  one function a test, written against [`TestRun`]: "these frames, please" ─► observations ─► numbers
//!  test_run who draws them: a method, the path tracer, or the path tracer spoilt by a [`Corruption`]
//!  suite    runs test × subject; the path tracer must pass each test, and its spoilt copy must fail it
//!  record   what JSON and tables are made of;  sheet: contact sheets and short sequences
//! ```
//!
//! A test does not know who draws. So the truth takes every test, too: what it does not pass is no
//! test of methods; and a test that the truth still passes when it is spoilt on purpose measures
//! nothing.

mod corruption;
mod explain;
mod measures;
mod observation;
mod page;
mod record;
mod rooms;
mod script;
mod sheet;
mod suite;
mod test_run;
mod tests;

pub use corruption::Corruption;
pub use observation::Observation;
pub use page::page;
pub use record::{Criterion, Finding, Found, Record, SCHEMA};
pub use script::Script;
pub use sheet::{Moment, Overview, Sheet};
pub use suite::{Event, Suite, SuiteOptions};
pub use test_run::{Subject, TestRun};
pub use tests::{all, named};

use super::session::SessionError;
use crate::metrics::MetricError;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What a number means, and how it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// A share, shown in per cent.
    Share,
    /// Frames.
    Frames,
    /// Pieces: pixels, faults.
    Count,
    /// FLIP, 0 to 1.
    Flip,
}

impl Unit {
    /// `value` in this unit.
    pub fn text(self, value: f64) -> String {
        match self {
            _ if !value.is_finite() => "none".into(),
            Unit::Share if value != 0.0 && value < 0.001 => format!("{:.4} %", 100.0 * value),
            Unit::Share if value < 0.1 => format!("{:.2} %", 100.0 * value),
            Unit::Share => format!("{:.0} %", 100.0 * value),
            Unit::Frames | Unit::Count => format!("{value:.0}"),
            Unit::Flip => format!("{value:.3}"),
        }
    }
}

/// A number that a test finds, and what it may be at most.
#[derive(Debug, Clone, Copy)]
pub struct Limit {
    /// What is measured.
    pub name: &'static str,
    /// In which unit.
    pub unit: Unit,
    /// The largest value that passes.
    pub at_most: f64,
    /// Where that comes from.
    pub source: &'static str,
}

impl Limit {
    const fn share(name: &'static str, at_most: f64, source: &'static str) -> Self {
        Self { name, unit: Unit::Share, at_most, source }
    }

    const fn frames(name: &'static str, at_most: f64, source: &'static str) -> Self {
        Self { name, unit: Unit::Frames, at_most, source }
    }

    const fn count(name: &'static str, at_most: f64, source: &'static str) -> Self {
        Self { name, unit: Unit::Count, at_most, source }
    }

    const fn flip(name: &'static str, at_most: f64, source: &'static str) -> Self {
        Self { name, unit: Unit::Flip, at_most, source }
    }
}

/// A named test.
pub struct Test {
    /// Name, as `--suite` takes it.
    pub name: &'static str,
    /// What can go wrong, one sentence.
    pub question: &'static str,
    /// Its numbers, in the order in which `run` returns them.
    pub limits: &'static [Limit],
    /// With what the truth is spoilt, so that the test must fail.
    pub control: Corruption,
    /// Width and height of its pictures, pixels; generators draw larger ones ([`Test::size_of`]).
    pub size: [u32; 2],
    /// Paths a point of the truth.
    pub paths: u32,
    /// Whether generators can take it: they answer pictures, not light.
    pub pictures: bool,
    /// Draws and measures.
    pub run: fn(&TestRun<'_>) -> Result<Vec<f64>, StabilityError>,
}

/// Generators know things as large as they are in pictures of this width, pixels.
const PAINTED: u32 = 512;

impl Test {
    /// Width and height of the pictures that `subject` draws, pixels.
    pub fn size_of(&self, subject: &Subject) -> [u32; 2] {
        let times = if subject.paints() { PAINTED.div_ceil(self.size[0]) } else { 1 };
        self.size.map(|n| n * times)
    }
}

/// Why a test could not be run, which is no answer of a method.
#[derive(Debug, Error)]
pub enum StabilityError {
    /// Drawing or tracing failed.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Pictures that cannot be compared.
    #[error(transparent)]
    Metric(#[from] MetricError),
    /// A result could not be read back.
    #[error(transparent)]
    Readback(#[from] bouncelight::gpu::readback::ReadbackError),
    /// A picture could not be written.
    #[error(transparent)]
    Image(#[from] bouncelight_scene::image_io::ImageError),
    /// No such test.
    #[error("there is no test `{name}`; there are: {known}")]
    NoTest {
        /// What was asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// A subject that the test has no meaning for.
    #[error("{0}")]
    NotForIt(&'static str),
}
