//! The frame, told in order: shadow → gbuffer → direct → indirect → composite. A display adds `tonemap` after it.

use super::RenderError;
use super::composite::CompositePass;
use super::direct::{DirectInputs, DirectPass};
use super::gbuffer::GbufferPass;
use super::shadow::{ShadowMaps, ShadowOptions, ShadowPass};
use super::targets::Targets;
use super::view::{FrameUniform, View};
use crate::gi::{self, ambient::AmbientGi, pass::NeuralGi};
use crate::gpu::timing::Recorder;
use crate::scene::upload::SceneGpu;

/// How a [`Renderer`] is made.
#[derive(Debug, Clone, Default)]
pub struct RendererOptions {
    /// How indirect light is found.
    pub method: gi::Method,
    /// Sizes of shadow maps.
    pub shadow: ShadowOptions,
}

/// What fills `indirect`.
enum Indirect {
    /// Nothing: direct light alone.
    Direct,
    Ambient(Box<AmbientGi>),
    Neural(Box<NeuralGi>),
}

impl Indirect {
    fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: [u32; 2],
        method: &gi::Method,
    ) -> Result<Self, RenderError> {
        Ok(match method {
            gi::Method::Direct => Indirect::Direct,
            gi::Method::Ambient => Indirect::Ambient(Box::new(AmbientGi::new(device))),
            gi::Method::Neural(weights) => {
                Indirect::Neural(Box::new(NeuralGi::new(device, queue, weights, gi::pass::Options { size })?))
            }
        })
    }

    /// Name on the command line.
    fn name(&self) -> &'static str {
        match self {
            Indirect::Direct => "direct",
            Indirect::Ambient(_) => "ambient",
            Indirect::Neural(_) => "neural",
        }
    }

    /// The targets are new: nothing that was bound to the old ones is of use.
    fn forget(&mut self) {
        match self {
            Indirect::Direct => {}
            Indirect::Ambient(ambient) => ambient.forget(),
            Indirect::Neural(neural) => neural.forget(),
        }
    }

    fn bytes(&self) -> u64 {
        match self {
            Indirect::Direct => 0,
            Indirect::Ambient(ambient) => ambient.bytes(),
            Indirect::Neural(neural) => neural.bytes(),
        }
    }

    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &gi::Inputs<'_>,
        targets: &Targets,
    ) -> Result<(), RenderError> {
        let output = &targets.indirect.view;
        match self {
            Indirect::Direct => clear(recorder, targets),
            Indirect::Ambient(ambient) => ambient.record(recorder, queue, inputs, output)?,
            Indirect::Neural(neural) => neural.record_stages(recorder, inputs, output)?,
        }
        Ok(())
    }
}

/// What is bound as long as the targets stay.
struct Picture {
    direct: wgpu::BindGroup,
    composite: wgpu::BindGroup,
}

/// What is bound as long as the scene stays.
struct Lighting {
    scene: u64,
    maps: ShadowMaps,
    group: wgpu::BindGroup,
    sky: wgpu::BindGroup,
}

/// The rasteriser. The host owns device, queue and encoder; a steady frame allocates nothing on the GPU.
pub struct Renderer {
    device: wgpu::Device,
    frame: wgpu::Buffer,
    targets: Targets,
    picture: Picture,
    lighting: Option<Lighting>,
    indirect: Indirect,
    shadow: ShadowPass,
    gbuffer: GbufferPass,
    direct: DirectPass,
    composite: CompositePass,
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
        let frame = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("render.frame"),
            size: size_of::<FrameUniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let shadow = ShadowPass::new(device, options.shadow);
        let gbuffer = GbufferPass::new(device, &frame);
        let direct = DirectPass::new(device);
        let composite = CompositePass::new(device);
        let picture = bind(device, &frame, &targets, &direct, &composite);
        let device = device.clone();
        let indirect = Indirect::new(&device, queue, size, &options.method)?;
        Ok(Self { device, frame, targets, picture, lighting: None, indirect, shadow, gbuffer, direct, composite })
    }

    /// New targets of `size` pixels; the views of the old ones are of no use any more.
    pub fn resize(&mut self, size: [u32; 2]) -> Result<(), RenderError> {
        if size != self.targets.size {
            self.targets = Targets::new(&self.device, size)?;
            self.picture = bind(&self.device, &self.frame, &self.targets, &self.direct, &self.composite);
            self.indirect.forget();
        }
        Ok(())
    }

    /// Changes how indirect light is found; builds the new method's pipelines and buffers.
    pub fn set_method(&mut self, queue: &wgpu::Queue, method: &gi::Method) -> Result<(), RenderError> {
        self.indirect = Indirect::new(&self.device, queue, self.targets.size, method)?;
        Ok(())
    }

    /// Name of the method that finds indirect light, as on the command line.
    pub fn method_name(&self) -> &'static str {
        self.indirect.name()
    }

    /// Width and height of the targets, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.targets.size
    }

    /// What a GI method reads of the frame that was drawn with `view` and `environment`.
    pub fn gi_inputs(&self, view: &View, environment: [f32; 3]) -> gi::Inputs<'_> {
        gi_inputs(&self.targets, view, environment)
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
        rows.push((self.indirect.name(), self.indirect.bytes()));
        rows
    }

    /// Records one frame of `scene` as `view` sees it into [`Renderer::targets`]. `view.size` is the targets' size.
    ///
    /// # Errors
    /// [`RenderError::Gi`] when the GI method cannot work with this camera; the encoder then holds half a frame.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        scene: &SceneGpu,
        view: &View,
    ) -> Result<(), RenderError> {
        self.record_frame(recorder, queue, scene, view, true)
    }

    /// As [`Renderer::record`]; without `shadows` the maps stay as the previous frame left them, which is right for
    /// further samples of one picture.
    pub(crate) fn record_frame(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        scene: &SceneGpu,
        view: &View,
        shadows: bool,
    ) -> Result<(), RenderError> {
        let size = self.targets.size;
        let known = self.lighting.take().filter(|l| l.scene == scene.id);
        let fresh = known.is_none();
        let mut lighting = known.unwrap_or_else(|| self.lighting(queue, scene));
        let uniform = view.uniform(&scene.environment, scene.lights.len() as u32);
        queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&uniform));

        if shadows || fresh {
            self.shadow.record(recorder, queue, scene, view, &mut lighting.maps);
        }
        self.gbuffer.record(recorder, scene, &self.targets);
        let inputs = DirectInputs { picture: &self.picture.direct, lights: &lighting.group, size };
        self.direct.record(recorder, inputs);
        let inputs = gi_inputs(&self.targets, view, scene.environment.radiance);
        self.indirect.record(recorder, queue, &inputs, &self.targets)?;
        self.composite.record(recorder, &self.picture.composite, &lighting.sky, size);
        self.lighting = Some(lighting);
        Ok(())
    }

    fn lighting(&self, queue: &wgpu::Queue, scene: &SceneGpu) -> Lighting {
        let maps = self.shadow.maps(&self.device, queue, scene);
        let group = self.direct.lights(&self.device, scene, &maps);
        let sky = self.composite.sky(&self.device, &scene.environment_view);
        Lighting { scene: scene.id, maps, group, sky }
    }
}

fn bind(
    device: &wgpu::Device,
    frame: &wgpu::Buffer,
    targets: &Targets,
    direct: &DirectPass,
    composite: &CompositePass,
) -> Picture {
    Picture { direct: direct.picture(device, frame, targets), composite: composite.picture(device, frame, targets) }
}

fn gi_inputs<'a>(targets: &'a Targets, view: &View, environment: [f32; 3]) -> gi::Inputs<'a> {
    gi::Inputs {
        size: targets.size,
        depth: &targets.depth.view,
        normal: &targets.normal.view,
        albedo: &targets.albedo.view,
        emissive: &targets.emissive.view,
        direct: &targets.direct_diffuse.view,
        camera: view.matrices(),
        environment,
    }
}

/// No indirect light.
fn clear(recorder: &mut Recorder<'_>, targets: &Targets) {
    let attachment = wgpu::RenderPassColorAttachment {
        view: &targets.indirect.view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
    };
    recorder.render("indirect", &[Some(attachment)], None, |_| {});
}
