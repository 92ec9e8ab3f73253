//! Pictures of a feature, and how far apart they are.

use super::studio::Feature;
use super::{BOUND, CONTROL};
use crate::glb::Glb;
use bouncelight::gi::{Method, gather};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, capture};
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight::render::{Renderer, RendererOptions};
use bouncelight::scene::Scene;
use bouncelight_lab::reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions};

/// Pictures as they are shown, three bytes a pixel.
pub struct Drawn {
    pub ours: Vec<u8>,
    pub traced: Vec<u8>,
    pub without: Vec<u8>,
    /// What the loader had to say of the file.
    pub warnings: Vec<String>,
}

impl Drawn {
    /// Mean difference of display values between rasteriser and path tracer, of 255.
    pub fn error(&self) -> f64 {
        apart(&self.ours, &self.traced)
    }

    /// The same of the rasteriser's picture without the feature.
    pub fn control(&self) -> f64 {
        apart(&self.without, &self.traced)
    }

    pub fn passes(&self) -> bool {
        self.error() <= BOUND && self.control() >= CONTROL
    }
}

fn apart(a: &[u8], b: &[u8]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    sum / a.len() as f64
}

/// How finely pictures are drawn.
#[derive(Clone, Copy)]
pub struct Effort {
    pub size: [u32; 2],
    /// Paths a pixel.
    pub paths: u32,
    /// Frames before the first sample, and samples, of the rasteriser.
    pub frames: [u32; 2],
    /// Slots of `gather`'s cache.
    pub slots: u32,
}

/// For the test: a small picture needs few slots.
pub const QUICK: Effort = Effort { size: [64, 48], paths: 32, frames: [4, 4], slots: 4096 };
/// For the page: what `render` draws.
pub const PAGE: Effort = Effort { size: [128, 96], paths: 96, frames: [Method::SETTLED - 1, 8], slots: 1 << 16 };

/// One renderer and one path tracer for all.
pub struct Painter<'a> {
    gpu: &'a Gpu,
    renderer: Renderer,
    kernel: Kernel,
    effort: Effort,
}

impl<'a> Painter<'a> {
    pub fn new(gpu: &'a Gpu, effort: Effort) -> Self {
        let method = Method::Gather(gather::Options { slots: effort.slots, ..Default::default() });
        let options = RendererOptions { method, ..Default::default() };
        let renderer = Renderer::new(&gpu.device, &gpu.queue, effort.size, options).expect("the size is fine");
        Self { gpu, renderer, kernel: Kernel::new(&gpu.device), effort }
    }

    pub fn draw(&mut self, feature: &Feature) -> Drawn {
        let file = self.load(feature, &feature.with, false);
        let ours = self.rasterise(&file);
        let equivalent = feature.equivalent.as_ref().map(|equivalent| self.load(feature, equivalent, true));
        let traced = self.trace(equivalent.as_ref().unwrap_or(&file));
        let without = self.load(feature, &feature.without, false);
        let without = self.rasterise(&without);
        Drawn { ours, traced, without, warnings: file.warnings }
    }

    fn load(&self, feature: &Feature, glb: &Glb, equivalent: bool) -> Scene {
        let mut scene = glb.load().unwrap_or_else(|e| panic!("{}: {e}", feature.name));
        if let Some(time) = feature.time.filter(|_| !equivalent) {
            scene.pose(0, time);
        }
        if let Some(variant) = feature.variant.filter(|_| !equivalent) {
            assert!(scene.choose_variant(variant), "{}: no variant {variant}", feature.name);
        }
        scene
    }

    /// As `render` draws a picture by default.
    fn rasterise(&mut self, scene: &Scene) -> Vec<u8> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let mut uploaded = SceneGpu::new(device, queue, scene).expect("the fixture uploads");
        uploaded.trace(device, queue, scene).expect("the fixture has rays");
        self.renderer.reset_history();
        let [warmup, samples] = self.effort.frames;
        let options = CaptureOptions { samples, warmup, ..Default::default() };
        let frame = capture(self.gpu, &mut self.renderer, &uploaded, &scene.cameras[0], options).expect("it draws");
        assert_eq!(self.renderer.drawn_by(), "gather");
        shown(&frame.beauty.data)
    }

    fn trace(&self, scene: &Scene) -> Vec<u8> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let packed = ReferenceScene::new(device, queue, scene).expect("the fixture packs");
        let subject = Subject { camera: &scene.cameras[0], size: self.effort.size, points: None };
        let options = TracerOptions { samples: self.effort.paths, ..Default::default() };
        let mut tracer = Tracer::new(device, queue, &self.kernel, &packed, subject, options).expect("it can be traced");
        while tracer.step().expect("it traces") {}
        let traced = tracer.finish().expect("it ends");
        shown(traced.layer(Layer::Combined).expect("the picture"))
    }
}

fn shown(rgba: &[f32]) -> Vec<u8> {
    let rgb: Vec<f32> = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    Tonemap::None.apply_to_bytes(&rgb)
}
