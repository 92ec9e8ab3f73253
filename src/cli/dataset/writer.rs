//! Draws samples and writes them, each whole or not at all, beside the list of their checksums.

use super::{
    super::{args::load_weights, interrupt},
    Args,
};
use crate::{
    gi::{Method, gather},
    gpu::Gpu,
    image_io::write_whole,
    reference::{Kernel, ReferenceScene},
    render::{Blending, Renderer, RendererOptions},
    scene::{Camera, Scene, upload::SceneGpu},
    study::{
        dataset::{Next, Sample, frame, sample},
        guides::Guides,
        moments::{self, When},
        motion, target,
    },
};
use anyhow::{Context, Result};
use sha2::{Digest, Sha256};
use std::{collections::HashSet, io::Write, path::PathBuf};

/// File with the SHA-256 of every sample, as `sha256sum -c` reads it.
const LIST: &str = "SHA256SUMS";

/// Draws samples and writes them; a file that exists is kept.
pub(super) struct Writer {
    gpu: Gpu,
    renderer: Renderer,
    /// The path tracer, if it makes the targets.
    kernel: Option<Kernel>,
    spp: u32,
    motion: bool,
    guides: bool,
    gi_frames: u32,
    /// What cells remember is written instead.
    lessons: Option<Lessons>,
    pub(super) out: PathBuf,
    /// Names in the list of checksums.
    listed: HashSet<String>,
}

/// What lessons of a filter are made with.
pub(super) struct Lessons {
    /// In the order in which they come.
    moments: Vec<When>,
    reader: moments::Reader,
    /// Gathers the light that is to be learnt.
    teacher: Renderer,
}

impl Lessons {
    fn new(gpu: &Gpu, args: &Args) -> Result<Self> {
        // Of its own seed: the noise of what is to be learnt must not be that of what it is learnt
        // from, or a cell's own few rays would seem to know more than its neighbours'.
        let method = Method::Gather(gather::Options { seed: 1, ..gather::Options::PLAIN });
        let options = RendererOptions { method, blending: Blending::Stochastic, ..Default::default() };
        let teacher = Renderer::new(&gpu.device, &gpu.queue, args.size, options)?;
        Ok(Self { moments: args.moments.clone(), reader: moments::Reader::new(&gpu.device), teacher })
    }
}

/// A scene as both renderers want it.
pub(super) struct Uploaded<'a> {
    scene: &'a Scene,
    pub(super) raster: SceneGpu,
    traced: Option<ReferenceScene>,
}

impl Writer {
    /// What `args` ask for, before anything is drawn; reads what the folder has.
    pub(super) fn open(gpu: Gpu, args: &Args) -> Result<Self> {
        let method = match &args.weights {
            Some(path) => Method::Neural(Box::new(load_weights(Some(path))?.into())),
            None => Method::Gather(gather::Options::default()),
        };
        let options = RendererOptions { method, blending: Blending::Stochastic, ..Default::default() };
        let renderer = Renderer::new(&gpu.device, &gpu.queue, args.size, options)?;
        let lessons = match args.moments.is_empty() {
            true => None,
            false => Some(Lessons::new(&gpu, args)?),
        };
        let kernel = (args.spp > 0 && lessons.is_none()).then(|| Kernel::new(&gpu.device));
        let Args { spp, motion, guides, gi_frames, .. } = *args;
        let (out, listed) = (args.out.clone(), HashSet::new());
        let mut writer = Self { gpu, renderer, kernel, spp, motion, guides, gi_frames, lessons, out, listed };
        writer.open_list()?;
        Ok(writer)
    }

    pub(super) fn upload<'a>(&self, scene: &'a Scene) -> Result<Uploaded<'a>> {
        let mut raster = SceneGpu::new(&self.gpu.device, &self.gpu.queue, scene)?;
        raster.trace(&self.gpu.device, &self.gpu.queue, scene)?;
        let trace = |_| ReferenceScene::new(&self.gpu.device, &self.gpu.queue, scene);
        Ok(Uploaded { scene, raster, traced: self.kernel.as_ref().map(trace).transpose()? })
    }

    /// Width and height of the pictures.
    pub(super) fn size(&self) -> [u32; 2] {
        self.renderer.size()
    }

    fn path(&self, stem: &str) -> PathBuf {
        self.out.join(format!("{stem}.safetensors"))
    }

    /// Draws, traces and writes the sample `stem`; `seed` is the path tracer's.
    pub(super) fn write(&mut self, stem: &str, scene: &mut Uploaded<'_>, camera: &Camera, seed: u32) -> Result<()> {
        if self.lessons.is_some() {
            return self.write_lesson(stem, scene, camera, seed);
        }
        let sample = self.sample(&scene.raster, camera)?;
        self.complete(stem, scene, camera, seed, sample)
    }

    /// As [`write`](Self::write) for a view whose sample was drawn last.
    pub(super) fn write_drawn(
        &mut self,
        stem: &str,
        scene: &mut Uploaded<'_>,
        camera: &Camera,
        seed: u32,
        sample: Sample,
    ) -> Result<()> {
        match self.lessons {
            Some(_) => self.write_lesson(stem, scene, camera, seed),
            None => self.complete(stem, scene, camera, seed, sample),
        }
    }

    /// Completes the sample that was drawn last, by what else of it is wanted, and writes it.
    fn complete(
        &mut self,
        stem: &str,
        scene: &Uploaded<'_>,
        camera: &Camera,
        seed: u32,
        mut sample: Sample,
    ) -> Result<()> {
        if self.guides {
            sample.guides = Some(Guides::read(&self.gpu, self.renderer.targets(), camera.near)?);
        }
        if self.motion {
            let size = self.renderer.size();
            let moved = motion::stepped(camera, size, motion::median_distance(&sample), u64::from(seed));
            // The guess goes on, as it does when a camera moves.
            interrupt::check()?;
            let next = frame(&self.gpu, &mut self.renderer, &scene.raster, &moved, 1)?;
            let flow = motion::flow((&sample, camera), (&next, &moved), size);
            sample.next = Some(Next { inputs: next.inputs, flow });
        }
        if let (Some(kernel), Some(traced)) = (&self.kernel, &scene.traced) {
            let options = target::options(self.spp, seed);
            let go_on = || !interrupt::requested();
            sample.target = target::target(&self.gpu, kernel, traced, camera, self.renderer.size(), options, go_on)?;
            interrupt::check()?;
        }
        self.save(stem, sample.to_bytes()?)
    }

    fn write_lesson(&mut self, stem: &str, scene: &mut Uploaded<'_>, camera: &Camera, seed: u32) -> Result<()> {
        let Some(Lessons { moments, reader, teacher }) = &mut self.lessons else { return Ok(()) };
        let shown = (scene.scene, &mut scene.raster);
        let drawn_by = (&mut self.renderer, teacher, reader);
        let asked = (moments.as_slice(), self.spp, seed);
        let go_on = || !interrupt::requested();
        let lesson = moments::lesson(&self.gpu, drawn_by, shown, camera, asked, go_on)?;
        interrupt::check()?;
        lesson.map_or(Ok(()), |lesson| self.save(stem, lesson.to_bytes()?))
    }

    fn save(&mut self, stem: &str, bytes: Vec<u8>) -> Result<()> {
        write_whole(&self.path(stem), &bytes)?;
        self.list(stem, &bytes)
    }

    pub(super) fn sample(&mut self, scene: &SceneGpu, camera: &Camera) -> Result<Sample> {
        interrupt::check()?;
        Ok(sample(&self.gpu, &mut self.renderer, scene, camera, self.gi_frames)?)
    }

    fn open_list(&mut self) -> Result<()> {
        let text = std::fs::read_to_string(self.out.join(LIST)).unwrap_or_default();
        self.listed = text.lines().filter_map(|l| l.split_once("  ")).map(|(_, name)| name.to_owned()).collect();
        Ok(())
    }

    /// Adds a sample to the list of checksums. One write, so that several shards may share a
    /// folder.
    fn list(&mut self, stem: &str, bytes: &[u8]) -> Result<()> {
        let name = format!("{stem}.safetensors");
        let sum: String = Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect();
        let path = self.out.join(LIST);
        let file = std::fs::OpenOptions::new().create(true).append(true).open(&path);
        let line = format!("{sum}  {name}\n");
        file.and_then(|mut f| f.write_all(line.as_bytes()))
            .with_context(|| format!("cannot write {}", path.display()))?;
        self.listed.insert(name);
        Ok(())
    }

    /// Whether the sample is there; one that a kill left without its checksum gets it now.
    pub(super) fn has(&mut self, stem: &str) -> Result<bool> {
        let path = self.path(stem);
        if !path.exists() {
            return Ok(false);
        }
        if !self.listed.contains(&format!("{stem}.safetensors")) {
            let bytes = std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
            self.list(stem, &bytes)?;
        }
        Ok(true)
    }
}
