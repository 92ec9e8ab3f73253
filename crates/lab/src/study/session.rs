//! One scene, any method: pictures with their layers in linear light, sequences that keep their
//! history, what it costs, and the path-traced picture beside it. The one place where studies draw.

mod frame;

pub use super::error::SessionError;
use super::{
    bench::{self, BenchOptions, Measurement},
    count, hash,
    projection::{self, Cost},
    truth,
    truth::Reference,
};
use crate::reference::{Kernel, ReferenceScene, TracerOptions};
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{
    Blending, Purpose, Renderer, RendererOptions, View,
    capture::{CaptureOptions, Layer, capture_with},
};
use bouncelight::scene::{Camera, Scene};
pub use frame::{Edits, Frame, FrameChange, Settling};
use std::path::PathBuf;

/// Layers of every [`Frame`] unless others are asked for.
pub const LAYERS: [Layer; 6] =
    [Layer::DiffDir, Layer::DiffInd, Layer::DiffCol, Layer::Normal, Layer::Depth, Layer::Emit];

/// How a trial draws.
#[derive(Debug, Clone)]
pub struct SessionOptions {
    /// Layers beside the picture.
    pub layers: Vec<Layer>,
    /// Temporal anti-aliasing.
    pub taa: bool,
    /// Seed of offsets and stochastic patterns.
    pub seed: u32,
    /// Folder of references that were traced before; made when it is needed. Without one nothing is
    /// kept.
    pub kept: Option<PathBuf>,
}

impl Default for SessionOptions {
    fn default() -> Self {
        Self { layers: LAYERS.to_vec(), taa: false, seed: 0, kept: None }
    }
}

/// Hears the share that is done of a picture or tracing, and says whether to go on.
pub type Watch<'a> = Box<dyn Fn(f64) -> bool + 'a>;

/// A scene on a device, ready to be drawn by any method.
pub struct Session<'a> {
    gpu: &'a Gpu,
    scene: Scene,
    uploaded: SceneGpu,
    size: [u32; 2],
    options: SessionOptions,
    watch: Watch<'a>,
    kernel: Option<Kernel>,
    packed: Option<ReferenceScene>,
    hash: Option<String>,
}

impl<'a> Session<'a> {
    /// Uploads the scene; pictures will have `size` pixels.
    ///
    /// # Errors
    /// A scene that does not fit on the device.
    pub fn new(gpu: &'a Gpu, scene: Scene, size: [u32; 2], options: SessionOptions) -> Result<Self, SessionError> {
        let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene)?;
        let watch: Watch = Box::new(|_| true);
        Ok(Self { gpu, scene, uploaded, size, options, watch, kernel: None, packed: None, hash: None })
    }

    /// From now on `watch` hears how far a picture or tracing is, and may stop it.
    pub fn watched(mut self, watch: impl Fn(f64) -> bool + 'a) -> Self {
        self.watch = Box::new(watch);
        self
    }

    /// References are traced with a kernel that is compiled already: compiling takes longer than a
    /// small picture.
    pub fn share_kernel(&mut self, kernel: Kernel) {
        self.kernel = Some(kernel);
    }

    /// The scene as it is drawn now.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Pixels of the pictures.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// The scene's name by content ([`hash::of_scene`]) as it is now.
    pub fn hash(&mut self) -> &str {
        self.hash.get_or_insert_with(|| hash::of_scene(&self.scene))
    }

    /// Changes the scene, for all that is drawn and traced from now on.
    ///
    /// # Errors
    /// An instance that is not there (then nothing has changed); surroundings that do not fit.
    pub fn edit(&mut self, edits: &Edits) -> Result<(), SessionError> {
        let Edits { lights, environment, placements } = edits;
        let count = self.scene.instances.len();
        if let Some(&(index, _)) = placements.iter().find(|(i, _)| *i >= count) {
            return Err(SessionError::Instance { index, count });
        }
        if lights.is_none() && environment.is_none() && placements.is_empty() {
            return Ok(());
        }
        (self.packed, self.hash) = (None, None);
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        if !placements.is_empty() {
            placements.iter().for_each(|(i, transform)| self.scene.instances[*i].transform = *transform);
            self.uploaded.set_placements(queue, &self.scene);
        }
        if let Some(lights) = lights {
            self.scene.lights.clone_from(lights);
        }
        match environment {
            Some(environment) => {
                self.scene.environment = environment.clone();
                self.uploaded.set_environment(device, queue, &self.scene)?;
            }
            None if lights.is_some() => self.uploaded.set_lights(device, queue, &self.scene),
            None => {}
        }
        Ok(())
    }

    /// One picture of a still camera, from a renderer that knows nothing yet. Where the scene can
    /// have no rays, the method below draws, and [`Frame::fallback`] says so.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn picture(&mut self, method: &Method, camera: &Camera, settling: Settling) -> Result<Frame, SessionError> {
        let mut renderer = self.renderer(method)?;
        let warmup = if method.has_history() || self.options.taa { settling.frames.max(1) - 1 } else { 0 };
        let mut frame = self.shoot(&mut renderer, camera, settling.samples, warmup, 0)?;
        if method.needs_rays() {
            frame.without = self.direct(camera, settling.samples)?;
        }
        Ok(frame)
    }

    /// DiffDir as `direct` draws it, where that is another than with methods that know the scene.
    fn direct(&mut self, camera: &Camera, samples: u32) -> Result<Option<Vec<f32>>, SessionError> {
        if !self.scene.lights.iter().any(|l| l.is_emissive_proxy) || !self.options.layers.contains(&Layer::DiffDir) {
            return Ok(None);
        }
        let mut renderer = self.renderer(&Method::Direct)?;
        let frame = self.shoot(&mut renderer, camera, samples, 0, 0)?;
        Ok(Some(frame.layer(Layer::DiffDir).data.clone()))
    }

    /// `frames` pictures one after the other by one renderer, which keeps its history; `change`
    /// says what each frame shows. Each is sampled through the pixels' centres. The scene is
    /// afterwards as it was before. Only wanted frames are handed to `take`, as soon as they are there.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn render_sequence(
        &mut self,
        method: &Method,
        change: &mut dyn FnMut(u32) -> FrameChange,
        frames: u32,
        take: &mut dyn FnMut(Frame),
    ) -> Result<(), SessionError> {
        let before = Edits {
            lights: Some(self.scene.lights.clone()),
            environment: Some(self.scene.environment.clone()),
            placements: self.scene.instances.iter().map(|i| i.transform).enumerate().collect(),
        };
        let mut edited = false;
        let mut draw = || -> Result<(), SessionError> {
            let mut renderer = self.renderer(method)?;
            for number in 0..frames {
                let FrameChange { camera, edits, cut, wanted } = change(number);
                edited |= edits.lights.is_some() || edits.environment.is_some() || !edits.placements.is_empty();
                self.edit(&edits)?;
                if cut {
                    renderer.reset_history();
                }
                if wanted {
                    let mut frame = self.shoot(&mut renderer, &camera, 1, 0, number)?;
                    if method.needs_rays() {
                        frame.without = self.direct(&camera, 1)?;
                    }
                    take(frame);
                } else {
                    self.draw(&mut renderer, &camera)?;
                }
                if !(self.watch)(f64::from(number + 1) / f64::from(frames)) {
                    return Err(SessionError::Stopped);
                }
            }
            Ok(())
        };
        let drawn = draw();
        if edited {
            self.edit(&before)?;
        }
        drawn
    }

    /// The path-traced picture of `camera`, from the folder of references if it was traced before;
    /// `options` from [`truth::samples`] or [`truth::until`], with limits of bounces where a
    /// comparison needs them.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn reference(&mut self, camera: &Camera, options: &TracerOptions) -> Result<Reference, SessionError> {
        let Some(folder) = self.options.kept.clone() else { return self.trace(camera, options) };
        let size = self.size;
        let path = folder.join(truth::file_name(self.hash(), camera, size, options));
        if let Some(reference) = truth::kept(&path) {
            return Ok(reference);
        }
        let reference = self.trace(camera, options)?;
        let broken = |e: std::io::Error| SessionError::Kept { path: folder.clone(), reason: e.to_string() };
        std::fs::create_dir_all(&folder).map_err(broken)?;
        truth::keep(&path, &reference, &self.gpu.sentence())?;
        Ok(reference)
    }

    /// As [`Self::reference`], traced now and not kept: for its seconds.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn trace(&mut self, camera: &Camera, options: &TracerOptions) -> Result<Reference, SessionError> {
        self.prepare_tracer()?;
        let (kernel, packed) = (self.kernel.as_ref().expect("prepared"), self.packed.as_ref().expect("prepared"));
        truth::trace(self.gpu, kernel, packed, (camera, self.size), options, &self.watch)
    }

    fn prepare_tracer(&mut self) -> Result<(), SessionError> {
        let gpu = self.gpu;
        self.kernel.get_or_insert_with(|| Kernel::new(&gpu.device));
        if self.packed.is_none() {
            self.packed = Some(ReferenceScene::new(&gpu.device, &gpu.queue, &self.scene)?);
        }
        Ok(())
    }

    /// What the method costs here, frame after frame of a still camera, at no time at rest; with `cuts`
    /// each is the first after one.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn measure(
        &mut self,
        method: &Method,
        camera: &Camera,
        options: BenchOptions,
        cuts: bool,
    ) -> Result<Measurement, SessionError> {
        let mut renderer = self.renderer(&method.clone().without_rest())?;
        Ok(bench::measure(self.gpu, &mut renderer, &self.uploaded, camera, options, cuts)?)
    }

    /// What the passes that find and add indirect light do in a frame of a still camera, settled
    /// over [`Method::frames_to_steady`].
    ///
    /// # Errors
    /// [`SessionError::Count`].
    pub fn count(&self, method: &Method, camera: &Camera) -> Result<Vec<Cost>, SessionError> {
        let still = count::Still { scene: &self.scene, camera, size: self.size };
        let mut costs = count::frame(self.gpu, still, self.renderer_options(method), method.frames_to_steady())?;
        costs.retain(|c| projection::is_indirect(&c.pass));
        Ok(costs)
    }

    fn renderer_options(&self, method: &Method) -> RendererOptions {
        // What is judged is compared with paths, which meet such surfaces by lot.
        let blending = Blending::Stochastic;
        RendererOptions { method: method.clone(), taa: self.options.taa, blending, ..Default::default() }
    }

    /// A renderer that knows nothing yet; rays are made when the first method asks for them.
    fn renderer(&mut self, method: &Method) -> Result<Renderer, SessionError> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        if method.needs_rays() && self.uploaded.rays.is_none() && self.uploaded.no_rays.is_none() {
            // Where they cannot be had, the method below draws, and each shot says so.
            let _ = self.uploaded.trace(device, queue, &self.scene);
        }
        Ok(Renderer::new(device, queue, self.size, self.renderer_options(method))?)
    }

    fn shoot(
        &self,
        renderer: &mut Renderer,
        camera: &Camera,
        samples: u32,
        warmup: u32,
        number: u32,
    ) -> Result<Frame, SessionError> {
        let options =
            CaptureOptions { samples, seed: self.options.seed, layers: &self.options.layers, warmup, number: 0 };
        let (mut done, all) = (0, f64::from(samples + warmup));
        let alone = all > 1.0;
        let frame = capture_with(self.gpu, renderer, &self.uploaded, camera, options, &mut || {
            done += 1;
            // A single frame is a step of a sequence, which tells of itself.
            !alone || (self.watch)(f64::from(done) / all)
        })?;
        let fallback = renderer.fallback().map(|i| self.uploaded.no_rays.clone().unwrap_or_else(|| i.why.to_owned()));
        let bytes = renderer.bytes().iter().map(|(_, b)| b).sum::<u64>() + self.uploaded.bytes();
        Ok(Frame {
            frame: frame.ok_or(SessionError::Stopped)?,
            number,
            drawn_by: renderer.drawn_by(),
            fallback,
            settled: renderer.settled(),
            bytes,
            without: None,
        })
    }

    /// A frame for its history alone, but waited for: drivers let thousands of them pile up otherwise.
    fn draw(&self, renderer: &mut Renderer, camera: &Camera) -> Result<(), SessionError> {
        let gpu = self.gpu;
        let seed = self.options.seed.wrapping_mul(0x9e37_79b9);
        let view = View::new(camera, self.size, [0.0; 2]).with_seed(seed);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let purpose = Purpose::WarmUp { first: true };
        renderer.record_frame(&mut Recorder::new(&mut encoder), &gpu.queue, &self.uploaded, &view, purpose)?;
        gpu.queue.submit([encoder.finish()]);
        // A device that is lost says so to the next that reads.
        let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
        Ok(())
    }
}
