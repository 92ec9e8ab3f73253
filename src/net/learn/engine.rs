//! [`Learner`]: the tape on a device.

use super::tape::{Call, Job, Kernel, Tape, loss_calls};
use super::{BETA, Example, KEEP, LearnError, MEANING};
use crate::gpu::binding::{READ, READ_WRITE};
use crate::gpu::{bind, readback, shaders};
use crate::net::format::Weights;
use std::collections::{BTreeMap, HashMap};

/// Sections of `numbers` before the results, and results; as `shaders/net/learn/job.wgsl` has them.
const SECTIONS: usize = 5;
const AVERAGE: usize = 3;
const GRADIENT: usize = 4;
const RESULTS: usize = 5;
/// Bytes from one job to the next: the largest alignment that a device may ask for.
const SLOT: u64 = 256;
/// Workgroups of one dimension.
const MOST_GROUPS: u64 = 65_535;

/// A network that is being learnt from pictures of one size. Owns its buffers; submits and waits:
/// for tools, not for frames.
pub struct Learner {
    device: wgpu::Device,
    queue: wgpu::Queue,
    weights: Weights,
    tape: Tape,
    cells: [u32; 2],
    pipelines: HashMap<Kernel, wgpu::ComputePipeline>,
    layout: wgpu::BindGroupLayout,
    jobs: wgpu::Buffer,
    values: wgpu::Buffer,
    slopes: wgpu::Buffer,
    numbers: wgpu::Buffer,
    /// Where what is learnt waits while the average is asked, and the average on its way there.
    aside: [wgpu::Buffer; 2],
    steps: u32,
}

/// A picture on the device.
pub struct Loaded {
    input: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// What came of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stride {
    /// Mean loss of the step's pictures, before the step.
    pub loss: f32,
    /// Relative error of the light in the step's pictures, root of the mean square: what the loss
    /// is of, loud pictures and the noise of targets included.
    pub error: f32,
    /// Norm of the gradients of all numbers together, before it is clipped.
    pub norm: f32,
}

/// The slope of a sum in each learnt number, by tensor.
pub type Gradients = BTreeMap<String, Vec<f32>>;

impl Learner {
    /// Takes the numbers of `weights` up, to be learnt from pictures of `cells` (width, height).
    /// Compiles the kernels.
    ///
    /// # Errors
    /// An operator without a way back, and what does not fit the device. A network whose answer has
    /// no loss here has a way back ([`Self::gradients`]), but [`Self::step`] refuses it.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        cells: [u32; 2],
    ) -> Result<Self, LearnError> {
        let tape = Tape::new(weights, cells)?;
        let numbers = tape.total() * SECTIONS + RESULTS;
        let most = device.limits().max_storage_buffer_binding_size.min(device.limits().max_buffer_size);
        for bytes in [tape.values * 4, numbers as u64 * 4] {
            if bytes > most {
                let reason = format!("they take {bytes} bytes, the device binds {most}");
                return Err(LearnError::Size { cells, reason });
            }
        }
        let dynamic = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: wgpu::BufferSize::new(size_of::<Job>() as u64),
        };
        let binder = bind::Binder::new(device, "learn", &[dynamic, READ_WRITE, READ_WRITE, READ_WRITE, READ]);
        let layout = binder.layout().clone();
        let buffer = |label, size: u64, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        // The network's own, and the loss's two and the step's two, which are written anew for each
        // step.
        let slots = (tape.forward.len() + tape.backward.len() + 4) as u64;
        let learner = Self {
            pipelines: pipelines(device, &layout),
            jobs: buffer("learn.jobs", slots * SLOT, wgpu::BufferUsages::UNIFORM),
            values: buffer("learn.values", tape.values * 4, wgpu::BufferUsages::STORAGE),
            slopes: buffer("learn.slopes", tape.values * 4, wgpu::BufferUsages::STORAGE),
            numbers: buffer("learn.numbers", numbers as u64 * 4, wgpu::BufferUsages::STORAGE),
            aside: ["learn.learnt", "learn.average"]
                .map(|label| buffer(label, tape.total() as u64 * 4, wgpu::BufferUsages::empty())),
            device: device.clone(),
            queue: queue.clone(),
            weights: weights.clone(),
            tape,
            cells,
            layout,
            steps: 0,
        };
        let own = learner.tape.forward.iter().chain(&learner.tape.backward);
        own.enumerate().for_each(|(slot, call)| learner.write_job(slot, call));
        let start: Vec<f32> = weights.tensors().values().flat_map(|t| &t.data).copied().collect();
        for section in [0, AVERAGE] {
            queue.write_buffer(&learner.numbers, learner.section(section), bytemuck::cast_slice(&start));
        }
        Ok(learner)
    }

    /// Copies a picture to the device.
    ///
    /// # Errors
    /// [`LearnError::Picture`] where it has another size.
    pub fn load(&self, example: &Example) -> Result<Loaded, LearnError> {
        let cells = self.tape.input.shape.pixels() as usize;
        let Example { input, guess, target, counts } = example;
        let wanted = self.tape.input.values() as usize;
        for (what, values, wanted) in [
            ("input", input, wanted),
            ("guess", guess, 3 * cells),
            ("target", target, 3 * cells),
            ("cells", counts, cells),
        ] {
            if values.len() != wanted {
                return Err(LearnError::Picture { what, found: values.len(), wanted });
            }
        }
        Ok(self.upload(input, &[guess.as_slice(), target, counts].concat()))
    }

    fn upload(&self, input: &[f32], picture: &[f32]) -> Loaded {
        let buffer = |label, values: &[f32], usage| {
            let (size, usage) = (size_of_val(values) as u64, usage | wgpu::BufferUsages::COPY_DST);
            let descriptor = wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false };
            let buffer = self.device.create_buffer(&descriptor);
            self.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(values));
            buffer
        };
        let input = buffer("learn.input", input, wgpu::BufferUsages::COPY_SRC);
        let picture = buffer("learn.picture", picture, wgpu::BufferUsages::STORAGE);
        let job =
            wgpu::BufferBinding { buffer: &self.jobs, offset: 0, size: wgpu::BufferSize::new(size_of::<Job>() as u64) };
        let whole = [&self.values, &self.slopes, &self.numbers, &picture].map(wgpu::Buffer::as_entire_binding);
        let resources = std::iter::once(wgpu::BindingResource::Buffer(job)).chain(whole);
        let entries: Vec<_> =
            (0u32..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let descriptor =
            wgpu::BindGroupDescriptor { label: Some("learn.picture"), layout: &self.layout, entries: &entries };
        Loaded { input, group: self.device.create_bind_group(&descriptor) }
    }

    /// One step down the mean loss of these pictures, `rate` long (AdamW's learning rate).
    ///
    /// # Errors
    /// A meaning without a loss; numbers that have run away; the device was lost.
    pub fn step(&mut self, pictures: &[&Loaded], rate: f32) -> Result<Stride, LearnError> {
        if self.weights.output.meaning != MEANING {
            return Err(LearnError::Meaning { found: self.weights.output.meaning.clone() });
        }
        self.steps += 1;
        let own = self.tape.forward.len() + self.tape.backward.len();
        let loss = self.write_loss(pictures.len());
        let unbias = BETA.map(|beta| (1.0 / (1.0 - f64::from(beta).powi(self.steps as i32))) as f32);
        // The first averages would be of the beginning alone.
        let keep = KEEP.min(self.steps as f32 / (9 + self.steps) as f32);
        let total = self.tape.total();
        let adam = Job { total: total as u32, rate, unbias, keep, ..Job::default() };
        let call = |kernel, elements| Call { kernel, job: adam, elements };
        let adam = [call(Kernel::AdamNorm, 1), call(Kernel::AdamStep, total as u64)];
        adam.iter().enumerate().for_each(|(i, call)| self.write_job(own + loss.len() + i, call));

        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.numbers, self.section(GRADIENT), None);
        for picture in pictures {
            self.prepare(&mut encoder, picture);
            let mut pass = self.pass(&mut encoder, picture);
            self.dispatch(&mut pass, 0, &self.tape.forward);
            self.dispatch(&mut pass, own, &loss);
            self.dispatch(&mut pass, self.tape.forward.len(), &self.tape.backward);
        }
        if let Some(any) = pictures.first() {
            self.dispatch(&mut self.pass(&mut encoder, any), own + loss.len(), &adam);
        }
        self.queue.submit([encoder.finish()]);
        let results = self.read(self.section(SECTIONS), RESULTS)?;
        let stride = Stride { loss: results[0], error: results[4].sqrt(), norm: results[2] };
        if stride.loss.is_finite() && stride.norm.is_finite() {
            return Ok(stride);
        }
        Err(LearnError::Diverged { step: self.steps, loss: stride.loss, norm: stride.norm })
    }

    /// Relative error of the light in these pictures, as [`Stride::error`], by the network that
    /// [`Self::weights`] returns. Learns nothing: the same for pictures that are never learnt from
    /// tells when to stop.
    ///
    /// # Errors
    /// A meaning without a loss; the device was lost.
    pub fn error(&self, pictures: &[Loaded]) -> Result<f32, LearnError> {
        if self.weights.output.meaning != MEANING {
            return Err(LearnError::Meaning { found: self.weights.output.meaning.clone() });
        }
        let own = self.tape.forward.len() + self.tape.backward.len();
        let loss = self.write_loss(pictures.len());
        let (learnt, average) = (&self.aside[0], &self.aside[1]);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&self.numbers, 0, learnt, 0, learnt.size());
        encoder.copy_buffer_to_buffer(&self.numbers, self.section(AVERAGE), average, 0, average.size());
        encoder.copy_buffer_to_buffer(average, 0, &self.numbers, 0, average.size());
        encoder.clear_buffer(&self.numbers, self.section(GRADIENT), None);
        for picture in pictures {
            self.prepare(&mut encoder, picture);
            let mut pass = self.pass(&mut encoder, picture);
            self.dispatch(&mut pass, 0, &self.tape.forward);
            self.dispatch(&mut pass, own, &loss);
        }
        encoder.copy_buffer_to_buffer(learnt, 0, &self.numbers, 0, learnt.size());
        self.queue.submit([encoder.finish()]);
        Ok(self.read(self.section(SECTIONS), RESULTS)?[4].sqrt())
    }

    /// The slope of Σ `output_slopes` · output in each learnt number, for one input; both channel
    /// by channel. Learns nothing.
    ///
    /// # Errors
    /// Lists of other lengths; the device was lost.
    pub fn gradients(&self, input: &[f32], output_slopes: &[f32]) -> Result<Gradients, LearnError> {
        let (from, to) = (self.tape.input, self.tape.output);
        for (what, values, place) in [("input", input, from), ("output", output_slopes, to)] {
            let wanted = place.values() as usize;
            if values.len() != wanted {
                return Err(LearnError::Picture { what, found: values.len(), wanted });
            }
        }
        let picture = self.upload(input, &[0.0]);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.numbers, self.section(GRADIENT), None);
        self.prepare(&mut encoder, &picture);
        self.dispatch(&mut self.pass(&mut encoder, &picture), 0, &self.tape.forward);
        self.queue.submit([encoder.finish()]);
        self.queue.write_buffer(&self.slopes, u64::from(to.first) * 4, bytemuck::cast_slice(output_slopes));
        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.dispatch(&mut self.pass(&mut encoder, &picture), self.tape.forward.len(), &self.tape.backward);
        self.queue.submit([encoder.finish()]);
        self.section_by_tensor(GRADIENT)
    }

    /// The gradients of the last [`Self::step`], before they were clipped.
    ///
    /// # Errors
    /// The device was lost.
    pub fn last_gradients(&self) -> Result<Gradients, LearnError> {
        self.section_by_tensor(GRADIENT)
    }

    /// The network as it is by now: the average over steps, to be stored as it was read.
    ///
    /// # Errors
    /// The device was lost.
    pub fn weights(&self) -> Result<Weights, LearnError> {
        let mut weights = self.weights.clone();
        for (name, values) in self.section_by_tensor(AVERAGE)? {
            if let Some(tensor) = weights.tensors.get_mut(&name) {
                tensor.data = values;
            }
        }
        Ok(weights)
    }

    /// Steps so far.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// Multiplications and additions of one picture there and back, three times those there.
    ///
    /// # Errors
    /// Never for a learner that could be made.
    pub fn flops(&self) -> Result<u64, LearnError> {
        Ok(3 * self.weights.graph.flops(self.cells[0], self.cells[1])?)
    }

    /// Byte at which a section of `numbers` begins.
    fn section(&self, section: usize) -> u64 {
        (section * self.tape.total() * 4) as u64
    }

    fn read(&self, from: u64, count: usize) -> Result<Vec<f32>, LearnError> {
        let bytes = readback::buffer(&self.device, &self.queue, &self.numbers, from, count as u64 * 4)?;
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    fn section_by_tensor(&self, section: usize) -> Result<Gradients, LearnError> {
        let all = self.read(self.section(section), self.tape.total())?;
        Ok(self.tape.learnt.iter().map(|(name, range)| (name.clone(), all[range.clone()].to_vec())).collect())
    }

    /// Writes the jobs of the mean loss of so many pictures, behind the network's own.
    fn write_loss(&self, pictures: usize) -> [Call; 2] {
        let loss = loss_calls(self.tape.output, self.tape.total(), pictures.max(1));
        let own = self.tape.forward.len() + self.tape.backward.len();
        loss.iter().enumerate().for_each(|(i, call)| self.write_job(own + i, call));
        loss
    }

    fn write_job(&self, slot: usize, call: &Call) {
        self.queue.write_buffer(&self.jobs, slot as u64 * SLOT, bytemuck::bytes_of(&call.job));
    }

    /// The picture becomes the network's input, and nothing has a slope yet.
    fn prepare(&self, encoder: &mut wgpu::CommandEncoder, picture: &Loaded) {
        let first = u64::from(self.tape.input.first) * 4;
        encoder.copy_buffer_to_buffer(&picture.input, 0, &self.values, first, picture.input.size());
        encoder.clear_buffer(&self.slopes, 0, None);
    }

    fn pass<'e>(&self, encoder: &'e mut wgpu::CommandEncoder, picture: &Loaded) -> Bound<'e> {
        let label = Some("learn");
        let pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes: None });
        Bound { pass, group: picture.group.clone() }
    }

    /// Dispatches calls whose jobs stand from slot `first` on.
    fn dispatch(&self, bound: &mut Bound<'_>, first: usize, calls: &[Call]) {
        for (i, call) in calls.iter().enumerate() {
            bound.pass.set_pipeline(&self.pipelines[&call.kernel]);
            bound.pass.set_bind_group(0, &bound.group, &[((first + i) as u64 * SLOT) as u32]);
            let groups = call.elements.div_ceil(64);
            let columns = groups.min(MOST_GROUPS);
            bound.pass.dispatch_workgroups(columns as u32, groups.div_ceil(columns) as u32, 1);
        }
    }
}

/// A pass and what is bound in it.
struct Bound<'e> {
    pass: wgpu::ComputePass<'e>,
    group: wgpu::BindGroup,
}

fn pipelines(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> HashMap<Kernel, wgpu::ComputePipeline> {
    let mut modules = HashMap::new();
    let mut made = HashMap::new();
    for kernel in Kernel::ALL {
        let (shader, entry) = kernel.entry();
        let compile = || shaders::module_with(device, shader, &super::prelude(shader));
        let module = modules.entry(shader).or_insert_with(compile);
        made.insert(kernel, bind::pipeline(device, &format!("{shader}.{entry}"), module, entry, &[layout]));
    }
    made
}
