//! Weights as a frame's method, and how they run.

use crate::gi::gather;
use crate::net::format::Weights;
use crate::net::gpu::{self, Tuned};
use crate::net::plan::Precision;
use std::sync::Arc;

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
    /// Numbers of the `gather` whose filter the network guides.
    pub gather: gather::Options,
}

impl From<Weights> for Neural {
    fn from(weights: Weights) -> Self {
        // What a filter's answer is worth ends long before halves do; its layers wait for memory.
        let network = gpu::Options { precision: Precision::F16, packed_input: true, ..gpu::Options::default() };
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
