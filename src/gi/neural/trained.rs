//! Weights as a frame's method: which of them it can run, and how they run.

use super::features::FeatureSet;
use super::reconstruct::Answer;
use crate::gi::gather;
use crate::gi::interface::GiError;
use crate::gi::stage::inputs::CELL;
use crate::net::format::Weights;
use crate::net::gpu::{self, Tuned};
use crate::net::plan::Precision;
use std::sync::Arc;

/// What the output of a network that filters means, in weights files.
pub const FILTER: &str = "filter";

/// Whether the weights are those of a network that filters.
pub fn is_filter(weights: &Weights) -> bool {
    weights.output.meaning == FILTER
}

/// Whether weights have method `gather` run before or around them, and so need
/// [`Inputs::rays`](crate::gi::Inputs::rays).
pub fn needs_guess(weights: &Weights) -> bool {
    is_filter(weights)
        || weights.output.meaning == Answer::Gain.name()
        || weights.inputs.iter().any(|f| f.name == "guess")
}

/// A network as a frame's method: what was trained, and how it runs.
#[derive(Debug, Clone)]
pub struct Neural {
    /// The trained numbers.
    pub weights: Weights,
    /// Kernels and storage. Dropout does not belong into frames; with a seed every frame has the
    /// same.
    pub network: gpu::Options,
    /// What a tuner has found on this device; empty without one.
    pub tuned: Arc<Tuned>,
    /// Numbers of the `gather` whose answer the network corrects.
    pub gather: gather::Options,
}

impl From<Weights> for Neural {
    fn from(weights: Weights) -> Self {
        // What a filter's answer is worth ends long before halves do; its layers wait for memory.
        let packed_input = is_filter(&weights);
        let precision = if packed_input { Precision::F16 } else { Precision::F32 };
        let network = gpu::Options { precision, packed_input, ..gpu::Options::default() };
        Self { weights, network, tuned: Arc::default(), gather: gather::Options::default() }
    }
}

impl Neural {
    /// The same with its numbers stored as `precision` says, where it says something.
    pub fn stored(mut self, precision: Option<Precision>) -> Self {
        self.network.precision = precision.unwrap_or(self.network.precision);
        self
    }
}

/// The feature set of weights that this pass can run, and what their numbers mean.
pub(super) fn check_weights(weights: &Weights) -> Result<(FeatureSet, Answer), GiError> {
    let table = &weights.table;
    if (table.name.as_str(), table.version, weights.cell) != ("screen", 1, CELL) {
        let found = format!("table {} version {}, {} pixels a cell", table.name, table.version, weights.cell);
        let reason = format!("list is made for {found}; this program makes screen version 1, {CELL} pixels a cell");
        return Err(GiError::Feature { name: "(all)".into(), reason });
    }
    let output = &weights.output;
    let fits = |a: &Answer| output.meaning == a.name() && output.channels == a.channels();
    let Some(answer) = [Answer::Light, Answer::Gain].into_iter().find(fits) else {
        return Err(GiError::Output(format!("{} channels of `{}`", output.channels, output.meaning)));
    };
    Ok((FeatureSet::new(weights.inputs.iter().map(|f| (f.name.as_str(), f.channels)))?, answer))
}
