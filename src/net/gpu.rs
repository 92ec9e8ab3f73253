//! Host side of the network's kernels: one arena, pipelines and bind groups built once, one compute
//! pass a step.
//!
//! The caller fills [`Network::input`] (all channels, padding included, as zeros), records, and
//! reads [`Network::output`]. Recording allocates nothing. The input's memory is reused by later
//! layers.

pub(crate) mod build;
mod conv;
mod examples;
mod kernel;
pub mod kernel_config;
mod kernels;
pub mod layer;
mod layer_readback;
mod pack;

use super::format::Weights;
use super::graph::Graph;
use super::plan::{Plan, PlanError, Precision};
use crate::gpu::{pipeline_cache::PipelineCache, timing::Recorder};
use build::{Layer, Memory};
pub use examples::example_preludes;
pub use kernel::{Bound, Choice, Kernel, Numbers, Part, Sum};
pub use kernel_config::{Facts, KernelConfig, Source, Tuned, Variant};
pub use layer::Filter;
pub use layer_readback::LayerReadback;
use std::sync::Arc;
use thiserror::Error;

/// Why a network cannot run on this device.
#[derive(Debug, Error)]
pub enum NetError {
    /// No plan for this size.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The device grants less than the network needs.
    #[error("network pass `{pass}`: the device's limit {limit} is {granted}, {needed} are needed")]
    Limit {
        /// Layer's label, or `net`.
        pass: String,
        /// WebGPU's name of the limit.
        limit: &'static str,
        /// What the device grants.
        granted: u64,
        /// What is needed.
        needed: u64,
    },
    /// Other weights must be for the same graph.
    #[error("the new weights are for another graph than the network's; build a network for them")]
    OtherGraph,
}

/// How a network runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Options {
    /// Convolution kernels.
    pub variant: Variant,
    /// Storage of weights and tensors. With [`Precision::F16`] the output stays in 32 bits and, unless
    /// it is packed, the input.
    pub precision: Precision,
    /// The caller writes the input in that precision, too: four halves a vector.
    pub packed_input: bool,
    /// Seed of dropout; off without one.
    pub dropout: Option<u32>,
    /// Operators are fused; off for tests that compare.
    pub fuse: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            variant: Variant::default(),
            precision: Precision::default(),
            packed_input: false,
            dropout: None,
            fuse: true,
        }
    }
}

impl Options {
    /// How the caller writes the input.
    pub fn input_precision(&self) -> Precision {
        if self.packed_input { self.precision } else { Precision::F32 }
    }
}

/// What a network is built with.
#[derive(Clone, Default)]
pub struct Setup {
    /// How it runs.
    pub options: Options,
    /// What a tuner has found on this device.
    pub tuned: Arc<Tuned>,
}

impl From<Options> for Setup {
    fn from(options: Options) -> Self {
        Self { options, ..Self::default() }
    }
}

/// One tensor on the GPU: NHWC, channels padded to a multiple of four; f32 but for a packed input.
#[derive(Debug, Clone, Copy)]
pub struct Binding<'a> {
    /// The arena (usage STORAGE, COPY_SRC, COPY_DST).
    pub buffer: &'a wgpu::Buffer,
    /// Byte offset, a multiple of 256.
    pub offset: u64,
    /// Bytes.
    pub size: u64,
}

impl<'a> Binding<'a> {
    /// For a bind group.
    pub fn resource(&self) -> wgpu::BindingResource<'a> {
        let size = wgpu::BufferSize::new(self.size);
        wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: self.buffer, offset: self.offset, size })
    }
}

/// A network ready to run at one input size.
pub struct Network {
    graph: Graph,
    plan: Plan,
    options: Options,
    memory: Memory,
    layers: Vec<Layer>,
    _pipeline_cache: PipelineCache,
    tuned: Arc<Tuned>,
}

impl Network {
    /// Compiles those kernels that nobody has yet on this device, uploads weights, allocates the arena for an input of `size` (width,
    /// height). `setup`: [`Options`] alone, or a whole [`Setup`].
    ///
    /// # Errors
    /// [`NetError`] when the graph does not take the size, or the device grants too little.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        size: [u32; 2],
        setup: impl Into<Setup>,
    ) -> Result<Self, NetError> {
        let Setup { options, tuned } = setup.into();
        let _pipeline_cache = PipelineCache::of(device);
        let plan = build::plan(device, &weights.graph, size, options)?;
        let choice = Choice { variant: options.variant, tuned: &tuned, facts: Facts::of(device) };
        let kernels: Vec<Kernel> = plan.steps.iter().map(|s| Kernel::choose(&plan, s, &choice)).collect();
        build::check_limits(device, &plan, &kernels)?;
        let memory = Memory::new(device, &plan, &kernels);
        queue.write_buffer(&memory.steps, 0, &build::uniforms(&plan, &kernels, options.dropout));
        let layers = build::layers(device, &plan, kernels, &memory);
        let graph = weights.graph.clone();
        let network = Self { graph, plan, options, memory, layers, _pipeline_cache, tuned };
        network.upload(queue, weights);
        Ok(network)
    }

    /// The same network for another size and other weights, whose graph may be another. Nothing
    /// that was compiled for it is compiled again.
    ///
    /// # Errors
    /// As [`Network::new`]; then the old network is gone.
    pub fn rebuilt(
        self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        size: [u32; 2],
    ) -> Result<Self, NetError> {
        let Self { options, tuned, _pipeline_cache, .. } = self;
        Self::new(device, queue, weights, size, Setup { options, tuned })
    }

    /// The same network with what a tuner has found in the meantime. Nothing that was compiled for
    /// it is compiled again.
    ///
    /// # Errors
    /// As [`Network::new`]; then the old network is gone.
    pub fn retuned(
        self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        weights: &Weights,
        tuned: Arc<Tuned>,
    ) -> Result<Self, NetError> {
        let Self { options, plan, _pipeline_cache, .. } = self;
        Self::new(device, queue, weights, [plan.width, plan.height], Setup { options, tuned })
    }

    /// Replaces the trained numbers from the queue's next submission on. Allocates nothing on the
    /// GPU.
    ///
    /// # Errors
    /// [`NetError::OtherGraph`] when the weights are for another graph.
    pub fn set_weights(&self, queue: &wgpu::Queue, weights: &Weights) -> Result<(), NetError> {
        if weights.graph != self.graph {
            return Err(NetError::OtherGraph);
        }
        self.upload(queue, weights);
        Ok(())
    }

    /// Another seed for dropout, from the queue's next submission on; nothing happens to a network
    /// without dropout.
    pub fn set_seed(&mut self, queue: &wgpu::Queue, seed: u32) {
        if self.options.dropout.is_some() {
            self.options.dropout = Some(seed);
            let kernels = self.layers.iter().map(|l| &l.kernel);
            queue.write_buffer(&self.memory.steps, 0, &build::uniforms(&self.plan, kernels, self.options.dropout));
        }
    }

    fn upload(&self, queue: &wgpu::Queue, weights: &Weights) {
        for (layer, step) in self.layers.iter().zip(&self.plan.steps) {
            let Some(buffer) = &layer.weights else { continue };
            let parts = pack::pack(weights, step, &layer.kernel);
            parts.iter().zip(layer.offsets()).for_each(|(bytes, offset)| queue.write_buffer(buffer, offset, bytes));
        }
    }

    /// Where the caller puts the input.
    pub fn input(&self) -> Binding<'_> {
        self.tensor(0)
    }

    /// Where the result is after [`Network::record`].
    pub fn output(&self) -> Binding<'_> {
        self.tensor(self.plan.output)
    }

    /// Records one compute pass a step, labelled `net.NAME`.
    pub fn record(&self, recorder: &mut Recorder<'_>) {
        for step in 0..self.layers.len() {
            self.record_step(step, recorder);
        }
    }

    /// Records one step alone, for measurements: its input is whatever lies in the arena.
    pub fn record_step(&self, step: usize, recorder: &mut Recorder<'_>) {
        let layer = &self.layers[step];
        recorder.compute(&layer.label, |pass| {
            pass.set_pipeline(&layer.pipeline);
            for (bind_group, part) in layer.bind_groups.iter().zip(&layer.kernel.parts) {
                let [x, y, z] = layer.kernel.workgroups(part);
                pass.set_bind_group(0, bind_group, &[]);
                pass.dispatch_workgroups(x, y, z);
            }
            if let (Some((pipeline, bind_group)), Some(sum)) = (&layer.sum, &layer.kernel.sum) {
                let [x, y, z] = sum.groups;
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, bind_group, &[]);
                pass.dispatch_workgroups(x, y, z);
            }
        });
    }

    /// How each step runs.
    pub fn kernels(&self) -> impl Iterator<Item = &Kernel> {
        self.layers.iter().map(|l| &l.kernel)
    }

    /// GPU memory of tensors, weights and uniforms, bytes.
    pub fn bytes(&self) -> u64 {
        self.memory.bytes() + self.layers.iter().filter_map(|l| l.weights.as_ref()).map(wgpu::Buffer::size).sum::<u64>()
    }

    /// Dispatches, memory, FLOPs.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// How it runs.
    pub fn options(&self) -> Options {
        self.options
    }

    fn tensor(&self, index: usize) -> Binding<'_> {
        let tensor = &self.plan.tensors[index];
        Binding { buffer: &self.memory.arena, offset: tensor.offset, size: tensor.bytes() }
    }
}
