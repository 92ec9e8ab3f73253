//! A tape of what compute passes are: while one runs on this thread, shaders, pipelines, bind
//! groups and dispatches are written down as they are made, for `export` and for whoever listens.
//! Without one, what is compiled is shared ([`pipeline_cache`]).

use super::bound::Bound;
use super::pipeline_cache;
use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicU32, Ordering};

thread_local! {
    static RUNS: Cell<bool> = const { Cell::new(false) };
    static TAPE: RefCell<Tape> = RefCell::default();
}

/// A compiled shader's name and text.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Source {
    pub name: String,
    pub text: String,
}

/// Resources of one group by number of the binding.
pub type Group = Vec<(u32, Bound)>;

/// One dispatch as it was recorded.
#[derive(Debug, Clone)]
pub struct Dispatch {
    /// Of the compute pass.
    pub label: String,
    pub source: Source,
    pub entry: String,
    pub workgroups: [u32; 3],
    /// What was bound, by number of the group, each with the offset of its first binding.
    pub groups: Vec<(u32, Group, u32)>,
}

/// A pipeline, and what it was made of.
pub struct Made {
    pub pipeline: wgpu::ComputePipeline,
    pub source: Source,
    pub entry: String,
    pub groups: Vec<Option<wgpu::BindGroupLayout>>,
}

/// Hears of each dispatch, and may set another pipeline for it.
pub trait Listener {
    /// It is about to be recorded. `made` is `None` where the pipeline was made before the tape
    /// began.
    fn before(&mut self, pass: &mut wgpu::ComputePass<'_>, made: Option<&Made>);
}

#[derive(Default)]
struct Tape {
    listener: Option<std::rc::Rc<RefCell<dyn Listener>>>,
    sources: Vec<(wgpu::ShaderModule, Source)>,
    layouts: Vec<(wgpu::PipelineLayout, Vec<Option<wgpu::BindGroupLayout>>)>,
    pipelines: Vec<Made>,
    groups: Vec<(wgpu::BindGroup, Group)>,
    dispatches: Vec<Dispatch>,
}

/// A tape that runs on this thread until it is dropped. There is one at a time.
pub struct DispatchCapture(());

impl DispatchCapture {
    /// Starts.
    pub fn start() -> Self {
        TAPE.take();
        RUNS.set(true);
        Self(())
    }

    /// From here on `listener` hears of dispatches, or nobody does.
    pub fn listen(&mut self, listener: Option<std::rc::Rc<RefCell<dyn Listener>>>) {
        TAPE.with_borrow_mut(|tape| tape.listener = listener);
    }

    /// Dispatches since the start or the last call, in order.
    pub fn take(&mut self) -> Vec<Dispatch> {
        TAPE.with_borrow_mut(|tape| std::mem::take(&mut tape.dispatches))
    }
}

impl Drop for DispatchCapture {
    fn drop(&mut self) {
        RUNS.set(false);
        TAPE.take();
    }
}

impl Tape {
    fn made(&self, pipeline: Option<&wgpu::ComputePipeline>) -> Option<&Made> {
        self.pipelines.iter().find(|made| Some(&made.pipeline) == pipeline)
    }
}

/// Whether one runs on this thread.
pub fn runs() -> bool {
    RUNS.get()
}

fn write(note: impl FnOnce(&mut Tape)) {
    if runs() {
        TAPE.with_borrow_mut(note);
    }
}

/// Modules that this process has compiled.
static COMPILED: AtomicU32 = AtomicU32::new(0);

/// How many modules this process has compiled so far.
pub fn compiled() -> u32 {
    COMPILED.load(Ordering::Relaxed)
}

/// Compiles WGSL.
pub fn shader_module(device: &wgpu::Device, name: &str, text: String) -> wgpu::ShaderModule {
    let make = || {
        COMPILED.fetch_add(1, Ordering::Relaxed);
        let source = wgpu::ShaderSource::Wgsl(text.as_str().into());
        device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source })
    };
    if !runs() {
        return pipeline_cache::shader_module(device, name, &text, make);
    }
    let module = make();
    write(|tape| tape.sources.push((module.clone(), Source { name: name.to_owned(), text })));
    module
}

/// Makes the layout of a pipeline.
pub fn pipeline_layout(
    device: &wgpu::Device,
    label: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::PipelineLayout {
    let descriptor =
        wgpu::PipelineLayoutDescriptor { label: Some(label), bind_group_layouts: groups, immediate_size: 0 };
    if !runs() {
        return pipeline_cache::pipeline_layout(device, &descriptor);
    }
    let layout = device.create_pipeline_layout(&descriptor);
    write(|tape| tape.layouts.push((layout.clone(), groups.iter().map(|g| g.cloned()).collect())));
    layout
}

/// Makes a pipeline.
pub fn compute_pipeline(
    device: &wgpu::Device,
    descriptor: &wgpu::ComputePipelineDescriptor<'_>,
) -> wgpu::ComputePipeline {
    if !runs() {
        return pipeline_cache::compute_pipeline(device, descriptor);
    }
    let pipeline = device.create_compute_pipeline(descriptor);
    write(|tape| {
        let source = tape.sources.iter().find(|(module, _)| module == descriptor.module).map(|s| s.1.clone());
        let groups = tape.layouts.iter().find(|(layout, _)| Some(layout) == descriptor.layout).map(|l| l.1.clone());
        if let Some(source) = source {
            let entry = descriptor.entry_point.unwrap_or_default().to_owned();
            let groups = groups.unwrap_or_default();
            tape.pipelines.push(Made { pipeline: pipeline.clone(), source, entry, groups });
        }
    });
    pipeline
}

/// Makes a bind group.
pub fn bind_group(device: &wgpu::Device, descriptor: &wgpu::BindGroupDescriptor<'_>) -> wgpu::BindGroup {
    let group = device.create_bind_group(descriptor);
    write(|tape| {
        let bound = |e: &wgpu::BindGroupEntry<'_>| Some((e.binding, Bound::of(&e.resource)?));
        tape.groups.push((group.clone(), descriptor.entries.iter().filter_map(bound).collect()));
    });
    group
}

/// A compute pass.
pub struct Pass<'a> {
    pass: wgpu::ComputePass<'a>,
    label: &'a str,
    pipeline: Option<wgpu::ComputePipeline>,
    groups: Vec<(u32, wgpu::BindGroup, u32)>,
}

impl<'a> Pass<'a> {
    pub fn new(pass: wgpu::ComputePass<'a>, label: &'a str) -> Self {
        Self { pass, label, pipeline: None, groups: Vec::new() }
    }

    /// As [`wgpu::ComputePass::set_pipeline`].
    pub fn set_pipeline(&mut self, pipeline: &wgpu::ComputePipeline) {
        self.pass.set_pipeline(pipeline);
        if RUNS.get() {
            self.pipeline = Some(pipeline.clone());
        }
    }

    /// As [`wgpu::ComputePass::set_bind_group`]; a dynamic offset is that of the group's first
    /// binding.
    pub fn set_bind_group(&mut self, index: u32, group: &wgpu::BindGroup, offsets: &[u32]) {
        self.pass.set_bind_group(index, group, offsets);
        if RUNS.get() {
            self.groups.retain(|g| g.0 != index);
            self.groups.push((index, group.clone(), offsets.first().copied().unwrap_or(0)));
        }
    }

    /// As [`wgpu::ComputePass::dispatch_workgroups`].
    pub fn dispatch_workgroups(&mut self, x: u32, y: u32, z: u32) {
        write(|tape| {
            if let Some(listener) = &tape.listener {
                listener.borrow_mut().before(&mut self.pass, tape.made(self.pipeline.as_ref()));
            }
        });
        self.pass.dispatch_workgroups(x, y, z);
        write(|tape| {
            // What was made before the tape began leaves an empty place, which `export` refuses.
            let made = tape.made(self.pipeline.as_ref());
            if let Some(made) = made.filter(|_| tape.listener.is_some()) {
                self.pass.set_pipeline(&made.pipeline);
            }
            let known = made.map(|made| (made.source.clone(), made.entry.clone()));
            let (source, entry) = known.unwrap_or((Source { name: String::new(), text: String::new() }, String::new()));
            let group = |(index, group, offset): &(u32, wgpu::BindGroup, u32)| {
                let bound = tape.groups.iter().find(|(g, _)| g == group);
                (*index, bound.map(|b| b.1.clone()).unwrap_or_default(), *offset)
            };
            let mut groups: Vec<_> = self.groups.iter().map(group).collect();
            groups.sort_by_key(|g| g.0);
            let label = self.label.to_owned();
            tape.dispatches.push(Dispatch { label, source, entry, workgroups: [x, y, z], groups });
        });
    }
}
