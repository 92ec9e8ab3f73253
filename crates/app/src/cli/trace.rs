//! `bouncelight trace`: one picture of a scene by paths, as PNG or EXR: flags, the tracing itself
//! with progress, and what is told of the noise.

use super::{
    args::{Global, number, usage},
    drawn::{Drawn, parse_layers},
    error::CliError,
    interrupt,
    picture::PictureArgs,
    progress::Progress,
    scene_args::SceneArgs,
};
use anyhow::Result;
use bouncelight::gpu::Gpu;
use bouncelight::render::capture::{CapturedFrame, Picture};
use bouncelight::scene::{Camera, Scene};
use bouncelight_lab::reference::{
    DEFAULT_CAP, JUDGED, Kernel, Layer, ReferenceScene, Subject, Traced, Tracer, TracerError, TracerOptions, job,
    preview,
};
use bouncelight_scene::image_io::{self, Metadata};

/// Samples when no flag tells how many.
const DEFAULT_SPP: u32 = 64;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    picture: PictureArgs,
    /// Samples a pixel, 1 or more; with --until-error the most [default: 64; 65536 with it].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = PATHS)]
    spp: Option<u32>,
    /// Stop when a pixel's noise (RMS over mean), above 0, is at most E, such as 0.05.
    #[arg(long, value_name = "E", value_parser = parse_error_bound, allow_hyphen_values = true, help_heading = PATHS)]
    until_error: Option<f64>,
    /// Clamp indirect contributions, as Cycles; fewer fireflies, less energy [default: 0, off].
    #[arg(long, value_name = "C", value_parser = parse_limit, allow_hyphen_values = true, help_heading = PATHS)]
    clamp: Option<f32>,
    /// Bounces in all, as Blender counts them [default: no limit].
    #[arg(long, value_name = "N", help_heading = PATHS)]
    bounces: Option<u32>,
    /// Diffuse bounces [default: no limit].
    #[arg(long, value_name = "N", help_heading = PATHS)]
    diffuse_bounces: Option<u32>,
    /// Glossy bounces [default: no limit].
    #[arg(long, value_name = "N", help_heading = PATHS)]
    glossy_bounces: Option<u32>,
    /// Widen lobes after blurry bounces, as Cycles' Filter Glossy; Blender's default is 1 [default:
    /// 0, off].
    #[arg(long, value_name = "F", value_parser = parse_limit, allow_hyphen_values = true, help_heading = PATHS)]
    filter_glossy: Option<f32>,
    /// Show diffusely scattered rays no gloss, as Cycles without Reflective Caustics; loses light.
    #[arg(long, help_heading = PATHS)]
    no_caustics: bool,
    /// Trace the one pixel centre of each NxN cell that the network samples; a pixel per cell.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = PATHS)]
    cells: Option<u32>,
    /// Denoise the picture (not layers) for a preview; it is no reference then.
    #[arg(long, conflicts_with = "cells", help_heading = PATHS)]
    denoise: bool,
    /// Seed of the paths.
    #[arg(long, default_value_t = 0, value_name = "N", help_heading = PATHS)]
    seed: u32,
}

/// Heading of the help.
const PATHS: &str = "Paths";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight trace scene.glb -o truth.exr --spp 256 --aov all
  bouncelight trace scene.glb -o truth.exr --until-error 0.05
  bouncelight trace interior -o look.png --spp 16 --denoise";

fn parse_error_bound(text: &str) -> Result<f64, String> {
    let otherwise = "no number of samples gets there; it must be above 0, such as 0.05 for 5 % noise a pixel";
    number(text, |bound: f64| bound.is_finite() && bound > 0.0, otherwise)
}

fn parse_limit(text: &str) -> Result<f32, String> {
    number(text, |clamp: f32| clamp.is_finite() && clamp >= 0.0, "it must be 0 (none) or above")
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    let format = args.picture.check()?;
    let task = args.task()?;
    let reference = args.picture.reference(task.size())?;
    let scene = args.scene.load(global)?;
    let showing = args.picture.showing(format, &scene, global.quiet);
    let camera = args.scene.camera(&scene)?;
    interrupt::install()?;
    let gpu = global.open_gpu()?;
    let drawn = task.run(global, &gpu, &scene, &camera)?;
    showing.write(&gpu, &args.picture.output, &drawn, None)?;
    args.picture.judge(&drawn, reference.as_ref())
}

impl Args {
    /// What the flags ask for.
    fn task(&self) -> Result<Task> {
        // Combined is the picture itself, which every file has.
        let known = &Layer::ALL[1..];
        let mut layers = vec![Layer::Combined];
        layers.extend(
            self.picture
                .aov
                .as_deref()
                .map(|text| parse_layers(text, known, Layer::name))
                .transpose()?
                .unwrap_or_default(),
        );
        let asked = layers.len();
        if self.denoise {
            layers.extend(preview::READ.into_iter().filter(|l| !layers.contains(l)).collect::<Vec<_>>());
        }
        let judged = if self.cells.is_some() { Layer::Gi } else { Layer::Combined };
        let samples = if self.until_error.is_some() { DEFAULT_CAP } else { DEFAULT_SPP };
        let options = TracerOptions {
            samples: self.spp.unwrap_or(samples),
            until_error: self.until_error.map(|bound| (judged, bound)),
            seed: self.seed,
            bounces: self.bounces.unwrap_or(job::UNLIMITED),
            diffuse_bounces: self.diffuse_bounces.unwrap_or(job::UNLIMITED),
            glossy_bounces: self.glossy_bounces.unwrap_or(job::UNLIMITED),
            clamp: self.clamp.unwrap_or(0.0),
            filter_glossy: self.filter_glossy.unwrap_or(0.0),
            flags: if self.no_caustics { job::NO_CAUSTICS } else { 0 },
            layers,
            ..Default::default()
        };
        Ok(Task { frame: self.scene.size, cells: self.cells, asked, denoise: self.denoise, options })
    }
}

/// A picture to trace.
struct Task {
    /// Size of the frame, pixels.
    frame: [u32; 2],
    cells: Option<u32>,
    /// Layers that were asked for; the options' further ones are for the denoiser.
    asked: usize,
    denoise: bool,
    options: TracerOptions,
}

impl Task {
    /// Size of the picture that comes out.
    fn size(&self) -> [u32; 2] {
        self.frame.map(|n| n.div_ceil(self.cells.unwrap_or(1)))
    }

    /// The points to trace instead of all pixels.
    fn points(&self) -> Option<Vec<[f32; 2]>> {
        let cell = self.cells?;
        let [width, height] = self.size();
        let centre = |i: u32, axis: usize| {
            let pixel = (u64::from(cell) * u64::from(i) + u64::from(cell / 2)).min(u64::from(self.frame[axis] - 1));
            pixel as f32 + 0.5
        };
        Some((0..height).flat_map(|j| (0..width).map(move |i| [centre(i, 0), centre(j, 1)])).collect())
    }

    /// Traces, shows progress, tells the noise.
    fn run(self, global: &Global, gpu: &Gpu, scene: &Scene, camera: &Camera) -> Result<Drawn> {
        let packed = ReferenceScene::new(&gpu.device, &gpu.queue, scene)?;
        let kernel = Kernel::new(&gpu.device);
        let points = self.points();
        let subject = Subject { camera, size: self.frame, points: points.as_deref() };
        let mut options = self.options.clone();
        if gpu.is_software() {
            // No watchdog there, and other programs may want the cores, too.
            options.dispatch *= 4;
        }
        let tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options).map_err(|e| match e {
            TracerError::Points { .. } | TracerError::Option(_) => usage(e.to_string()),
            e => e.into(),
        })?;
        let mut progress = Progress::new(global, "samples", tracer.expected_samples());
        let traced = tracer.run(|t| {
            let expected = t.expected_samples();
            progress.at(t.progress() * expected as f64, expected);
            !interrupt::requested()
        })?;
        progress.finish();
        interrupt::check()?;
        let mut traced = traced.ok_or(CliError::Interrupted)?;
        if !global.quiet {
            eprintln!("{}", sentence(&traced));
        }
        if traced.dropped > 0 {
            eprintln!("warning: {} samples were NaN or infinite and were left out", traced.dropped);
        }
        if self.denoise {
            if let Some(picture) = preview::denoise(&traced, camera) {
                traced.layers[0].1 = picture;
            }
            traced.layers.truncate(self.asked);
            if !global.quiet {
                eprintln!("denoised for a preview; not a reference to compare with");
            }
        }
        Ok(self.drawn(traced))
    }

    fn drawn(&self, mut traced: Traced) -> Drawn {
        let facts = self.facts(&traced);
        let [width, height] = self.size().map(|n| n as usize);
        // The picture was asked for first.
        let (_, data) = traced.layers.remove(0);
        let beauty = Picture { width, height, channels: 4, data };
        let layers = traced
            .layers
            .iter()
            .map(|(layer, data)| image_io::Layer::new(layer.name(), layer.channels(), data))
            .collect();
        Drawn { frame: CapturedFrame { beauty, layers: Vec::new() }, layers, facts }
    }

    /// Metadata of the picture; `docs/internals/path-tracer.md` explains the keys.
    fn facts(&self, traced: &Traced) -> Metadata {
        let o = &self.options;
        let limit = |n: u32| if n == job::UNLIMITED { "unlimited".into() } else { n.to_string() };
        let mut facts = vec![
            ("ReferenceSamples", traced.samples[0].to_string()),
            ("ReferenceSamplesMost", traced.samples[1].to_string()),
            ("ReferenceSeed", o.seed.to_string()),
            ("ReferenceBounces", [o.bounces, o.diffuse_bounces, o.glossy_bounces].map(limit).join(" ")),
            ("ReferenceClamp", o.clamp.to_string()),
            ("ReferenceFilterGlossy", o.filter_glossy.to_string()),
            ("ReferenceCaustics", (o.flags & job::NO_CAUSTICS == 0).to_string()),
            ("ReferenceDenoised", self.denoise.to_string()),
            ("ReferenceCells", self.cells.map_or("none".into(), |n| n.to_string())),
            ("ReferenceSeconds", format!("{:.3}", traced.seconds)),
            ("ReferenceSamplesPerSecond", format!("{:.0}", rate(traced))),
        ]
        .into_iter()
        .map(|(k, v)| (k.to_owned(), v))
        .collect::<Vec<_>>();
        for (layer, noise) in JUDGED.iter().zip(&traced.noise) {
            facts.push((format!("ReferenceNoise{}", layer.name()), format!("{:.6}", noise.pixel)));
            facts.push((format!("ReferenceNoiseOfMean{}", layer.name()), format!("{:.3e}", noise.picture)));
        }
        facts
    }
}

fn rate(traced: &Traced) -> f64 {
    traced.traced as f64 / traced.seconds.max(1e-9)
}

/// How many samples, how fast, how much noise is left.
fn sentence(traced: &Traced) -> String {
    let samples = match traced.samples {
        [fewest, most] if fewest == most => fewest.to_string(),
        [fewest, most] => format!("{fewest} to {most}"),
    };
    let noise = JUDGED.iter().zip(&traced.noise).map(|(layer, noise)| {
        let name = if *layer == Layer::Combined { "picture" } else { layer.name() };
        format!("{name} {} (mean {})", percent(noise.pixel), percent(noise.picture))
    });
    format!(
        "{samples} samples a pixel in {:.1} s, {:.3} million a second; noise left in a pixel: {}",
        traced.seconds,
        rate(traced) / 1e6,
        noise.collect::<Vec<_>>().join(", ")
    )
}

fn percent(share: f64) -> String {
    match share {
        s if s.is_infinite() => "unknown".into(),
        s if s >= 0.1 => format!("{:.0} %", s * 100.0),
        s => format!("{:.2} %", s * 100.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bouncelight::gi::inputs::sample_pixel;

    fn task(frame: [u32; 2], cells: u32) -> Task {
        Task { frame, cells: Some(cells), asked: 1, denoise: false, options: TracerOptions::default() }
    }

    #[test]
    fn points_are_the_pixels_that_the_network_samples() {
        for size in [[64, 32], [17, 13], [1, 1], [1025, 3]] {
            let task = task(size, 4);
            let points = task.points().unwrap();
            let [w, h] = task.size();
            assert_eq!(points.len(), (w * h) as usize);
            for (i, point) in points.iter().enumerate() {
                let [x, y] = sample_pixel([i as u32 % w, i as u32 / w], size);
                assert_eq!(*point, [x as f32 + 0.5, y as f32 + 0.5], "{size:?}, cell {i}");
            }
        }
        assert_eq!(task([5, 3], u32::MAX).points().unwrap(), [[4.5, 2.5]]);
        assert_eq!(task([3, 2], 1).points().unwrap()[4], [1.5, 1.5]);
    }
}
