//! Speed charted against accuracy: every method over a set of scenes, measured and judged, with the
//! paths that would do the same.
//!
//! [`run`] fills a [`Record`], piece by piece, so that what was done is kept; [`summary`] makes
//! means, spreads and the Pareto frontier of it; [`report`] writes, and `training/chart.py` draws
//! what was written.

pub mod entries;
pub mod plan;
pub mod published;
pub mod report;
pub mod run;
pub mod scenes;
mod stage;
pub mod summary;

use super::{
    bench::{BenchError, Spread},
    device::Device,
    projection::Cost,
    session::SessionError,
};
use crate::metrics::MetricError;
use bouncelight::gpu_scene::UploadError;
use bouncelight::net::gpu::NetError;
use bouncelight_scene::SceneError;
use bouncelight_scene::image_io::ImageError;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use thiserror::Error;

/// What is up on the chart; less is better for all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Error of the light that a method has to add
    /// ([`judge::light_error`](super::judge::light_error)).
    Light,
    /// FLIP of the finished picture.
    Flip,
    /// The paper's L1 of the finished picture, for as many pixels as 1024×512 has.
    L1,
}

impl Metric {
    /// All of them.
    pub const ALL: [Metric; 3] = [Metric::Light, Metric::Flip, Metric::L1];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        ["light", "flip", "l1"][self as usize]
    }

    /// What an axis says.
    pub fn title(self) -> &'static str {
        ["error of the light that is added, %", "FLIP", "the paper's L1 (sum, for 1024×512 pixels)"][self as usize]
    }

    /// The value of a score.
    pub fn of(self, scores: &Scores) -> Option<f64> {
        match self {
            Metric::Light => scores.light,
            Metric::Flip => Some(scores.flip),
            Metric::L1 => Some(scores.l1),
        }
    }

    /// As it is printed.
    pub fn text(self, value: f64) -> String {
        match self {
            Metric::Light => format!("{:.1} %", 100.0 * value),
            Metric::Flip => format!("{value:.4}"),
            Metric::L1 => format!("{value:.0}"),
        }
    }
}

/// How near one picture is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Error of the light; absent where an entry has no light of its own to compare, or the scene
    /// none.
    pub light: Option<f64>,
    /// How much too bright that light is, as a share of it.
    pub light_bias: Option<f64>,
    /// FLIP.
    pub flip: f64,
    /// The paper's L1, for as many pixels as 1024×512 has.
    pub l1: f64,
    /// Decibels on display values; absent for equal pictures.
    pub psnr: Option<f64>,
    /// Relative mean square error of radiance; absent for networks on pictures.
    pub relmse: Option<f64>,
}

/// What it costs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Time {
    /// Sum of all passes' timestamps in a frame, rasteriser included, milliseconds.
    pub gpu_ms: Option<Spread>,
    /// The same frame from recording until the device is idle, milliseconds: the check beside it.
    pub wall_ms: Spread,
}

/// One entry in one scene: a piece of the work.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// Everything that decides the result; a piece with the same key is not done again.
    pub key: String,
    /// Name of the entry.
    pub entry: String,
    /// Name of the scene.
    pub scene: String,
    /// Why there is nothing more of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
    /// The picture as it stands: settled, for methods with a history.
    pub scores: Option<Scores>,
    /// The first frame after a cut, for methods with a history.
    pub cold: Option<Scores>,
    /// A frame of a still camera.
    pub time: Option<Time>,
    /// A frame that is the first after a cut, for methods with a history.
    pub cold_time: Option<Time>,
    /// Counted cost of the passes that find and add indirect light.
    pub costs: Vec<Cost>,
    /// GPU memory of everything, bytes.
    pub bytes: u64,
    /// Which method drew in its place, and why.
    pub fallback: Option<String>,
}

/// What kind of thing an entry is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Drawn in a frame.
    Method,
    /// A network on four pictures of the rasteriser, as the paper's.
    Pictures,
    /// Paths traced.
    Paths,
}

/// An entry as the record names it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EntryFacts {
    /// Name.
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Hash of its weights.
    pub weights: Option<String>,
    /// Paths a pixel.
    pub paths: Option<u32>,
}

/// A scene as the record names it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneFacts {
    /// Name.
    pub name: String,
    /// Hash of its content.
    pub hash: String,
    /// Pixels of its pictures.
    pub size: [u32; 2],
    /// Where its reference comes from.
    pub reference: String,
    /// Fewest and most samples of its reference's pixels, where they are known.
    pub samples: Option<[u32; 2]>,
    /// Root mean square error of the reference's light at a pixel, as a share of its mean, and of a
    /// block of 4×4.
    pub noise: Option<[f64; 2]>,
    /// Where it failed, and nothing was done in it.
    pub failed: Option<String>,
}

/// Where a record comes from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// What was typed.
    pub command: String,
    /// The program's version.
    pub version: String,
    /// The source's commit, with `+` where files differ from it; `unknown` outside a repository.
    pub commit: String,
    /// First 16 digits of the program file's SHA-256.
    pub program: String,
    /// Day on which it was finished, UTC, as YYYY-MM-DD.
    pub date: String,
}

/// Everything that `chart --out` writes as JSON.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Version of this record, 1.
    pub schema: u32,
    /// Where it comes from.
    pub provenance: Provenance,
    /// What it ran on.
    pub device: Device,
    /// Pixels of the pictures, but for scenes that bring a reference of their own.
    pub size: [u32; 2],
    /// Jittered frames averaged in settled pictures; cold ones have one.
    pub samples: u32,
    /// Frames timed, and frames before them.
    pub frames: [u32; 2],
    /// Bound of the references' error at a pixel, and most samples.
    pub reference: (f64, u32),
    /// Light that gloss throws on after a diffuse bounce is left out, in references, paths and
    /// methods.
    #[serde(default)]
    pub no_caustics: bool,
    /// Entries, in the order of the table.
    pub entries: Vec<EntryFacts>,
    /// Scenes.
    pub scenes: Vec<SceneFacts>,
    /// Results.
    pub units: Vec<Unit>,
    /// The paper's generator, run here.
    pub generator: Option<published::Generator>,
}

/// Why a chart could not be made.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ChartError {
    /// A folder that holds nothing to judge by.
    #[error(
        "{}: no references here: a folder with scene.glb, frame0000.exr and meta.json, folders of that kind, or \
         roomIIII_view0.exr are needed", path.display()
    )]
    NoReferences { path: PathBuf },
    /// A file of a reference.
    #[error("{}: {reason}", path.display())]
    File { path: PathBuf, reason: String },
    /// A scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A picture cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Drawing or tracing failed.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Comparing failed.
    #[error(transparent)]
    Metric(#[from] MetricError),
    /// A network does not fit.
    #[error(transparent)]
    Net(#[from] NetError),
    /// A measurement failed.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// A scene of a sweep does not fit.
    #[error(transparent)]
    Upload(#[from] UploadError),
    /// Reading back failed.
    #[error(transparent)]
    Readback(#[from] bouncelight::gpu::readback::ReadbackError),
    /// The driver refused a command.
    #[error("the GPU driver refused a command: {0}")]
    Driver(String),
    /// Whoever watches said so.
    #[error("stopped")]
    Stopped,
}
