//! Shaders, layouts and pipelines of a device, made once. Compiling a method's shaders takes far
//! longer than drawing by it; a second view, another size or another method share most of them.
//!
//! A device's cache lives as long as a [`PipelineCache`] of it. Failures are not kept: whoever asks
//! next gets the error, too.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Keeps what is compiled on a device, as long as it or a clone of it lives.
#[derive(Clone)]
pub struct PipelineCache(#[allow(dead_code, reason = "it is there to be there")] Arc<Caches>);

/// Each place has a lock of its own, so that two threads compile two things at once.
type CacheMap<K, V> = Mutex<HashMap<K, Arc<Mutex<Option<V>>>>>;

struct Caches {
    device: wgpu::Device,
    modules: CacheMap<(String, String), wgpu::ShaderModule>,
    groups: CacheMap<(Option<String>, Vec<wgpu::BindGroupLayoutEntry>), wgpu::BindGroupLayout>,
    layouts: CacheMap<Vec<Option<wgpu::BindGroupLayout>>, wgpu::PipelineLayout>,
    compute: CacheMap<(Option<wgpu::PipelineLayout>, Stage), wgpu::ComputePipeline>,
    render: CacheMap<Drawing, wgpu::RenderPipeline>,
}

/// Of all devices of this process.
static ALL: Mutex<Vec<Weak<Caches>>> = Mutex::new(Vec::new());

/// Whether anything is kept.
static KEEPS: AtomicBool = AtomicBool::new(true);

/// From here on, what is made is kept, or is not.
pub fn keeps(keeps: bool) {
    KEEPS.store(keeps, Ordering::Relaxed);
}

/// What a call may be told of.
const MISTAKES: [wgpu::ErrorFilter; 3] =
    [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Internal];

impl PipelineCache {
    /// Of `device`: the one that others hold already, if they do.
    pub fn of(device: &wgpu::Device) -> Self {
        let mut all = lock(&ALL);
        all.retain(|shelves| shelves.strong_count() > 0);
        if let Some(held) = find(&all, device) {
            return Self(held);
        }
        let shelves = Arc::new(Caches {
            device: device.clone(),
            modules: CacheMap::default(),
            groups: CacheMap::default(),
            layouts: CacheMap::default(),
            compute: CacheMap::default(),
            render: CacheMap::default(),
        });
        all.push(Arc::downgrade(&shelves));
        Self(shelves)
    }
}

fn find(all: &[Weak<Caches>], device: &wgpu::Device) -> Option<Arc<Caches>> {
    all.iter().filter_map(Weak::upgrade).find(|shelves| is_same(&shelves.device, device))
}

/// Whether two handles are of one device. wgpu compares numbers, which it gives anew for each
/// instance: where they are the same, a mistake made on the one device is heard of by the other, or
/// is not.
fn is_same(one: &wgpu::Device, other: &wgpu::Device) -> bool {
    if one != other {
        return false;
    }
    let unheard = other.push_error_scope(wgpu::ErrorFilter::Validation);
    let heard = one.push_error_scope(wgpu::ErrorFilter::Validation);
    let usage = wgpu::BufferUsages::empty();
    let label = Some("a mistake");
    let _ = other.create_buffer(&wgpu::BufferDescriptor { label, size: 4, usage, mapped_at_creation: false });
    let heard = pollster::block_on(heard.pop()).is_some();
    pollster::block_on(unheard.pop());
    heard
}

/// A panic elsewhere leaves all of it whole: values go in complete.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What `key` stands for on one of the device's shelves, made where it is not there.
fn get<K: Eq + Hash, V: Clone>(
    device: &wgpu::Device,
    map: impl FnOnce(&Caches) -> &CacheMap<K, V>,
    key: impl FnOnce() -> K,
    make: impl Fn() -> V,
) -> V {
    let shelves = KEEPS.load(Ordering::Relaxed).then(|| find(&lock(&ALL), device)).flatten();
    let Some(shelves) = shelves else { return make() };
    let place = lock(map(&shelves)).entry(key()).or_default().clone();
    let mut place = lock(&place);
    if let Some(there) = &*place {
        return there.clone();
    }
    let scopes = MISTAKES.map(|mistake| device.push_error_scope(mistake));
    let made = make();
    let mistakes = scopes.into_iter().rev().filter_map(|scope| pollster::block_on(scope.pop())).count();
    if mistakes > 0 {
        // Again, for those to hear who listen.
        return make();
    }
    *place = Some(made.clone());
    made
}

/// A module of WGSL; `make` compiles it.
pub fn shader_module(
    device: &wgpu::Device,
    name: &str,
    text: &str,
    make: impl Fn() -> wgpu::ShaderModule,
) -> wgpu::ShaderModule {
    get(device, |s| &s.modules, || (name.to_owned(), text.to_owned()), make)
}

/// The layout of a bind group.
pub fn bind_group_layout(
    device: &wgpu::Device,
    descriptor: &wgpu::BindGroupLayoutDescriptor<'_>,
) -> wgpu::BindGroupLayout {
    let key = || (descriptor.label.map(str::to_owned), descriptor.entries.to_vec());
    get(device, |s| &s.groups, key, || device.create_bind_group_layout(descriptor))
}

/// The layout of a pipeline.
pub fn pipeline_layout(device: &wgpu::Device, descriptor: &wgpu::PipelineLayoutDescriptor<'_>) -> wgpu::PipelineLayout {
    let key = || descriptor.bind_group_layouts.iter().map(|group| group.cloned()).collect();
    get(device, |s| &s.layouts, key, || device.create_pipeline_layout(descriptor))
}

/// A pipeline of a compute pass.
pub fn compute_pipeline(
    device: &wgpu::Device,
    descriptor: &wgpu::ComputePipelineDescriptor<'_>,
) -> wgpu::ComputePipeline {
    let key = || {
        let stage = Stage::of(descriptor.module, descriptor.entry_point, &descriptor.compilation_options);
        (descriptor.layout.cloned(), stage)
    };
    get(device, |s| &s.compute, key, || device.create_compute_pipeline(descriptor))
}

/// A pipeline of a render pass.
pub fn render_pipeline(device: &wgpu::Device, descriptor: &wgpu::RenderPipelineDescriptor<'_>) -> wgpu::RenderPipeline {
    get(device, |s| &s.render, || Drawing::of(descriptor), || device.create_render_pipeline(descriptor))
}

/// One stage of a pipeline.
#[derive(PartialEq, Eq, Hash)]
struct Stage {
    module: wgpu::ShaderModule,
    entry: Option<String>,
    /// Numbers by their bits.
    constants: Vec<(String, u64)>,
    zeroed: bool,
}

impl Stage {
    fn of(module: &wgpu::ShaderModule, entry: Option<&str>, options: &wgpu::PipelineCompilationOptions<'_>) -> Self {
        Self {
            module: module.clone(),
            entry: entry.map(str::to_owned),
            constants: options.constants.iter().map(|(name, value)| ((*name).to_owned(), value.to_bits())).collect(),
            zeroed: options.zero_initialize_workgroup_memory,
        }
    }
}

/// What tells one pipeline of a render pass from another: its descriptor without the label.
#[derive(PartialEq, Eq, Hash)]
struct Drawing {
    layout: Option<wgpu::PipelineLayout>,
    vertex: Stage,
    buffers: Vec<Option<(u64, wgpu::VertexStepMode, Vec<wgpu::VertexAttribute>)>>,
    primitive: wgpu::PrimitiveState,
    depth: Option<wgpu::DepthStencilState>,
    multisample: wgpu::MultisampleState,
    fragment: Option<(Stage, Vec<Option<wgpu::ColorTargetState>>)>,
    views: Option<std::num::NonZeroU32>,
}

impl Drawing {
    fn of(descriptor: &wgpu::RenderPipelineDescriptor<'_>) -> Self {
        let vertex = &descriptor.vertex;
        let buffer = |b: &wgpu::VertexBufferLayout<'_>| (b.array_stride, b.step_mode, b.attributes.to_vec());
        let fragment = |f: &wgpu::FragmentState<'_>| {
            (Stage::of(f.module, f.entry_point, &f.compilation_options), f.targets.to_vec())
        };
        Self {
            layout: descriptor.layout.cloned(),
            vertex: Stage::of(vertex.module, vertex.entry_point, &vertex.compilation_options),
            buffers: vertex.buffers.iter().map(|b| b.as_ref().map(buffer)).collect(),
            primitive: descriptor.primitive,
            depth: descriptor.depth_stencil.clone(),
            multisample: descriptor.multisample,
            fragment: descriptor.fragment.as_ref().map(fragment),
            views: descriptor.multiview_mask,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Gpu, GpuOptions, bind, binding, tape};
    use std::sync::atomic::AtomicU32;

    fn gpu() -> Option<Gpu> {
        Gpu::open(&GpuOptions::default())
            .inspect_err(|e| {
                assert!(std::env::var_os("REQUIRE_GPU").is_none(), "{e}");
                println!("SKIP: {e}");
            })
            .ok()
    }

    /// A pipeline that writes `value`.
    fn pipeline(device: &wgpu::Device, value: &str) -> wgpu::ComputePipeline {
        let text = format!(
            "@group(0) @binding(0) var<storage, read_write> made: array<f32>;
            @compute @workgroup_size(1) fn main() {{ made[0] = {value}; }}"
        );
        let binder = bind::Binder::new(device, "test", &[binding::READ_WRITE]);
        let module = tape::shader_module(device, "test", text);
        bind::pipeline(device, "test", &module, "main", &[binder.layout()])
    }

    #[test]
    fn the_same_is_made_once_for_a_device_and_as_long_as_somebody_has_it() {
        let (Some(gpu), Some(other)) = (gpu(), gpu()) else { return };
        let first = pipeline(&gpu.device, "1.0");
        assert_eq!(first, pipeline(&gpu.device, "1.0"));
        // Negative controls: another text, another device, though wgpu may say it is the same.
        assert_ne!(first, pipeline(&gpu.device, "2.0"));
        assert!(is_same(&gpu.device, &gpu.device.clone()) && !is_same(&gpu.device, &other.device));
        let (held, device) = (PipelineCache::of(&gpu.device), gpu.device.clone());
        drop(gpu);
        assert_eq!(first, pipeline(&device, "1.0"));
        drop(held);
        assert_ne!(first, pipeline(&device, "1.0"));
    }

    #[test]
    fn a_tape_has_all_that_is_made_under_it() {
        let Some(gpu) = gpu() else { return };
        let first = pipeline(&gpu.device, "1.0");
        let tape = tape::DispatchCapture::start();
        assert_ne!(first, pipeline(&gpu.device, "1.0"));
        drop(tape);
        assert_eq!(first, pipeline(&gpu.device, "1.0"));
    }

    #[test]
    fn each_who_asks_hears_of_a_mistake() {
        let Some(gpu) = gpu() else { return };
        let heard = Arc::new(AtomicU32::new(0));
        let counter = heard.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |_| {
            counter.fetch_add(1, Ordering::Relaxed);
        }));
        pipeline(&gpu.device, "unknown");
        let once = heard.load(Ordering::Relaxed);
        assert!(once > 0);
        pipeline(&gpu.device, "unknown");
        assert_eq!(heard.load(Ordering::Relaxed), 2 * once);
        pipeline(&gpu.device, "1.0");
        assert_eq!(heard.load(Ordering::Relaxed), 2 * once);
    }
}
