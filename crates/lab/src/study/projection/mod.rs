//! What counted work would take on a card that nobody here owns: a model of five terms, fitted to
//! what other cards took. Never a measurement; whoever prints it says so.

mod card;
pub mod fit;
mod layer;
mod model;

pub use card::{Card, GTX_1050, GTX_1650};
pub use model::{Modelled, Parameters, model, modelled};

use serde::{Deserialize, Serialize};

/// Arithmetic and memory traffic of one pass: of a frame's counted by its shaders (`study::count`),
/// of a network's layers and of the plan that they follow.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// The pass's label, as in the timing table.
    pub pass: String,
    /// Operations of all threads, on floats, integers and comparisons; a multiply-add counts 2, a
    /// transcendental or division 4.
    pub flops: f64,
    /// Operations that threads let pass while they wait for the slowest of their 32. They take a
    /// card's time, too.
    #[serde(default)]
    pub waited: f64,
    /// Bytes that move between memory and the chip: what shaders ask of each binding, but of none
    /// more than it has.
    pub bytes: f64,
    /// Rays into the scene's triangles, those that only ask whether something stands between
    /// included.
    #[serde(default)]
    pub rays: f64,
    /// Dispatches; none in a record of an earlier version, which so tells that the fields below are
    /// not known.
    #[serde(default)]
    pub dispatches: f64,
    /// Threads of all dispatches, in whole 32s.
    #[serde(default)]
    pub threads: f64,
    /// Reads of memory that wait for the one before, of all threads, each of 32 as many as the one
    /// of them with most.
    #[serde(default)]
    pub links: f64,
    /// The same of the 32 with most, of each dispatch after the other.
    #[serde(default)]
    pub longest: f64,
    /// Operations of the 32 with most, of each dispatch after the other.
    #[serde(default)]
    pub steps: f64,
    /// Barriers that a thread meets, of each dispatch after the other.
    #[serde(default)]
    pub barriers: f64,
}

impl Cost {
    /// A row of the table, of which no thread waits for another.
    pub fn new(pass: &str, flops: f64, bytes: f64) -> Self {
        Self { pass: pass.into(), flops, bytes, ..Self::default() }
    }

    /// Whether threads were counted, without which a time would leave out most of what takes it.
    pub fn has_threads(&self) -> bool {
        self.dispatches > 0.0
    }

    /// The same with so many rays.
    pub fn with_rays(self, rays: f64) -> Self {
        Self { rays, ..self }
    }
}

/// Whether a pass of that label finds or adds indirect light.
pub fn is_indirect(pass: &str) -> bool {
    pass.starts_with("gi.") || pass.starts_with("net.") || ["pictures", "paint"].contains(&pass)
}
