//! Buffers, pipelines and bind groups of a network.

use super::kernels::{Bound, Kernel, Part};
use super::permutation::ROW;
use super::{NetError, Options};
use crate::gpu::shaders;
use crate::net::dropout;
use crate::net::graph::Graph;
use crate::net::plan::{self, Kind, Plan, Precision, Step};
use std::collections::HashMap;

/// The uniform that a kernel reads; `Step` in `shaders/net/common.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct StepUniform {
    in_size: [u32; 2],
    out_size: [u32; 2],
    input: u32,
    output: u32,
    skip: u32,
    second: u32,
    pad: [i32; 2],
    phase: [u32; 2],
    first_block: u32,
    stream: u32,
    threshold: u32,
    keep: f32,
    slope: f32,
    epsilon: f32,
    channel: u32,
    tiles: u32,
}

/// Distance of uniforms in their buffer, and alignment of weights: WebGPU's default alignment of bindings.
const SLOT: u64 = 256;

/// One step ready to record.
pub(super) struct Layer {
    pub label: String,
    pub kernel: Kernel,
    pub pipeline: wgpu::ComputePipeline,
    pub weights: Trained,
    /// One for each part of the kernel.
    pub bind_groups: Vec<wgpu::BindGroup>,
    /// First rows and numbers of rows of the mirror that the step reads.
    pub copied: Vec<[u32; 2]>,
}

/// Where a layer's trained numbers are.
pub(super) enum Trained {
    /// It has none.
    None,
    /// Those of all parts, at [`Layer::offsets`].
    Buffer(wgpu::Buffer),
    /// One for each part, rows of [`ROW`] texels.
    Textures(Vec<wgpu::Texture>),
}

impl Trained {
    /// Bytes on the GPU.
    pub fn bytes(&self) -> u64 {
        match self {
            Trained::None => 0,
            Trained::Buffer(buffer) => buffer.size(),
            Trained::Textures(textures) => textures.iter().map(texture_bytes).sum(),
        }
    }
}

/// Bytes of a texture as [`texture`] makes them.
pub(super) fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let texel = texture.format().block_copy_size(None).unwrap_or(0);
    u64::from(texture.width()) * u64::from(texture.height()) * u64::from(texel)
}

/// A texture of `rows` rows of [`ROW`] vectors.
pub(super) fn texture(device: &wgpu::Device, label: &str, rows: u32, texel: u64) -> wgpu::Texture {
    let (width, height) = (ROW as u32, rows.max(1));
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: if texel == 8 { wgpu::TextureFormat::Rgba16Float } else { wgpu::TextureFormat::Rgba32Float },
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
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

type Compiled = (wgpu::ComputePipeline, wgpu::BindGroupLayout);

/// Compiled shaders by name and prelude. Steps with the same two share a pipeline.
#[derive(Default)]
pub(super) struct Pipelines(HashMap<(String, String), Compiled>);

impl Pipelines {
    /// Lets go of what none of `kernels` uses.
    pub fn keep(&mut self, kernels: &[Kernel]) {
        self.0.retain(|(shader, prelude), _| kernels.iter().any(|k| k.shader == *shader && k.prelude == *prelude));
    }

    fn get(&mut self, device: &wgpu::Device, kernel: &Kernel) -> Compiled {
        let make = || {
            let module = shaders::module_with(device, &kernel.shader, &kernel.prelude);
            let descriptor = wgpu::ComputePipelineDescriptor {
                label: Some(&kernel.shader),
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
        self.0.entry((kernel.shader.clone(), kernel.prelude.clone())).or_insert_with(make).clone()
    }
}

pub(super) fn buffer(device: &wgpu::Device, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
}

/// The plan within this device's limits.
pub(super) fn plan(device: &wgpu::Device, graph: &Graph, size: [u32; 2], options: Options) -> Result<Plan, NetError> {
    let limits = device.limits();
    let options = plan::Options {
        precision: options.precision,
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
        if kernel.bound == Bound::Texture {
            // `permutation` has seen that they fit.
        } else if kernel.bound == Bound::Uniform {
            check("max_uniform_buffer_binding_size", limits.max_uniform_buffer_binding_size, bytes)?;
        } else {
            check("max_storage_buffer_binding_size", limits.max_storage_buffer_binding_size, bytes)?;
        }
        if kernel.bound != Bound::Texture {
            let all = bytes.next_multiple_of(SLOT) * kernel.parts.len() as u64;
            check("max_buffer_size", limits.max_buffer_size, all)?;
        }
        let blocks = kernel.parts.iter().map(|p| p.blocks).max().unwrap_or(0);
        let most = kernel.workgroups(blocks).into_iter().max().unwrap_or(0);
        let granted = limits.max_compute_workgroups_per_dimension;
        check("max_compute_workgroups_per_dimension", granted.into(), most.into())?;
    }
    Ok(())
}

/// Room for the uniforms of all dispatches.
pub(super) fn steps_buffer(device: &wgpu::Device, kernels: &[Kernel]) -> wgpu::Buffer {
    let parts: usize = kernels.iter().map(|k| k.parts.len()).sum();
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    buffer(device, "net.steps", (parts.max(1) as u64) * SLOT, usage)
}

/// The uniforms of all dispatches.
pub(super) fn uniforms<'a>(plan: &Plan, kernels: impl IntoIterator<Item = &'a Kernel>, seed: Option<u32>) -> Vec<u8> {
    let mut data = Vec::new();
    for (step, kernel) in plan.steps.iter().zip(kernels) {
        for part in &kernel.parts {
            data.extend_from_slice(bytemuck::bytes_of(&uniform(plan, step, part, seed)));
            data.resize(data.len().next_multiple_of(SLOT as usize), 0);
        }
    }
    data
}

fn uniform(plan: &Plan, step: &Step, part: &Part, seed: Option<u32>) -> StepUniform {
    let (input, output) = (&plan.tensors[step.input], &plan.tensors[step.output]);
    let element = element(plan);
    // An arena is one binding, so a place counted in its elements fits.
    let place = |t: usize| (plan.tensors[t].offset / element) as u32;
    let mut in_size = [input.shape.width, input.shape.height];
    let (mut epsilon, mut channel, mut tiles) = (0.0, 0, output.shape.width);
    match step.kind {
        Kind::Merge { eps, .. } => {
            // The moments' picture, and how many tiles it was cut into.
            tiles = input.shape.width;
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
        pad: part.pad,
        phase: part.phase,
        first_block: part.first_block,
        stream,
        threshold: dropout::threshold(p),
        keep: 1.0 / (1.0 - p),
        slope: step.activation.slope(),
        epsilon,
        channel,
        tiles,
    }
}

/// Pipelines, bind groups and buffers for weights (not yet filled) of every step.
pub(super) fn layers(
    device: &wgpu::Device,
    plan: &Plan,
    kernels: Vec<Kernel>,
    pipelines: &mut Pipelines,
    arena: &wgpu::Buffer,
    steps: &wgpu::Buffer,
    mirror: Option<&wgpu::Texture>,
) -> Vec<Layer> {
    let mut slot = 0;
    let layer = |(step, kernel): (&Step, Kernel)| {
        let (pipeline, layout) = pipelines.get(device, &kernel);
        let label = format!("net.{}", step.name);
        let each = kernel.bound_bytes();
        let parts = kernel.parts.len() as u64;
        let weights = match kernel.bound {
            Bound::None => Trained::None,
            Bound::Texture => {
                let rows = (each / (ROW * kernel.texel())) as u32;
                Trained::Textures((0..parts).map(|_| texture(device, &label, rows, kernel.texel())).collect())
            }
            bound => {
                let uniform = bound == Bound::Uniform;
                let kind = if uniform { wgpu::BufferUsages::UNIFORM } else { wgpu::BufferUsages::STORAGE };
                let size = each.next_multiple_of(SLOT) * parts;
                Trained::Buffer(buffer(device, &label, size, kind | wgpu::BufferUsages::COPY_DST))
            }
        };
        let read = [Some(step.input), step.skip].into_iter().flatten().filter(|_| kernel.mirror);
        let copied: Vec<_> = read.map(|t| rows(plan, t)).collect();
        let bind_group = |(part, offset): (usize, u64)| {
            let whole = |buffer, offset, size| {
                let size = wgpu::BufferSize::new(size);
                wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size })
            };
            let mut resources = vec![
                (0, whole(steps, slot * SLOT, size_of::<StepUniform>() as u64)),
                (1, whole(arena, 0, plan.arena_bytes)),
            ];
            let view = |t: &wgpu::Texture| t.create_view(&Default::default());
            let trained = match &weights {
                Trained::Textures(textures) => Some(view(&textures[part])),
                _ => None,
            };
            let mirrored = mirror.filter(|_| kernel.mirror).map(view);
            if let Trained::Buffer(buffer) = &weights {
                resources.push((2, whole(buffer, offset, each)));
            }
            resources.extend(trained.iter().map(|v| (2, wgpu::BindingResource::TextureView(v))));
            resources.extend(mirrored.iter().map(|v| (3, wgpu::BindingResource::TextureView(v))));
            slot += 1;
            let entries: Vec<_> =
                resources.into_iter().map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&step.name),
                layout: &layout,
                entries: &entries,
            })
        };
        let bind_groups = offsets(&kernel).enumerate().map(bind_group).collect();
        Layer { label, kernel, pipeline, weights, bind_groups, copied }
    };
    plan.steps.iter().zip(kernels).map(layer).collect()
}

/// First row and number of rows of the mirror that hold tensor `t`.
fn rows(plan: &Plan, t: usize) -> [u32; 2] {
    let tensor = &plan.tensors[t];
    let row = ROW * element(plan);
    let end = tensor.offset + tensor.shape.pixels() * u64::from(tensor.pitch) * element(plan);
    let (first, end) = (tensor.offset / row, end.min(plan.arena_bytes).div_ceil(row));
    [first as u32, (end - first) as u32]
}
