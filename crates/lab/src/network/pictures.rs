//! Networks on pictures from elsewhere: from display values to the input tensor, and back from
//! the output.

use super::cpu::Tensor;
use bouncelight::gpu::{
    Gpu,
    readback::{self, ReadbackError},
};
use bouncelight::net::{format::Weights, gpu::Network, graph::Shape};
use thiserror::Error;

/// Pictures of one size, display values in [0, 1], RGB interleaved, rows from the top.
#[derive(Debug, Clone, Copy)]
pub struct Pictures<'a> {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Depth, as a grey picture.
    pub depth: &'a [f32],
    /// Direct light.
    pub direct: &'a [f32],
    /// Albedo.
    pub diffuse: &'a [f32],
    /// Normals.
    pub normal: &'a [f32],
    /// Direct light and that of method `gather`, for networks that want it.
    pub gathered: Option<&'a [f32]>,
}

/// Why a network cannot run on pictures.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PicturesError {
    /// The network wants other inputs.
    #[error("the weights want {wanted}, which cannot be made from pictures: {why}")]
    Inputs {
        /// What they want.
        wanted: String,
        /// Why it cannot be made.
        why: &'static str,
    },
    /// The network gives no picture.
    #[error("the weights' output is `{meaning}` with {channels} channels, not a picture (`display_signed` with 3)")]
    Output {
        /// Its meaning.
        meaning: String,
        /// Its channels.
        channels: u32,
    },
    /// The network wants a picture that is not there.
    #[error("the weights want the picture `gathered`: direct light and that of method `gather`")]
    Gathered,
    /// A picture has another number of values than `size` says.
    #[error("picture `{name}` has {values} values, {wanted} are needed")]
    Length {
        /// Which one.
        name: &'static str,
        /// Values it has.
        values: usize,
        /// Values needed.
        wanted: usize,
    },
}

/// Whether `weights` take pictures and give one.
///
/// # Errors
/// [`PicturesError::Inputs`], [`PicturesError::Output`].
pub fn check(weights: &Weights) -> Result<(), PicturesError> {
    let inputs = |why| {
        let names: Vec<&str> = weights.inputs.iter().map(|f| f.name.as_str()).collect();
        let wanted = format!("the features {} of table `{}`", names.join(", "), weights.table.name);
        Err(PicturesError::Inputs { wanted, why })
    };
    match weights.table.name.as_str() {
        "images" if weights.cell == 1 => {}
        "images" => return inputs("they are cells of several pixels, and which pixel stands for a cell is not said"),
        "cells" => return inputs("they are what `gather` remembers of cells; use `render`"),
        _ => return inputs("nothing says what they are"),
    }
    let (meaning, channels) = (weights.output.meaning.clone(), weights.output.channels);
    if meaning != "display_signed" || channels != 3 {
        return Err(PicturesError::Output { meaning, channels });
    }
    Ok(())
}

/// The network's input for `pictures`, features in the order and encoding that the weights say.
///
/// # Errors
/// As [`check`]; [`PicturesError::Gathered`], [`PicturesError::Length`].
pub fn input(weights: &Weights, pictures: &Pictures<'_>) -> Result<Tensor, PicturesError> {
    check(weights)?;
    let [width, height] = pictures.size;
    let pixels = width as usize * height as usize;
    let mut data = Vec::with_capacity(pixels * weights.graph.input_channels as usize);
    for feature in &weights.inputs {
        // `check` and the reader have seen the table's names.
        let (name, values) = match feature.name.as_str() {
            "depth" => ("depth", pictures.depth),
            "direct" => ("direct", pictures.direct),
            "diffuse" => ("diffuse", pictures.diffuse),
            "gathered" => ("gathered", pictures.gathered.ok_or(PicturesError::Gathered)?),
            _ => ("normal", pictures.normal),
        };
        if values.len() != 3 * pixels {
            return Err(PicturesError::Length { name, values: values.len(), wanted: 3 * pixels });
        }
        let [scale, offset] = encoding(&feature.encoding, values);
        data.extend((0..3).flat_map(|c| values[c..].iter().step_by(3).map(move |v| v * scale + offset)));
    }
    let shape = Shape { channels: weights.graph.input_channels, height, width };
    Ok(Tensor { shape, data })
}

/// Scale and offset of an encoding, see [`bouncelight::net::format::IMAGES_V1`].
fn encoding(name: &str, values: &[f32]) -> [f32; 2] {
    match name {
        "signed" => [2.0, -1.0],
        "signed_stretched" => {
            let (min, max) = values.iter().fold((f32::MAX, f32::MIN), |(min, max), v| (min.min(*v), max.max(*v)));
            if max > min { [2.0 / (max - min), -1.0 - 2.0 * min / (max - min)] } else { [0.0, -1.0] }
        }
        _ => [1.0, 0.0],
    }
}

/// Writes `input` where `network` reads it.
pub fn upload(gpu: &Gpu, network: &Network, input: &Tensor) {
    let place = network.input();
    gpu.queue.write_buffer(place.buffer, place.offset, bytemuck::cast_slice(&input.to_padded()));
}

/// What the steps of `network` that were submitted have made.
///
/// # Errors
/// [`ReadbackError`].
pub fn download(gpu: &Gpu, network: &Network) -> Result<Tensor, ReadbackError> {
    let (place, plan) = (network.output(), network.plan());
    let bytes = readback::buffer(&gpu.device, &gpu.queue, place.buffer, place.offset, place.size)?;
    Ok(Tensor::from_padded(plan.tensors[plan.output].shape, &bytemuck::pod_collect_to_vec::<u8, f32>(&bytes)))
}

/// The picture that `output` of meaning `display_signed` holds: (y + 1) / 2 in [0, 1], RGB
/// interleaved.
pub fn picture(output: &Tensor) -> Vec<f32> {
    let pixels = output.shape.pixels() as usize;
    let shown = |p: usize| (0..3).map(move |c| ((output.data[c * pixels + p] + 1.0) / 2.0).clamp(0.0, 1.0));
    (0..pixels).flat_map(shown).collect()
}
