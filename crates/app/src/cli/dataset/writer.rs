//! Draws samples and writes them, each whole or not at all, beside the list of their checksums.

use super::{
    super::{args::load_weights, interrupt},
    Args,
};
use anyhow::{Context, Result};
use bouncelight::gi::{
    Method, gather,
    inputs::{cells_of, sample_pixel},
};
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{Blending, Renderer, RendererOptions, View};
use bouncelight::scene::{Camera, Scene};
use bouncelight_lab::study::moments::{self, When};
use bouncelight_scene::image_io::write_whole;
use sha2::{Digest, Sha256};
use std::{collections::HashSet, io::Write, path::PathBuf};

/// File with the SHA-256 of every sample, as `sha256sum -c` reads it.
const LIST: &str = "SHA256SUMS";

/// Draws samples and writes them; a file that exists is kept.
pub(super) struct Writer {
    gpu: Gpu,
    renderer: Renderer,
    spp: u32,
    /// In the order in which they come.
    moments: Vec<When>,
    reader: moments::Reader,
    /// Gathers the light that is to be learnt.
    teacher: Renderer,
    pub(super) out: PathBuf,
    /// Names in the list of checksums.
    listed: HashSet<String>,
}

/// A scene and what the device has of it.
pub(super) struct Uploaded<'a> {
    scene: &'a Scene,
    pub(super) raster: SceneGpu,
}

impl Writer {
    /// What `args` ask for, before anything is drawn; reads what the folder has.
    pub(super) fn open(gpu: Gpu, args: &Args) -> Result<Self> {
        let mut method = match &args.weights {
            Some(path) => Method::Neural(Box::new(load_weights(Some(path))?.into())),
            None => Method::Gather(gather::Options::default()),
        };
        if let (Some(options), Some(asked)) = (method.gather_mut(), args.gather) {
            *options = asked;
        }
        // Of its own seed: the noise of what is to be learnt must not be that of what it is learnt
        // from, or a cell's own few rays would seem to know more than its neighbours'.
        let plain = Method::Gather(gather::Options { seed: 1, ..gather::Options::PLAIN });
        let of = |method| {
            let options = RendererOptions { method, blending: Blending::Stochastic, ..Default::default() };
            Renderer::new(&gpu.device, &gpu.queue, args.size, options)
        };
        let (renderer, teacher, reader) = (of(method)?, of(plain)?, moments::Reader::new(&gpu.device));
        let (spp, moments, out, listed) = (args.spp, args.moments.clone(), args.out.clone(), HashSet::new());
        let mut writer = Self { gpu, renderer, spp, moments, reader, teacher, out, listed };
        writer.open_list()?;
        Ok(writer)
    }

    pub(super) fn upload<'a>(&self, scene: &'a Scene) -> Result<Uploaded<'a>> {
        let mut raster = SceneGpu::new(&self.gpu.device, &self.gpu.queue, scene)?;
        raster.trace(&self.gpu.device, &self.gpu.queue, scene)?;
        Ok(Uploaded { scene, raster })
    }

    /// Width and height of the pictures.
    pub(super) fn size(&self) -> [u32; 2] {
        self.renderer.size()
    }

    fn path(&self, stem: &str) -> PathBuf {
        self.out.join(format!("{stem}.safetensors"))
    }

    /// Draws and writes the sample `stem`; `seed` decides the pan and what changes.
    pub(super) fn write(&mut self, stem: &str, scene: &mut Uploaded<'_>, camera: &Camera, seed: u32) -> Result<()> {
        let shown = (scene.scene, &mut scene.raster);
        let drawn_by = (&mut self.renderer, &mut self.teacher, &mut self.reader);
        let asked = (self.moments.as_slice(), self.spp, seed);
        let go_on = || !interrupt::requested();
        let sample = moments::sample(&self.gpu, drawn_by, shown, camera, asked, go_on)?;
        interrupt::check()?;
        sample.map_or(Ok(()), |sample| self.save(stem, sample.to_bytes()?))
    }

    fn save(&mut self, stem: &str, bytes: Vec<u8>) -> Result<()> {
        write_whole(&self.path(stem), &bytes)?;
        self.list(stem, &bytes)
    }

    /// Share of the cells whose surface is nearer than `distance`, metres.
    pub(super) fn closer_than(&mut self, scene: &SceneGpu, camera: &Camera, distance: f32) -> Result<f32> {
        interrupt::check()?;
        let (device, queue, size) = (&self.gpu.device, &self.gpu.queue, self.renderer.size());
        let view = View::new(camera, size, [0.0; 2]);
        self.renderer.reset_history();
        let mut encoder = device.create_command_encoder(&Default::default());
        self.renderer.record(&mut Recorder::new(&mut encoder), queue, scene, &view)?;
        queue.submit([encoder.finish()]);
        let texels = readback::texture(device, queue, &self.renderer.targets().depth.texture)?;
        let depth: Vec<f32> = bytemuck::pod_collect_to_vec(&texels);
        let [w, h] = cells_of(size);
        let cells = (0..h).flat_map(|y| (0..w).map(move |x| sample_pixel([x, y], size)));
        // Reversed: the near plane is at 1, nothing at 0.
        let near = cells.filter(|[x, y]| depth[(y * size[0] + x) as usize] > camera.near / distance);
        Ok(near.count() as f32 / (w * h) as f32)
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
