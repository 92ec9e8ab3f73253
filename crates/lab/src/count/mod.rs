//! What compute passes do, counted while they run: between `Count::begin` and `Count::take`
//! each dispatch is done by a pipeline that counts (`instrument`), which adds
//! up in a place of its own.

mod chain;
mod instrument;
mod reader;

use bouncelight::gpu::bound::Bound;
use bouncelight::gpu::tape::{self, Made};
use bouncelight::gpu::{Gpu, readback};
use instrument::GROUP;
use reader::{FIRST, NUMBERS};
use std::borrow::Cow;
use std::cell::RefCell;
use std::rc::Rc;

/// Dispatches of a frame that there is room for, and bytes of each: 32 pairs of words.
const DISPATCHES: usize = 4096;
const STRIDE: u64 = 256;

/// Groups and numbers of bindings.
type Bindings = Vec<(u32, u32)>;

struct Counter {
    device: wgpu::Device,
    sums: wgpu::Buffer,
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    /// By those that do not count, the pipelines that do, and the bindings of their numbers; `None`
    /// where one cannot.
    pipelines: Vec<(wgpu::ComputePipeline, Option<(wgpu::ComputePipeline, Bindings)>)>,
    /// Bindings of the numbers of each dispatch; `None` where it does not count.
    dispatches: Vec<Option<Bindings>>,
}

/// What a dispatch did.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Counted {
    /// Label of its pass.
    pub label: String,
    /// Operations of all threads, and the same where each of 32 takes as long as the slowest.
    pub operations: [f64; 2],
    /// Rays into triangles.
    pub rays: f64,
    /// Threads dispatched, in whole 32s.
    pub threads: f64,
    /// Reads of memory that wait for the one before, of all threads as each of 32 goes with the
    /// slowest.
    pub links: f64,
    /// Links and operations of the slowest 32.
    pub longest: [f64; 2],
    /// Barriers that a thread meets.
    pub barriers: f64,
    /// Bytes of each binding, added up: what was asked for, but no more than there is, since what
    /// is there need not come from memory twice.
    pub bytes: f64,
}

/// Counts what is recorded on this thread by passes that were made since; there is one at a time.
pub(crate) struct Count {
    tape: tape::DispatchCapture,
    counter: Option<Rc<RefCell<Counter>>>,
}

impl Count {
    /// From here on it is remembered of what pipelines are made.
    pub fn start() -> Self {
        Self { tape: tape::DispatchCapture::start(), counter: None }
    }

    /// Dispatches count from here on. The device needs room for a storage buffer more a stage than
    /// shaders have that do not count.
    pub fn begin(&mut self, device: &wgpu::Device) {
        self.tape.take();
        let counter = Rc::new(RefCell::new(Counter::new(device.clone())));
        self.tape.listen(Some(counter.clone()));
        self.counter = Some(counter);
    }

    /// What each dispatch did that was recorded since [`begin`](Self::begin) and submitted. Those
    /// of shaders that do not count are left out.
    pub fn take(&mut self, gpu: &Gpu) -> Result<Vec<Counted>, readback::ReadbackError> {
        self.tape.listen(None);
        let Some(counter) = self.counter.take() else { return Ok(Vec::new()) };
        let counter = counter.borrow();
        let words = readback::buffer(&gpu.device, &gpu.queue, &counter.sums, 0, counter.sums.size())?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&words);
        let parts = words.chunks_exact(STRIDE as usize / 4).zip(&counter.dispatches);
        let found = self.tape.take().into_iter().zip(parts).filter_map(|(dispatch, (words, bindings))| {
            let number = |i: usize| f64::from(words[2 * i]) + f64::from(words[2 * i + 1]) * 2f64.powi(32);
            let asked = |(i, (group, binding)): (usize, &(u32, u32))| {
                let (_, bound, _) = dispatch.groups.iter().find(|g| g.0 == *group)?;
                let (_, bound) = bound.iter().find(|b| b.0 == *binding)?;
                let (unit, all) = size(bound);
                Some((unit * number(FIRST + i)).min(all))
            };
            let bytes = bindings.as_ref()?.iter().enumerate().filter_map(asked).sum();
            let operations = [number(0), number(NUMBERS)];
            let low_high = |i: usize| [words[2 * (NUMBERS + i)], words[2 * (NUMBERS + i) + 1]].map(f64::from);
            let [links, barriers] = low_high(2);
            Some(Counted {
                label: dispatch.label,
                operations,
                rays: number(1),
                threads: number(NUMBERS + 4),
                links: number(NUMBERS + 1),
                longest: [links, low_high(3)[0]],
                barriers,
                bytes,
            })
        });
        Ok(found.collect())
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

impl Counter {
    fn new(device: wgpu::Device) -> Self {
        let sums = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("count.sums"),
            size: DISPATCHES as u64 * STRIDE,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
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
        Self { device, sums, layout, group, pipelines: Vec::new(), dispatches: Vec::new() }
    }

    /// The pipeline that counts in the place of `made`. A network's layers are left alone: their
    /// plan says what they do, and which of many kernels does it hangs on the device.
    fn counting(&self, made: &Made) -> Option<(wgpu::ComputePipeline, Bindings)> {
        let source = Some(&made.source).filter(|source| !source.name.starts_with("net."))?;
        let found = instrument::counting(&source.text)?;
        let label = Some(source.name.as_str());
        let naga = wgpu::ShaderSource::Naga(Cow::Owned(found.module));
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source: naga });
        let mut groups: Vec<_> = made.groups.iter().map(Option::as_ref).collect();
        groups.resize(GROUP, None);
        groups.push(Some(&self.layout));
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label,
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: Some(&layout),
            module: &module,
            entry_point: Some(&made.entry),
            compilation_options: Default::default(),
            cache: None,
        });
        Some((pipeline, found.bindings))
    }

    fn found(&mut self, made: &Made) -> Option<(wgpu::ComputePipeline, Bindings)> {
        if let Some((_, known)) = self.pipelines.iter().find(|(plain, _)| *plain == made.pipeline) {
            return known.clone();
        }
        let counting = self.counting(made);
        self.pipelines.push((made.pipeline.clone(), counting.clone()));
        counting
    }
}

impl tape::Listener for Counter {
    /// Sets the pipeline that counts in the place of the one that is about to be dispatched, and
    /// where.
    fn before(&mut self, pass: &mut wgpu::ComputePass<'_>, made: Option<&Made>) {
        let at = self.dispatches.len();
        let found = made.filter(|_| at < DISPATCHES).and_then(|made| self.found(made));
        self.dispatches.push(found.map(|(pipeline, bindings)| {
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(GROUP as u32, &self.group, &[(at as u64 * STRIDE) as u32]);
            bindings
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bouncelight::gpu::timing::Recorder;
    use bouncelight::gpu::{GpuOptions, bind, binding};

    /// Thread i of 128 goes round i times: a comparison, a sum and a step each, and a comparison at
    /// the end. Every second one does four operations more.
    const LOOP: &str = "
@group(0) @binding(0) var<storage, read> given: array<f32>;
@group(0) @binding(1) var<storage, read_write> made: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    var sum = 0.0;
    for (var i = 0u; i < id.x; i++) {
        sum += given[i];
    }
    var all = vec4f(sum);
    if (id.x & 1u) == 1u {
        all = all * 2.0;
    }
    made[id.x] = all;
}
";

    fn for_counting() -> Option<Gpu> {
        match Gpu::open(&GpuOptions::default()).and_then(|gpu| gpu.for_counting()) {
            Ok(gpu) => Some(gpu),
            Err(e) => {
                assert!(std::env::var_os("REQUIRE_GPU").is_none(), "{e}");
                println!("SKIP: {e}");
                None
            }
        }
    }

    fn counted(gpu: &Gpu, text: &str) -> Counted {
        let buffer = |size| {
            let usage = wgpu::BufferUsages::STORAGE;
            let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
            gpu.device.create_buffer(&descriptor)
        };
        let mut count = Count::start();
        let mut binder = bind::Binder::new(&gpu.device, "test", &[binding::READ, binding::READ_WRITE]);
        let module = tape::shader_module(&gpu.device, "test", text.into());
        let pipeline = bind::pipeline(&gpu.device, "test", &module, "main", &[binder.layout()]);
        let group = binder.group([(&buffer(4 * 200)).into(), (&buffer(16 * 200)).into()]);
        count.begin(&gpu.device);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        Recorder::new(&mut encoder).compute("test", |pass| {
            pass.set_bind_group(0, &group, &[]);
            pass.set_pipeline(&pipeline);
            pass.dispatch_workgroups(2, 1, 1);
        });
        gpu.queue.submit([encoder.finish()]);
        let mut found = count.take(gpu).expect("read");
        assert_eq!(found.len(), 1);
        found.remove(0)
    }

    #[test]
    fn a_loop_of_known_length_is_counted_to_the_operation() {
        let Some(gpu) = for_counting() else { return };
        let found = counted(&gpu, LOOP);
        let rounds = 128.0 * 127.0 / 2.0;
        // After the loop: a comparison that ends it, a bit and whether it is set, and a vector's
        // product.
        assert_eq!(found.operations[0], 3.0 * rounds + 128.0 * 3.0 + 64.0 * 4.0);
        // The last thread of each 32 is the slowest, and an odd one.
        let slowest = [31.0, 63.0, 95.0, 127.0].map(|rounds| 32.0 * (3.0 * rounds + 3.0 + 4.0));
        assert_eq!(found.operations[1], slowest.iter().sum::<f64>());
        // Of what is read there are 200 numbers only; of what is written, 128 vectors.
        assert_eq!((found.bytes, found.rays), (4.0 * 200.0 + 16.0 * 128.0, 0.0));
        // A read a round waits for the one before; the slowest goes round most often.
        assert_eq!((found.threads, found.barriers), (128.0, 0.0));
        assert_eq!(found.links, 32.0 * (31.0 + 63.0 + 95.0 + 127.0));
        assert_eq!(found.longest, [127.0, 3.0 * 127.0 + 3.0 + 4.0]);
        // Negative controls: an operation more in the loop; half of the rounds; half of what is
        // written.
        let other = |from: &str, to: &str| {
            assert!(LOOP.contains(from));
            counted(&gpu, &LOOP.replace(from, to))
        };
        let more = other("sum += given[i];", "sum += given[i] * 3.0;");
        assert_eq!(more.operations[0], found.operations[0] + rounds);
        // Reads that need nothing of each other are under way together; those that do wait.
        let two = other("given[i]", "given[i] * given[i + 1u]");
        assert_eq!((two.links, two.longest[0]), (found.links, 127.0));
        let chained = other("given[i]", "given[u32(given[i])]");
        assert_eq!((chained.links, chained.longest[0]), (2.0 * found.links, 254.0));
        let called = LOOP.replace("given[i]", "fetch(i)") + "fn fetch(i: u32) -> f32 { return given[u32(given[i])]; }";
        assert_eq!(counted(&gpu, &called).links, chained.links);
        let fewer = other("i++", "i += 2u");
        assert!(fewer.operations[0] < found.operations[0] && fewer.operations[1] < found.operations[1]);
        let narrow = other("    made[id.x] = all;", "    if id.x < 64u { made[id.x] = all; }");
        assert_eq!(found.bytes - narrow.bytes, 16.0 * 64.0);
        // Who works before a barrier and who works behind it wait for each other.
        let halves = LOOP.replace("    var all = vec4f(sum);", "    workgroupBarrier();\n    var all = vec4f(sum);");
        let met = counted(&gpu, &halves);
        assert_eq!((met.operations[0], met.barriers), (found.operations[0], 1.0));
        let behind = "(id.x & 1u) == 1u";
        assert_eq!(met.operations[1], found.operations[1], "the slowest are the slowest on both sides");
        let turned = [LOOP, &halves].map(|text| counted(&gpu, &text.replace(behind, "(id.x & 31u) == 0u")));
        assert_eq!(turned[1].operations[0], turned[0].operations[0]);
        // Of four times 32 the first does four operations more, the last goes round most often.
        assert_eq!(turned[1].operations[1] - turned[0].operations[1], 4.0 * 32.0 * 4.0);
        // A ray is a call of the function of that name.
        let traced = LOOP.replace("given[i]", "f32(walk_begin(i))") + "fn walk_begin(x: u32) -> u32 { return x; }";
        assert_eq!(counted(&gpu, &traced).rays, rounds);
    }
}
