//! Host side of the network's kernels: one arena, pipelines and bind groups built once, one compute pass a step.
//!
//! The caller fills [`Network::input`] (all channels, padding included, as zeros), records, and reads
//! [`Network::output`]. Recording allocates nothing. The input's memory is reused by later layers.

mod build;
mod examples;
mod kernels;
mod pack;

use super::format::Weights;
use super::graph::Graph;
use super::plan::{Plan, PlanError, Precision};
use crate::gpu::timing::Recorder;
pub use build::StepUniform;
use build::{Layer, Pipelines};
pub use examples::example_preludes;
pub use kernels::{Bound, Filter, Kernel, Part, Variant};
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
    /// Storage of weights and tensors. With [`Precision::F16`] input and output stay in 32 bits.
    pub precision: Precision,
    /// Seed of dropout; off without one.
    pub dropout: Option<u32>,
    /// Operators are fused; off for tests that compare.
    pub fuse: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { variant: Variant::default(), precision: Precision::default(), dropout: None, fuse: true }
    }
}

/// One tensor on the GPU: NHWC f32, channels padded to a multiple of four.
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
    arena: wgpu::Buffer,
    steps: wgpu::Buffer,
    layers: Vec<Layer>,
    pipelines: Pipelines,
}

impl Network {
    /// Builds pipelines, uploads weights, allocates the arena for an input of `size` (width, height).
    ///
    /// # Errors
    /// [`NetError`] when the graph does not take the size, or the device grants too little.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        size: [u32; 2],
    ) -> Result<Self, NetError> {
        Self::with_options(device, queue, weights, size, Options::default())
    }

    /// As [`Network::new`], told how.
    ///
    /// # Errors
    /// As [`Network::new`].
    pub fn with_options(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        size: [u32; 2],
        options: Options,
    ) -> Result<Self, NetError> {
        Self::build(device, queue, weights, size, options, Pipelines::default())
    }

    fn build(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        size: [u32; 2],
        options: Options,
        mut pipelines: Pipelines,
    ) -> Result<Self, NetError> {
        let plan = build::plan(device, &weights.graph, size, options)?;
        let kernels: Vec<Kernel> = plan.steps.iter().map(|s| Kernel::choose(&plan, s, options.variant)).collect();
        build::check_limits(device, &plan, &kernels)?;
        pipelines.keep(&kernels);
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        // wgpu clears new buffers; the kernels count on the zeros at the beginning.
        let arena = build::buffer(device, "net.arena", plan.arena_bytes, usage);
        let steps = build::steps_buffer(device, &kernels);
        queue.write_buffer(&steps, 0, &build::uniforms(&plan, &kernels, options.dropout));
        let layers = build::layers(device, &plan, kernels, &mut pipelines, &arena, &steps);
        let network = Self { graph: weights.graph.clone(), plan, options, arena, steps, layers, pipelines };
        network.upload(queue, weights);
        Ok(network)
    }

    /// The same network for another size and other weights, whose graph may be another. Pipelines that serve again are kept.
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
        let Self { options, pipelines, .. } = self;
        Self::build(device, queue, weights, size, options, pipelines)
    }

    /// Replaces the trained numbers from the queue's next submission on. Allocates nothing on the GPU.
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

    /// Another seed for dropout, from the queue's next submission on; nothing happens to a network without dropout.
    pub fn set_seed(&mut self, queue: &wgpu::Queue, seed: u32) {
        if self.options.dropout.is_some() {
            self.options.dropout = Some(seed);
            let kernels = self.layers.iter().map(|l| &l.kernel);
            queue.write_buffer(&self.steps, 0, &build::uniforms(&self.plan, kernels, self.options.dropout));
        }
    }

    fn upload(&self, queue: &wgpu::Queue, weights: &Weights) {
        for (layer, step) in self.layers.iter().zip(&self.plan.steps) {
            if let Some(buffer) = &layer.weights {
                for (bytes, offset) in pack::pack(weights, step, &layer.kernel).iter().zip(layer.offsets()) {
                    queue.write_buffer(buffer, offset, bytes);
                }
            }
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
        for layer in &self.layers {
            recorder.compute(&layer.label, |pass| {
                pass.set_pipeline(&layer.pipeline);
                for (bind_group, part) in layer.bind_groups.iter().zip(&layer.kernel.parts) {
                    let [x, y, z] = layer.kernel.workgroups(part.blocks);
                    pass.set_bind_group(0, bind_group, &[]);
                    pass.dispatch_workgroups(x, y, z);
                }
            });
        }
    }

    /// GPU memory of tensors, weights and uniforms, bytes.
    pub fn bytes(&self) -> u64 {
        let weights = self.layers.iter().filter_map(|l| l.weights.as_ref()).map(wgpu::Buffer::size);
        self.arena.size() + self.steps.size() + weights.sum::<u64>()
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
        Binding { buffer: &self.arena, offset: tensor.offset, size: tensor.bytes() }
    }
}
