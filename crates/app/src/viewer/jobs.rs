//! Long work on threads of its own: loading, building, capturing. Each job tells how far it is and
//! can be cancelled; what it has made comes back to the window as an event.

use super::choice::Source;
use super::command;
use super::state::State;
use crate::shown;
use bouncelight::accel::{AccelError, SceneRays};
use bouncelight::gi::{Method, Neural, ambient::AmbientTerm, gather};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::{SceneGpu, TextureMemory};
use bouncelight::net::{gpu::Tuned, plan::Precision};
use bouncelight::render::capture::{CaptureOptions, Layer, capture_with};
use bouncelight::render::{Backdrop, Renderer, RendererOptions};
use bouncelight::scene::{Camera, Environment, Scene};
use bouncelight_lab::network::shipped;
use bouncelight_lab::reference::{Kernel, Layer as Traced, ReferenceScene, Subject, Tracer, TracerOptions};
use bouncelight_lab::study::fitted::Fitted;
use bouncelight_lab::study::hash;
use bouncelight_scene::image_io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// How far a job is, shared with its thread.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    stop: Arc<AtomicBool>,
    /// Thousandths; more than 1000 for unknown.
    share: Arc<AtomicU32>,
    stage: Arc<Mutex<String>>,
}

impl Progress {
    fn stage(&self, text: &str) {
        if let Ok(mut stage) = self.stage.lock() {
            *stage = text.into();
        }
        self.share.store(u32::MAX, Ordering::Relaxed);
    }

    fn at(&self, share: f64) -> bool {
        self.share.store((share.clamp(0.0, 1.0) * 1000.0) as u32, Ordering::Relaxed);
        !self.stopped()
    }

    /// True once nobody waits for the result.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Asks the thread to end.
    pub fn cancel(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// What it does, and the share that is done if it is known.
    pub fn read(&self) -> (String, Option<f32>) {
        let share = self.share.load(Ordering::Relaxed);
        let stage = self.stage.lock().map(|s| s.clone()).unwrap_or_default();
        (stage, (share <= 1000).then_some(share as f32 / 1000.0))
    }
}

/// A job at work.
pub struct Job {
    pub name: String,
    pub kind: Kind,
    pub started: Instant,
    pub progress: Progress,
}

/// What a job makes; two of one kind are never at work at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Scene,
    Surroundings,
    Rays,
    Weights,
    Renderer(usize),
    Capture,
}

/// What decides how a renderer has to be built: source, and how often weights, scene file and
/// shaders were replaced.
pub type Key = (Source, u64);

/// What a job has made.
pub enum Product {
    Scene {
        spec: String,
        scene: Box<Scene>,
        gpu: Box<SceneGpu>,
        /// What was fitted for it, or why that is not obeyed; none where nobody has asked.
        fitted: Option<Result<Box<Fitted>, String>>,
    },
    /// Rays into the scene that was uploaded as number `stamp`, or why it can have none.
    Rays {
        stamp: u64,
        rays: Result<Box<SceneRays>, String>,
    },
    /// The scene on show, on a new device.
    Uploaded(Box<SceneGpu>),
    Surroundings {
        path: PathBuf,
        environment: Environment,
    },
    Weights(Option<PathBuf>),
    Renderer {
        side: usize,
        key: Key,
        renderer: Box<Renderer>,
        /// Whether its method asks rays.
        rays: bool,
    },
    /// A file, and what drew it in the place of the method that was asked for.
    Captured(PathBuf, Option<String>),
}

/// A job's end.
pub struct Done {
    pub kind: Kind,
    pub progress: Progress,
    pub product: Result<Product, String>,
}

/// Device and queue, for threads.
#[derive(Clone)]
pub struct Handles {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub textures: TextureMemory,
}

impl Handles {
    /// Uploads a scene.
    pub fn upload(&self, scene: &Scene) -> Result<SceneGpu, String> {
        SceneGpu::with_textures(&self.device, &self.queue, scene, self.textures).map_err(|e| e.to_string())
    }
}

/// Starts `work` on a thread; `send` brings its end to the window.
pub fn spawn(
    name: String,
    kind: Kind,
    send: impl FnOnce(Done) + Send + 'static,
    work: impl FnOnce(&Progress) -> Result<Product, String> + Send + 'static,
) -> Job {
    let progress = Progress::default();
    progress.stage(&name);
    let theirs = progress.clone();
    let run = move || {
        let product = work(&theirs);
        send(Done { kind, progress: theirs, product });
    };
    if let Err(e) = std::thread::Builder::new().name(name.clone()).spawn(run) {
        tracing::error!("no thread for `{name}`: {e}");
        progress.cancel();
    }
    Job { name, kind, started: Instant::now(), progress }
}

/// Reads and uploads a scene; `obey` looks for what `fit` found for it.
pub fn scene(
    handles: &Handles,
    spec: String,
    options: bouncelight_scene::LoadOptions,
    obey: bool,
    progress: &Progress,
) -> Result<Product, String> {
    progress.stage(&format!("reading {spec}"));
    let scene = bouncelight_lab::scenes::load_with(&spec, options).map_err(|e| e.to_string())?;
    if progress.stopped() {
        return Err("cancelled".into());
    }
    progress.stage(&format!("uploading {spec}"));
    let gpu = handles.upload(&scene)?;
    let fitted = if obey { fitted(&spec, &scene) } else { None };
    Ok(Product::Scene { spec, scene: Box::new(scene), gpu: Box::new(gpu), fitted })
}

/// What lies beside the scene, or why it is not obeyed.
fn fitted(spec: &str, scene: &Scene) -> Option<Result<Box<Fitted>, String>> {
    match Fitted::load(&Fitted::path(spec)) {
        Ok(None) => None,
        Ok(Some(found)) => Some(match found.stale(&hash::of_scene(scene)) {
            Ok(None) => Ok(Box::new(found)),
            Ok(Some(why)) => Err(why),
            Err(e) => Err(e.to_string()),
        }),
        Err(e) => Some(Err(e.to_string())),
    }
}

/// Builds the trees that rays need, while the method below draws.
pub fn rays(handles: &Handles, stamp: u64, scene: &Scene, progress: &Progress) -> Result<Product, String> {
    let told = |done: usize, all: usize| {
        progress.stage(&format!("building BVH: {done} of {all} meshes"));
        progress.at(done as f64 / all.max(1) as f64)
    };
    let rays = match SceneRays::with_progress(&handles.device, &handles.queue, scene, &told) {
        Err(AccelError::Stopped) => return Err("cancelled".into()),
        made => made.map(Box::new).map_err(|e| e.to_string()),
    };
    Ok(Product::Rays { stamp, rays })
}

/// How networks are run, and rays.
#[derive(Debug, Clone, Default)]
pub struct Network {
    /// How they store their numbers; `None`: each as it is best.
    pub precision: Option<Precision>,
    pub tuned: Arc<Tuned>,
    /// Numbers of `gather` that were fitted to the scene, but for `rays`.
    pub gather: gather::Options,
    /// The ambient term that was.
    pub ambient_term: AmbientTerm,
}

/// The method behind a source; reads weights.
fn method(source: Source, weights: Option<&Path>, network: &Network, rays: f32) -> Result<Method, String> {
    let with = || {
        let weights = shipped::fitting(source, weights).map_err(|e| e.to_string())?;
        let neural = Neural::from(weights).stored(network.precision);
        Ok::<_, String>(Neural { tuned: network.tuned.clone(), ..neural })
    };
    // Beside the reference, direct light fills the G-buffer.
    let mut method = source.method(with)?.unwrap_or(Method::Direct);
    if let Some(options) = method.gather_mut() {
        // Fitted without a network.
        if !source.needs_weights() {
            *options = network.gather;
        }
        options.rays = rays;
    }
    if let Some(term) = method.ambient_term_mut() {
        *term = network.ambient_term;
    }
    Ok(method)
}

/// What a renderer is built for.
pub struct Plan {
    pub side: usize,
    pub key: Key,
    pub size: [u32; 2],
    pub weights: Option<PathBuf>,
    pub network: Network,
}

/// Builds a renderer. Shaders or weights that the driver refuses are an error, not the end.
pub fn renderer(handles: &Handles, plan: Plan, progress: &Progress) -> Result<Product, String> {
    // How many rays there are the stage tells it, frame by frame.
    let method = method(plan.key.0, plan.weights.as_deref(), &plan.network, 1.0)?;
    progress.stage(&format!("building {}", plan.key.0.name()));
    let rays = method.needs_rays();
    let scope = handles.device.push_error_scope(wgpu::ErrorFilter::Validation);
    // A still window stops drawing; where it is asked to go on, frames are to be timed.
    let options = RendererOptions { method: method.without_rest(), ..Default::default() };
    let built = Renderer::new(&handles.device, &handles.queue, plan.size, options);
    if let Some(e) = pollster::block_on(scope.pop()) {
        return Err(bouncelight::gpu::shaders::located(&e.to_string()));
    }
    let renderer = Box::new(built.map_err(|e| e.to_string())?);
    Ok(Product::Renderer { side: plan.side, key: plan.key, renderer, rays })
}

/// What is captured: the arguments of `bouncelight render`, or `trace`, that draw the same.
pub struct Shot {
    pub output: PathBuf,
    pub source: Source,
    pub weights: Option<PathBuf>,
    pub network: Network,
    pub scene: Arc<Scene>,
    pub camera: Camera,
    pub textures: TextureMemory,
    pub size: [u32; 2],
    pub samples: u32,
    pub rays: f32,
    pub backdrop: Backdrop,
    pub ev: f32,
    pub tonemap: bouncelight::render::tonemap_curve::Tonemap,
    pub metadata: image_io::Metadata,
}

impl Shot {
    /// Of what `state` shows on the left.
    pub fn new(state: &State, network: Network, output: PathBuf, gpu: &Gpu) -> Option<Self> {
        let scene = state.shown.as_ref()?.scene.clone();
        let s = &state.settings;
        let metadata = shown::metadata(gpu, command::line(state, Some(&output.display().to_string())));
        Some(Self {
            output,
            source: s.left,
            weights: s.weights.clone(),
            network,
            camera: state.navigator.camera(&scene, state.size),
            scene,
            textures: state.textures,
            size: state.size,
            samples: if s.left == Source::Reference { s.spp } else { s.samples },
            rays: s.rays,
            backdrop: s.backdrop,
            ev: state.stops(),
            tonemap: s.tonemap,
            metadata,
        })
    }

    fn is_exr(&self) -> bool {
        self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    }
}

/// Draws the picture anew, away from the window, just as the command line would, and writes it.
pub fn capture(gpu: &Gpu, shot: &Shot, progress: &Progress) -> Result<Product, String> {
    let cancelled = || Err("cancelled".to_string());
    let mut fallback = None;
    let (beauty, layers) = if shot.source == Source::Reference {
        let Some(traced) = trace(gpu, shot, progress)? else { return cancelled() };
        traced
    } else {
        let method = method(shot.source, shot.weights.as_deref(), &shot.network, shot.rays)?;
        let mut scene =
            SceneGpu::with_textures(&gpu.device, &gpu.queue, &shot.scene, shot.textures).map_err(|e| e.to_string())?;
        if method.needs_rays() {
            progress.stage("building BVHs");
            // Where they cannot be had, the method below draws, and the file says so.
            let _ = scene.trace(&gpu.device, &gpu.queue, &shot.scene);
        }
        progress.stage("capturing");
        let warmup = if shot.samples > 1 { method.frames_to_settle() - 1 } else { 0 };
        let options = RendererOptions { method, backdrop: shot.backdrop, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, shot.size, options).map_err(|e| e.to_string())?;
        let layers: &[Layer] = if shot.is_exr() { &Layer::ALL } else { &[] };
        let options = CaptureOptions { samples: shot.samples, layers, warmup, ..Default::default() };
        let mut done = 0;
        let frame = capture_with(gpu, &mut renderer, &scene, &shot.camera, options, &mut || {
            done += 1;
            progress.at(f64::from(done) / f64::from(shot.samples + warmup))
        });
        let Some(frame) = frame.map_err(|e| e.to_string())? else { return cancelled() };
        fallback = renderer.fallback().map(|i| format!("{} ({})", i.method, i.why));
        let layer = |(layer, picture): &(Layer, bouncelight::render::capture::Picture)| {
            image_io::Layer::new(layer.name(), &layer.channels().concat(), &picture.data)
        };
        (frame.beauty.data, frame.layers.iter().map(layer).collect())
    };
    let [width, height] = shot.size;
    let mut metadata = shot.metadata.clone();
    metadata.extend(fallback.clone().map(|by| ("DrawnBy".to_string(), by)));
    let written = if shot.is_exr() {
        let mut all = vec![image_io::Layer::new("", "RGBA", &beauty)];
        all.extend(layers);
        image_io::write_exr(&shot.output, width, height, &all, &metadata)
    } else {
        let bytes = shown::rgba(&beauty, shot.ev, shot.tonemap);
        image_io::write_png(&shot.output, width, height, &bytes, &metadata)
    };
    written.map_err(|e| e.to_string())?;
    Ok(Product::Captured(shot.output.clone(), fallback))
}

/// The path tracer's picture and layers; `None` when cancelled.
type Pictures = Option<(Vec<f32>, Vec<image_io::Layer>)>;

fn trace(gpu: &Gpu, shot: &Shot, progress: &Progress) -> Result<Pictures, String> {
    progress.stage("tracing");
    let packed = ReferenceScene::new(&gpu.device, &gpu.queue, &shot.scene).map_err(|e| e.to_string())?;
    let kernel = Kernel::new(&gpu.device);
    let subject = Subject { camera: &shot.camera, size: shot.size, points: None };
    let layers = if shot.is_exr() { Traced::ALL.to_vec() } else { vec![Traced::Combined] };
    let options = TracerOptions { samples: shot.samples, layers, ..Default::default() };
    let tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options);
    let traced = tracer.and_then(|t| t.run(|t| progress.at(t.progress()))).map_err(|e| e.to_string())?;
    let Some(mut traced) = traced else { return Ok(None) };
    let (_, beauty) = traced.layers.remove(0);
    let layer = |(l, data): &(Traced, Vec<f32>)| image_io::Layer::new(l.name(), l.channels(), data);
    Ok(Some((beauty, traced.layers.iter().map(layer).collect())))
}
