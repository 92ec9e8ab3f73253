//! Temporal anti-aliasing and the history behind it: the mean over frames, each of which samples
//! its pixels elsewhere.
//!
//! A camera that stands still in a scene that does not change averages without end, so the picture
//! converges to the filtered one and stops moving. Otherwise the mean is fetched along the motion
//! vectors, dropped where the surface was not seen before, and held within the colours around the
//! pixel (variance clipping, Salvi 2016), which keeps ten frames at most. A frame's value at a
//! pixel is the mean of the 3×3 samples around its centre under the pixel filter ([`sampling`]),
//! whatever the jitter, so the mean over frames is the filtered picture.
//!
//! What it cannot do: tell a changed light from noise faster than the neighbourhood's colours
//! allow; reflections move with their surfaces; things thinner than a pixel lose brightness while
//! the camera moves. What an object's distance was is guessed from where it is now, so one that
//! comes or goes by more than a few percent of it in a frame starts anew.

use super::decode::{LayerGroups, LayerWriter, PICTURE};
use super::pipelines;
use super::sampling;
use super::targets::{Target, Targets};
use super::view::View;
use crate::gpu::timing::Recorder;
use crate::gpu_scene::SceneGpu;

/// What history is worth in a frame; `mode` in the shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// First frame, new size, another scene, or a cut.
    Fresh = 0,
    /// The very view of the frame before, of objects where they were.
    Still = 1,
    /// Another view of the same scene, or objects elsewhere.
    Moving = 2,
}

/// `Blend` of `shaders/render/taa.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Blend {
    pub mode: [i32; 4],
    pub wx: [f32; 4],
    pub wy: [f32; 4],
}

impl Blend {
    /// The pixel filter at the samples that lie around a pixel's centre in a frame that is jittered
    /// by `jitter` pixels. Summed over frames they are the filter's integral, whichever way the
    /// jitter goes.
    fn new(mode: Mode, jitter: [f32; 2]) -> Self {
        let whole = jitter.map(f32::round);
        let weights = |axis: usize| {
            let at = |i: usize| {
                let x = i as f32 - 1.0 + jitter[axis] - whole[axis];
                sampling::window(x.clamp(-sampling::FILTER_WIDTH, sampling::FILTER_WIDTH)).max(0.0)
            };
            let w = [at(0), at(1), at(2)];
            let sum: f32 = w.iter().sum();
            [w[0] / sum, w[1] / sum, w[2] / sum, 0.0]
        };
        Self { mode: [mode as i32, whole[0] as i32, whole[1] as i32, 0], wx: weights(0), wy: weights(1) }
    }
}

/// The pass with its history, for one size of targets.
pub struct TaaPass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    mode: wgpu::Buffer,
    textures: Option<Textures>,
    /// What reads layers of the frame, where any are averaged.
    writer: Option<LayerWriter>,
    /// Numbers of these layers.
    layers: Vec<u32>,
    last: Option<Last>,
    frames: u32,
}

/// What the frame before showed.
struct Last {
    scene: u64,
    placement: u64,
    view: View,
}

struct Textures {
    distance: [Target; 2],
    /// The picture's, then layers'.
    means: Vec<Mean>,
}

/// Something that is averaged over frames.
struct Mean {
    /// [`PICTURE`], or a layer's number.
    layer: u32,
    /// The frame before anti-aliasing; composite writes the picture's.
    current: Target,
    /// The mean where it can be read, of a layer; the picture's is `hdr` of the targets.
    shown: Option<(Target, LayerGroups)>,
    history: [Target; 2],
    /// Group `i` reads history `i` and writes the other.
    groups: [wgpu::BindGroup; 2],
}

impl TaaPass {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        use pipelines::{LOAD, STORE_HALF, UNIFORM};
        let store_distance = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: wgpu::TextureFormat::R32Float,
            view_dimension: wgpu::TextureViewDimension::D2,
        };
        let types = [UNIFORM, LOAD, LOAD, LOAD, LOAD, LOAD, UNIFORM, STORE_HALF, STORE_HALF, store_distance];
        let layout = pipelines::layout(device, "render.taa", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = pipelines::compute(device, "render.taa", "taa", &[&layout]);
        let mode = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("render.taa"),
            size: size_of::<Blend>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { pipeline, layout, mode, textures: None, writer: None, layers: Vec::new(), last: None, frames: 0 }
    }

    /// Makes the history's textures for `targets` and forgets what it held.
    pub fn fit(&mut self, device: &wgpu::Device, frame: &wgpu::Buffer, targets: &Targets) {
        let stored = wgpu::TextureUsages::STORAGE_BINDING;
        let make = |name| Target::new(device, name, targets.size, wgpu::TextureFormat::R32Float, stored);
        let distance = ["taa.distance_a", "taa.distance_b"].map(make);
        self.textures = Some(Textures { distance, means: Vec::new() });
        self.add(device, frame, targets, PICTURE);
        for layer in std::mem::take(&mut self.layers) {
            self.add(device, frame, targets, layer);
        }
        self.reset_history();
    }

    /// From the next frame on the layers of these numbers are averaged as well, for
    /// [`capture`](super::capture); those that already are go on.
    pub(super) fn average(
        &mut self,
        device: &wgpu::Device,
        frame: &wgpu::Buffer,
        targets: &Targets,
        layers: impl Iterator<Item = u32>,
    ) {
        for layer in layers {
            if !self.layers.contains(&layer) {
                self.add(device, frame, targets, layer);
            }
        }
    }

    fn add(&mut self, device: &wgpu::Device, frame: &wgpu::Buffer, targets: &Targets, layer: u32) {
        let Some(textures) = &mut self.textures else { return };
        let (stored, half) = (wgpu::TextureUsages::STORAGE_BINDING, wgpu::TextureFormat::Rgba16Float);
        let make = |name| Target::new(device, name, targets.size, half, stored);
        // What blends is drawn into the picture.
        let drawn = stored | wgpu::TextureUsages::RENDER_ATTACHMENT;
        let current = Target::new(device, "taa.current", targets.size, half, drawn);
        // A new history is of no frames: its texels are 0.
        let history = ["taa.history_a", "taa.history_b"].map(make);
        let shown = (layer != PICTURE).then(|| {
            self.layers.push(layer);
            let writer = self.writer.get_or_insert_with(|| LayerWriter::new(device));
            (make("taa.layer"), writer.bind(device, frame, targets, (layer, &current)))
        });
        let mean = shown.as_ref().map_or(&targets.hdr, |(mean, _)| mean);
        let distance = &textures.distance;
        let groups = [0, 1].map(|i| {
            let read = [&targets.depth, &targets.motion, &current, &history[i], &distance[i]].map(pipelines::view);
            let written = [mean, &history[1 - i], &distance[1 - i]].map(pipelines::view);
            let mut resources = vec![frame.as_entire_binding()];
            resources.extend(read);
            resources.push(self.mode.as_entire_binding());
            resources.extend(written);
            pipelines::group(device, "render.taa", &self.layout, &resources)
        });
        textures.means.push(Mean { layer, current, shown, history, groups });
    }

    /// Number and mean of each layer that is averaged.
    pub(super) fn averaged(&self) -> impl Iterator<Item = (u32, &Target)> {
        let means = self.textures.iter().flat_map(|t| &t.means);
        means.filter_map(|m| m.shown.as_ref().map(|(mean, _)| (m.layer, mean)))
    }

    /// Where composite puts the frame before anti-aliasing.
    ///
    /// # Panics
    /// Before [`fit`](Self::fit).
    pub fn current(&self) -> &Target {
        &self.textures.as_ref().expect("fitted before it is bound").means[0].current
    }

    /// The next frame has nothing to do with the last: a cut.
    pub fn reset_history(&mut self) {
        self.last = None;
    }

    /// Frames recorded so far; numbers the patterns of methods that let the history average them.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// `view` with motion vectors that point to the frame recorded before it.
    pub fn follow(&self, view: &View) -> View {
        self.last.as_ref().map_or(*view, |last| view.after(&last.view))
    }

    /// Records the pass: `hdr` of the targets becomes the mean of this frame
    /// ([`current`](Self::current)) and history. `scene` is what the frame shows.
    pub fn record(&mut self, recorder: &mut Recorder<'_>, queue: &wgpu::Queue, scene: &SceneGpu, view: &View) {
        let Some(textures) = &self.textures else { return };
        let mode = match &self.last {
            Some(last) if last.scene == scene.id => {
                let same_view = last.view.clip_from_world_unjittered == view.clip_from_world_unjittered;
                if same_view && last.placement == scene.placement { Mode::Still } else { Mode::Moving }
            }
            _ => Mode::Fresh,
        };
        queue.write_buffer(&self.mode, 0, bytemuck::bytes_of(&Blend::new(mode, view.jitter)));
        for mean in &textures.means {
            if let (Some((_, groups)), Some(writer)) = (&mean.shown, &self.writer) {
                writer.record(recorder, groups, view.size);
            }
            recorder.compute("taa", |pass| {
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, &mean.groups[self.frames as usize % 2], &[]);
                pipelines::dispatch(pass, view.size);
            });
        }
        self.last = Some(Last { scene: scene.id, placement: scene.placement, view: *view });
        self.frames = self.frames.wrapping_add(1);
    }

    /// Name and bytes of the history's textures.
    pub fn bytes(&self) -> Vec<(&'static str, u64)> {
        let Some(t) = &self.textures else { return Vec::new() };
        let means = t.means.iter().flat_map(|m| {
            let shown = m.shown.iter().map(|(mean, _)| mean);
            [&m.current].into_iter().chain(&m.history).chain(shown)
        });
        means.chain(&t.distance).map(|t| (t.name, t.bytes())).collect()
    }
}
