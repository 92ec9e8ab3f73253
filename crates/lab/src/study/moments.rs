//! What a network that filters learns from: what `gather` remembers of a view's cells at several
//! moments of its settling, and the light that they are to show: what such rays find in the end.
//!
//! The light is `gather`'s own ([`Options::PLAIN`](bouncelight::gi::gather::Options::PLAIN): nothing
//! blurred, all frames alike) and not the path tracer's. A filter can take away noise and nothing
//! else, so what `gather` is wrong about in the mean must not be learnt from the scenes that happen
//! to be shown; and a ray that ends in the cache has a tenth of the noise of a path.

use super::changes::Change;
pub use super::error::DatasetError;
use bouncelight::accel::luminance;
use bouncelight::gi::{
    ExposurePass,
    gather::HISTORY,
    inputs::{CELL, InputGroup, cells_of},
    memory::{CHANNELS, FeaturesPass, PITCH},
};
use bouncelight::gpu::{Gpu, bind::Bound, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::plan::Precision;
use bouncelight::numbers::SplitMix;
use bouncelight::render::{Purpose, Renderer, View};
use bouncelight::scene::{Camera, Scene};
use glam::{Mat4, Quat, Vec3};
use safetensors::{Dtype, tensor::TensorView};

/// When a memory is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum When {
    /// After so many frames of a still camera, the first of which follows a cut.
    Frames(u32),
    /// At the end of [`PAN`] frames of a camera that turns and moves, which count as frames since
    /// the cut. Before a pan that comes first the camera stands still for four.
    Pan,
    /// After six frames in which a lamp (the sky, where there is none) came to what it is in the
    /// scene, and eight in which it was what it came from. Left out where nothing shines but
    /// surfaces.
    Lamp,
    /// The same of a thing, which moves through the picture to where it stands. Left out where none
    /// is in view.
    Thing,
}

/// Frames of a pan, and of rest before one that comes first: by then the blur is narrow, and what
/// comes into view is younger than the rest.
pub const PAN: u32 = 6;
const STILL: u32 = 4;
/// Frames of a change, and of rest before it.
const CHANGE: u32 = 6;
const BEFORE: u32 = 8;

/// Frames since the cut at each of these moments, which one run of frames passes in this order:
/// 1, 8, pan, 20 are 1, 8, 14, 20. `None` where a moment lies no later than the one before it.
pub fn ages(moments: &[When]) -> Option<Vec<u32>> {
    let mut drawn = 0;
    let age = |when: &When| {
        let age = match *when {
            When::Frames(frames) => frames,
            When::Pan => drawn.max(STILL) + PAN,
            When::Lamp | When::Thing => drawn + BEFORE + CHANGE,
        };
        let later = age > drawn;
        drawn = age;
        later.then_some(age)
    };
    moments.iter().map(age).collect()
}

/// Planes that a moment takes: features, memory, light, changes.
pub const PLANES: u64 = CHANNELS as u64 + HISTORY / 4 + 13;

/// The memory of all cells at one moment; planes of rows.
#[derive(Debug, Clone)]
pub struct Moment {
    /// When it was.
    pub when: When,
    /// Frames since the cut before it.
    pub age: u32,
    /// What the network is given: [`CHANNELS`] planes.
    pub features: Vec<f32>,
    /// Histories of cells: 20 planes, as `History` lies in memory, the normal and the halves of its
    /// fourth vector as bits.
    pub past: Vec<f32>,
    /// The light that `gather` shows of each cell: three vectors, 12 planes.
    pub shown: Vec<f32>,
    /// One plane: 1 where light has changed, so that the filter shows that of lately, else 0.
    pub changed: Vec<f32>,
}

/// One view.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Width and height in cells.
    pub cells: [u32; 2],
    /// In the order in which they were asked for.
    pub moments: Vec<Moment>,
    /// Width of a cell at view distance 1 (`cell_foot`), and the eye and the direction of view in
    /// the world.
    pub view: [f32; 7],
    /// E/π on each cell's surface, three planes; its noise: root mean square error of a cell over
    /// the mean.
    pub light: Vec<f32>,
    /// See `light`.
    pub noise: f32,
    /// Where that is in the world, three planes, and its normal's bits, as in [`Moment::past`].
    pub place: Vec<f32>,
}

/// Draws one view. `renderer`'s method gathers, and so does `teacher`'s, plainly, for `frames`
/// frames; `seed` decides the pan and what changes, `moments` are in order ([`ages`]). `raster` is
/// made of `scene` and shows it at the end.
///
/// # Errors
/// What drawing and reading back report; `None` where `go_on` said no.
pub fn sample(
    gpu: &Gpu,
    (renderer, teacher, reader): (&mut Renderer, &mut Renderer, &mut Reader),
    (scene, raster): (&Scene, &mut SceneGpu),
    camera: &Camera,
    (moments, frames, seed): (&[When], u32, u32),
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Sample>, DatasetError> {
    let size = renderer.size();
    let mut read = Vec::new();
    renderer.reset_history();
    let (mut drawn, mut first) = (0, true);
    let ages = ages(moments).unwrap_or_default();
    for (&when, age) in moments.iter().zip(ages) {
        let aspect = size[0] as f32 / size[1] as f32;
        let change = match when {
            When::Frames(_) | When::Pan => None,
            When::Lamp => Change::of_lamp(scene, camera, seed),
            When::Thing => Change::of_thing(scene, camera, aspect, seed),
        };
        if matches!(when, When::Lamp | When::Thing) && change.is_none() {
            continue;
        }
        let frames = age - drawn;
        let views: Vec<Camera> = match when {
            When::Pan => pan(camera, seed, frames),
            _ => vec![camera.clone(); frames as usize],
        };
        drawn = age;
        for (i, camera) in (1..).zip(&views) {
            if !go_on() {
                return Ok(None);
            }
            // Taken over where it is another than before only: a sky counts as changed by that.
            let left = (frames - i).min(CHANGE);
            if let Some(change) = change.as_ref().filter(|_| i == 1 || left < CHANGE) {
                change.upload(gpu, raster, scene, left as f32 / CHANGE as f32)?;
            }
            // What the filter shows is read at the moment itself only. Where nothing but the camera
            // moves one frame's shadow maps do for all.
            let new = first || change.is_some();
            let purpose = match i == frames {
                false => Purpose::WarmUp { first: new },
                true if new => Purpose::Picture,
                true => Purpose::FurtherSample,
            };
            draw(gpu, renderer, raster, camera, purpose)?;
            // After a change things rest, which motion vectors have to learn.
            first = change.is_some();
        }
        let view = View::new(camera, size, [0.0; 2]);
        read.push(reader.read(gpu, renderer, &view, raster.environment.radiance, (when, age))?);
    }
    teacher.reset_history();
    for frame in 0..frames {
        if !go_on() {
            return Ok(None);
        }
        draw(gpu, teacher, raster, camera, Purpose::WarmUp { first: frame == 0 })?;
    }
    let view = View::new(camera, size, [0.0; 2]);
    let taught = reader.read(gpu, teacher, &view, raster.environment.radiance, (When::Frames(frames), frames))?.past;
    let cells = cells_of(size);
    let count = cells[0] as usize * cells[1] as usize;
    let place = Mat4::from_cols_array_2d(&camera.transform);
    let (eye, ahead) = (place.w_axis.truncate(), -place.z_axis.truncate().normalize_or(Vec3::Z));
    let foot = 2.0 * (0.5 * camera.yfov).tan() * CELL as f32 / size[1] as f32;
    Ok(Some(Sample {
        cells,
        moments: read,
        view: [foot, eye.x, eye.y, eye.z, ahead.x, ahead.y, ahead.z],
        noise: noise_of(&taught, count),
        light: taught[..3 * count].to_vec(),
        place: taught[8 * count..12 * count].to_vec(),
    }))
}

/// Root mean square error of a cell's luminance over the mean, of planes of what `count` cells
/// remember.
fn noise_of(past: &[f32], count: usize) -> f32 {
    let plane = |i: usize| &past[i * count..(i + 1) * count];
    let (mut error, mut sum, mut cells) = (0.0, 0.0, 0.0);
    for i in (0..count).filter(|&i| plane(3)[i] > 0.0) {
        let l = luminance(Vec3::new(plane(0)[i], plane(1)[i], plane(2)[i]));
        error += f64::from((plane(7)[i] - l * l).max(0.0) / plane(3)[i]);
        sum += f64::from(l);
        cells += 1.0;
    }
    if sum > 0.0 { ((error / cells).sqrt() / (sum / cells)) as f32 } else { f32::INFINITY }
}

/// The cameras of a pan that ends at `camera`, so many `frames` with those of the rest before it:
/// 0.2 to 2 degrees a frame about its vertical, up to 0.3 about its horizontal, and up to 0.04
/// metres of way, a frame.
fn pan(camera: &Camera, seed: u32, frames: u32) -> Vec<Camera> {
    let mut numbers = SplitMix::new(0x9a70_0000_0000 | u64::from(seed));
    let mut between = |low: f32, high: f32| low + (high - low) * numbers.next();
    let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
    let turn = side * between(0.2, 2.0).to_radians();
    let nod = between(-0.3, 0.3).to_radians();
    let step = Vec3::new(between(-0.02, 0.02), between(-0.01, 0.01), between(-0.03, 0.03));
    let own = Mat4::from_cols_array_2d(&camera.transform);
    (0..frames)
        .rev()
        .map(|before| before.min(PAN))
        .map(|before| {
            let before = before as f32;
            let about = Quat::from_rotation_y(before * turn) * Quat::from_rotation_x(before * nod);
            let transform = own * Mat4::from_rotation_translation(about, before * step);
            Camera { transform: transform.to_cols_array_2d(), ..camera.clone() }
        })
        .collect()
}

fn draw(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &SceneGpu,
    camera: &Camera,
    purpose: Purpose,
) -> Result<(), DatasetError> {
    let view = View::new(camera, renderer.size(), [0.0; 2]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.record_frame(&mut Recorder::new(&mut encoder), &gpu.queue, scene, &view, purpose)?;
    gpu.queue.submit([encoder.finish()]);
    Ok(())
}

/// Reads what cells remember.
pub struct Reader {
    inputs: InputGroup,
    exposure: ExposurePass,
    features: FeaturesPass,
}

impl Reader {
    /// Compiles the shaders.
    pub fn new(device: &wgpu::Device) -> Self {
        let inputs = InputGroup::new(device);
        let (exposure, features) =
            (ExposurePass::new(device, &inputs), FeaturesPass::new(device, &inputs, Precision::F32));
        Self { inputs, exposure, features }
    }

    /// The memory of the last frame.
    fn read(
        &mut self,
        gpu: &Gpu,
        renderer: &Renderer,
        view: &View,
        environment: [f32; 3],
        (when, age): (When, u32),
    ) -> Result<Moment, DatasetError> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let Some(memory) = renderer.memory() else { return Err(bouncelight::gi::GiError::Rays.into()) };
        let bound = self.inputs.bind(queue, &renderer.gi_inputs(view, environment))?;
        let count = u64::from(bound.cells[0]) * u64::from(bound.cells[1]);
        let target = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.features"),
            size: count * 4 * u64::from(PITCH),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(&mut encoder);
        self.exposure.record(&mut recorder, &bound);
        self.features.record(&mut recorder, &bound, (memory.histories, &self.exposure), Bound::from(&target));
        queue.submit([encoder.finish()]);
        let planes = |buffer: &wgpu::Buffer, pitch: usize, channels: usize| -> Result<Vec<f32>, DatasetError> {
            let raw = readback::buffer(device, queue, buffer, 0, count * 4 * pitch as u64)?;
            let rows: Vec<f32> = bytemuck::pod_collect_to_vec(&raw);
            Ok((0..channels).flat_map(|c| rows.iter().skip(c).step_by(pitch).copied()).collect())
        };
        let past = HISTORY as usize / 4;
        Ok(Moment {
            when,
            age,
            features: planes(&target, PITCH as usize, CHANNELS as usize)?,
            past: planes(memory.histories, past, past)?,
            shown: planes(memory.light, 12, 12)?,
            changed: planes(memory.changes, 4, 4)?.split_off(3 * count as usize),
        })
    }
}

impl When {
    /// `3`, `pan`, `lamp` or `thing`: part of tensors' names.
    pub fn name(&self) -> String {
        match self {
            When::Frames(frames) => frames.to_string(),
            When::Pan => "pan".into(),
            When::Lamp => "lamp".into(),
            When::Thing => "thing".into(),
        }
    }
}

impl Sample {
    /// The sample as a safetensors file, all f32: `features.WHEN` [15, h, w], `past.WHEN` [20, h,
    /// w], `shown.WHEN` [12, h, w], `changed.WHEN` [1, h, w], `age.WHEN` (one number) of each moment (WHEN: frames,
    /// `pan`, `lamp` or `thing`); `light` [3, h, w], `noise` (one number), `place` [4, h, w], `view` (seven).
    ///
    /// # Errors
    /// [`DatasetError::Serialize`].
    pub fn to_bytes(&self) -> Result<Vec<u8>, DatasetError> {
        let [w, h] = self.cells.map(|n| n as usize);
        let mut tensors: Vec<(String, Vec<usize>, &[f32])> = vec![
            ("light".into(), vec![3, h, w], &self.light),
            ("noise".into(), vec![1], std::slice::from_ref(&self.noise)),
            ("place".into(), vec![4, h, w], &self.place),
            ("view".into(), vec![7], &self.view),
        ];
        let ages: Vec<f32> = self.moments.iter().map(|m| m.age as f32).collect();
        for (moment, age) in self.moments.iter().zip(&ages) {
            let name = moment.when.name();
            tensors.push((format!("age.{name}"), vec![1], std::slice::from_ref(age)));
            let Moment { features, past, shown, changed, .. } = moment;
            for (what, values) in [("features", features), ("past", past), ("shown", shown), ("changed", changed)] {
                tensors.push((format!("{what}.{name}"), vec![values.len() / (w * h), h, w], values));
            }
        }
        let failed = |e: safetensors::SafeTensorError| DatasetError::Serialize(e.to_string());
        let views = tensors
            .iter()
            .map(|(name, shape, values)| {
                TensorView::new(Dtype::F32, shape.clone(), bytemuck::cast_slice(values))
                    .map(|view| (name.as_str(), view))
            })
            .collect::<Result<Vec<_>, _>>()
            .map_err(failed)?;
        safetensors::serialize(views, None).map_err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::{When::*, ages};

    #[test]
    fn moments_pass_in_order() {
        assert_eq!(ages(&[Frames(1), Frames(2), Pan, Frames(20)]), Some(vec![1, 2, 10, 20]));
        assert_eq!(ages(&[Pan]), Some(vec![10]));
        assert_eq!(ages(&[Frames(8), Pan]), Some(vec![8, 14]));
        assert_eq!(ages(&[Lamp, Frames(20), Thing]), Some(vec![14, 20, 34]));
        for late in [&[Frames(4), Frames(4)][..], &[Frames(8), Frames(2)], &[Frames(8), Pan, Frames(14)]] {
            assert_eq!(ages(late), None);
        }
    }
}
