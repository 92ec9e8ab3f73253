//! What compute passes do, counted while they run: while a [`Count`] is kept, shaders are compiled so that they count
//! ([`instrument`](super::instrument)), and each dispatch has a place where its threads add up.

use super::bound::Bound;
pub(super) use super::instrument::GROUP;
use super::instrument::{self, NUMBERS};
use super::{readback, tape};
use std::cell::RefCell;

/// Dispatches of a frame that there is room for, and bytes of each.
const DISPATCHES: u64 = 1024;
const STRIDE: u64 = 256;

thread_local! {
    static COUNT: RefCell<Option<Counter>> = const { RefCell::new(None) };
}

struct Counter {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    /// Modules that count, and the bindings of their numbers.
    modules: Vec<(wgpu::ShaderModule, Vec<(u32, u32)>)>,
    pipelines: Vec<(wgpu::ComputePipeline, Vec<(u32, u32)>)>,
    /// Bindings of the numbers of each dispatch; `None` where it does not count.
    dispatches: Vec<Option<Vec<(u32, u32)>>>,
}

/// What a dispatch did.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Counted {
    /// Label of its pass.
    pub label: String,
    /// Operations of all threads, and the same where each of 32 takes as long as the slowest.
    pub operations: [f64; 2],
    pub rays: f64,
    /// Bytes of each binding: what was asked for, but no more than there is, since a byte that is there need not come
    /// again.
    pub bytes: f64,
}

/// Counts on this thread until it is dropped. There is one at a time.
pub(crate) struct Count {
    tape: tape::Running,
    sums: wgpu::Buffer,
}

impl Count {
    /// Starts; `device` needs a storage buffer more a stage than shaders have without counting.
    pub fn start(device: &wgpu::Device) -> Self {
        let sums = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("count.sums"),
            size: DISPATCHES * STRIDE,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let entry = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage { read_only: false },
                has_dynamic_offset: true,
                min_binding_size: None,
            },
            count: None,
        };
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("count"), entries: &[entry] };
        let layout = device.create_bind_group_layout(&descriptor);
        let part = Bound::Slot(sums.clone(), STRIDE);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("count"),
            layout: &layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: part.resource() }],
        });
        let (modules, pipelines, dispatches) = Default::default();
        COUNT.set(Some(Counter { layout, group, modules, pipelines, dispatches }));
        Self { tape: tape::Running::start(), sums }
    }

    /// Forgets what was counted so far.
    pub fn clear(&mut self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.sums, 0, None);
        with(|counter| counter.dispatches.clear());
        self.tape.take();
    }

    /// What each dispatch did that was recorded since the last call of [`clear`](Self::clear) and has run; those of
    /// shaders that do not count are left out.
    pub fn take(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
    ) -> Result<Vec<Counted>, readback::ReadbackError> {
        let words = readback::buffer(device, queue, &self.sums, 0, self.sums.size())?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&words);
        let bindings = with(|counter| std::mem::take(&mut counter.dispatches)).unwrap_or_default();
        let found = self.tape.take().into_iter().zip(bindings).enumerate().filter_map(|(at, (dispatch, bindings))| {
            let words = &words[at * STRIDE as usize / 4..];
            let number = |i: usize| f64::from(words[2 * i]) + f64::from(words[2 * i + 1]) * 2f64.powi(32);
            let asked = |(i, (group, binding)): (usize, &(u32, u32))| {
                let (_, bound, _) = dispatch.groups.iter().find(|g| g.0 == *group)?;
                let (_, bound) = bound.iter().find(|b| b.0 == *binding)?;
                let (unit, all) = size(bound);
                Some((unit * number(instrument::FIRST + i)).min(all))
            };
            let bytes = bindings?.iter().enumerate().filter_map(asked).sum();
            let operations = [number(0), number(NUMBERS)];
            Some(Counted { label: dispatch.label, operations, rays: number(1), bytes })
        });
        Ok(found.collect())
    }
}

impl Drop for Count {
    fn drop(&mut self) {
        COUNT.set(None);
    }
}

/// Bytes of one of the things that are counted of a binding, and of all of it.
fn size(bound: &Bound) -> (f64, f64) {
    match bound {
        Bound::Buffer(buffer) => (1.0, buffer.size() as f64),
        Bound::Slot(_, bytes) | Bound::Part(_, _, bytes) => (1.0, *bytes as f64),
        Bound::View(view) => {
            let texture = view.texture();
            let texel = f64::from(texture.format().block_copy_size(None).unwrap_or(4));
            let texels = f64::from(texture.width()) * f64::from(texture.height());
            (texel, texel * texels * f64::from(texture.depth_or_array_layers()))
        }
    }
}

fn with<T>(f: impl FnOnce(&mut Counter) -> T) -> Option<T> {
    COUNT.with_borrow_mut(|counter| counter.as_mut().map(f))
}

/// The module of `text` that counts; `None` where nobody counts or it cannot. Networks' layers are not among them:
/// their plan says what they do.
pub(super) fn module(device: &wgpu::Device, name: &str, text: &str) -> Option<wgpu::ShaderModule> {
    with(|counter| {
        let found = Some(text).filter(|_| !name.starts_with("net.")).and_then(instrument::counting)?;
        let source = wgpu::ShaderSource::Naga(std::borrow::Cow::Owned(found.module));
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source });
        counter.modules.push((module.clone(), found.bindings));
        Some(module)
    })
    .flatten()
}

/// The layout of the sums' group, where `module` counts.
pub(super) fn layout(module: &wgpu::ShaderModule) -> Option<wgpu::BindGroupLayout> {
    with(|counter| counter.modules.iter().any(|(m, _)| m == module).then(|| counter.layout.clone())).flatten()
}

/// Remembers what a pipeline counts.
pub(super) fn pipeline(pipeline: &wgpu::ComputePipeline, module: &wgpu::ShaderModule) {
    with(|counter| {
        let bindings = counter.modules.iter().find(|(m, _)| m == module).map(|(_, bindings)| bindings.clone());
        counter.pipelines.extend(bindings.map(|bindings| (pipeline.clone(), bindings)));
    });
}

/// Gives the next dispatch of `pipeline` its place.
pub(super) fn dispatch(pass: &mut wgpu::ComputePass<'_>, pipeline: Option<&wgpu::ComputePipeline>) {
    with(|counter| {
        let bindings = counter.pipelines.iter().find(|(p, _)| Some(p) == pipeline).map(|(_, b)| b.clone());
        if bindings.is_some() {
            let at = (counter.dispatches.len() as u64).min(DISPATCHES - 1);
            pass.set_bind_group(GROUP as u32, &counter.group, &[(at * STRIDE) as u32]);
        }
        counter.dispatches.push(bindings);
    });
}
