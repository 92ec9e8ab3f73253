//! Bind groups, kept as long as everything in them stays the same: every bound resource is part of
//! the key, so a host that hands over another light buffer gets another group, and one that hands
//! over the same things every frame makes each group once.

pub use super::bound::Bound;
use super::{pipeline_cache, tape};

/// Groups that are kept: enough for both halves of a ping-pong under triple buffering.
const CAPACITY: usize = 8;

/// A layout and the groups made of it.
pub struct Binder {
    device: wgpu::Device,
    label: &'static str,
    layout: wgpu::BindGroupLayout,
    groups: Vec<(Vec<Bound>, wgpu::BindGroup)>,
    next: usize,
    made: u64,
}

impl Binder {
    /// A layout for compute shaders whose bindings are numbered by the list.
    pub fn new(device: &wgpu::Device, label: &'static str, types: &[wgpu::BindingType]) -> Self {
        let entries: Vec<_> = (0u32..)
            .zip(types)
            .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty,
                count: None,
            })
            .collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
        let layout = pipeline_cache::bind_group_layout(device, &descriptor);
        Self { device: device.clone(), label, layout, groups: Vec::with_capacity(CAPACITY), next: 0, made: 0 }
    }

    /// The layout.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// The group of these resources, in the order of the bindings.
    pub fn group(&mut self, resources: impl Into<Vec<Bound>>) -> wgpu::BindGroup {
        let resources: Vec<Bound> = resources.into();
        if let Some((_, group)) = self.groups.iter().find(|(kept, _)| kept[..] == resources[..]) {
            return group.clone();
        }
        let entries: Vec<_> = (0u32..)
            .zip(&resources)
            .map(|(binding, bound)| wgpu::BindGroupEntry { binding, resource: bound.resource() })
            .collect();
        let group = tape::bind_group(
            &self.device,
            &wgpu::BindGroupDescriptor { label: Some(self.label), layout: &self.layout, entries: &entries },
        );
        self.made += 1;
        let entry = (resources, group.clone());
        if self.groups.len() < CAPACITY {
            self.groups.push(entry);
        } else {
            self.groups[self.next] = entry;
            self.next = (self.next + 1) % CAPACITY;
        }
        group
    }

    /// Lets go of all groups, and so of what is bound in them.
    pub fn release_bindings(&mut self) {
        self.groups.clear();
        self.next = 0;
    }

    /// Groups made so far; stands still in steady frames.
    pub fn made(&self) -> u64 {
        self.made
    }
}

/// How shaders of frames are compiled: they write what a workgroup shares before they read it. naga
/// would else set it to zero, in GLSL by constructors with as many arguments as arrays have
/// elements, which takes Mesa minutes.
pub(crate) fn compilation() -> wgpu::PipelineCompilationOptions<'static> {
    wgpu::PipelineCompilationOptions { zero_initialize_workgroup_memory: false, ..Default::default() }
}

/// A compute pipeline of a shader module with these groups.
pub fn pipeline(
    device: &wgpu::Device,
    label: &str,
    module: &wgpu::ShaderModule,
    entry: &str,
    layouts: &[&wgpu::BindGroupLayout],
) -> wgpu::ComputePipeline {
    let layouts: Vec<_> = layouts.iter().map(|&l| Some(l)).collect();
    let layout = tape::pipeline_layout(device, label, &layouts);
    let descriptor = wgpu::ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(&layout),
        module,
        entry_point: Some(entry),
        compilation_options: compilation(),
        cache: None,
    };
    tape::compute_pipeline(device, &descriptor)
}
