//! Inputs of the network: features of each cell's history. Table `cells`, version 2.
//!
//! ```
//! use bouncelight::gi::memory::{CHANNELS, FEATURES};
//! assert_eq!(FEATURES.iter().map(|(_, channels)| channels).sum::<u32>(), CHANNELS);
//! ```

use crate::gi::stage::exposure::ExposurePass;
use crate::gi::stage::inputs::{BoundInputs, InputGroup};
use crate::gpu::bind::{self, Binder, Bound};
use crate::gpu::binding::{READ, READ_WRITE};
use crate::gpu::{shaders, timing::Recorder};
use crate::net::plan::Precision;

/// Table `cells` version 2: (name, channels), in channel order. s and m (e^ln_m) are
/// [`Exposure`](crate::gi::stage::exposure::Exposure)'s, L the luminance of the cell's mean light.
/// All are 0 where a cell shows no surface, and none changes when all light is multiplied by one
/// number.
///
/// | name | what it holds |
/// |---|---|
/// | `light` | L / (L + s) |
/// | `chroma` | (red − green) and (blue − green) over the sum of the three |
/// | `deviation` | ln(1 + standard deviation of single frames / L) |
/// | `history_length` | 1/√(frames in the mean) |
/// | `fast_history` | (fast mean − L) / (fast mean + L) |
/// | `hit_proximity` | mean of 2w/(2w + length of the cell's rays), w the cell's width |
/// | `depth` | ln(z/m) clamped to ±4, z the distance along the view axis |
/// | `normal` | unit normal in the gravity frame: horizontal right, up, horizontal backward |
/// | `hit` | 1 |
/// | `dominant_direction` | mean direction of what arrives, weighted by its luminance, in the gravity frame |
pub const FEATURES: [(&str, u32); 10] = [
    ("light", 1),
    ("chroma", 2),
    ("deviation", 1),
    ("history_length", 1),
    ("fast_history", 1),
    ("hit_proximity", 1),
    ("depth", 1),
    ("normal", 3),
    ("hit", 1),
    ("dominant_direction", 3),
];

/// Table `cells` version 1: the same by other names.
pub const FEATURES_V1: [(&str, u32); 10] = [
    ("light", 1),
    ("chroma", 2),
    ("deviation", 1),
    ("frames", 1),
    ("lately", 1),
    ("nearness", 1),
    ("depth", 1),
    ("normal", 3),
    ("hit", 1),
    ("towards", 3),
];

/// Channels of the table.
pub const CHANNELS: u32 = 15;

/// Channels as they lie in the buffer: whole vectors.
pub const PITCH: u32 = CHANNELS.next_multiple_of(4);

/// Constants of the shader as WGSL.
pub fn prelude(precision: Precision) -> String {
    let half = precision == Precision::F16;
    format!("{}const HALF_TABLE = {half};\n", crate::gi::gather::prelude())
}

/// The pass `gi.features`.
pub struct FeaturesPass {
    pipeline: wgpu::ComputePipeline,
    binder: Binder,
}

impl FeaturesPass {
    /// Compiles the shader; `inputs` gives the layout of group 0. The table is of numbers stored as
    /// `precision` says.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup, precision: Precision) -> Self {
        let binder = Binder::new(device, "gi.features", &[READ, READ, READ_WRITE]);
        let module = shaders::module_with(device, "gi.features", &prelude(precision));
        let layouts = [inputs.layout(), binder.layout()];
        Self { pipeline: bind::pipeline(device, "gi.features", &module, "features", &layouts), binder }
    }

    /// Records the pass into `target` ([`PITCH`] numbers a cell, row by row); `histories` is what
    /// cells remember, and the exposure must have been recorded before.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        inputs: &BoundInputs,
        (histories, exposure): (&wgpu::Buffer, &ExposurePass),
        target: Bound,
    ) {
        let own = self.binder.group([Bound::from(histories), Bound::from(exposure.buffer()), target]);
        let [w, h] = inputs.cells.map(|n| n.div_ceil(8));
        recorder.compute("gi.features", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &own, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(w, h, 1);
        });
    }

    /// Bind groups made since the start.
    pub fn made(&self) -> u64 {
        self.binder.made()
    }

    /// Lets go of what is bound.
    pub fn release_bindings(&mut self) {
        self.binder.release_bindings();
    }
}
