//! One camera's picture, lit by a method.

use super::check::{Complaint, Evidence};
use super::{World, sample};
use crate::gi::interface::technique::{Fallback, Technique};
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::method::{self, Method};
use crate::gi::stage::inputs::Params;
use crate::gpu::pipeline_cache::PipelineCache;
use crate::gpu::timing::Recorder;

/// A method's passes and history for one camera's picture. Make one for each camera; any number may
/// share a [`World`], a device and a submission.
///
/// ```no_run
/// use bouncelight::gi::{GiError, Inputs, View, World};
/// use bouncelight::wgpu;
///
/// /// One submission for two cameras; in debug builds mistakes are named.
/// fn both(
///     (device, queue): (&wgpu::Device, &wgpu::Queue),
///     (world, views): (&World, &mut [View; 2]),
///     (inputs, outputs): ([&Inputs<'_>; 2], [&wgpu::TextureView; 2]),
/// ) -> Result<(), GiError> {
///     let mut encoder = device.create_command_encoder(&Default::default());
///     for ((view, inputs), output) in views.iter_mut().zip(inputs).zip(outputs) {
///         view.record(&mut encoder, world, inputs, output)?;
///     }
///     queue.submit([encoder.finish()]);
///     if cfg!(debug_assertions) {
///         views[0].check(device, world, inputs[0])?.iter().for_each(|c| eprintln!("{c}"));
///     }
///     Ok(())
/// }
/// ```
pub struct View {
    queue: wgpu::Queue,
    technique: Box<dyn Technique>,
    size: [u32; 2],
    /// The last frame's camera, and that of the frame before if the last one followed it.
    seen: [Option<Params>; 2],
    _pipeline_cache: PipelineCache,
}

impl View {
    /// Features that would be used where the adapter has them: timestamps, by hosts that time
    /// passes, and what some of the network's kernels use. None is needed.
    pub fn optional_features(adapter: &wgpu::Adapter) -> wgpu::Features {
        adapter.features() & crate::gpu::wanted_features()
    }

    /// Limits that the device must have: WebGPU's defaults.
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// Compiles those of `method`'s pipelines that neither another view nor a [`World`] of this
    /// device has, and makes its buffers for pictures of `size` pixels. Keeps clones of device and
    /// queue (handles).
    ///
    /// # Errors
    /// [`GiError::NoMethod`] for [`Method::Direct`], which adds no light; [`GiError`] where a
    /// network does not fit.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, size: [u32; 2], method: &Method) -> Result<Self, GiError> {
        let _pipeline_cache = PipelineCache::of(device);
        let technique = method::build(device, queue, size, method)?.ok_or(GiError::NoMethod(method.name()))?;
        Ok(Self { queue: queue.clone(), technique, size, seen: [None; 2], _pipeline_cache })
    }

    /// Records all of the method's passes. `outputs`: one view for the diffuse light, or [`Outputs`].
    /// Lights, sky and rays are those of `world`, whatever `inputs` say. Allocates only when the
    /// size or the texture views are new. Never submits and never waits.
    ///
    /// With `None` for the world `gather` and `neural` have nothing to ask: `ssgi` draws,
    /// [`View::fallback`] says so, and albedo and direct light must be there.
    ///
    /// # Errors
    /// [`GiError`] when inputs or outputs do not fit, or the world has changed since
    /// [`World::prepare`]; then nothing was recorded.
    pub fn record<'a>(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        world: impl Into<Option<&'a World>>,
        inputs: &Inputs<'_>,
        outputs: impl Into<Outputs<'a>>,
    ) -> Result<(), GiError> {
        let inputs = match world.into() {
            Some(world) => world.complete(inputs)?,
            None => *inputs,
        };
        if inputs.size != self.size {
            self.technique.release_bindings();
            self.size = inputs.size;
        }
        self.technique.record(&mut Recorder::new(encoder), &self.queue, &inputs, outputs.into())?;
        let before = self.seen[0].filter(|p| !inputs.reset && p.size == inputs.size);
        self.seen = [Some(Params::of(&inputs, None)?), before];
        Ok(())
    }

    /// Reads a few texels of what was handed over to the last [`View::record`] and says what does
    /// not fit: NaN, ranges, depth against the world's triangles (units, convention, a flipped y,
    /// matrices), normals against depth (space, encoding, signs), motion against the cameras of the
    /// last two frames (units, sense, jitter). What it takes for granted: most of the picture is in
    /// the world and at rest. Makes buffers, submits and waits: call it when you ask, after the
    /// frame was submitted, in debug builds say.
    ///
    /// # Errors
    /// [`GiError`] when the inputs do not fit or reading back fails.
    pub fn check<'a>(
        &self,
        device: &wgpu::Device,
        world: impl Into<Option<&'a World>>,
        inputs: &Inputs<'_>,
    ) -> Result<Vec<Complaint>, GiError> {
        let samples = sample::read(device, &self.queue, inputs)?;
        let now = Params::of(inputs, None)?;
        let rays = match world.into().and_then(World::rays) {
            Some(scene) => {
                let eye = now.eye_position();
                let cast = |offset: fn(&sample::Sample) -> [f32; 4]| {
                    let offsets: Vec<_> = samples.iter().map(offset).collect();
                    sample::cast(device, &self.queue, scene, eye, &offsets)
                };
                Some([cast(|s| s.offset)?, cast(|s| s.mirrored)?])
            }
            None => None,
        };
        Ok(Evidence { inputs, samples: &samples, now, before: self.seen[1], rays }.complaints())
    }

    /// Returns the method that drew the last frame in the place of the one asked for, and why; `None`
    /// where that drew itself.
    pub fn fallback(&self) -> Option<Fallback<'_>> {
        self.technique.fallback()
    }

    /// Returns whether the last frame wrote [`Outputs::specular`], if it was given: methods that trace
    /// specular rays do; a fallback does not.
    pub fn writes_specular(&self) -> bool {
        self.technique.writes_specular()
    }

    /// Returns the frames accumulated since the last reset; `None` for methods without history.
    pub fn settled(&self) -> Option<u32> {
        self.technique.settled()
    }

    /// Drops the texture views that it keeps, and so the host's textures. A change of
    /// size does so by itself.
    pub fn release_bindings(&mut self) {
        self.technique.release_bindings();
    }

    /// Returns the number of bind groups and rebuilds so far; it is constant in steady frames.
    pub fn allocations(&self) -> u64 {
        self.technique.allocations()
    }

    /// Returns the GPU memory of buffers, textures and weights, bytes.
    pub fn bytes(&self) -> u64 {
        self.technique.bytes()
    }
}
