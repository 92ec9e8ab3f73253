//! Networks on four pictures, fed with our rasteriser's as the paper fed its own with Eevee's: 8
//! bits, through Filmic. `training/bouncelight_training/pix2pix/pairs.py` makes the pictures that
//! such networks learn from in the same way.

use super::{
    judge::{NOTHING, shown},
    session::Frame,
};
use crate::network::pictures::{self, PicturesError};
use bouncelight::gpu::{Gpu, readback::ReadbackError, timing::Recorder};
use bouncelight::net::{format::Weights, gpu::Network};
use bouncelight::render::capture::Layer;

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
        let (depth, normal) = (&shot.layer(Layer::Depth).data, &shot.layer(Layer::Normal).data);
        let (diffuse, glossy) = (&shot.layer(Layer::DiffCol).data, &shot.layer(Layer::GlossCol).data);
        let surface = |p: usize| depth[p] < NOTHING;
        let of_surfaces = depth.iter().copied().filter(|z| *z < NOTHING);
        let (nearest, farthest) = of_surfaces.fold((f32::MAX, f32::MIN), |(a, b), z| (a.min(z), b.max(z)));
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
            depth: shown(&(0..depth.len()).flat_map(|p| [stretched(p); 3]).collect::<Vec<_>>()),
            direct: shown(&shot.rgb().into_iter().enumerate().map(lit).collect::<Vec<_>>()),
            diffuse: shown(diffuse),
            normal: shown(&normal.chunks_exact(3).flat_map(clamped).collect::<Vec<_>>()),
        }
    }
}

/// What `network`, which is that of `weights`, makes of a view's direct light: display values. `sky`: as
/// [`Four::new`] takes it.
///
/// # Errors
/// A network for other inputs; a result that cannot be read back.
pub(super) fn picture<E: From<PicturesError> + From<ReadbackError>>(
    gpu: &Gpu,
    (weights, network): (&Weights, &Network),
    shot: &Frame,
    sky: [f32; 3],
) -> Result<Vec<f32>, E> {
    let Four { size, depth, direct, diffuse, normal } = &Four::new(shot, sky);
    let input = pictures::input(weights, &pictures::Pictures { size: *size, depth, direct, diffuse, normal })?;
    pictures::upload(gpu, network, &input);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    network.record(&mut Recorder::new(&mut encoder));
    gpu.queue.submit([encoder.finish()]);
    Ok(pictures::picture(&pictures::download(gpu, network)?))
}
