//! Ambient occlusion: how much of the light that comes from all around reaches a surface past what
//! stands near it, by visibility bitmask at half resolution, brought back to full resolution along
//! the surface's own plane.
//!
//! What it cannot do: see what is off the screen or behind what is seen. A surface's thickness is
//! assumed ([`March::thickness`]), so light passes behind thick things and is held back behind thin
//! ones.

use super::bitmask::{Kernel, March, Pattern, Stage, bind, half_of, pattern_entry, write_entry};
use crate::gi::stage::inputs::{BoundInputs, InputGroup, texture_entry};
use crate::gpu::timing::Recorder;

/// Finds visibility. Other methods make one, call [`fit`](Self::fit) when the size changes, bind
/// [`visibility`](Self::visibility) as `texture_2d<f32>` (unfilterable, r) and
/// [`record`](Self::record) it first.
pub struct OcclusionPass {
    device: wgpu::Device,
    gather: Kernel,
    full: Kernel,
    pattern: Pattern,
    half: Stage,
    visibility: Stage,
    groups: Option<[wgpu::BindGroup; 2]>,
    made: u64,
}

impl OcclusionPass {
    /// Compiles the two stages; `inputs` gives the layout of group 0.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup, march: March) -> Self {
        use wgpu::TextureFormat::{R32Float, Rgba32Float};
        let entries = [pattern_entry(0), write_entry(1, Rgba32Float)];
        let gather = Kernel::new(device, inputs, "gi.occlusion", &march.prelude(), &entries);
        let full = [texture_entry(0), write_entry(1, R32Float)];
        let full = Kernel::new(device, inputs, "gi.occlusion_full", "", &full);
        Self {
            device: device.clone(),
            gather,
            full,
            pattern: Pattern::new(device),
            half: Stage::new("gi.occlusion", Rgba32Float),
            visibility: Stage::new("gi.visibility", R32Float),
            groups: None,
            made: 0,
        }
    }

    /// Makes textures for pictures of `size` pixels; true when they are new and groups that bind
    /// them must be made anew.
    pub fn fit(&mut self, size: [u32; 2]) -> bool {
        let fresh = self.visibility.fit(&self.device, size) | self.half.fit(&self.device, half_of(size));
        if fresh {
            let half = bind(self.half.get());
            let gather = self.gather.group(&self.device, &[self.pattern.binding(), half.clone()]);
            let full = self.full.group(&self.device, &[half, bind(self.visibility.get())]);
            self.groups = Some([gather, full]);
            self.made += 2;
        }
        fresh
    }

    /// Cosine-weighted visibility of the near field at full resolution, `R32Float`, 0 to 1, 1 on
    /// the background.
    ///
    /// # Panics
    /// Before [`fit`](Self::fit).
    pub fn visibility(&self) -> &wgpu::TextureView {
        self.visibility.get()
    }

    /// Moves the pattern of the gather; 0, the pattern of a picture on its own, unless a history
    /// averages frames.
    pub fn set_frame(&self, queue: &wgpu::Queue, frame: u32) {
        self.pattern.set(queue, frame);
    }

    /// Records `gi.occlusion` and `gi.occlusion_full`.
    pub fn record(&mut self, recorder: &mut Recorder<'_>, inputs: &BoundInputs) {
        self.fit(inputs.size);
        let Some([gather, full]) = &self.groups else { return };
        self.gather.record(recorder, inputs, gather, half_of(inputs.size));
        self.full.record(recorder, inputs, full, inputs.size);
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.half.bytes() + self.visibility.bytes() + 16
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.made
    }
}
