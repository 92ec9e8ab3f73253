//! How many rays the last frame has sent, read back without waiting for the GPU.

use super::Stage;
use bouncelight::gi::gather::RAYS_SENT;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Bytes of a side's number.
const WORD: u64 = 4;

/// A number for each side, on its way or read.
pub(super) struct RayCount {
    buffer: wgpu::Buffer,
    /// Tells when the buffer can be read; none while nothing is on its way.
    answer: Option<Receiver<Result<(), wgpu::BufferAsyncError>>>,
}

impl RayCount {
    pub fn new(device: &wgpu::Device) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("viewer.rays"),
            size: 2 * WORD,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer, answer: None }
    }
}

impl Stage {
    /// True where a method gathers on one side.
    pub fn has_cells(&self) -> bool {
        self.slots.iter().flatten().any(|slot| slot.renderer.memory().is_some())
    }

    /// Asks how many rays the last frame has sent. False where it has none or an answer is awaited.
    pub fn count_rays(&mut self) -> bool {
        if self.ray_count.answer.is_some() || !self.has_cells() {
            return false;
        }
        let buffer = &self.ray_count.buffer;
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(buffer, 0, None);
        let memories = self.slots.iter().flatten().filter_map(|slot| slot.renderer.memory());
        for (memory, at) in memories.zip([0, WORD]) {
            encoder.copy_buffer_to_buffer(memory.jobs, RAYS_SENT, buffer, at, WORD);
        }
        self.gpu.queue.submit([encoder.finish()]);
        let (send, answer) = channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |mapped| {
            // Nobody listens any more where the device went.
            let _ = send.send(mapped);
        });
        self.ray_count.answer = Some(answer);
        true
    }

    /// The answer, once it has arrived: the number, or none where it cannot be had.
    pub fn counted_rays(&mut self) -> Option<Option<u64>> {
        let arrived = match self.ray_count.answer.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            arrived => arrived,
        };
        self.ray_count.answer = None;
        let Ok(Ok(())) = arrived else { return Some(None) };
        let buffer = &self.ray_count.buffer;
        let read = buffer.get_mapped_range(..).map(|bytes| bytemuck::pod_collect_to_vec::<u8, u32>(&bytes));
        buffer.unmap();
        Some(read.ok().map(|words| words.into_iter().map(u64::from).sum()))
    }
}
