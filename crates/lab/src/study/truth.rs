//! What methods are judged by: a path-traced picture with its layers and its stated noise, kept in
//! a folder once it is traced.

use super::{error::SessionError, hash};
use crate::reference::{Kernel, Layer, Noise, ReferenceScene, Subject, Tracer, TracerOptions};
use bouncelight::gpu::{Gpu, shaders};
use bouncelight::scene::Camera;
use bouncelight_scene::image_io;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize};
use std::{collections::HashMap, path::Path};

/// Layers that every reference has.
pub const LAYERS: [Layer; 7] =
    [Layer::Combined, Layer::DiffDir, Layer::DiffInd, Layer::DiffCol, Layer::Gi, Layer::Normal, Layer::Depth];

/// A path-traced picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// Pixels.
    pub size: [u32; 2],
    /// Those of [`LAYERS`]: rows from the top, channels interleaved.
    pub layers: Vec<(Layer, Vec<f32>)>,
    /// Noise of [`JUDGED`](crate::reference::JUDGED): Combined, DiffInd, Gi; from two halves of the
    /// samples.
    pub noise: [Noise; 3],
    /// Samples of the pixel that has fewest and of the one that has most.
    pub samples: [u32; 2],
    /// Seconds that the GPU took.
    pub seconds: f64,
    /// It was traced earlier and read from its folder; `seconds` are those of then.
    pub kept: bool,
}

impl Reference {
    /// The layer, one of [`LAYERS`].
    ///
    /// # Panics
    /// For another layer.
    pub fn layer(&self, layer: Layer) -> &[f32] {
        let found = self.layers.iter().find(|(l, _)| *l == layer);
        &found.unwrap_or_else(|| panic!("a reference has no layer {}", layer.name())).1
    }

    /// The picture as linear red, green and blue.
    pub fn rgb(&self) -> Vec<f32> {
        self.layer(Layer::Combined).chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// Root mean square error of a pixel of the light that a method has to add ([`Layer::Gi`]),
    /// divided by its mean.
    pub fn light_noise(&self) -> f64 {
        self.noise[2].pixel
    }
}

/// As many samples a pixel as said, without limit of bounces or brightness.
pub fn samples(count: u32, seed: u32) -> TracerOptions {
    TracerOptions { samples: count, seed, ..TracerOptions::default() }
}

/// Samples until the root mean square error of a pixel of `layer` (one of
/// [`JUDGED`](crate::reference::JUDGED)), divided by its mean, is surely not above `error`, and at
/// most `most` of them.
pub fn until(layer: Layer, error: f64, most: u32, seed: u32) -> TracerOptions {
    TracerOptions { until_error: Some((layer, error)), ..samples(most, seed) }
}

/// Traces the picture. `go_on` hears the share that is done and asked whether to go on.
///
/// # Errors
/// What the tracer reports; [`SessionError::Stopped`].
pub(super) fn trace(
    gpu: &Gpu,
    kernel: &Kernel,
    scene: &ReferenceScene,
    (camera, size): (&Camera, [u32; 2]),
    options: &TracerOptions,
    go_on: &dyn Fn(f64) -> bool,
) -> Result<Reference, SessionError> {
    let subject = Subject { camera, size, points: None };
    let mut options = TracerOptions { layers: LAYERS.to_vec(), ..options.clone() };
    if gpu.is_software() {
        // No watchdog there, and other programs may want the cores, too.
        options.dispatch *= 4;
    }
    let tracer = Tracer::new(&gpu.device, &gpu.queue, kernel, scene, subject, options)?;
    let traced = tracer.run(|t| go_on(t.progress()))?.ok_or(SessionError::Stopped)?;
    let (noise, samples, seconds) = (traced.noise, traced.samples, traced.seconds);
    Ok(Reference { size, layers: traced.layers, noise, samples, seconds, kept: false })
}

/// Name of the file that holds the picture: everything that decides what is in it, the tracer's own
/// shaders included.
pub(super) fn file_name(scene: &str, camera: &Camera, size: [u32; 2], options: &TracerOptions) -> String {
    let TracerOptions {
        samples,
        until_error,
        seed,
        bounces,
        diffuse_bounces,
        glossy_bounces,
        clamp,
        filter_glossy,
        filter_width,
        flags,
        layers: _,
        dispatch: _,
        band: _,
    } = options;
    let limits = (bounces, diffuse_bounces, glossy_bounces, clamp, filter_glossy, filter_width, flags);
    let program = ["reference.path", "reference.first_hit"].map(|name| shaders::source(name, ""));
    let rest = hash::of_text(&(hash::of_camera(camera), samples, until_error, seed, limits, program));
    format!("{scene}-{}x{}-{rest}.safetensors", size[0], size[1])
}

/// Numbers beside the layers.
#[derive(Serialize, Deserialize)]
struct Facts {
    schema: u32,
    size: [u32; 2],
    /// Mean, pixel, pixel_at_most, picture of each of `JUDGED`; what is unknown is absent.
    noise: [[Option<f64>; 4]; 3],
    samples: [u32; 2],
    seconds: f64,
    device: String,
}

/// Keeps a picture.
pub(super) fn keep(path: &Path, reference: &Reference, device: &str) -> Result<(), SessionError> {
    let number = |v: f64| v.is_finite().then_some(v);
    let facts = Facts {
        schema: 1,
        size: reference.size,
        noise: reference.noise.map(|n| [n.mean, n.pixel, n.pixel_at_most, n.picture].map(number)),
        samples: reference.samples,
        seconds: reference.seconds,
        device: device.into(),
    };
    let broken = |e: &dyn std::fmt::Display| SessionError::Kept { path: path.into(), reason: e.to_string() };
    let words = HashMap::from([("facts".to_owned(), serde_json::to_string(&facts).map_err(|e| broken(&e))?)]);
    let [width, height] = reference.size.map(|n| n as usize);
    let views = reference.layers.iter().map(|(layer, data)| {
        let shape = vec![height, width, layer.channels().len()];
        Ok((layer.name(), TensorView::new(Dtype::F32, shape, bytemuck::cast_slice(data)).map_err(|e| broken(&e))?))
    });
    let views = views.collect::<Result<Vec<_>, SessionError>>()?;
    let bytes = safetensors::serialize(views, Some(words)).map_err(|e| broken(&e))?;
    Ok(image_io::write_whole(path, &bytes)?)
}

/// The picture that [`keep`] kept; `None` where there is none, or none that can be read: it is then
/// traced again.
pub(super) fn kept(path: &Path) -> Option<Reference> {
    let bytes = std::fs::read(path).ok()?;
    let (_, words) = SafeTensors::read_metadata(&bytes).ok()?;
    let facts: Facts = serde_json::from_str(words.metadata().as_ref()?.get("facts")?).ok()?;
    let file = SafeTensors::deserialize(&bytes).ok()?;
    let pixels = facts.size[0] as usize * facts.size[1] as usize;
    let layer = |layer: Layer| {
        let tensor = file.tensor(layer.name()).ok().filter(|t| t.dtype() == Dtype::F32)?;
        let data: Vec<f32> = bytemuck::pod_collect_to_vec(tensor.data());
        (data.len() == pixels * layer.channels().len()).then_some((layer, data))
    };
    let noise = facts.noise.map(|n| {
        let [mean, pixel, pixel_at_most, picture] = n.map(|v| v.unwrap_or(f64::INFINITY));
        Noise { mean, pixel, pixel_at_most, picture }
    });
    let layers = LAYERS.into_iter().map(layer).collect::<Option<_>>()?;
    let (size, samples, seconds) = (facts.size, facts.samples, facts.seconds);
    (facts.schema == 1).then_some(Reference { size, layers, noise, samples, seconds, kept: true })
}
