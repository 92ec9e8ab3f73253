//! The path tracer's host: a progressive object that works in short dispatches and can be asked for
//! its layers at any time.
//!
//! Unlike the passes of a frame it submits and waits for the device, as capture does. Random
//! numbers are keyed by seed, half, point and sample, and samples are summed one by one; so neither
//! the cutting into dispatches nor into bands shows in the result, bit for bit.

use super::{
    Job, Kernel, Layer, Noise, ReferenceScene, Traced, TracerError,
    film::Film,
    job,
    kernel::Entry,
    noise,
    schedule::Schedule,
    traced::{Gathered, JUDGED},
};
use bouncelight::gpu::readback;
use bouncelight::scene::Camera;
use std::time::{Duration, Instant};

/// Samples where `until_error` decides and nobody said how many there may be at most.
pub const DEFAULT_CAP: u32 = 65_536;

/// Most points of a picture or list.
const MOST_POINTS: u64 = 1 << 27;

/// Points that `reference.first_hit` takes at once.
const FIRST_HITS: u32 = 1 << 16;

/// What is traced: a picture, or chosen points of it.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// From where.
    pub camera: &'a Camera,
    /// Size of the picture, pixels.
    pub size: [u32; 2],
    /// Picture coordinates of the points, pixels (x right, y down; the centre of the first pixel is
    /// 0.5, 0.5); every sample goes through its point, no pixel filter. `None` for all pixels,
    /// through the filter.
    pub points: Option<&'a [[f32; 2]]>,
}

/// How it is traced.
#[derive(Debug, Clone, PartialEq)]
pub struct TracerOptions {
    /// Samples for each point; with `until_error` the most there may be.
    pub samples: u32,
    /// Stops as soon as the root mean square error of a point of this layer, divided by the layer's
    /// mean, is surely not above this. One of [`JUDGED`]. Each band of a large picture stops on its
    /// own.
    pub until_error: Option<(Layer, f64)>,
    /// Seed; the same seed gives the same result on the same device.
    pub seed: u32,
    /// Most bounces in all, as Blender counts them; [`job::UNLIMITED`] leaves the end to Russian
    /// roulette, without bias.
    pub bounces: u32,
    /// Most diffuse bounces.
    pub diffuse_bounces: u32,
    /// Most glossy bounces.
    pub glossy_bounces: u32,
    /// Limit of indirect contributions as Cycles' `sample_clamp_indirect`; 0 for none. Darkens.
    pub clamp: f32,
    /// Cycles' "Filter Glossy"; 0 for none. Biased; for comparisons with Cycles.
    pub filter_glossy: f32,
    /// Width of the pixel filter as Cycles counts it, pixels; 0 for none. Points never have one.
    pub filter_width: f32,
    /// Mode flags of [`job`], such as [`job::ANALYTIC_ONLY`].
    pub flags: u32,
    /// Layers wanted.
    pub layers: Vec<Layer>,
    /// How long a dispatch should take.
    pub dispatch: Duration,
    /// Most points of a film; larger pictures are done in bands. The device's limits lower it.
    pub band: u32,
}

impl Default for TracerOptions {
    fn default() -> Self {
        Self {
            samples: 64,
            until_error: None,
            seed: 0,
            bounces: job::UNLIMITED,
            diffuse_bounces: job::UNLIMITED,
            glossy_bounces: job::UNLIMITED,
            clamp: 0.0,
            filter_glossy: 0.0,
            filter_width: bouncelight::render::sampling::FILTER_WIDTH,
            flags: 0,
            layers: vec![Layer::Combined],
            dispatch: Duration::from_millis(100),
            band: u32::MAX,
        }
    }
}

/// Traces one subject, step by step.
pub struct Tracer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    kernel: Kernel,
    scene: wgpu::BindGroup,
    options: TracerOptions,
    points: u32,
    film: Film,
    groups: [wgpu::BindGroup; 2],
    job_buffer: wgpu::Buffer,
    job: Job,
    /// First point of the film and how many it holds.
    band: (u32, u32),
    most: u32,
    schedule: Schedule,
    /// Samples at which the band is done or looked at.
    goal: u32,
    /// Samples that will probably be enough.
    expected: u32,
    finished: bool,
    /// Of the bands before this one.
    before: Gathered,
    traced: Traced,
    samples_before: Option<[u32; 2]>,
}

impl Tracer {
    /// Prepares `subject` in `scene`. Compile the `kernel` once and give it to every tracer.
    ///
    /// # Errors
    /// No or too many points, coordinates that are no numbers, options that cannot be met.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        kernel: &Kernel,
        scene: &ReferenceScene,
        subject: Subject<'_>,
        options: TracerOptions,
    ) -> Result<Self, TracerError> {
        check_options(&options)?;
        let points = check_subject(device, subject)?;
        let size = if subject.points.is_some() { [points, 1] } else { subject.size };
        let mut job = Job::new(subject.camera, subject.size);
        let camera = job.world_from_view.as_flattened().iter().chain(&job.tan_half);
        if !camera.chain([&job.near]).all(|v| v.is_finite()) {
            return Err(TracerError::Input(format!("camera `{}`", subject.camera.name)));
        }
        job.seed = options.seed;
        job.flags = options.flags | if subject.points.is_some() { job::POINTS } else { 0 };
        job.filter_width = if subject.points.is_some() { 0.0 } else { options.filter_width };
        job.clamp = options.clamp;
        job.filter_glossy = options.filter_glossy;
        job.bounces = options.bounces;
        job.diffuse_bounces = options.diffuse_bounces;
        job.glossy_bounces = options.glossy_bounces;

        let traced = Traced::new(size, points as usize, &options.layers)?;
        let most = options.band.min(Film::most_points(device)).min(points).max(1);
        let film = Film::new(device, most);
        let make = |label, size, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let job_buffer = make("reference.job", size_of::<Job>() as u64, wgpu::BufferUsages::STORAGE);
        let list: &[u8] = bytemuck::cast_slice(subject.points.unwrap_or(&[]));
        let point_list = make("reference.points", (list.len() as u64).max(16), wgpu::BufferUsages::STORAGE);
        if !list.is_empty() {
            queue.write_buffer(&point_list, 0, list);
        }
        let groups = film.halves.each_ref().map(|half| kernel.group(device, &job_buffer, &point_list, half));
        let mut tracer = Self {
            device: device.clone(),
            queue: queue.clone(),
            kernel: kernel.clone(),
            scene: scene.group().clone(),
            points,
            film,
            groups,
            job_buffer,
            job,
            band: (0, most),
            most,
            schedule: Schedule::new(most, options.dispatch.as_secs_f64()),
            goal: first_goal(&options, most),
            expected: first_goal(&options, most),
            finished: false,
            before: Gathered::default(),
            traced,
            samples_before: None,
            options,
        };
        // Many drivers compile when a kernel runs for the first time; that is no measure of how
        // fast it is.
        tracer.dispatch(Entry::Path, &tracer.job)?;
        tracer.begin_band()?;
        Ok(tracer)
    }

    /// Runs one short dispatch; false when there is nothing left to do. Blocks until the GPU is
    /// done with it.
    ///
    /// # Errors
    /// The device was lost or could not be read.
    pub fn step(&mut self) -> Result<bool, TracerError> {
        if self.finished {
            return Ok(false);
        }
        let Some(chunk) = self.schedule.next(self.goal) else {
            self.look()?;
            return Ok(!self.finished);
        };
        let job = Job {
            first_point: self.band.0 + chunk.first,
            point_count: chunk.count,
            film_first: self.band.0,
            first_sample: chunk.first_sample,
            sample_count: chunk.samples,
            half: chunk.half as u32,
            ..self.job
        };
        let started = Instant::now();
        self.dispatch(Entry::Path, &job)?;
        let seconds = started.elapsed().as_secs_f64();
        tracing::debug!("{} points, {} samples: {:.1} ms", chunk.count, chunk.samples, seconds * 1e3);
        self.schedule.took(chunk, seconds);
        self.traced.seconds += seconds;
        self.traced.traced += u64::from(chunk.count) * u64::from(chunk.samples);
        Ok(true)
    }

    /// Steps until all is done. `None` where `go_on`, asked after each step, says no.
    ///
    /// # Errors
    /// As [`Self::step`] and [`Self::finish`].
    pub fn run(mut self, mut go_on: impl FnMut(&Self) -> bool) -> Result<Option<Traced>, TracerError> {
        while self.step()? {
            if !go_on(&self) {
                return Ok(None);
            }
        }
        self.finish().map(Some)
    }

    /// True when all samples are done or the noise is small enough.
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// Samples of every point of the band under way.
    pub fn samples(&self) -> u32 {
        self.schedule.samples()
    }

    /// Samples traced so far, of all points together: what the time goes into.
    pub fn traced(&self) -> u64 {
        self.traced.traced
    }

    /// How many samples a point will probably get: those asked for, or as many as the error bound
    /// seems to need.
    pub fn expected_samples(&self) -> u64 {
        self.expected.into()
    }

    /// How much is done, 0 to 1; with an error bound it is a guess, which may fall.
    pub fn progress(&self) -> f64 {
        if self.finished {
            return 1.0;
        }
        let band = f64::from(self.schedule.samples()) / f64::from(self.expected);
        (f64::from(self.band.0) + f64::from(self.band.1) * band) / f64::from(self.points)
    }

    /// The layers as they are by now, with the noise that is left. Points that no sample reached
    /// yet are 0. Blocks.
    ///
    /// # Errors
    /// The device was lost or could not be read.
    pub fn resolve(&mut self) -> Result<&Traced, TracerError> {
        if !self.finished {
            self.gather()?;
        }
        Ok(&self.traced)
    }

    /// Noise left in `layer`, one of [`JUDGED`], as [`Self::resolve`] or the last look found it.
    pub fn noise(&self, layer: Layer) -> Option<Noise> {
        self.traced.noise_of(layer)
    }

    /// The result, once and for all.
    ///
    /// # Errors
    /// As [`Self::resolve`], and values that are no numbers.
    pub fn finish(mut self) -> Result<Traced, TracerError> {
        self.resolve()?;
        self.traced.check()?;
        Ok(self.traced)
    }

    /// The band has the samples of its goal: it is done, or wants more.
    fn look(&mut self) -> Result<(), TracerError> {
        let gathered = self.gather()?;
        let samples = self.schedule.samples();
        if let Some((layer, bound)) = self.options.until_error
            && samples < self.options.samples
        {
            let noise = gathered.noise()[JUDGED.iter().position(|l| *l == layer).unwrap_or(0)];
            if noise.pixel_at_most > bound {
                self.goal = noise::next_check(samples, &noise, bound).min(self.options.samples);
                let needed = f64::from(samples) * (noise.pixel_at_most / bound).powi(2);
                self.expected = (needed as u32).clamp(self.goal, self.options.samples);
                return Ok(());
            }
        }
        self.before = self.before.plus(&gathered);
        let [fewest, most] = self.samples_before.unwrap_or([samples; 2]);
        self.samples_before = Some([fewest.min(samples), most.max(samples)]);
        let next = self.band.0 + self.band.1;
        if next >= self.points {
            self.finished = true;
            return Ok(());
        }
        self.band = (next, self.most.min(self.points - next));
        self.schedule = self.schedule.restart(self.band.1);
        self.goal = first_goal(&self.options, self.band.1);
        self.begin_band()
    }

    /// Empties the film, and fills in what comes from the first hit alone.
    fn begin_band(&mut self) -> Result<(), TracerError> {
        if self.options.layers.iter().any(|l| l.is_first_hit()) {
            // The film's own memory holds the hits for a moment.
            let (first, count) = self.band;
            for start in (first..first + count).step_by(FIRST_HITS as usize) {
                let point_count = FIRST_HITS.min(first + count - start);
                let job = Job { first_point: start, point_count, film_first: start, ..self.job };
                self.dispatch(Entry::FirstHit, &job)?;
                let bytes = 16 * u64::from(point_count);
                let bytes = readback::buffer(&self.device, &self.queue, &self.film.halves[0], 0, bytes)?;
                let hits: Vec<[f32; 4]> = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
                self.traced.fill_first_hits(start as usize, &hits);
            }
        }
        self.film.clear(&self.device, &self.queue);
        Ok(())
    }

    /// Brings layers and noise up to date with the film; gives what the band alone has gathered.
    fn gather(&mut self) -> Result<Gathered, TracerError> {
        let schedule = &self.schedule;
        let samples = |point| schedule.samples_of(point);
        let gathered = self.traced.fill((&self.device, &self.queue), &self.film, self.band, samples)?;
        let all = self.before.plus(&gathered);
        let here = self.schedule.samples();
        let [fewest, most] = self.samples_before.unwrap_or([here; 2]);
        self.traced.samples = [fewest.min(here), most.max(here)];
        self.traced.noise = all.noise();
        self.traced.dropped = all.dropped();
        Ok(gathered)
    }

    fn dispatch(&self, entry: Entry, job: &Job) -> Result<(), TracerError> {
        self.queue.write_buffer(&self.job_buffer, 0, bytemuck::bytes_of(job));
        let groups = [&self.scene, &self.groups[job.half as usize]];
        self.kernel.run(&self.device, &self.queue, entry, groups, job.point_count)
    }
}

fn first_goal(options: &TracerOptions, points: u32) -> u32 {
    match options.until_error {
        Some(_) => noise::first_check(points).min(options.samples),
        None => options.samples,
    }
}

fn check_options(options: &TracerOptions) -> Result<(), TracerError> {
    let wrong = |text: String| Err(TracerError::Option(text));
    if options.samples == 0 {
        return wrong("a picture needs at least one sample".into());
    }
    if let Some((layer, bound)) = options.until_error {
        if !(bound.is_finite() && bound > 0.0) {
            return wrong(format!("an error of {bound} cannot be reached; it must be above 0"));
        }
        if !JUDGED.contains(&layer) {
            let known = JUDGED.map(Layer::name).join(", ");
            return wrong(format!("the noise of {} is not known; there are {known}", layer.name()));
        }
    }
    if !(options.clamp.is_finite() && options.clamp >= 0.0) {
        return wrong(format!("a clamp of {} limits nothing; it must be 0 (none) or above", options.clamp));
    }
    if !(options.filter_glossy.is_finite() && options.filter_glossy >= 0.0) {
        return wrong(format!("a glossy filter of {} is none", options.filter_glossy));
    }
    if !(options.filter_width.is_finite() && options.filter_width >= 0.0) {
        return wrong(format!("a pixel filter of width {} is none", options.filter_width));
    }
    Ok(())
}

/// How many points there are, if they can be traced.
fn check_subject(device: &wgpu::Device, subject: Subject<'_>) -> Result<u32, TracerError> {
    let [width, height] = subject.size;
    let pixels = u64::from(width) * u64::from(height);
    let points = subject.points.map_or(pixels, |p| p.len() as u64);
    let wrong = |reason: String| Err(TracerError::Points { points, width, height, reason });
    if pixels == 0 || points == 0 {
        return wrong("there is nothing to trace".into());
    }
    if points > MOST_POINTS {
        return wrong(format!("at most {MOST_POINTS} points can be traced at once"));
    }
    if let Some(list) = subject.points {
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 8;
        if points > most {
            return wrong(format!("a list for this device may have {most} points"));
        }
        if let Some(i) = list.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
            return Err(TracerError::Input(format!("point {i} of the list ({}, {})", list[i][0], list[i][1])));
        }
    }
    Ok(points as u32)
}
