//! A generator on top of the picture: a network that is given pictures of the G-buffer and paints
//! what a path tracer would show (the paper's Pix2Pix generator, or one that is given the picture
//! with the light of `gather`, too).
//!
//! It speaks in display values: the pictures are what Filmic shows at exposure 0, and its answer
//! becomes the radiance that Filmic shows so. Unlike methods of light it does not scale with the
//! light, and paints where there is none.

use super::pipelines;
use super::targets::{Target, Targets};
use crate::gi::{GiError, Neural};
use crate::gpu::bind;
use crate::gpu::shaders;
use crate::gpu::timing::Recorder;
use crate::net::format::Weights;
use crate::net::gpu::{LayerReadback, Network, Setup};
use crate::net::plan::{Plan, Precision};
use std::fmt::Write;

/// Features that a frame has, as `pictures.wgsl` numbers them.
const FEATURES: [&str; 5] = ["depth", "direct", "diffuse", "normal", "gathered"];

/// What it reads and paints over.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub frame: &'a wgpu::Buffer,
    pub targets: &'a Targets,
    /// The picture.
    pub hdr: &'a Target,
}

/// The network and its passes.
pub(super) struct Generator {
    device: wgpu::Device,
    queue: wgpu::Queue,
    neural: Neural,
    network: Network,
    size: [u32; 2],
    range: wgpu::Buffer,
    layouts: [wgpu::BindGroupLayout; 2],
    depth_range: wgpu::ComputePipeline,
    pictures: wgpu::ComputePipeline,
    paint: wgpu::ComputePipeline,
    /// Of the pictures and of painting.
    groups: [wgpu::BindGroup; 2],
    /// Of the next frame's dropout, where it is on.
    seed: Option<u32>,
}

impl Generator {
    /// Compiles all pipelines, uploads the weights and makes the buffers.
    ///
    /// # Errors
    /// [`GiError::Feature`] or [`GiError::Output`] when the weights speak of something else,
    /// [`GiError::Network`] when the size does not fit the device.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, neural: &Neural, seen: Seen<'_>) -> Result<Self, GiError> {
        use pipelines::*;
        let prelude = prelude(&neural.weights, neural.network.input_precision())?;
        let layout = |name, types: &[_]| layout(device, name, wgpu::ShaderStages::COMPUTE, types);
        let read = [UNIFORM, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, READ_WRITE, READ_WRITE];
        let layouts = [layout("render.pictures", &read), layout("render.paint", &[UNIFORM, LOAD, READ, STORE_HALF])];
        let network = network(device, queue, neural, seen.targets.size)?;
        let range = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("render.pictures.range"),
            size: 8,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let groups = groups(device, &layouts, (&range, &network), seen);
        let module = shaders::module_with(device, "render.pictures", &prelude);
        let pipeline = |entry| bind::pipeline(device, "render.pictures", &module, entry, &[&layouts[0]]);
        Ok(Self {
            depth_range: pipeline("depth_range"),
            pictures: pipeline("pictures"),
            paint: compute(device, "render.paint", "paint", &[&layouts[1]]),
            network,
            range,
            device: device.clone(),
            queue: queue.clone(),
            seed: neural.network.dropout,
            neural: neural.clone(),
            size: seen.targets.size,
            layouts,
            groups,
        })
    }

    /// Other targets, of another size.
    ///
    /// # Errors
    /// [`GiError::Network`] when the size does not fit the device.
    pub fn resize(&mut self, seen: Seen<'_>) -> Result<(), GiError> {
        self.network = network(&self.device, &self.queue, &self.neural, seen.targets.size)?;
        self.size = seen.targets.size;
        self.groups = groups(&self.device, &self.layouts, (&self.range, &self.network), seen);
        Ok(())
    }

    /// Records passes `pictures`, the network's, and `paint`, over the picture as it was composed.
    pub fn record(&mut self, recorder: &mut Recorder<'_>) {
        if let Some(seed) = &mut self.seed {
            self.network.set_seed(&self.queue, *seed);
            *seed = seed.wrapping_add(1);
        }
        self.record_input(recorder);
        self.network.record(recorder);
        recorder.compute("paint", |pass| {
            pass.set_pipeline(&self.paint);
            pass.set_bind_group(0, &self.groups[1], &[]);
            pipelines::dispatch(pass, self.size);
        });
    }

    fn record_input(&self, recorder: &mut Recorder<'_>) {
        recorder.encoder().clear_buffer(&self.range, 0, None);
        recorder.compute("pictures", |pass| {
            pass.set_bind_group(0, &self.groups[0], &[]);
            for pipeline in [&self.depth_range, &self.pictures] {
                pass.set_pipeline(pipeline);
                pipelines::dispatch(pass, self.size);
            }
        });
    }

    /// Names of the network's layers.
    pub fn layers(&self) -> Vec<&str> {
        self.network.taps().into_iter().map(|(_, name)| name).collect()
    }

    /// What the network does, step by step.
    pub fn plan(&self) -> &Plan {
        self.network.plan()
    }

    /// What a layer makes of the last frame, or without one what the network is given. A generator that is given the
    /// painted-over picture is given its own.
    ///
    /// # Errors
    /// [`GiError::Readback`].
    pub fn read_layer(&self, layer: Option<usize>) -> Result<Option<LayerReadback>, GiError> {
        let taps = self.network.taps();
        let step = match layer {
            Some(layer) => match taps.get(layer) {
                Some(&(step, _)) => Some(step),
                None => return Ok(None),
            },
            None => None,
        };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(&mut encoder);
        self.record_input(&mut recorder);
        if let Some(step) = step {
            self.network.record_until(step, &mut recorder);
        }
        self.queue.submit([encoder.finish()]);
        Ok(Some(match step {
            Some(step) => self.network.read_layer(&self.device, &self.queue, step)?,
            None => self.network.read_input(&self.device, &self.queue)?,
        }))
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.network.bytes() + self.range.size()
    }
}

fn network(device: &wgpu::Device, queue: &wgpu::Queue, neural: &Neural, size: [u32; 2]) -> Result<Network, GiError> {
    let setup = Setup { options: neural.network, tuned: neural.tuned.clone() };
    Network::new(device, queue, &neural.weights, size, setup)
        .map_err(|e| GiError::Network { cells: size, source: Box::new(e) })
}

/// Of the pictures, whose depth range and table lie in the buffers, and of painting.
fn groups(
    device: &wgpu::Device,
    layouts: &[wgpu::BindGroupLayout; 2],
    (range, network): (&wgpu::Buffer, &Network),
    Seen { frame, targets: t, hdr }: Seen<'_>,
) -> [wgpu::BindGroup; 2] {
    let read = [&t.depth, &t.normal, &t.albedo, &t.specular, &t.emissive, &t.direct_diffuse, &t.direct_specular, hdr];
    let buffers = [range.as_entire_binding(), network.input().resource()];
    let all = [frame.as_entire_binding()].into_iter().chain(read.map(pipelines::view)).chain(buffers);
    let pictures = pipelines::group(device, "render.pictures", &layouts[0], &all.collect::<Vec<_>>());
    let answer = network.output().resource();
    let painted = [frame.as_entire_binding(), pipelines::view(&t.depth), answer, pipelines::view(hdr)];
    [pictures, pipelines::group(device, "render.paint", &layouts[1], &painted)]
}

/// Constants of `pictures.wgsl` for what the weights want.
fn prelude(weights: &Weights, precision: Precision) -> Result<String, GiError> {
    let wrong = |name: &str, reason: String| GiError::Feature { name: name.into(), reason };
    if weights.table.name != "images" || weights.cell != 1 {
        let found = format!("table {}, {} pixels a cell", weights.table.name, weights.cell);
        return Err(wrong("(all)", format!("list is made for {found}; a generator is given pictures, pixel by pixel")));
    }
    let output = &weights.output;
    if (output.meaning.as_str(), output.channels) != ("display_signed", 3) {
        return Err(GiError::Output(format!("{} channels of `{}`", output.channels, output.meaning)));
    }
    let mut order = String::new();
    for (i, feature) in weights.inputs.iter().enumerate() {
        let Some(known) = FEATURES.iter().position(|name| *name == feature.name) else {
            return Err(wrong(&feature.name, "is no picture of a frame".into()));
        };
        if feature.encoding != weights.inputs[0].encoding || feature.encoding == "signed_stretched" {
            let reason =
                format!("is `{}`; in a frame all are `signed`, or all `unit` (apply takes others)", feature.encoding);
            return Err(wrong(&feature.name, reason));
        }
        let _ = write!(order, "case {i}u: {{ return {known}u; }} ");
    }
    let channels = 3 * weights.inputs.len();
    let (scale, offset) = if weights.inputs.first().is_some_and(|f| f.encoding == "unit") { (1, 0) } else { (2, -1) };
    let (half, vectors) = (precision == Precision::F16, channels.div_ceil(4));
    Ok(format!(
        "const HALF_TABLE = {half};\nconst CHANNELS = {channels}u;\nconst VECTORS = {vectors}u;\n\
         const SCALE = {scale}.0;\nconst OFFSET = {offset}.0;\n\
         fn order(feature: u32) -> u32 {{ switch feature {{ {order}default: {{ return 0u; }} }} }}\n"
    ))
}

/// The shader with an example of its prelude.
pub fn preludes() -> Vec<(&'static str, String)> {
    let order =
        "fn order(feature: u32) -> u32 { switch feature { case 1u: { return 1u; } default: { return 0u; } } }\n";
    let example = |half| {
        let numbers = "const CHANNELS = 15u;\nconst VECTORS = 4u;\nconst SCALE = 2.0;\nconst OFFSET = -1.0;\n";
        ("render.pictures", format!("const HALF_TABLE = {half};\n{numbers}{order}"))
    };
    vec![example(true), example(false)]
}
