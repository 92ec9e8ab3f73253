//! Host side of the network's kernels: one arena, pipelines and bind groups built once, one compute pass a layer.
//!
//! The caller fills [`Network::input`] (all channels, padding included, as zeros), records, and reads
//! [`Network::output`]. Recording allocates nothing. The input's memory is reused by later layers.

mod kernels;

use super::format::Weights;
use super::graph::Op;
use super::plan::{Plan, PlanError, Step};
use crate::gpu::{shaders, timing::Recorder};
pub use kernels::{Kernel, Variant, example_preludes};
use std::collections::HashMap;
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

/// The uniform that a kernel reads; `Step` in `shaders/net/common.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct StepUniform {
    in_size: [u32; 2],
    out_size: [u32; 2],
    input: u32,
    output: u32,
    skip: u32,
    first_block: u32,
}

struct Dispatch {
    bind_group: wgpu::BindGroup,
    workgroups: [u32; 3],
}

struct Layer {
    label: String,
    pipeline: wgpu::ComputePipeline,
    dispatches: Vec<Dispatch>,
}

/// A network ready to run at one input size.
pub struct Network {
    plan: Plan,
    arena: wgpu::Buffer,
    layers: Vec<Layer>,
    bytes: u64,
}

impl Network {
    /// Builds pipelines, uploads weights, allocates the arena for an input of `size` (width, height).
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        size: [u32; 2],
    ) -> Result<Self, NetError> {
        Self::with_variant(device, queue, weights, size, Variant::default())
    }

    /// As [`Network::new`] with a given family of kernels, for comparisons.
    pub fn with_variant(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        size: [u32; 2],
        variant: Variant,
    ) -> Result<Self, NetError> {
        let plan = Plan::new(&weights.graph, size[0], size[1])?;
        let kernels: Vec<Kernel> = plan.steps.iter().map(|s| Kernel::choose(&plan, s, variant)).collect();
        check_limits(device, &plan, &kernels)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        // wgpu clears new buffers; the kernels count on the zeros at the beginning.
        let arena = buffer(device, "net.arena", plan.arena_bytes, usage);
        let steps = upload_steps(device, queue, &plan, &kernels);
        let (packed, places) = upload_weights(device, queue, weights, &plan, &kernels);
        let mut pipelines = Pipelines { device, made: HashMap::new() };
        let mut layers = Vec::with_capacity(plan.steps.len());
        let mut slot = 0;
        for (i, (step, kernel)) in plan.steps.iter().zip(&kernels).enumerate() {
            let (pipeline, layout) = pipelines.get(kernel);
            let mut dispatches = Vec::new();
            for (d, (_, blocks)) in kernel.dispatches().into_iter().enumerate() {
                let whole = |buffer, offset, size| {
                    let size = wgpu::BufferSize::new(size);
                    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size })
                };
                let mut resources = vec![
                    whole(&steps, slot * SLOT, size_of::<StepUniform>() as u64),
                    whole(&arena, 0, plan.arena_bytes),
                ];
                if kernel.blocks > 0 {
                    resources.push(whole(&packed, places[i][d], kernel.bound_bytes()));
                }
                let numbered = (0..).zip(resources);
                let entries: Vec<_> =
                    numbered.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
                let descriptor =
                    wgpu::BindGroupDescriptor { label: Some(&step.name), layout: &layout, entries: &entries };
                let bind_group = device.create_bind_group(&descriptor);
                dispatches.push(Dispatch { bind_group, workgroups: kernel.workgroups(blocks) });
                slot += 1;
            }
            layers.push(Layer { label: format!("net.{}", step.name), pipeline, dispatches });
        }
        let bytes = arena.size() + steps.size() + packed.size();
        Ok(Self { plan, arena, layers, bytes })
    }

    /// Where the caller puts the input.
    pub fn input(&self) -> Binding<'_> {
        self.tensor(0)
    }

    /// Where the result is after [`Network::record`].
    pub fn output(&self) -> Binding<'_> {
        self.tensor(self.plan.output)
    }

    /// Records one compute pass a layer, labelled `net.NAME`.
    pub fn record(&self, recorder: &mut Recorder<'_>) {
        for layer in &self.layers {
            recorder.compute(&layer.label, |pass| {
                pass.set_pipeline(&layer.pipeline);
                for dispatch in &layer.dispatches {
                    let [x, y, z] = dispatch.workgroups;
                    pass.set_bind_group(0, &dispatch.bind_group, &[]);
                    pass.dispatch_workgroups(x, y, z);
                }
            });
        }
    }

    /// GPU memory of tensors, weights and uniforms, bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Dispatches, memory, FLOPs.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    fn tensor(&self, index: usize) -> Binding<'_> {
        let tensor = &self.plan.tensors[index];
        Binding { buffer: &self.arena, offset: tensor.offset, size: tensor.shape.padded_bytes() }
    }
}

/// Distance of uniforms in their buffer: WebGPU's default alignment of uniform bindings.
const SLOT: u64 = 256;

struct Pipelines<'a> {
    device: &'a wgpu::Device,
    made: HashMap<(&'static str, String), (wgpu::ComputePipeline, wgpu::BindGroupLayout)>,
}

impl Pipelines<'_> {
    /// Steps with the same shader and prelude share a pipeline.
    fn get(&mut self, kernel: &Kernel) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
        let device = self.device;
        let make = || {
            let module = shaders::module_with(device, kernel.shader, &kernel.prelude);
            let descriptor = wgpu::ComputePipelineDescriptor {
                label: Some(kernel.shader),
                layout: None,
                module: &module,
                entry_point: Some("main"),
                compilation_options: Default::default(),
                cache: None,
            };
            let pipeline = device.create_compute_pipeline(&descriptor);
            let layout = pipeline.get_bind_group_layout(0);
            (pipeline, layout)
        };
        self.made.entry((kernel.shader, kernel.prelude.clone())).or_insert_with(make).clone()
    }
}

fn buffer(device: &wgpu::Device, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
}

fn check_limits(device: &wgpu::Device, plan: &Plan, kernels: &[Kernel]) -> Result<(), NetError> {
    let limits = device.limits();
    let check = |pass: &str, limit, granted: u64, needed: u64| {
        let error = NetError::Limit { pass: pass.into(), limit, granted, needed };
        if needed > granted { Err(error) } else { Ok(()) }
    };
    let binding = limits.max_storage_buffer_binding_size;
    check("net", "max_storage_buffer_binding_size", binding, plan.arena_bytes)?;
    for (kernel, step) in kernels.iter().zip(&plan.steps) {
        let (limit, granted) = if kernel.uniform {
            ("max_uniform_buffer_binding_size", limits.max_uniform_buffer_binding_size)
        } else {
            ("max_storage_buffer_binding_size", binding)
        };
        check(&step.name, limit, granted, kernel.bound_bytes())?;
        let groups = kernel.workgroups(kernel.blocks_per_dispatch);
        let most = groups.into_iter().max().unwrap_or(0);
        let granted = limits.max_compute_workgroups_per_dimension;
        check(&step.name, "max_compute_workgroups_per_dimension", granted.into(), most.into())?;
    }
    Ok(())
}

fn upload_steps(device: &wgpu::Device, queue: &wgpu::Queue, plan: &Plan, kernels: &[Kernel]) -> wgpu::Buffer {
    let mut data = Vec::new();
    for (step, kernel) in plan.steps.iter().zip(kernels) {
        for (first_block, _) in kernel.dispatches() {
            data.extend_from_slice(bytemuck::bytes_of(&uniform(plan, step, first_block)));
            data.resize(data.len().next_multiple_of(SLOT as usize), 0);
        }
    }
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    let steps = buffer(device, "net.steps", data.len() as u64, usage);
    queue.write_buffer(&steps, 0, &data);
    steps
}

fn uniform(plan: &Plan, step: &Step, first_block: u32) -> StepUniform {
    let (input, output) = (&plan.tensors[step.input], &plan.tensors[step.output]);
    // The arena holds at most 128 MiB, so a place counted in vectors fits.
    let place = |offset: u64| (offset / 16) as u32;
    StepUniform {
        in_size: [input.shape.width, input.shape.height],
        out_size: [output.shape.width, output.shape.height],
        input: place(input.offset),
        output: place(output.offset),
        skip: step.skip.map_or(0, |s| place(plan.tensors[s].offset)),
        first_block,
    }
}

/// All layers' packed weights in one buffer, with the byte offset of each dispatch's part.
fn upload_weights(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    weights: &Weights,
    plan: &Plan,
    kernels: &[Kernel],
) -> (wgpu::Buffer, Vec<Vec<u64>>) {
    let mut data: Vec<f32> = Vec::new();
    let mut places = Vec::new();
    for (step, kernel) in plan.steps.iter().zip(kernels) {
        let mut own = Vec::new();
        if let Op::Conv2d(o) = &weights.graph.ops[step.op] {
            let (weight, bias) = (weights.values(&o.name, "weight"), weights.values(&o.name, "bias"));
            for part in kernel.pack(weight, bias, o.in_channels as usize, o.kernel.map(|k| k as usize)) {
                own.push(data.len() as u64 * 4);
                data.extend(part);
                data.resize(data.len().next_multiple_of(64), 0.0);
            }
        }
        places.push(own);
    }
    // A graph of sums alone has no weights, and a buffer must not be empty.
    data.resize(data.len().max(64), 0.0);
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    let packed = buffer(device, "net.weights", data.len() as u64 * 4, usage);
    queue.write_buffer(&packed, 0, bytemuck::cast_slice(&data));
    (packed, places)
}
