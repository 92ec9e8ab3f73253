//! `bouncelight render`: one picture of a scene, as PNG through a view transform or as EXR with
//! layers.

use super::{
    args::{Global, MethodName, MethodParser, draws_frames, real_time, usage},
    drawn::{Drawn, parse_layers},
    error::CliError,
    interrupt,
    picture::PictureArgs,
    progress::Progress,
    scene_args::SceneArgs,
    sequence,
    showing::Showing,
};
use anyhow::Result;
use bouncelight::gi::{Method, gather};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::{SceneGpu, TextureMemory, UploadError};
use bouncelight::render::{
    Backdrop, Blending, Renderer, RendererOptions,
    capture::{CaptureOptions, Layer, Picture, capture_with},
};
use bouncelight::scene::{Camera, Scene};
use bouncelight_lab::network::shipped;
use bouncelight_scene::image_io;
use std::path::PathBuf;

/// Samples of a picture where none are asked for: edges without steps, and what is half covered
/// without grain.
const PICTURE_SAMPLES: u32 = 8;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    picture: PictureArgs,
    /// What is seen behind the scene: shown (the sky), blurred, hidden, or transparent (alpha).
    #[arg(long, visible_alias = "background", default_value = "shown", value_name = "HOW", help_heading = "Output")]
    backdrop: Backdrop,
    #[command(flatten)]
    sequence: sequence::SequenceFlags,
    /// Method for indirect light [default: as `fit` found, else gather; with --weights theirs].
    #[arg(long, value_parser = MethodParser(draws_frames), help_heading = METHOD)]
    method: Option<MethodName>,
    /// Weights, or the name of shipped ones [default: the method's].
    #[arg(long, help_heading = METHOD, value_name = "FILE")]
    weights: Option<PathBuf>,
    #[command(flatten)]
    fitted: super::fitted::Flag,
    /// Constants of gather and neural, such as blur=0,cell_frames=256; `plain`: no history, no
    /// blur.
    #[arg(long, value_name = "NAME=VALUE,...", help_heading = METHOD)]
    gather: Option<gather::Options>,
    /// Off-screen light of ambient and ssgi, as shares: sky=X,bounce=Y [default: 0.83, 0.56].
    #[arg(long, value_name = "TERM", help_heading = METHOD)]
    ambient_term: Option<bouncelight::gi::ambient::AmbientTerm>,
    /// Jittered frames averaged, 1 to 4096 [default: 8; 1 with --aov, --taa, sequences and
    /// --accumulate 1].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096), value_name = "N", help_heading = QUALITY)]
    samples: Option<u32>,
    /// Frames of a still camera that gather and neural accumulate before the picture, 1 (just after
    /// a cut) to 65536 [default: 32].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536), help_heading = QUALITY)]
    accumulate: Option<u32>,
    /// Temporal anti-aliasing over 1 to 4096 frames before the picture, and through a sequence.
    #[arg(long, conflicts_with = "samples", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096),
        help_heading = QUALITY)]
    taa: Option<u32>,
    /// Blended surfaces: sorted (no noise) or stochastic (as paths meet them) [default: sorted;
    /// stochastic with --aov].
    #[arg(long, value_name = "HOW", help_heading = QUALITY)]
    blending: Option<Blending>,
    /// Seed of jitter and soft shadows.
    #[arg(long, default_value_t = 0, value_name = "N", help_heading = QUALITY)]
    seed: u32,
}

/// Headings of the help.
const METHOD: &str = "Method";
/// As [`METHOD`].
const QUALITY: &str = "Quality";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight render scene.glb -o picture.png
  bouncelight render interior -o view.png --eye 1.8,1.6,2 --look-at -0.5,1,-1 --method neural
  bouncelight render scene.glb -o layers.exr --aov all --samples 4";

impl Args {
    /// The method asked for, or that of the weights, or the best that needs nothing but the scene.
    fn method(&self) -> MethodName {
        let of_weights = |path: &PathBuf| match shipped::find(path) {
            Ok(weights) => shipped::method_of(&weights),
            // What is wrong with the file is said where it is read.
            Err(_) => MethodName::Neural,
        };
        self.method.unwrap_or_else(|| self.weights.as_ref().map_or(MethodName::Gather, of_weights))
    }

    /// Frames that are averaged.
    fn samples(&self) -> u32 {
        let raw =
            self.picture.aov.is_some() || self.taa.is_some() || self.accumulate == Some(1) || self.sequence.is_given();
        self.samples.unwrap_or(if raw { 1 } else { PICTURE_SAMPLES })
    }

    /// How what blends is drawn.
    fn blending(&self) -> Blending {
        self.blending.unwrap_or(if self.picture.aov.is_some() { Blending::Stochastic } else { Blending::Sorted })
    }

    /// It may run a network on a device: what was fitted is not known yet.
    pub fn runs_network(&self) -> bool {
        self.method().needs_weights() || self.asks_fit()
    }

    /// No flag says how light is found.
    fn asks_fit(&self) -> bool {
        self.method.is_none() && self.weights.is_none() && self.gather.is_none() && self.ambient_term.is_none()
    }

    /// Takes what was fitted for the scene, which is returned where it had to be loaded for that.
    fn obey(&mut self, global: &Global) -> Result<Option<Scene>> {
        let fitted = if self.asks_fit() { self.fitted.read(&self.scene.scene)? } else { None };
        let Some(fitted) = fitted else { return Ok(None) };
        let scene = self.scene.load(global)?;
        if let Some(fitted) = super::fitted::fresh(fitted, &scene)? {
            if !global.quiet {
                eprintln!("method `{}`, as fitted to {}", fitted.method.name(), self.scene.scene);
            }
            let settles = fitted.method()?.has_history();
            self.accumulate = self.accumulate.or(settles.then_some(fitted.frames));
            (self.gather, self.ambient_term) = (fitted.gather(), fitted.ambient_term());
            self.weights = fitted.weights.map(|w| w.file);
            self.method = Some(fitted.method);
        }
        Ok(Some(scene))
    }
}

pub fn run(global: &Global, mut args: Args) -> Result<()> {
    let loaded = args.obey(global)?;
    check(&args)?;
    let format = args.picture.check()?;
    let layers = args.picture.aov.as_deref().map(|text| parse_layers(text, &Layer::ALL, Layer::name)).transpose()?;
    let mut method = real_time(args.method(), global, args.weights.as_ref())?;
    if let (Some(options), Some(asked)) = (method.gather_mut(), args.gather) {
        *options = asked;
    }
    if let (Some(term), Some(asked)) = (method.ambient_term_mut(), args.ambient_term) {
        *term = asked;
    }
    let reference = args.picture.reference(args.scene.size)?;
    let sequence = args.sequence.sequence(&args.picture.output, args.scene.animation.is_some())?;
    let scene = loaded.map_or_else(|| args.scene.load(global), Ok)?;
    let showing = args.picture.showing(format, &scene, global.quiet);
    let camera = match sequence.as_ref().and_then(|s| s.frames().next()) {
        Some((_, _, Some(camera))) => camera,
        _ => args.scene.camera(&scene)?,
    };
    interrupt::install()?;
    let gpu = global.open_gpu()?;
    let method = super::tuned::tuned(method, &gpu, global.quiet);
    // Says from here on what the program does: without a shader cache nothing is drawn for half a
    // minute.
    let progress = Progress::compiling(global, if sequence.is_some() { "frames" } else { "samples" }, 1);
    let mut raster = Raster::new(&args, (&gpu, global.textures), &scene, method, layers.unwrap_or_default())?;
    if let Some(sequence) = sequence {
        return film(progress, &args, showing, raster, (&sequence, scene));
    }
    let drawn = raster.draw(progress, &args, &camera)?;
    showing.write(&gpu, &args.picture.output, &drawn, None)?;
    args.picture.judge(&drawn, reference.as_ref())
}

/// The rasteriser, ready to draw.
struct Raster<'a> {
    gpu: &'a Gpu,
    scene: SceneGpu,
    renderer: Renderer,
    layers: Vec<Layer>,
    /// Frames that are averaged for a picture.
    samples: u32,
    weights: String,
    /// Name of the method that is asked for.
    asked: &'static str,
    /// The method's answer settles over frames.
    settles: bool,
    /// Frames of a sequence that have been drawn: the next goes on from them, as in a viewer.
    drawn: u32,
}

impl<'a> Raster<'a> {
    fn new(
        args: &Args,
        (gpu, textures): (&'a Gpu, TextureMemory),
        scene: &Scene,
        method: Method,
        layers: Vec<Layer>,
    ) -> Result<Self> {
        let weights = match &method {
            Method::Neural(neural) | Method::Generator(neural) => neural.weights.hash_text(),
            _ => "none".into(),
        };
        let (asked, settles, needs_rays) = (method.name(), method.has_history(), method.needs_rays());
        let (taa, blending, backdrop) = (args.taa.is_some(), args.blending(), args.backdrop);
        let options = RendererOptions { method, taa, blending, backdrop, ..Default::default() };
        // Trees are built while the driver compiles shaders.
        let upload = || {
            let mut uploaded = SceneGpu::with_textures(&gpu.device, &gpu.queue, scene, textures)?;
            if needs_rays {
                // Where they cannot be had, the method below draws, and `picture` says so.
                let _ = uploaded.trace(&gpu.device, &gpu.queue, scene);
            }
            Ok::<_, UploadError>(uploaded)
        };
        let (scene, renderer) = std::thread::scope(|scope| {
            let uploading = scope.spawn(upload);
            let renderer = Renderer::new(&gpu.device, &gpu.queue, args.scene.size, options);
            (uploading.join().unwrap_or_else(|e| std::panic::resume_unwind(e)), renderer)
        });
        let (scene, renderer) = (scene?, renderer?);
        let samples = args.samples();
        Ok(Self { gpu, scene, renderer, layers, samples, weights, asked, settles, drawn: 0 })
    }

    /// Frames before the first sample: the method's and anti-aliasing's go on at once.
    fn warmup(&self, args: &Args) -> u32 {
        if self.drawn > 0 {
            return 0;
        }
        let settle = if self.settles { args.accumulate.unwrap_or(Method::SETTLED) - 1 } else { 0 };
        args.taa.unwrap_or(0).max(settle)
    }

    /// A picture.
    fn draw(&mut self, mut progress: Progress, args: &Args, camera: &Camera) -> Result<Drawn> {
        progress.expect((self.samples + self.warmup(args)).into());
        let drawn = self.picture(args, camera, &mut || progress.step())?;
        progress.finish();
        Ok(drawn)
    }

    fn picture(&mut self, args: &Args, camera: &Camera, step: &mut dyn FnMut()) -> Result<Drawn> {
        let warmup = self.warmup(args);
        let number = if args.taa.is_some() { self.drawn } else { 0 };
        let options = CaptureOptions { samples: self.samples, seed: args.seed, layers: &self.layers, warmup, number };
        let frame = capture_with(self.gpu, &mut self.renderer, &self.scene, camera, options, &mut || {
            step();
            !interrupt::requested()
        })?;
        interrupt::check()?;
        let frame = frame.ok_or(CliError::Interrupted)?;
        let layer = |(layer, picture): &(Layer, Picture)| {
            image_io::Layer::new(layer.name(), &layer.channels().concat(), &picture.data)
        };
        let layers = frame.layers.iter().map(layer).collect();
        let mut facts =
            vec![("Method".into(), self.renderer.drawn_by().into()), ("Weights".into(), self.weights.clone())];
        if let Some(fallback) = self.renderer.fallback().filter(|_| self.drawn == 0) {
            let why = self.scene.no_rays.as_deref().unwrap_or(fallback.why);
            eprintln!("warning: `{}` cannot draw this, so `{}` did: {why}", self.asked, fallback.method);
        }
        facts.extend(self.renderer.settled().map(|frames| ("GiFrames".into(), frames.to_string())));
        Ok(Drawn { frame, layers, facts })
    }
}

/// A picture for each frame of a camera path or an animation.
fn film(
    mut progress: Progress,
    args: &Args,
    showing: Showing,
    mut raster: Raster,
    (sequence, mut scene): (&sequence::Sequence, Scene),
) -> Result<()> {
    progress.expect(sequence.count());
    let mut stops = None;
    let animation = args.scene.animation(&scene)?;
    for (number, time, camera) in sequence.frames() {
        if let Some(animation) = animation {
            args.scene.move_to(&mut scene, animation, args.scene.pose_time + time as f32)?;
            let (device, queue) = (&raster.gpu.device, &raster.gpu.queue);
            raster.scene.set_placements(queue, &scene);
            raster.scene.set_lights(device, queue, &scene);
        }
        let camera = camera.map_or_else(|| args.scene.camera(&scene), Ok)?;
        let drawn = raster.picture(args, &camera, &mut || ())?;
        // The first frame's measure holds for all, so that a path does not flicker.
        stops = Some(showing.write(raster.gpu, &sequence::name(&args.picture.output, number), &drawn, stops)?);
        raster.drawn += 1;
        progress.step();
    }
    progress.finish();
    Ok(())
}

/// Flags that do not belong to the method.
fn check(args: &Args) -> Result<()> {
    if args.backdrop == Backdrop::Transparent && args.taa.is_some() {
        return Err(usage("--taa keeps no alpha; with --backdrop transparent use --samples".into()));
    }
    let belongs = |flag: &str, asked: bool, takes: fn(MethodName) -> bool| {
        let (all, name) = (MethodName::which(takes), args.method().name());
        let wrong = asked && !takes(args.method());
        if wrong { Err(usage(format!("{flag} belongs to methods {all}, not to `{name}`"))) } else { Ok(()) }
    };
    belongs("--accumulate", args.accumulate.is_some(), MethodName::has_history)?;
    belongs("--gather", args.gather.is_some(), MethodName::gathers)?;
    belongs("--ambient-term", args.ambient_term.is_some(), MethodName::has_ambient_term)
}
