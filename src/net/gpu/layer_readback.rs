//! What a layer has made of a picture, read back: for tools that look into a network, not for
//! frames.

use super::Network;
use crate::gpu::readback::{self, ReadbackError};
use crate::gpu::timing::Recorder;
use crate::net::graph::Shape;
use crate::net::plan::Kind;

/// A layer's result.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerReadback {
    /// The step's name: the last operator that is fused into it.
    pub name: String,
    /// Channels, height and width.
    pub shape: Shape,
    /// CHW.
    pub values: Vec<f32>,
}

impl Network {
    /// Position in the plan and name of each step whose result is a picture, in order; the
    /// statistics of norms are none.
    pub fn taps(&self) -> Vec<(usize, &str)> {
        let steps = self.plan.steps.iter().enumerate();
        steps
            .filter(|(_, s)| !matches!(s.kind, Kind::Moments | Kind::Merge { .. }))
            .map(|(i, s)| (i, s.name.as_str()))
            .collect()
    }

    /// Records the steps up to and with `step`, so that its result is not yet overwritten: layers
    /// share memory.
    pub fn record_until(&self, step: usize, recorder: &mut Recorder<'_>) {
        (0..self.layers.len().min(step + 1)).for_each(|i| self.record_step(i, recorder));
    }

    /// Reads the result of `step`, after [`Network::record_until`] was submitted. Waits for the
    /// GPU.
    ///
    /// # Errors
    /// Reading back failed.
    ///
    /// # Panics
    /// If the plan has no such step.
    pub fn read_layer(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        step: usize,
    ) -> Result<LayerReadback, ReadbackError> {
        let name = self.plan.steps[step].name.clone();
        self.read_tensor(device, queue, (self.plan.steps[step].output, name))
    }

    /// Reads the input that the caller has put there. Waits for the GPU.
    ///
    /// # Errors
    /// Reading back failed.
    pub fn read_input(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<LayerReadback, ReadbackError> {
        self.read_tensor(device, queue, (0, "input".into()))
    }

    fn read_tensor(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        (tensor, name): (usize, String),
    ) -> Result<LayerReadback, ReadbackError> {
        let tensor = &self.plan.tensors[tensor];
        let (shape, vector) = (tensor.shape, tensor.vector_bytes());
        let pitch = u64::from(tensor.pitch);
        let bytes = ((shape.pixels() - 1) * pitch + u64::from(shape.vectors())) * vector;
        let raw = readback::buffer(device, queue, &self.memory.arena, tensor.offset, bytes)?;
        let numbers: Vec<f32> = if tensor.full {
            bytemuck::pod_collect_to_vec(&raw)
        } else {
            bytemuck::pod_collect_to_vec::<u8, half::f16>(&raw).into_iter().map(half::f16::to_f32).collect()
        };
        let stride = 4 * pitch as usize;
        let channel = |c: usize| numbers.iter().skip(c).step_by(stride).take(shape.pixels() as usize).copied();
        let values = (0..shape.channels as usize).flat_map(channel).collect();
        Ok(LayerReadback { name, shape, values })
    }
}
