//! A finished picture in memory: N jittered frames averaged, with the layers that Blender's passes
//! would hold.

use super::decode::Decoder;
use super::view::View;
use super::{Purpose, RenderError, Renderer, sampling};
use crate::gpu::{Gpu, timing::Recorder};
use crate::gpu_scene::SceneGpu;
use crate::scene::Camera;

/// Layers beside the picture. Names and meanings are those of Blender's passes:
/// picture = DiffCol · (DiffDir + DiffInd) + GlossCol · (GlossDir + GlossInd) + Emit + background.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Layer {
    /// Direct diffuse light, E/π. Without the sky, which Cycles counts in.
    DiffDir = 1,
    /// Indirect diffuse light (sky and bounces), E/π.
    DiffInd = 2,
    /// Diffuse reflectance.
    DiffCol = 3,
    /// Direct specular radiance divided by GlossCol.
    GlossDir = 4,
    /// Indirect specular radiance divided by GlossCol.
    GlossInd = 5,
    /// Directional albedo of the specular lobe.
    GlossCol = 6,
    /// Emitted radiance.
    Emit = 7,
    /// World-space shading normal (Y up).
    Normal = 8,
    /// Distance along the view axis, metres, of the sample at the pixel's centre; 1e10 where
    /// nothing was hit.
    Depth = 9,
    /// World position of the sample at the pixel's centre, metres (Y up).
    Position = 10,
    /// Texture coordinates in the previous frame minus in this one, of the sample at the pixel's
    /// centre. Objects have moved since the renderer's last frame; the camera only with temporal
    /// anti-aliasing.
    Motion = 11,
}

impl Layer {
    /// All of them.
    pub const ALL: [Layer; 11] = [
        Layer::DiffDir,
        Layer::DiffInd,
        Layer::DiffCol,
        Layer::GlossDir,
        Layer::GlossInd,
        Layer::GlossCol,
        Layer::Emit,
        Layer::Normal,
        Layer::Depth,
        Layer::Position,
        Layer::Motion,
    ];

    /// Blender's pass name.
    pub fn name(self) -> &'static str {
        match self {
            Layer::DiffDir => "DiffDir",
            Layer::DiffInd => "DiffInd",
            Layer::DiffCol => "DiffCol",
            Layer::GlossDir => "GlossDir",
            Layer::GlossInd => "GlossInd",
            Layer::GlossCol => "GlossCol",
            Layer::Emit => "Emit",
            Layer::Normal => "Normal",
            Layer::Depth => "Depth",
            Layer::Position => "Position",
            Layer::Motion => "Motion",
        }
    }

    /// Names of its channels.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Layer::Normal | Layer::Position => &["X", "Y", "Z"],
            Layer::Depth => &["Z"],
            Layer::Motion => &["X", "Y"],
            _ => &["R", "G", "B"],
        }
    }

    /// The layer by Blender's name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|l| l.name() == name)
    }

    /// Averages over an edge would name points and depths that are nowhere, so these take the
    /// sample at the pixel's centre, or in a frame of a sequence that nearest to it.
    fn is_unfiltered(self) -> bool {
        matches!(self, Layer::Depth | Layer::Position | Layer::Motion)
    }

    /// The colour that is divided out after filtering, as Blender does it.
    fn divisor(self) -> Option<Sum> {
        match self {
            Layer::DiffDir | Layer::DiffInd => Some(Sum { number: WEIGHT, ..Sum::of(self) }),
            Layer::GlossDir | Layer::GlossInd => Some(Sum::of(Layer::GlossCol)),
            _ => None,
        }
    }
}

/// The shader's number for DiffCol kept away from 0, by which diffuse light is weighted.
const WEIGHT: u32 = 12;

/// Something that is summed over the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sum {
    number: u32,
    channels: usize,
    filtered: bool,
}

impl Sum {
    fn of(layer: Layer) -> Self {
        Self { number: layer as u32, channels: layer.channels().len(), filtered: !layer.is_unfiltered() }
    }
}

/// Options of [`capture`].
#[derive(Debug, Clone, Copy)]
pub struct CaptureOptions<'a> {
    /// Jittered frames to average, 1 or more; 1 by default, which has stepped edges and grainy soft
    /// shadows. 0 is [`RenderError::NoSamples`].
    pub samples: u32,
    /// Seed of offsets and stochastic patterns. Default 0; equal seeds give equal pictures.
    pub seed: u32,
    /// Layers beside the picture. Default none.
    pub layers: &'a [Layer],
    /// Frames drawn before the first sample, for temporal anti-aliasing and methods with a history.
    /// Default 0, whose picture is as noisy as the first after a cut; 31 settles `gather`.
    pub warmup: u32,
    /// Number of the picture in a sequence under temporal anti-aliasing, whose frames' samples lie
    /// at one place of the pixel after the other; 0 has its first through the pixels' centres.
    pub number: u32,
}

impl Default for CaptureOptions<'_> {
    fn default() -> Self {
        Self { samples: 1, seed: 0, layers: &[], warmup: 0, number: 0 }
    }
}

/// A picture of floats: rows from the top, channels interleaved.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Values a pixel.
    pub channels: usize,
    /// `width · height · channels` values.
    pub data: Vec<f32>,
}

impl Picture {
    /// The values of pixel (x, y).
    pub fn at(&self, x: usize, y: usize) -> &[f32] {
        let i = (y * self.width + x) * self.channels;
        &self.data[i..i + self.channels]
    }
}

/// Result of [`capture`].
#[derive(Debug, Clone)]
pub struct CapturedFrame {
    /// Scene-linear radiance, RGBA; alpha is 1, or before a transparent backdrop the share that
    /// surfaces cover, by which the radiance is multiplied.
    pub beauty: Picture,
    /// The layers asked for, in that order.
    pub layers: Vec<(Layer, Picture)>,
}

impl CapturedFrame {
    /// The layer, if it was asked for.
    pub fn layer(&self, layer: Layer) -> Option<&Picture> {
        self.layers.iter().find(|(l, _)| *l == layer).map(|(_, p)| p)
    }
}

/// Draws `scene` as `camera` sees it at the renderer's size: sample 0 through the pixels' centres,
/// the others spread by the filter, all with equal weight. With temporal anti-aliasing filtered
/// layers are means over frames as the picture is. Blocks until the picture is in memory.
pub fn capture(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &SceneGpu,
    camera: &Camera,
    options: CaptureOptions<'_>,
) -> Result<CapturedFrame, RenderError> {
    let frame = capture_with(gpu, renderer, scene, camera, options, &mut || true)?;
    Ok(frame.expect("nobody asked to stop"))
}

/// Captures like [`capture`], calling `go_on` after every sample; `None` when it said false.
pub fn capture_with(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &SceneGpu,
    camera: &Camera,
    options: CaptureOptions<'_>,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<CapturedFrame>, RenderError> {
    if options.samples == 0 {
        return Err(RenderError::NoSamples);
    }
    let size = renderer.targets().size;
    let mut needed: Vec<Sum> = options.layers.iter().map(|&l| Sum::of(l)).collect();
    needed.extend(options.layers.iter().filter_map(|l| l.divisor()));
    needed.sort_by_key(|s| s.number);
    needed.dedup();
    let pixels = size[0] as usize * size[1] as usize;
    let mut beauty = vec![0.0; 4 * pixels];
    let mut sums: Vec<(Sum, Vec<f32>)> = needed.iter().map(|&s| (s, vec![0.0; s.channels * pixels])).collect();
    renderer.average(needed.iter().filter(|s| s.filtered).map(|s| s.number));
    let decoder = Decoder::new(&gpu.device, renderer);
    let mut draw = |i: u32, offset: [f32; 2], purpose: Purpose| -> Result<(), RenderError> {
        let seed = options.seed.wrapping_mul(0x9e37_79b9).wrapping_add(i);
        let view = View::new(camera, size, offset).with_seed(seed).with_samples(options.samples);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        renderer.record_frame(&mut Recorder::new(&mut encoder), &gpu.queue, scene, &view, purpose)?;
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    };
    // Backwards, so that the picture's own sample is the one through the pixels' centres.
    for i in (1..=options.warmup).rev() {
        draw(i, sampling::offset(i, options.seed), Purpose::WarmUp { first: i == options.warmup })?;
        if !go_on() {
            return Ok(None);
        }
    }
    for i in 0..options.samples {
        let number = options.number + i;
        let offset = match options.number {
            0 => sampling::offset_of(i, options.samples, options.seed),
            _ => sampling::offset(number, options.seed),
        };
        let new = i == 0 && options.warmup == 0;
        draw(number, offset, if new { Purpose::Picture } else { Purpose::FurtherSample })?;
        decoder.add(gpu, size, 0, &mut beauty, 4)?;
        for (sum, data) in &mut sums {
            if i == 0 || sum.filtered {
                decoder.add(gpu, size, sum.number, data, sum.channels)?;
            }
        }
        if !go_on() {
            return Ok(None);
        }
    }
    let scale = 1.0 / options.samples as f32;
    beauty.iter_mut().for_each(|v| *v *= scale);
    for (_, data) in sums.iter_mut().filter(|(sum, _)| sum.filtered) {
        data.iter_mut().for_each(|v| *v *= scale);
    }
    let find = |wanted: Sum| &sums.iter().find(|(s, _)| *s == wanted).expect("every needed layer was summed").1;
    let picture = |channels, data| Picture { width: size[0] as usize, height: size[1] as usize, channels, data };
    let beauty = checked("the picture", picture(4, beauty))?;
    let mut layers = Vec::with_capacity(options.layers.len());
    for &layer in options.layers {
        let mut data = find(Sum::of(layer)).clone();
        if let Some(divisor) = layer.divisor() {
            for (v, &d) in data.iter_mut().zip(find(divisor)) {
                *v = if d > 0.0 { *v / d } else { 0.0 };
            }
        }
        layers.push((layer, checked(layer.name(), picture(layer.channels().len(), data))?));
    }
    Ok(Some(CapturedFrame { beauty, layers }))
}

fn checked(name: &str, picture: Picture) -> Result<Picture, RenderError> {
    let mut bad =
        picture.data.chunks_exact(picture.channels).enumerate().filter(|(_, p)| !p.iter().all(|v| v.is_finite()));
    let Some((first, _)) = bad.next() else { return Ok(picture) };
    let count = 1 + bad.count();
    let (x, y) = (first % picture.width, first / picture.width);
    Err(RenderError::NotFinite { layer: name.to_string(), count, x, y })
}
