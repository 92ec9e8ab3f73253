//! Weights as a frame's method, and how they run.

use crate::gi::gather;
use crate::net::format::Weights;
use crate::net::gpu::{self, Tuned};
use crate::net::plan::Precision;
use std::sync::Arc;

/// A network as a method (a filter's or a generator's): its weights, and how it runs.
/// `weights.into()` has the defaults.
#[derive(Debug, Clone)]
pub struct Neural {
    /// The weights.
    pub weights: Weights,
    /// Kernels and storage. Default: 16 bits and a packed input. Dropout is for published
    /// generators; in frames it is a fixed error.
    pub network: gpu::Options,
    /// Kernels that a tuner found fastest on this device. Default: none; the choice is then by
    /// counted loads.
    pub tuned: Arc<Tuned>,
    /// Options of the `gather` whose filter the network guides, or whose light it is given.
    pub gather: gather::Options,
}

impl From<Weights> for Neural {
    fn from(weights: Weights) -> Self {
        // What a filter's answer is worth ends long before halves do; its layers wait for memory.
        let network = gpu::Options { precision: Precision::F16, packed_input: true, ..gpu::Options::default() };
        Self { weights, network, tuned: Arc::default(), gather: gather::Options::default() }
    }
}

/// The feature of generators that needs the light of `gather`.
const GATHERED: &str = "gathered";

impl Neural {
    /// Whether a generator of these weights is given the picture with the light of `gather`.
    pub fn is_given_gathered(&self) -> bool {
        self.weights.inputs.iter().any(|feature| feature.name == GATHERED)
    }

    /// The same with its numbers stored as `precision` says, where it says something.
    pub fn stored(mut self, precision: Option<Precision>) -> Self {
        self.network.precision = precision.unwrap_or(self.network.precision);
        self
    }
}
