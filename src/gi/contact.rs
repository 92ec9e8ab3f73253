//! Contact shadows: how much of the light from all around reaches a surface past what the depth buffer shows right beside
//! it, at half resolution. [`upsample`](super::upsample) multiplies a method's light with it.
//!
//! Cheaper and nearer than [`occlusion`](super::occlusion): no thickness and no sectors, one horizon a direction, which may
//! lie beyond the zenith. What it cannot do: see what is off the screen or behind what is seen.

use super::bitmask::{Kernel, Stage, bind, half_of, write_entry};
use super::inputs::{BoundInputs, InputGroup};
use super::rung::Cost;
use crate::gpu::timing::Recorder;

/// Directions in the tangent plane. (6 instead of 4 would take 0.03 points of the light's error, of 4.4 %, and half as much
/// time again.)
const AZIMUTHS: u32 = 4;
/// Points on each of them.
const TAPS: u32 = 2;
/// How far an occluder may be, as part of the distance from the camera: about as wide as a texel of the cube around the
/// camera is there, beyond which surfels are blockers themselves. (Error of the light on training rooms 2 to 5 with points in
/// the tangent plane only: 0.06 4.70 %, 0.1 4.64 %, 0.16 4.57 %, 0.25 4.62 %; without the pass 4.87 %.)
pub const RADIUS: f32 = 0.16;
/// The nearest point, as part of the radius.
const NEAREST: f32 = 0.06;
/// Sine of the elevation that counts as the surface itself.
const BIAS: f32 = 0.03;

/// The constants as WGSL.
pub fn prelude() -> String {
    let mut text = format!("const CELL_SIDE = 8i;\nconst AZIMUTHS = {AZIMUTHS}i;\nconst TAPS = {TAPS}i;\n");
    for (name, value) in [("RADIUS", RADIUS), ("NEAREST", NEAREST), ("BIAS", BIAS)] {
        text.push_str(&format!("const {name} = f32({value:?});\n"));
    }
    text
}

/// The pass.
pub struct ContactPass {
    device: wgpu::Device,
    kernel: Kernel,
    visibility: Stage,
    group: Option<wgpu::BindGroup>,
    made: u64,
}

impl ContactPass {
    /// Compiles the shader; `inputs` gives the layout of group 0.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup) -> Self {
        let entries = [write_entry(0, wgpu::TextureFormat::R32Float)];
        Self {
            kernel: Kernel::new(device, inputs, "gi.contact", &prelude(), &entries),
            visibility: Stage::new("gi.contact", wgpu::TextureFormat::R32Float),
            device: device.clone(),
            group: None,
            made: 0,
        }
    }

    /// Makes the texture for pictures of `size` pixels; true when it is new and groups that bind it must be made anew.
    pub fn fit(&mut self, size: [u32; 2]) -> bool {
        let fresh = self.visibility.fit(&self.device, half_of(size));
        if fresh {
            self.group = Some(self.kernel.group(&self.device, &[bind(self.visibility.get())]));
            self.made += 1;
        }
        fresh
    }

    /// Cosine-weighted visibility of what stands beside, `R32Float`, 0 to 1, half the picture's size (rounded up).
    ///
    /// # Panics
    /// Before [`fit`](Self::fit).
    pub fn visibility(&self) -> &wgpu::TextureView {
        self.visibility.get()
    }

    /// Records `gi.contact`.
    pub fn record(&mut self, recorder: &mut Recorder<'_>, inputs: &BoundInputs) {
        self.fit(inputs.size);
        let Some(group) = &self.group else { return };
        self.kernel.record(recorder, inputs, group, half_of(inputs.size));
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.visibility.bytes()
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.made
    }

    /// What the pass costs for a picture of `size` pixels: 70 operations a texel, 20 a direction, 67 a point.
    pub fn cost(size: [u32; 2]) -> Cost {
        let [w, h] = half_of(size);
        let texels = f64::from(w) * f64::from(h);
        let flops = 70.0 + f64::from(AZIMUTHS) * (20.0 + f64::from(TAPS) * 67.0);
        Cost::new("gi.contact", texels * flops, texels * (4.0 * 4.0 + 4.0 + 4.0))
    }
}
