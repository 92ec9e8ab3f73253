//! The frame, pass by pass: deform → shadow → gbuffer (→ lights) → direct → indirect → ssr →
//! composite (→ pictures → network → paint) → blended (→ taa). A display adds `tonemap` after it.

use super::RenderError;
use super::blended::{BlendedInputs, Blending};
use super::composite::Backdrop;
use super::cull::DrawnCount;
use super::direct::DirectInputs;
use super::gbuffer::GbufferInputs;
use super::generator::{Generator, Seen};
use super::gi_inputs::{clear, gi_inputs};
use super::light_choice::LightOptions;
use super::lights::LightLists;
use super::passes::{FrameBindings, Passes};
use super::previous_transforms::PreviousTransforms;
use super::shadow::{ShadowMaps, ShadowOptions};
use super::shadow_maps::Audience;
use super::ssr::{SsrInputs, SsrPass, SsrPicture};
use super::taa::TaaPass;
use super::targets::{Target, Targets};
use super::view::{FrameUniform, View};
use crate::gi::{
    self, Outputs, method,
    technique::{self, Technique},
};
use crate::gpu::pipeline_cache::PipelineCache;
use crate::gpu::timing::Recorder;
use crate::gpu_scene::SceneGpu;
use crate::net::gpu::LayerReadback;
use crate::net::plan::Plan;

/// Options of a [`Renderer`].
#[derive(Debug, Clone, Default)]
pub struct RendererOptions {
    /// Method of indirect light. Default [`Method::Ambient`](gi::Method); the program's is `gather`.
    pub method: gi::Method,
    /// Sizes of shadow maps. Smaller ones save memory and soften contact.
    pub shadow: ShadowOptions,
    /// Treatment of many lights.
    pub lights: LightOptions,
    /// Temporal anti-aliasing ([`TaaPass`]): `hdr` is the mean over frames. Default off, which costs
    /// nothing. On, views should be jittered by [`sampling::offset`](super::sampling::offset) of the
    /// frame's number; without jitter edges stay stepped.
    pub taa: bool,
    /// How blended surfaces are drawn. Default [`Blending::Sorted`].
    pub blending: Blending,
    /// What is shown behind the scene. Default [`Backdrop::Shown`].
    pub backdrop: Backdrop,
}

/// What is bound as long as the scene stays.
struct Lighting {
    scene: u64,
    maps: ShadowMaps,
    lists: LightLists,
    group: wgpu::BindGroup,
    sky: wgpu::BindGroup,
}

/// Purpose of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A picture to be shown.
    Picture,
    /// Another sample of the picture before: shadow maps stay as they are and, without temporal
    /// anti-aliasing, to which each sample is a frame, motion vectors of objects.
    FurtherSample,
    /// A frame for its history alone: targets hold no picture after it.
    WarmUp {
        /// Whether it is the first of its picture, whose shadow maps are drawn.
        first: bool,
    },
}

/// The rasteriser. The host owns device, queue and encoder; a steady frame allocates nothing on the
/// GPU.
pub struct Renderer {
    device: wgpu::Device,
    _pipeline_cache: PipelineCache,
    frame: wgpu::Buffer,
    targets: Targets,
    picture: FrameBindings,
    lighting: Option<Lighting>,
    method: &'static str,
    /// What fills `indirect`; nothing for direct light alone.
    indirect: Option<Box<dyn Technique>>,
    /// What paints over the picture.
    generator: Option<Generator>,
    passes: Passes,
    lights: LightOptions,
    backdrop: Backdrop,
    taa: Option<TaaPass>,
    /// Where objects were in the frame before.
    previous_transforms: PreviousTransforms,
    /// What the frame before was seen with, for motion vectors.
    last: Option<View>,
    /// What the last frame drew.
    drawn: DrawnCount,
}

impl Renderer {
    /// Pipelines, and targets of `size` pixels.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: [u32; 2],
        options: RendererOptions,
    ) -> Result<Self, RenderError> {
        let targets = Targets::new(device, size)?;
        let shared = PipelineCache::of(device);
        let frame = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("render.frame"),
            size: size_of::<FrameUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let passes = Passes::new(device, &frame, &options);
        let mut taa = options.taa.then(|| TaaPass::new(device));
        let picture = passes.bind(device, &frame, &targets, &mut taa);
        let indirect = method::build(device, queue, size, &options.method)?;
        let hdr = taa.as_ref().map_or(&targets.hdr, TaaPass::current);
        let seen = Seen { frame: &frame, targets: &targets, hdr };
        let generator = match &options.method {
            gi::Method::Generator(neural) => Some(Generator::new(device, queue, neural, seen)?),
            _ => None,
        };
        let method = options.method.name();
        let device = device.clone();
        let (lighting, previous_transforms, drawn) = (None, PreviousTransforms::default(), DrawnCount::default());
        let (lights, last, backdrop) = (options.lights, None, options.backdrop);
        Ok(Self {
            device,
            _pipeline_cache: shared,
            frame,
            targets,
            picture,
            lighting,
            method,
            indirect,
            generator,
            passes,
            lights,
            backdrop,
            taa,
            previous_transforms,
            last,
            drawn,
        })
    }

    /// New targets of `size` pixels; the views of the old ones are of no use any more.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if size != self.targets.size {
            self.targets = Targets::new(&self.device, size)?;
            self.picture = self.passes.bind(&self.device, &self.frame, &self.targets, &mut self.taa);
            if let Some(indirect) = &mut self.indirect {
                indirect.release_bindings();
            }
            if let Some(generator) = &mut self.generator {
                let hdr = self.taa.as_ref().map_or(&self.targets.hdr, TaaPass::current);
                generator.resize(Seen { frame: &self.frame, targets: &self.targets, hdr })?;
            }
        }
        Ok(())
    }

    /// Sets the background from the next frame on.
    pub fn set_backdrop(&mut self, backdrop: Backdrop) {
        self.backdrop = backdrop;
    }

    /// Sets [`Options::rays`](gi::gather::Options::rays) from the next frame on, where the method is `gather`
    /// or `neural`.
    pub fn set_rays(&mut self, rays: f32) {
        if let Some(indirect) = &mut self.indirect {
            indirect.set_rays(rays);
        }
    }

    /// The next frame has nothing to do with the last (a cut): no object has moved since, and
    /// temporal anti-aliasing starts anew.
    pub fn reset_history(&mut self) {
        self.previous_transforms.reset_history();
        self.passes.deform.reset_history();
        if let Some(taa) = &mut self.taa {
            taa.reset_history();
        }
        if let Some(indirect) = &mut self.indirect {
            indirect.reset_history();
        }
        self.last = None;
    }

    /// Frames that the method's answer has settled over since the last cut; `None` where it does
    /// not settle.
    pub fn settled(&self) -> Option<u32> {
        self.indirect.as_ref().and_then(|i| i.settled())
    }

    /// Returns the method that drew the last frame in the place of the one asked for, and why; `None`
    /// where that drew itself.
    pub fn fallback(&self) -> Option<technique::Fallback<'_>> {
        self.indirect.as_ref()?.fallback()
    }

    /// Name of the method that found the last frame's indirect light, as on the command line.
    pub fn drawn_by(&self) -> &'static str {
        self.fallback().map_or(self.method, |i| i.method)
    }

    /// Name of the method that finds indirect light, as on the command line.
    pub fn method_name(&self) -> &'static str {
        self.method
    }

    /// Returns the plan of the method's network, where one runs.
    pub fn plan(&self) -> Option<&Plan> {
        self.generator.as_ref().map(Generator::plan).or_else(|| self.indirect.as_ref()?.plan())
    }

    /// Width and height of the targets, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.targets.size
    }

    /// Returns the inputs of a GI method for the frame that was drawn with `view` and `environment`.
    pub fn gi_inputs(&self, view: &View, environment: [f32; 3]) -> gi::Inputs<'_> {
        gi_inputs(&self.targets, view, environment, None)
    }

    /// Returns the network's input of the last frame, which `view` drew; `None` without a network.
    /// Waits for the GPU.
    ///
    /// # Errors
    /// As [`Technique::read_input`].
    pub fn read_network_input(
        &mut self,
        view: &View,
        environment: [f32; 3],
    ) -> Result<Option<LayerReadback>, gi::GiError> {
        if let Some(generator) = &self.generator {
            return generator.read_layer(None);
        }
        let Some(indirect) = &mut self.indirect else { return Ok(None) };
        indirect.read_input(&gi_inputs(&self.targets, view, environment, None))
    }

    /// Returns the history of cells after the last frame, where the method is `gather` or `neural`.
    pub fn memory(&self) -> Option<technique::Memory<'_>> {
        self.indirect.as_ref()?.memory()
    }

    /// Names of the network's layers; none without a network.
    pub fn layers(&self) -> Vec<&str> {
        match &self.generator {
            Some(generator) => generator.layers(),
            None => self.indirect.as_ref().map(|i| i.layers()).unwrap_or_default(),
        }
    }

    /// Returns the output of a layer of the network for the last frame, which `view` drew; `None` where there is
    /// no such layer. Runs the network again and waits for the GPU.
    ///
    /// # Errors
    /// As [`Technique::read_layer`].
    pub fn read_layer(
        &mut self,
        view: &View,
        environment: [f32; 3],
        layer: usize,
    ) -> Result<Option<LayerReadback>, gi::GiError> {
        if let Some(generator) = &self.generator {
            return generator.read_layer(Some(layer));
        }
        let Some(indirect) = &mut self.indirect else { return Ok(None) };
        indirect.read_layer(&gi_inputs(&self.targets, view, environment, None), layer)
    }

    /// Draw calls, triangles and shadow maps of the last frame.
    pub fn drawn(&self) -> DrawnCount {
        self.drawn
    }

    /// Layers of these numbers are averaged by temporal anti-aliasing from now on, where there is
    /// any.
    pub(super) fn average(&mut self, layers: impl Iterator<Item = u32>) {
        if let Some(taa) = &mut self.taa {
            taa.average(&self.device, &self.frame, &self.targets, layers);
        }
    }

    /// Number and mean of each layer that is.
    pub(super) fn averaged(&self) -> impl Iterator<Item = (u32, &Target)> {
        self.taa.iter().flat_map(TaaPass::averaged)
    }

    /// The textures that [`Renderer::record`] fills.
    pub fn targets(&self) -> &Targets {
        &self.targets
    }

    /// The frame's uniform buffer, for passes that read the same G-buffer.
    pub fn frame(&self) -> &wgpu::Buffer {
        &self.frame
    }

    /// Name and bytes of every target and, once a scene was drawn, its shadow maps.
    pub fn bytes(&self) -> Vec<(&'static str, u64)> {
        let mut rows = self.targets.bytes();
        rows.extend(self.lighting.iter().flat_map(|l| l.maps.bytes()));
        rows.extend(self.lighting.iter().map(|l| ("lights", l.lists.buffer.size())));
        rows.push(("gi.color_pyramid", self.picture.ssr.as_ref().map_or(0, SsrPicture::bytes)));
        rows.push(("previous_transforms", self.previous_transforms.bytes()));
        rows.push(("deform", self.passes.deform.bytes()));
        rows.extend(self.taa.iter().flat_map(TaaPass::bytes));
        let painted = self.generator.as_ref().map_or(0, Generator::bytes);
        rows.push((self.method, painted + self.indirect.as_ref().map_or(0, |i| i.bytes())));
        rows
    }

    /// Records one frame of `scene` as `view` sees it into [`Renderer::targets`]. `view.size` is
    /// the targets' size. What was placed elsewhere in the frame recorded before has motion vectors
    /// that point there.
    ///
    /// # Errors
    /// [`RenderError::Gi`] when the GI method cannot work with this camera; the encoder then holds
    /// half a frame.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        scene: &SceneGpu,
        view: &View,
    ) -> Result<(), RenderError> {
        self.record_frame(recorder, queue, scene, view, Purpose::Picture)
    }

    /// Records like [`Renderer::record`], no more than `purpose` needs.
    pub fn record_frame(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        scene: &SceneGpu,
        view: &View,
        purpose: Purpose,
    ) -> Result<(), RenderError> {
        let size = self.targets.size;
        let new_picture = matches!(purpose, Purpose::Picture | Purpose::WarmUp { first: true });
        let known = self.lighting.take().filter(|l| l.scene == scene.id);
        let fresh = known.is_none();
        let mut lighting = known.unwrap_or_else(|| self.lighting(scene));
        if !lighting.lists.fit(size) {
            (lighting.lists, lighting.group) = self.lists(scene, &lighting.maps);
        }
        let last = self.last.filter(|last| last.size == view.size);
        let view = &match &self.taa {
            Some(taa) => taa.follow(view),
            None => last.map_or(*view, |last| view.after(&last)),
        };
        self.last = Some(*view);
        let picture_only = !self.indirect.as_ref().is_some_and(|i| i.uses_rays(scene.rays.is_some()));
        let counts = [scene.lights.len() as u32, lighting.lists.words];
        let uniform = view.uniform(&scene.environment, counts, picture_only, self.backdrop);
        queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&uniform));

        let mut drawn = DrawnCount::default();
        if new_picture || self.taa.is_some() || !self.previous_transforms.knows(scene) {
            self.previous_transforms.follow(&self.device, queue, scene);
            self.passes.deform.record(recorder, queue, scene);
        }
        if new_picture || fresh {
            let audience = Audience { scene, view, options: &self.lights, stand_ins: picture_only };
            self.passes.shadow.record(recorder, queue, &audience, &mut lighting.maps, &mut drawn);
        }
        let (before, deformed) = (self.previous_transforms.before(scene), self.passes.deform.before());
        let inputs = GbufferInputs { scene, before, deformed, view };
        self.passes.gbuffer.record(recorder, inputs, &self.targets, &mut drawn.camera);
        let mut inputs = gi_inputs(&self.targets, view, scene.environment.radiance, Some(scene));
        // What is cut out by lot shows other surfaces in a frame of another number.
        let same_lots = last.is_some_and(|last| last.seed == view.seed);
        inputs.moves_with_world = same_lots || !scene.draws.iter().any(|draw| draw.covered);
        if let Some(lights) = &mut inputs.lights {
            lights.has_emissive_proxies &= picture_only;
        }
        // What a frame leaves behind has no history of pictures but that of temporal anti-aliasing.
        if let (Purpose::WarmUp { .. }, Some(indirect), None) = (purpose, &mut self.indirect, &self.taa)
            && indirect.warm_up(recorder, queue, &inputs)?
        {
            (self.lighting, self.drawn) = (Some(lighting), drawn);
            return Ok(());
        }
        self.passes.lights.record(recorder, &self.picture.lights, &lighting.lists);
        let direct = DirectInputs { picture: &self.picture.direct, lights: &lighting.group, size };
        self.passes.direct.record(recorder, direct);
        if let (Some(indirect), Some(taa)) = (&mut self.indirect, &self.taa) {
            indirect.set_frame(queue, taa.frames());
        }
        match &mut self.indirect {
            Some(indirect) => {
                let Targets { indirect: light, indirect_specular: specular, .. } = &self.targets;
                let outputs = Outputs { light: &light.view, specular: Some(&specular.view) };
                indirect.record(recorder, queue, &inputs, outputs)?;
                if !indirect.writes_specular() {
                    let ssr = self.passes.ssr.get_or_insert_with(|| SsrPass::new(&self.device));
                    let made = || ssr.picture(&self.device, &self.frame, &self.targets);
                    let picture = self.picture.ssr.get_or_insert_with(made);
                    ssr.record(recorder, SsrInputs { picture, sky: &scene.environment_view }, size);
                }
            }
            None => clear(recorder, &self.targets),
        }
        self.passes.composite.record(recorder, &self.picture.composite, &lighting.sky, size);
        if let Some(generator) = &mut self.generator {
            generator.record(recorder);
        }
        if let (Some(blended), Some(picture)) = (&self.passes.blended, &self.picture.blended) {
            let hdr = &self.taa.as_ref().map_or(&self.targets.hdr, TaaPass::current).view;
            let (lights, depth) = (&lighting.group, &self.targets.depth.view);
            blended.record(recorder, BlendedInputs { scene, view, picture, lights, hdr, depth }, &mut drawn.camera);
        }
        if let Some(taa) = &mut self.taa {
            taa.record(recorder, queue, scene, view);
        }
        self.lighting = Some(lighting);
        self.drawn = drawn;
        Ok(())
    }

    fn lighting(&self, scene: &SceneGpu) -> Lighting {
        let maps = self.passes.shadow.maps(&self.device, scene);
        let (lists, group) = self.lists(scene, &maps);
        let sky = self.passes.composite.sky(&self.device, &scene.environment_view);
        Lighting { scene: scene.id, maps, lists, group, sky }
    }

    /// Lists of lights for pictures of the targets' size.
    fn lists(&self, scene: &SceneGpu, maps: &ShadowMaps) -> (LightLists, wgpu::BindGroup) {
        let (device, passes) = (&self.device, &self.passes);
        let lists = passes.lights.lists(device, scene, maps, self.targets.size, self.lights.tiled_from);
        let group = passes.direct.lights(device, scene, maps, &lists);
        (lists, group)
    }
}
