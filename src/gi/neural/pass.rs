//! [`NeuralGi`]: G-buffer in, indirect light out, as one pass that any wgpu renderer can embed. It records; it never
//! submits, never waits and never creates a device.
//!
//! ```text
//!  depth ───────┬──────────────┬──────────────────────────────────┐
//!  normal ──────┼──────────────┼──────────────────────────────┐   │
//!  albedo ──────┼──────────────┤                              │   │
//!  emissive ────┼─► exposure ─┬┴► pack ─► U-Net (net.*) ─► reconstruct ─► E/π
//!  direct ──────┘      s      ├──►│                           │
//!  rays ──► gather ─► guess ──┴───┴──────────────────────────►┘
//! ```
//!
//! Weights whose answer is a gain on the first guess
//! ([`Answer::Gain`](super::reconstruct::Answer::Gain)) have method `gather` run before them, need
//! the scene's triangles as it does, and settle over frames as it does; weights that answer light
//! itself need the G-buffer alone.
//!
//! What the method cannot do: see [`crate::gi`].

use super::features::FeatureSet;
use super::pack::{self, NetworkInputs};
use super::rebuilt::{Rebuilt, guess_bytes};
use super::reconstruct::ReconstructPass;
use super::trained::check_weights;
pub use super::trained::{Neural, needs_guess};
use crate::gi::gather::GatherGi;
use crate::gi::interface::technique::Technique;
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::stage::exposure::ExposurePass;
use crate::gi::stage::inputs::InputGroup;
use crate::gpu::timing::Recorder;
use crate::net::format::Weights;
use crate::net::gpu::{Network, Tap};
use crate::net::plan::Plan;

/// What the host chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Width and height of the pictures to come, pixels. A recording of another size rebuilds the
    /// buffers.
    pub size: [u32; 2],
}

/// The embeddable pass. Keeps clones of device and queue (both are handles) to rebuild on a change
/// of size and to write its parameters; parameters become visible to the GPU with the host's next
/// submission, and up to [`SLOTS`](crate::gi::stage::inputs::SLOTS) recordings may go into one
/// submission.
pub struct NeuralGi {
    device: wgpu::Device,
    queue: wgpu::Queue,
    neural: Neural,
    features: FeatureSet,
    inputs: InputGroup,
    exposure: ExposurePass,
    reconstruct: ReconstructPass,
    /// The method whose answer the network corrects.
    gather: Option<GatherGi>,
    rebuilt: Rebuilt,
    rebuilds: u64,
}

impl NeuralGi {
    /// Features that would be used where the adapter has them: timestamps, by hosts that time
    /// passes, and what some of the network's kernels use. None is needed.
    pub fn optional_features(adapter: &wgpu::Adapter) -> wgpu::Features {
        adapter.features() & crate::gpu::wanted_features()
    }

    /// Limits that the device must have: WebGPU's defaults.
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// Compiles all pipelines, uploads the weights and makes the buffers for `options.size`.
    ///
    /// # Errors
    /// [`GiError::Feature`] or [`GiError::Output`] when the weights speak of something else than
    /// light on this program's features, [`GiError::Size`] and [`GiError::Network`] when the size
    /// does not fit the device.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        weights: &Weights,
        options: Options,
    ) -> Result<Self, GiError> {
        Self::with(device, queue, &weights.clone().into(), options)
    }

    /// As [`NeuralGi::new`], with options for how the network runs.
    ///
    /// # Errors
    /// As [`NeuralGi::new`].
    pub fn with(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        neural: &Neural,
        options: Options,
    ) -> Result<Self, GiError> {
        let (features, answer) = check_weights(&neural.weights)?;
        let inputs = InputGroup::new(device);
        let exposure = ExposurePass::new(device, &inputs);
        let reconstruct = ReconstructPass::new(device, &inputs, answer);
        let rebuilt = Rebuilt::new(device, queue, neural, &features, &inputs, &exposure, options.size)?;
        Ok(Self {
            device: device.clone(),
            queue: queue.clone(),
            neural: neural.clone(),
            features,
            inputs,
            exposure,
            reconstruct,
            gather: needs_guess(&neural.weights).then(|| GatherGi::new(device, options.size, neural.gather)),
            rebuilt,
            rebuilds: 0,
        })
    }

    /// Records all stages: `output` (`Rgba16Float`, usage STORAGE_BINDING, the inputs' size)
    /// becomes the light that direct lighting misses, as E/π; 0 on the background. Allocates only
    /// when the size or the views are new.
    ///
    /// # Errors
    /// [`GiError`] when inputs or output do not fit; then nothing was recorded.
    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &Inputs<'_>,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        self.record_stages(&mut Recorder::new(encoder), inputs, output.into())
    }

    /// Like [`record`](Self::record), for a frame that times each stage: `gi.exposure`, `gi.pack`,
    /// `net.*`, `gi.reconstruct`.
    ///
    /// # Errors
    /// As [`record`](Self::record).
    pub fn record_stages(
        &mut self,
        recorder: &mut Recorder<'_>,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        crate::gi::stage::inputs::check_outputs(outputs, inputs.size)?;
        if inputs.size != self.rebuilt.size {
            self.resize(inputs.size)?;
        }
        let bound = self.inputs.bind(&self.queue, inputs)?;
        let Rebuilt { network, pack, guess, .. } = &self.rebuilt;
        if let Some(gather) = &mut self.gather {
            gather.record(recorder, &self.queue, inputs, Outputs { light: guess, ..outputs })?;
        }
        self.exposure.record(recorder, &bound);
        pack.record(recorder, &bound);
        network.record(recorder);
        self.reconstruct.record(recorder, &bound, &self.exposure, network.output().resource(), guess, outputs.light)
    }

    fn resize(&mut self, size: [u32; 2]) -> Result<(), GiError> {
        self.rebuilt =
            Rebuilt::new(&self.device, &self.queue, &self.neural, &self.features, &self.inputs, &self.exposure, size)?;
        self.rebuilds += 1;
        self.forget();
        Ok(())
    }

    /// What the network is given for `inputs`, read back; they must be those of the last recording
    /// where the weights use the first guess. Makes its own buffers, submits and waits: for tools,
    /// not for frames. [`pack::read_features`] does the same without weights.
    ///
    /// # Errors
    /// [`GiError`] when the inputs do not fit or reading back fails.
    pub fn read_inputs(&self, inputs: &Inputs<'_>) -> Result<NetworkInputs, GiError> {
        pack::read_features(&self.device, &self.queue, &self.features, inputs, &self.rebuilt.guess)
    }

    /// Names of the network's layers in order, as [`NeuralGi::read_layer`] numbers them.
    pub fn layers(&self) -> Vec<&str> {
        self.rebuilt.network.taps().into_iter().map(|(_, name)| name).collect()
    }

    /// What a layer of the network makes of `inputs`, which must be those of the last recording;
    /// `None` if there is no such layer. Runs the network as far as that layer, submits and waits:
    /// for tools, not for frames.
    ///
    /// # Errors
    /// [`GiError`] when the inputs do not fit or reading back fails.
    pub fn read_layer(&mut self, inputs: &Inputs<'_>, layer: usize) -> Result<Option<Tap>, GiError> {
        let taps = self.rebuilt.network.taps();
        let Some(&(step, _)) = taps.get(layer).filter(|_| inputs.size == self.rebuilt.size) else { return Ok(None) };
        let bound = self.inputs.bind(&self.queue, inputs)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(&mut encoder);
        self.rebuilt.pack.record(&mut recorder, &bound);
        self.rebuilt.network.record_until(step, &mut recorder);
        self.queue.submit([encoder.finish()]);
        Ok(Some(self.rebuilt.network.read_tap(&self.device, &self.queue, step)?))
    }

    /// What method `gather` answered in the last recording, where the network builds on it.
    pub fn guess(&self) -> Option<&wgpu::TextureView> {
        self.gather.as_ref().map(|_| &self.rebuilt.guess)
    }

    /// The next recording has nothing to do with the last (a cut of the camera): the first guess
    /// settles anew.
    pub fn cut(&mut self) {
        if let Some(gather) = &mut self.gather {
            gather.cut();
        }
    }

    /// Recordings that the first guess has settled over since the last cut; `None` for weights
    /// without one.
    pub fn settled(&self) -> Option<u32> {
        self.gather.as_ref().and_then(|gather| gather.settled())
    }

    /// Lets go of the remembered texture views, and so of the textures; call it when targets are
    /// rebuilt.
    pub fn forget(&mut self) {
        self.inputs.forget();
        self.reconstruct.forget();
        if let Some(gather) = &mut self.gather {
            gather.forget();
        }
    }

    /// The exposure of the last recording, see [`crate::gi::stage::exposure::read`].
    pub fn exposure_buffer(&self) -> &wgpu::Buffer {
        self.exposure.buffer()
    }

    /// How the network runs.
    pub fn network(&self) -> &Network {
        &self.rebuilt.network
    }

    /// The features that the weights use.
    pub fn features(&self) -> &FeatureSet {
        &self.features
    }

    /// GPU memory of all buffers and weights, bytes.
    pub fn bytes(&self) -> u64 {
        let gather = self.gather.as_ref().map_or(0, |gather| gather.bytes() + guess_bytes(self.rebuilt.size));
        self.inputs.bytes() + self.exposure.bytes() + self.rebuilt.network.bytes() + gather
    }

    /// Bind groups and rebuilds since the start; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        let gather = self.gather.as_ref().map_or(0, GatherGi::allocations);
        self.inputs.made() + self.reconstruct.made() + self.rebuilds + gather
    }
}

// What a frame of our own sees; hosts that embed the pass use its own methods and need not know the
// trait.
impl Technique for NeuralGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        _queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        self.record_stages(recorder, inputs, outputs)
    }

    fn warm_up(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
    ) -> Result<bool, GiError> {
        if inputs.size != self.rebuilt.size {
            self.resize(inputs.size)?;
        }
        self.gather.as_mut().map_or(Ok(false), |gather| gather.warm_up(recorder, queue, inputs))
    }

    fn cut(&mut self) {
        self.cut();
    }

    fn settled(&self) -> Option<u32> {
        self.settled()
    }

    fn knows_scene(&self, rays: bool) -> bool {
        self.gather.as_ref().is_some_and(|gather| gather.knows_scene(rays))
    }

    fn shows_lobes(&self) -> bool {
        self.gather.as_ref().is_some_and(|gather| gather.shows_lobes())
    }

    fn guess(&self) -> Option<&wgpu::TextureView> {
        self.guess()
    }

    fn layers(&self) -> Vec<&str> {
        self.layers()
    }

    fn read_layer(&mut self, inputs: &Inputs<'_>, layer: usize) -> Result<Option<Tap>, GiError> {
        self.read_layer(inputs, layer)
    }

    fn forget(&mut self) {
        self.forget();
    }

    fn allocations(&self) -> u64 {
        self.allocations()
    }

    fn bytes(&self) -> u64 {
        self.bytes()
    }

    fn plan(&self) -> Option<&Plan> {
        Some(self.network().plan())
    }
}
