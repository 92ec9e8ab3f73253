//! One training sample: what the network is fed for a view, with the raw G-buffer values at the
//! same sample points.

pub use super::error::DatasetError;
use super::guides::Guides;
use crate::{
    gi::{
        cpu::oct_decode,
        features::FeatureSet,
        inputs::sample_pixel,
        pack::{NetworkInputs, read_features},
    },
    gpu::{Gpu, readback, timing::Recorder},
    render::{Renderer, View},
    scene::{Camera, upload::SceneGpu},
};
use half::f16;
use safetensors::{Dtype, tensor::TensorView};

/// What belongs to one view, at the network's resolution. Planes are `[channel][row][column]`.
#[derive(Debug, Clone)]
pub struct Sample {
    /// The network's inputs and the exposure scalar.
    pub inputs: NetworkInputs,
    /// Direct diffuse light as E/π, three planes.
    pub direct: Vec<f32>,
    /// Diffuse reflectance, three planes.
    pub albedo: Vec<f32>,
    /// World normal, three planes; zero on background.
    pub normal: Vec<f32>,
    /// Distance along the view axis, metres, one plane; 0 on background.
    pub depth: Vec<f32>,
    /// The picture at full resolution, if it was read.
    pub guides: Option<Guides>,
    /// The view a moment later, if it was drawn.
    pub next: Option<Next>,
    /// The light to be learnt, if it was traced.
    #[cfg(feature = "reference")]
    pub target: Option<super::target::Target>,
}

/// A frame of the same scene from a camera that has moved a little.
#[derive(Debug, Clone)]
pub struct Next {
    /// What the network is given for it.
    pub inputs: NetworkInputs,
    /// Where it shows each cell's surface: `super::motion::flow`.
    pub flow: Vec<f32>,
}

/// Draws `camera`'s view for `frames` frames after a cut, unjittered, and reads what training needs
/// of the last. `renderer`'s method is `gather`, whose answer is one of the network's inputs.
/// Blocks.
pub fn sample(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &SceneGpu,
    camera: &Camera,
    frames: u32,
) -> Result<Sample, DatasetError> {
    renderer.cut();
    frame(gpu, renderer, scene, camera, frames)
}

/// As [`sample`], going on from the frame drawn before.
pub fn frame(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &SceneGpu,
    camera: &Camera,
    frames: u32,
) -> Result<Sample, DatasetError> {
    let view = View::new(camera, renderer.size(), [0.0; 2]);
    for _ in 0..frames.max(1) {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, scene, &view)?;
        gpu.queue.submit([encoder.finish()]);
    }
    let gi_inputs = renderer.gi_inputs(&view, scene.environment.radiance);
    let guess = &renderer.targets().indirect.view;
    let inputs = read_features(&gpu.device, &gpu.queue, &FeatureSet::all(), &gi_inputs, guess)?;
    let cells = Cells { size: renderer.size(), low: inputs.cells };
    let targets = renderer.targets();
    let read = |texture: &wgpu::Texture| readback::texture(&gpu.device, &gpu.queue, texture);
    let depth = cells.pick(&read(&targets.depth.texture)?, |b: [u8; 4]| [f32::from_le_bytes(b)]);
    let half = |b: &[u8]| f16::from_le_bytes([b[0], b[1]]).to_f32();
    Ok(Sample {
        direct: cells
            .pick(&read(&targets.direct_diffuse.texture)?, |b: [u8; 8]| [half(&b), half(&b[2..]), half(&b[4..])]),
        albedo: cells.pick(&read(&targets.albedo.texture)?, |b: [u8; 4]| [srgb(b[0]), srgb(b[1]), srgb(b[2])]),
        normal: cells.pick(&read(&targets.normal.texture)?, |b: [u8; 4]| oct_decode([half(&b), half(&b[2..])])),
        depth: depth.into_iter().map(|d| if d > 0.0 { camera.near / d } else { 0.0 }).collect(),
        inputs,
        guides: None,
        next: None,
        #[cfg(feature = "reference")]
        target: None,
    })
}

impl Sample {
    /// Share of the cells on surfaces nearer than `distance`, metres.
    pub fn closer_than(&self, distance: f32) -> f32 {
        let near = self.depth.iter().filter(|d| **d > 0.0 && **d < distance).count();
        near as f32 / self.depth.len().max(1) as f32
    }

    /// The sample as a safetensors file: `features` [channels, h, w], `scale` (the exposure s, one
    /// value), `direct`, `albedo` and `normal` [3, h, w], `depth` [h, w]; where it was drawn,
    /// `next_features`, `next_scale` and `flow` [2, h, w] of the next frame; where it was traced,
    /// `light` [3, h, w] and its `noise` (one value); all f32; and, where they were read, the
    /// [`Guides`].
    pub fn to_bytes(&self) -> Result<Vec<u8>, DatasetError> {
        let [w, h] = self.inputs.cells.map(|n| n as usize);
        let channels = self.inputs.features.len() / (w * h);
        let scale = [self.inputs.exposure.s];
        let own: [(&str, Vec<usize>, &[f32]); 6] = [
            ("features", vec![channels, h, w], &self.inputs.features),
            ("scale", vec![1], &scale),
            ("direct", vec![3, h, w], &self.direct),
            ("albedo", vec![3, h, w], &self.albedo),
            ("normal", vec![3, h, w], &self.normal),
            ("depth", vec![h, w], &self.depth),
        ];
        let next_scale = [self.next.as_ref().map_or(0.0, |n| n.inputs.exposure.s)];
        let next = self.next.iter().flat_map(|n| {
            [
                ("next_features", vec![channels, h, w], n.inputs.features.as_slice()),
                ("next_scale", vec![1], next_scale.as_slice()),
                ("flow", vec![2, h, w], n.flow.as_slice()),
            ]
        });
        #[cfg(feature = "reference")]
        let traced = self.target.iter().flat_map(|t| {
            [("light", vec![3, h, w], t.light.as_slice()), ("noise", vec![1], std::slice::from_ref(&t.noise))]
        });
        #[cfg(not(feature = "reference"))]
        let traced = std::iter::empty();
        let failed = |e: safetensors::SafeTensorError| DatasetError::Serialize(e.to_string());
        let mut views = own
            .into_iter()
            .chain(next)
            .chain(traced)
            .map(|(name, shape, values)| {
                TensorView::new(Dtype::F32, shape, bytemuck::cast_slice(values)).map(|view| (name, view))
            })
            .collect::<Result<Vec<_>, _>>()
            .map_err(failed)?;
        if let Some(guides) = &self.guides {
            views.extend(guides.tensors()?);
        }
        safetensors::serialize(views, None).map_err(failed)
    }
}

/// Which pixel stands for which cell.
struct Cells {
    size: [u32; 2],
    low: [u32; 2],
}

impl Cells {
    /// Decodes the sample point of every cell from tightly packed texels of `T` bytes into `N`
    /// planes.
    fn pick<const T: usize, const N: usize>(&self, texels: &[u8], decode: impl Fn([u8; T]) -> [f32; N]) -> Vec<f32> {
        let mut planes: [Vec<f32>; N] = std::array::from_fn(|_| Vec::new());
        for j in 0..self.low[1] {
            for i in 0..self.low[0] {
                let [x, y] = sample_pixel([i, j], self.size);
                let at = (y * self.size[0] + x) as usize * T;
                let texel: [u8; T] = texels[at..at + T].try_into().expect("a slice of T bytes");
                for (plane, value) in planes.iter_mut().zip(decode(texel)) {
                    plane.push(value);
                }
            }
        }
        planes.concat()
    }
}

/// Linear value of an sRGB byte (IEC 61966-2-1).
fn srgb(byte: u8) -> f32 {
    crate::srgb::decode(f32::from(byte) / 255.0)
}
