//! Networks on four pictures, fed with our rasteriser's as the paper fed its own with Eevee's: 8
//! bits, through Filmic. `training/bouncelight_training/pix2pix/pairs.py` makes the pictures that
//! such networks learn from in the same way.

use super::{ChartError, published};
use crate::network::{cpu::Tensor, pictures};
use crate::study::session::Frame;
use bouncelight::gpu::{Gpu, readback};
use bouncelight::net::{format::Weights, gpu::Network};
use bouncelight::render::{capture::Layer, tonemap_curve::Tonemap};

/// The four pictures of a view, 8-bit display values as shares of 255.
struct Four {
    size: [u32; 2],
    depth: Vec<f32>,
    direct: Vec<f32>,
    diffuse: Vec<f32>,
    normal: Vec<f32>,
}

impl Four {
    /// Of direct light. `sky`: radiance that comes from everywhere, which Eevee counts as direct,
    /// without occlusion.
    fn new(shot: &Frame, sky: [f32; 3]) -> Self {
        let shown = |linear: Vec<f32>| -> Vec<f32> {
            Tonemap::Filmic.apply_to_bytes(&linear).into_iter().map(|b| f32::from(b) / 255.0).collect()
        };
        let (depth, normal) = (&shot.layer(Layer::Depth).data, &shot.layer(Layer::Normal).data);
        let (diffuse, glossy) = (&shot.layer(Layer::DiffCol).data, &shot.layer(Layer::GlossCol).data);
        let surface = |p: usize| depth[p] < 1e4;
        let of_surfaces = || depth.iter().copied().filter(|z| *z < 1e4);
        let (nearest, farthest) = of_surfaces().fold((f32::MAX, f32::MIN), |(a, b), z| (a.min(z), b.max(z)));
        let stretched = |p: usize| match surface(p) {
            true => (depth[p] - nearest) / (farthest - nearest).max(1e-6),
            false => 1.0,
        };
        let lit = |(i, light): (usize, f32)| match surface(i / 3) {
            true => light + sky[i % 3] * (diffuse[i] + glossy[i]),
            false => light,
        };
        let beauty = &shot.frame.beauty;
        // Z up, as Blender has it; what points the other way is lost, as it was to the authors.
        let clamped = |n: &[f32]| [n[0], -n[2], n[1]].map(|v| v.max(0.0));
        Self {
            size: [beauty.width as u32, beauty.height as u32],
            depth: shown((0..depth.len()).flat_map(|p| [stretched(p); 3]).collect()),
            direct: shown(shot.rgb().into_iter().enumerate().map(lit).collect()),
            diffuse: shown(diffuse.clone()),
            normal: shown(normal.chunks_exact(3).flat_map(clamped).collect()),
        }
    }
}

/// What `weights` make of a view's direct light: display values, and the network that did it.
///
/// # Errors
/// A network for other inputs, or too large for the device.
pub(super) fn picture(
    gpu: &Gpu,
    weights: &Weights,
    shot: &Frame,
    sky: [f32; 3],
) -> Result<(Vec<f32>, Network), ChartError> {
    let four = Four::new(shot, sky);
    let Four { size, depth, direct, diffuse, normal } = &four;
    let input = pictures::input(weights, &pictures::Pictures { size: *size, depth, direct, diffuse, normal })?;
    let network = published::network(gpu, weights, *size)?;
    let place = network.input();
    gpu.queue.write_buffer(place.buffer, place.offset, bytemuck::cast_slice(&input.to_padded()));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    network.record(&mut bouncelight::gpu::timing::Recorder::new(&mut encoder));
    gpu.queue.submit([encoder.finish()]);
    let place = network.output();
    let bytes = readback::buffer(&gpu.device, &gpu.queue, place.buffer, place.offset, place.size)?;
    let shape = network.plan().tensors[network.plan().output].shape;
    let output = Tensor::from_padded(shape, &bytemuck::pod_collect_to_vec::<u8, f32>(&bytes));
    // A saved picture has 8 bits.
    let shown = pictures::picture(&output).into_iter().map(|v| (v * 255.0).round() / 255.0).collect();
    Ok((shown, network))
}
