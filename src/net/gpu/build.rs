//! Buffers, pipelines and bind groups of a network.

use super::kernel::{Bound, Kernel, Numbers, Part};
use super::{NetError, Options};
use crate::gpu::shaders::{self, NetKernel};
use crate::gpu::tape;
use crate::net::dropout;
use crate::net::graph::Graph;
use crate::net::plan::{self, Kind, Plan, Precision, Step};
use std::collections::HashMap;

/// The uniform that a kernel reads; `Step` in `shaders/net/common.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct StepUniform {
    pub in_size: [u32; 2],
    pub out_size: [u32; 2],
    pub input: u32,
    pub output: u32,
    pub skip: u32,
    pub second: u32,
    pub pad: [i32; 2],
    pub base: [i32; 2],
    pub first_block: u32,
    pub blocks: u32,
    pub parts: u32,
    pub in_channels: u32,
    pub in_vectors: u32,
    pub in_pitch: u32,
    pub out_channels: u32,
    pub out_vectors: u32,
    pub out_pitch: u32,
    pub skip_pitch: u32,
    pub group: u32,
    pub stream: u32,
    pub threshold: u32,
    pub keep: f32,
    pub slope: f32,
    pub epsilon: f32,
    pub channel: u32,
    pub tiles: u32,
    pub moments: u32,
    pub group_inputs: u32,
}

/// Distance of uniforms in their buffer, and alignment of weights: WebGPU's default alignment of
/// bindings.
const SLOT: u64 = 256;

/// One step ready to record.
pub(super) struct Layer {
    pub label: String,
    pub kernel: Kernel,
    pub pipeline: wgpu::ComputePipeline,
    /// Trained numbers.
    pub weights: Option<wgpu::Buffer>,
    /// One for each part of the kernel.
    pub bind_groups: Vec<wgpu::BindGroup>,
    /// What adds up the parts that the kernel has made.
    pub sum: Option<(wgpu::ComputePipeline, wgpu::BindGroup)>,
}

/// Room for the trained numbers of all parts of a kernel, at [`Layer::offsets`]; nothing where it
/// has none.
fn trained(device: &wgpu::Device, label: &str, kernel: &Kernel) -> Option<wgpu::Buffer> {
    let place = match kernel.bound {
        Bound::None => return None,
        Bound::Uniform => wgpu::BufferUsages::UNIFORM,
        _ => wgpu::BufferUsages::STORAGE,
    };
    let size = kernel.bound_bytes().next_multiple_of(SLOT) * kernel.parts.len() as u64;
    Some(buffer(device, label, size, place | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC))
}

/// Bytes of one element of the arena.
pub(super) fn element(plan: &Plan) -> u64 {
    if plan.precision == Precision::F16 { 8 } else { 16 }
}

impl Layer {
    /// Byte offset of each part's weights.
    pub fn offsets(&self) -> impl Iterator<Item = u64> {
        offsets(&self.kernel)
    }
}

fn offsets(kernel: &Kernel) -> impl Iterator<Item = u64> + use<> {
    let each = kernel.bound_bytes().next_multiple_of(SLOT);
    (0..kernel.parts.len() as u64).map(move |i| i * each)
}

pub(super) fn buffer(device: &wgpu::Device, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
}

/// The plan within this device's limits.
pub(super) fn plan(device: &wgpu::Device, graph: &Graph, size: [u32; 2], options: Options) -> Result<Plan, NetError> {
    let limits = device.limits();
    let options = plan::Options {
        precision: options.precision,
        packed_input: options.packed_input,
        dropout: options.dropout.is_some(),
        fuse: options.fuse,
        limit: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
    };
    Ok(Plan::with(graph, size[0], size[1], &options)?)
}

pub(super) fn check_limits(device: &wgpu::Device, plan: &Plan, kernels: &[Kernel]) -> Result<(), NetError> {
    let limits = device.limits();
    for (kernel, step) in kernels.iter().zip(&plan.steps) {
        let check = |limit, granted: u64, needed: u64| {
            let error = NetError::Limit { pass: step.name.clone(), limit, granted, needed };
            if needed > granted { Err(error) } else { Ok(()) }
        };
        let bytes = kernel.bound_bytes();
        if kernel.bound == Bound::Uniform {
            check("max_uniform_buffer_binding_size", limits.max_uniform_buffer_binding_size, bytes)?;
        } else {
            check("max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size, bytes)?;
        }
        let all = bytes.next_multiple_of(SLOT) * kernel.parts.len() as u64;
        check("max_buffer_size", limits.max_buffer_size, all)?;
        let sum = kernel.sum.iter().flat_map(|s| s.groups);
        let most = kernel.parts.iter().flat_map(|p| kernel.workgroups(p)).chain(sum).max().unwrap_or(0);
        let granted = limits.max_compute_workgroups_per_dimension;
        check("max_compute_workgroups_per_dimension", granted.into(), most.into())?;
    }
    Ok(())
}

/// Room for the uniforms of all dispatches.
fn steps_buffer(device: &wgpu::Device, kernels: &[Kernel]) -> wgpu::Buffer {
    let parts: usize = kernels.iter().map(|k| k.parts.len()).sum();
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
    buffer(device, "net.steps", (parts.max(1) as u64) * SLOT, usage)
}

/// The uniforms of all dispatches.
pub(super) fn uniforms<'a>(plan: &Plan, kernels: impl IntoIterator<Item = &'a Kernel>, seed: Option<u32>) -> Vec<u8> {
    let mut data = Vec::new();
    for (step, kernel) in plan.steps.iter().zip(kernels) {
        for part in &kernel.parts {
            data.extend_from_slice(bytemuck::bytes_of(&uniform(plan, step, (&kernel.numbers, part), seed)));
            data.resize(data.len().next_multiple_of(SLOT as usize), 0);
        }
    }
    data
}

fn uniform(plan: &Plan, step: &Step, (numbers, part): (&Numbers, &Part), seed: Option<u32>) -> StepUniform {
    let (input, output) = (&plan.tensors[step.input], &plan.tensors[step.output]);
    let element = element(plan);
    // An arena is one binding, so a place counted in its elements fits.
    let place = |t: usize| (plan.tensors[t].offset / element) as u32;
    let mut in_size = [input.shape.width, input.shape.height];
    let (mut epsilon, mut channel) = (0.0, 0);
    match step.kind {
        Kind::Merge { eps, .. } => {
            // The moments' picture.
            let picture = step.second.map_or(input.shape, |s| plan.tensors[s].shape);
            in_size = [picture.width, picture.height];
            epsilon = eps;
        }
        Kind::Window { channel: first, .. } => channel = first,
        _ => {}
    }
    let (stream, p) = match (seed, step.dropout) {
        (Some(seed), Some((op, p))) => (dropout::stream(seed, op), p),
        _ => (0, 0.0),
    };
    StepUniform {
        in_size,
        out_size: [output.shape.width, output.shape.height],
        input: place(step.input),
        output: place(step.output),
        skip: step.skip.map_or(0, place),
        second: step.second.map_or(0, place),
        pad: numbers.pad,
        base: numbers.base,
        first_block: part.first_block,
        blocks: numbers.blocks,
        parts: numbers.parts,
        in_channels: numbers.in_channels,
        in_vectors: numbers.in_vectors,
        in_pitch: numbers.in_pitch,
        out_channels: numbers.out_channels,
        out_vectors: numbers.out_vectors,
        out_pitch: numbers.out_pitch,
        skip_pitch: numbers.skip_pitch,
        group: numbers.group,
        stream,
        threshold: dropout::threshold(p),
        keep: 1.0 / (1.0 - p),
        slope: step.activation.slope(),
        epsilon,
        channel,
        tiles: numbers.tiles,
        moments: step.moments.map_or(0, place),
        group_inputs: numbers.group_inputs,
    }
}

/// What all steps share.
pub(super) struct Memory {
    pub arena: wgpu::Buffer,
    /// The uniforms of all dispatches.
    pub steps: wgpu::Buffer,
    /// Parts of sums, where a convolution works in parts.
    pub partial: Option<wgpu::Buffer>,
}

impl Memory {
    /// For a plan and the kernels chosen for it.
    pub fn new(device: &wgpu::Device, plan: &Plan, kernels: &[Kernel]) -> Self {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let partial = kernels.iter().filter_map(|k| k.sum.as_ref()).map(|s| s.bytes).max();
        Self {
            // wgpu clears new buffers; the kernels count on the zeros at the beginning.
            arena: buffer(device, "net.arena", plan.arena_bytes, usage),
            steps: steps_buffer(device, kernels),
            partial: partial.map(|bytes| {
                buffer(device, "net.partial", bytes, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC)
            }),
        }
    }

    /// On the GPU.
    pub fn bytes(&self) -> u64 {
        self.arena.size() + self.steps.size() + self.partial.as_ref().map_or(0, wgpu::Buffer::size)
    }
}

/// Pipelines, bind groups and buffers for weights (not yet filled) of every step.
pub(super) fn layers(device: &wgpu::Device, plan: &Plan, kernels: Vec<Kernel>, memory: &Memory) -> Vec<Layer> {
    let mut slot = 0;
    // Steps of one text share a pipeline.
    let mut compiled = HashMap::new();
    let mut compiled_of = |shader: NetKernel, prelude: &str| {
        let make = || compile(device, shader, prelude);
        compiled.entry((shader, prelude.to_owned())).or_insert_with(make).clone()
    };
    let layer = |(step, kernel): (&Step, Kernel)| {
        let label = format!("net.{}", step.name);
        let weights = trained(device, &label, &kernel);
        let (pipeline, layout) = compiled_of(kernel.shader, &kernel.prelude);
        let first_slot = slot;
        let whole = |buffer, offset, size| {
            let size = wgpu::BufferSize::new(size);
            wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size })
        };
        let group = |layout: &wgpu::BindGroupLayout, resources: Vec<(u32, wgpu::BindingResource<'_>)>| {
            let entries: Vec<_> =
                resources.into_iter().map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            let label = Some(step.name.as_str());
            tape::bind_group(device, &wgpu::BindGroupDescriptor { label, layout, entries: &entries })
        };
        let shared = |slot: u64| {
            vec![
                (0, whole(&memory.steps, slot * SLOT, size_of::<StepUniform>() as u64)),
                (1, whole(&memory.arena, 0, plan.arena_bytes)),
            ]
        };
        let partial = kernel.sum.as_ref().and(memory.partial.as_ref()).map(|b| (4, b.as_entire_binding()));
        let bind_group = |offset: u64| {
            let mut resources = shared(slot);
            resources.extend(weights.as_ref().map(|b| (2, whole(b, offset, kernel.bound_bytes()))));
            resources.extend(partial.clone());
            slot += 1;
            group(&layout, resources)
        };
        let bind_groups = offsets(&kernel).map(bind_group).collect();
        let sum = kernel.sum.as_ref().map(|sum| {
            let (pipeline, layout) = compiled_of(sum.shader, &sum.prelude);
            let mut resources = shared(first_slot);
            resources.extend(partial.clone());
            (pipeline, group(&layout, resources))
        });
        Layer { label, kernel, pipeline, weights, bind_groups, sum }
    };
    plan.steps.iter().zip(kernels).map(layer).collect()
}

/// The pipeline of a shader behind its `const` lines, and the layout of its bind group.
fn compile(device: &wgpu::Device, shader: NetKernel, prelude: &str) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
    let name = shader.name();
    let descriptor = wgpu::ComputePipelineDescriptor {
        label: Some(&name),
        layout: None,
        module: &shaders::module_with(device, &name, prelude),
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    };
    let pipeline = tape::compute_pipeline(device, &descriptor);
    let layout = pipeline.get_bind_group_layout(0);
    (pipeline, layout)
}
