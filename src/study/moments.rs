//! What a network that filters learns from: what `gather` remembers of a view's cells at several moments of
//! its settling, and the light that they are to show.

use super::error::DatasetError;
use crate::{
    gi::{
        ExposurePass,
        cells::NO_PIXEL,
        gather::PAST,
        inputs::{CELL, InputGroup, cells_of, sample_pixel},
        memory::{CHANNELS, FeaturesPass, PITCH},
    },
    gpu::{Gpu, bind::Bound, readback, timing::Recorder},
    numbers::SplitMix,
    reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions},
    render::{Renderer, View},
    scene::{Camera, upload::SceneGpu},
};
use glam::{Mat4, Quat, Vec3};
use safetensors::{Dtype, tensor::TensorView};

/// When a memory is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum When {
    /// After so many frames of a still camera, the first of which follows a cut.
    Frames(u32),
    /// At the end of [`PAN`] frames of a camera that turns and moves.
    Pan,
}

/// Frames of a pan.
pub const PAN: u32 = 6;

/// Planes that a moment takes: features, memory, light.
pub const PLANES: u64 = CHANNELS as u64 + PAST / 4 + 12;

/// The memory of all cells at one moment; planes of rows.
#[derive(Debug, Clone)]
pub struct Moment {
    /// When it was.
    pub when: When,
    /// What the network is given: [`CHANNELS`] planes.
    pub features: Vec<f32>,
    /// What cells remember: 20 planes, as `Past` lies in memory, the normal and the halves of its fourth
    /// vector as bits.
    pub past: Vec<f32>,
    /// The light that `gather` shows of each cell: three vectors, 12 planes.
    pub shown: Vec<f32>,
}

/// One view.
#[derive(Debug, Clone)]
pub struct Lesson {
    /// Width and height in cells.
    pub cells: [u32; 2],
    /// In the order in which they were asked for.
    pub moments: Vec<Moment>,
    /// Width of a cell at view distance 1 (`cell_foot`), and the eye and the direction of view in the world.
    pub view: [f32; 7],
    /// E/π that a method must add at each cell's pixel, three planes; its noise: root mean square error of a
    /// cell over the mean.
    pub light: Vec<f32>,
    /// See `light`.
    pub noise: f32,
}

/// Draws and traces one view. `renderer`'s method gathers; `seed` decides the pan and the paths.
///
/// # Errors
/// What drawing, tracing and reading back report; `None` where `go_on` said no.
pub fn lesson(
    gpu: &Gpu,
    (renderer, reader): (&mut Renderer, &mut Reader),
    (raster, traced, kernel): (&SceneGpu, &ReferenceScene, &Kernel),
    camera: &Camera,
    (moments, samples, seed): (&[When], u32, u32),
    mut go_on: impl FnMut() -> bool,
) -> Result<Option<Lesson>, DatasetError> {
    let size = renderer.size();
    let mut read = Vec::new();
    let mut pixels = Vec::new();
    renderer.cut();
    let (mut drawn, mut fresh) = (0, true);
    for &when in moments {
        let views: Vec<Camera> = match when {
            When::Frames(frames) => (drawn..frames).map(|_| camera.clone()).collect(),
            When::Pan => {
                renderer.cut();
                pan(camera, seed)
            }
        };
        drawn = match when {
            When::Frames(frames) => frames,
            // What follows a pan would not be still.
            When::Pan => u32::MAX,
        };
        for camera in &views {
            if !go_on() {
                return Ok(None);
            }
            // Nothing but the camera moves: one frame's shadow maps do for all.
            draw(gpu, renderer, raster, camera, fresh)?;
            fresh = false;
        }
        let view = View::new(camera, size, [0.0; 2]);
        let (moment, own) = reader.read(gpu, renderer, &view, raster.environment.radiance, when)?;
        pixels = own;
        read.push(moment);
    }
    let [w, h] = cells_of(size);
    let points: Vec<[f32; 2]> = (0..h)
        .flat_map(|y| (0..w).map(move |x| [x, y]))
        .zip(&pixels)
        .map(|(cell, &packed)| {
            let pixel =
                if packed == NO_PIXEL { sample_pixel(cell, size) } else { [packed & 0xffff, packed >> 16 & 0x7fff] };
            pixel.map(|p| p as f32 + 0.5)
        })
        .collect();
    let subject = Subject { camera, size, points: Some(&points) };
    let options = TracerOptions { samples, seed, layers: vec![Layer::Gi], ..TracerOptions::default() };
    let mut tracer = Tracer::new(&gpu.device, &gpu.queue, kernel, traced, subject, options)?;
    while tracer.step()? {
        if !go_on() {
            return Ok(None);
        }
    }
    let traced = tracer.finish()?;
    let gi = traced.layer(Layer::Gi).unwrap_or_default();
    let place = Mat4::from_cols_array_2d(&camera.transform);
    let (eye, ahead) = (place.w_axis.truncate(), -place.z_axis.truncate().normalize_or(Vec3::Z));
    let foot = 2.0 * (0.5 * camera.yfov).tan() * CELL as f32 / size[1] as f32;
    Ok(Some(Lesson {
        cells: [w, h],
        moments: read,
        view: [foot, eye.x, eye.y, eye.z, ahead.x, ahead.y, ahead.z],
        light: (0..3).flat_map(|c| gi.iter().skip(c).step_by(3).copied()).collect(),
        noise: traced.noise_of(Layer::Gi).map_or(f64::INFINITY, |n| n.pixel) as f32,
    }))
}

/// The cameras of a pan that ends at `camera`: 0.2 to 2 degrees a frame about its vertical, up to 0.3 about its
/// horizontal, and up to 0.04 metres of way, a frame.
fn pan(camera: &Camera, seed: u32) -> Vec<Camera> {
    let mut numbers = SplitMix::new(0x9a70_0000_0000 | u64::from(seed));
    let mut between = |low: f32, high: f32| low + (high - low) * numbers.next();
    let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
    let turn = side * between(0.2, 2.0).to_radians();
    let nod = between(-0.3, 0.3).to_radians();
    let step = Vec3::new(between(-0.02, 0.02), between(-0.01, 0.01), between(-0.03, 0.03));
    let own = Mat4::from_cols_array_2d(&camera.transform);
    (0..PAN)
        .rev()
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
    shadows: bool,
) -> Result<(), DatasetError> {
    let view = View::new(camera, renderer.size(), [0.0; 2]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.record_frame(&mut Recorder::new(&mut encoder), &gpu.queue, scene, &view, shadows)?;
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
        let (exposure, features) = (ExposurePass::new(device, &inputs), FeaturesPass::new(device, &inputs));
        Self { inputs, exposure, features }
    }

    /// The memory of the last frame, and the pixel of each cell.
    fn read(
        &mut self,
        gpu: &Gpu,
        renderer: &Renderer,
        view: &View,
        environment: [f32; 3],
        when: When,
    ) -> Result<(Moment, Vec<u32>), DatasetError> {
        let (device, queue) = (&gpu.device, &gpu.queue);
        let Some(memory) = renderer.memory() else { return Err(crate::gi::GiError::Rays.into()) };
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
        self.features.record(&mut recorder, &bound, (memory.pasts, &self.exposure), Bound::from(&target));
        queue.submit([encoder.finish()]);
        let planes = |buffer: &wgpu::Buffer, pitch: usize, channels: usize| -> Result<Vec<f32>, DatasetError> {
            let raw = readback::buffer(device, queue, buffer, 0, count * 4 * pitch as u64)?;
            let rows: Vec<f32> = bytemuck::pod_collect_to_vec(&raw);
            Ok((0..channels).flat_map(|c| rows.iter().skip(c).step_by(pitch).copied()).collect())
        };
        let past = PAST as usize / 4;
        let moment = Moment {
            when,
            features: planes(&target, PITCH as usize, CHANNELS as usize)?,
            past: planes(memory.pasts, past, past)?,
            shown: planes(memory.light, 12, 12)?,
        };
        let pixels = bytemuck::pod_collect_to_vec(&readback::buffer(device, queue, memory.pixels, 0, 4 * count)?);
        Ok((moment, pixels))
    }
}

impl When {
    /// `3` or `pan`: part of tensors' names.
    pub fn name(&self) -> String {
        match self {
            When::Frames(frames) => frames.to_string(),
            When::Pan => "pan".into(),
        }
    }
}

impl Lesson {
    /// The lesson as a safetensors file, all f32: `features.WHEN` [15, h, w], `past.WHEN` [20, h, w],
    /// `shown.WHEN` [12, h, w] of each moment (WHEN: frames, or `pan`); `light` [3, h, w], `noise` (one
    /// number), `view` (seven).
    ///
    /// # Errors
    /// [`DatasetError::Serialize`].
    pub fn to_bytes(&self) -> Result<Vec<u8>, DatasetError> {
        let [w, h] = self.cells.map(|n| n as usize);
        let mut tensors: Vec<(String, Vec<usize>, &[f32])> = vec![
            ("light".into(), vec![3, h, w], &self.light),
            ("noise".into(), vec![1], std::slice::from_ref(&self.noise)),
            ("view".into(), vec![7], &self.view),
        ];
        for moment in &self.moments {
            let name = moment.when.name();
            for (what, values) in [("features", &moment.features), ("past", &moment.past), ("shown", &moment.shown)] {
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
