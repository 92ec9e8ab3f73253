//! [`FilterGi`]: method `gather`, whose filter over neighbouring cells a network guides.
//!
//! ```text
//!  G-buffer ─► gather: rays, means ──┬──────────────────────────────► gi.blur ─► gi.atrous ─► gi.upsample ─► E/π, gloss
//!                                    └► gi.features ─► U-Net (net.*) ──► ▲ guidance
//! ```
//!
//! The network never says light, it says which cells' light is averaged: darkness stays dark, twice
//! the light is twice the answer, and an answer of zeros is `gather` itself.

use super::memory::{self, FeaturesPass};
use super::trained::Neural;
use crate::gi::gather::{GUIDANCE, GatherGi};
use crate::gi::interface::technique::{Memory, Technique};
use crate::gi::interface::{GiError, Inputs, Outputs};
use crate::gi::stage;
use crate::gi::stage::exposure::ExposurePass;
use crate::gi::stage::inputs::{InputGroup, cells_of};
use crate::gpu::bind::Bound;
use crate::gpu::timing::Recorder;
use crate::net::format::Weights;
use crate::net::gpu::{Binding, LayerReadback, Network, Setup};
use crate::net::plan::Plan;

/// Numbers of a cell: two places in spaces of four dimensions; trust, tolerance, and two that are
/// not read.
pub const CHANNELS: u32 = GUIDANCE as u32 / 4;

/// What the output of a network that filters means, in weights files.
const FILTER: &str = "filter";

/// The method at work.
pub struct FilterGi {
    device: wgpu::Device,
    queue: wgpu::Queue,
    neural: Neural,
    gather: GatherGi,
    inputs: InputGroup,
    exposure: ExposurePass,
    features: FeaturesPass,
    network: Network,
    size: [u32; 2],
    rebuilds: u64,
}

impl FilterGi {
    /// Compiles all pipelines, uploads the weights and makes the buffers for pictures of `size`
    /// pixels.
    ///
    /// # Errors
    /// [`GiError::Feature`] or [`GiError::Output`] when the weights speak of something else,
    /// [`GiError::Network`] when the size does not fit the device.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, neural: &Neural, size: [u32; 2]) -> Result<Self, GiError> {
        check(&neural.weights)?;
        let inputs = InputGroup::new(device);
        let gather = GatherGi::new(device, size, neural.gather);
        Ok(Self {
            exposure: ExposurePass::new(device, &inputs),
            features: FeaturesPass::new(device, &inputs, neural.network.input_precision()),
            network: network(device, queue, neural, size)?,
            device: device.clone(),
            queue: queue.clone(),
            neural: neural.clone(),
            gather,
            inputs,
            size,
            rebuilds: 0,
        })
    }

    /// Makes the tensors anew for pictures of another size.
    fn fit(&mut self, size: [u32; 2]) -> Result<(), GiError> {
        if size != self.size {
            self.network = network(&self.device, &self.queue, &self.neural, size)?;
            self.size = size;
            self.rebuilds += 1;
            self.release_bindings();
        }
        Ok(())
    }
}

impl FilterGi {
    /// Makes the features of the last recording again, of which `inputs` are, and runs the network up
    /// to and with `step`: its layers share memory, the input's included. False where nothing was
    /// recorded yet. Submits.
    fn run_again(&mut self, inputs: &Inputs<'_>, step: Option<usize>) -> Result<bool, GiError> {
        let Some(memory) = self.gather.memory().filter(|_| inputs.size == self.size) else { return Ok(false) };
        let lit = self.inputs.bind(&self.queue, inputs)?;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(&mut encoder);
        let known = (memory.histories, &self.exposure);
        self.features.record(&mut recorder, &lit, known, bound(self.network.input()));
        if let Some(step) = step {
            self.network.record_until(step, &mut recorder);
        }
        self.queue.submit([encoder.finish()]);
        Ok(true)
    }
}

/// The tensors for pictures of `size` pixels.
fn network(device: &wgpu::Device, queue: &wgpu::Queue, neural: &Neural, size: [u32; 2]) -> Result<Network, GiError> {
    let cells = cells_of(size);
    let setup = Setup { options: neural.network, tuned: neural.tuned.clone() };
    Network::new(device, queue, &neural.weights, cells, setup)
        .map_err(|e| GiError::Network { cells, source: Box::new(e) })
}

/// Whether the weights are given what there is, and answer what is asked.
fn check(weights: &Weights) -> Result<(), GiError> {
    let wrong = |name: &str, reason: String| Err(GiError::Feature { name: name.into(), reason });
    let table = &weights.table;
    let features = match (table.name.as_str(), table.version) {
        ("cells", 1) => Some(memory::FEATURES_V1),
        ("cells", 2) => Some(memory::FEATURES),
        _ => None,
    };
    let Some(features) = features.filter(|_| weights.cell == stage::inputs::CELL) else {
        let found = format!("table {} version {}, {} pixels a cell", table.name, table.version, weights.cell);
        let own = stage::inputs::CELL;
        return wrong(
            "(all)",
            format!("list is made for {found}; a filter is given cells version 1 or 2, {own} pixels a cell"),
        );
    };
    let named = || weights.inputs.iter().map(|f| (f.name.as_str(), f.channels));
    if !named().eq(features) {
        let found: Vec<_> = named().map(|(name, _)| name).collect();
        return wrong("(all)", format!("list is {}; a filter is given the whole table", found.join(", ")));
    }
    let output = &weights.output;
    if (output.meaning.as_str(), output.channels) != (FILTER, CHANNELS) {
        return Err(GiError::Output(format!("{} channels of `{}`", output.channels, output.meaning)));
    }
    Ok(())
}

fn bound(binding: Binding<'_>) -> Bound {
    Bound::Part(binding.buffer.clone(), binding.offset, binding.size)
}

impl Technique for FilterGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        stage::inputs::check_outputs(outputs, inputs.size)?;
        self.fit(inputs.size)?;
        let lit = self.inputs.bind(queue, inputs)?;
        let accumulated = self.gather.accumulate(recorder, queue, inputs, true)?;
        if let Some(means) = &accumulated.means {
            self.exposure.record(recorder, &lit);
            let known = (&means.histories, &self.exposure);
            self.features.record(recorder, &lit, known, bound(self.network.input()));
            self.network.record(recorder);
        }
        self.gather.filter(recorder, &accumulated, Some(bound(self.network.output())), outputs);
        Ok(())
    }

    fn warm_up(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
    ) -> Result<bool, GiError> {
        // What is remembered hangs on no network.
        self.fit(inputs.size)?;
        self.gather.warm_up(recorder, queue, inputs)
    }

    fn reset_history(&mut self) {
        self.gather.reset_history();
    }

    fn set_rays(&mut self, rays: f32) {
        self.gather.set_rays(rays);
    }

    fn settled(&self) -> Option<u32> {
        self.gather.settled()
    }

    fn uses_rays(&self, rays: bool) -> bool {
        self.gather.uses_rays(rays)
    }

    fn writes_specular(&self) -> bool {
        self.gather.writes_specular()
    }

    fn memory(&self) -> Option<Memory<'_>> {
        self.gather.memory()
    }

    fn layers(&self) -> Vec<&str> {
        self.network.taps().into_iter().map(|(_, name)| name).collect()
    }

    fn read_input(&mut self, inputs: &Inputs<'_>) -> Result<Option<LayerReadback>, GiError> {
        if !self.run_again(inputs, None)? {
            return Ok(None);
        }
        Ok(Some(self.network.read_input(&self.device, &self.queue)?))
    }

    fn read_layer(&mut self, inputs: &Inputs<'_>, layer: usize) -> Result<Option<LayerReadback>, GiError> {
        let taps = self.network.taps();
        let Some(&(step, _)) = taps.get(layer) else { return Ok(None) };
        if !self.run_again(inputs, Some(step))? {
            return Ok(None);
        }
        Ok(Some(self.network.read_layer(&self.device, &self.queue, step)?))
    }

    fn release_bindings(&mut self) {
        self.inputs.release_bindings();
        self.features.release_bindings();
        self.gather.release_bindings();
    }

    fn allocations(&self) -> u64 {
        self.inputs.made() + self.features.made() + self.rebuilds + self.gather.allocations()
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.exposure.bytes() + self.network.bytes() + self.gather.bytes()
    }

    fn plan(&self) -> Option<&Plan> {
        Some(self.network.plan())
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_table_has_the_channels_that_it_says() {
        let sum: u32 = super::memory::FEATURES.iter().map(|(_, channels)| channels).sum();
        assert_eq!(sum, super::memory::CHANNELS);
        // What `guidance.wgsl` reads of a cell.
        assert_eq!(super::CHANNELS, 12);
    }
}
