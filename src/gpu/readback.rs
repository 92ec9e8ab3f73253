//! Copies from the GPU to memory, for capture and tests. They block; frames never call them.
//!
//! ```no_run
//! use bouncelight::{gpu::{Gpu, readback}, wgpu};
//! fn texels(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<f32>, readback::ReadbackError> {
//!     let bytes = readback::texture(&gpu.device, &gpu.queue, texture)?;
//!     Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
//! }
//! ```

use thiserror::Error;

/// Why a copy from the GPU did not arrive.
#[derive(Debug, Error)]
pub enum ReadbackError {
    /// The driver refused to map the staging buffer.
    #[error("the driver could not map the read-back buffer `{label}`: {source}")]
    Map {
        /// Label of what was read.
        label: String,
        /// The driver's reason.
        source: wgpu::BufferAsyncError,
    },
    /// Waiting for the device failed, usually because it was lost.
    #[error("waiting for the GPU failed while reading `{label}`: {message}")]
    Wait {
        /// Label of what was read.
        label: String,
        /// The driver's reason.
        message: String,
    },
    /// The texture's format has no bytes to read.
    #[error("texture `{label}` has format {format:?}, which cannot be read back")]
    Format {
        /// Label of what was read.
        label: String,
        /// The format.
        format: wgpu::TextureFormat,
    },
}

/// Reads `size` bytes of `buffer` from `offset` (both multiples of 4; usage COPY_SRC). Submits and
/// waits.
pub fn buffer(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    buffer: &wgpu::Buffer,
    offset: u64,
    size: u64,
) -> Result<Vec<u8>, ReadbackError> {
    let staging = staging_buffer(device, size);
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, offset, &staging, 0, size);
    queue.submit([encoder.finish()]);
    map(device, &staging, "buffer")
}

/// Reads mip 0, layer 0 of `texture` (usage COPY_SRC) as tightly packed rows from the top. Submits
/// and waits.
pub fn texture(device: &wgpu::Device, queue: &wgpu::Queue, texture: &wgpu::Texture) -> Result<Vec<u8>, ReadbackError> {
    let format = texture.format();
    let aspect = if format.has_depth_aspect() { wgpu::TextureAspect::DepthOnly } else { wgpu::TextureAspect::All };
    let texel = format
        .block_copy_size(Some(aspect))
        .ok_or_else(|| ReadbackError::Format { label: "texture".into(), format })?;
    let (width, height) = (texture.width(), texture.height());
    let row = width * texel;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let staging = staging_buffer(device, u64::from(padded) * u64::from(height));
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin: wgpu::Origin3d::ZERO, aspect },
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None },
        },
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
    );
    queue.submit([encoder.finish()]);
    let bytes = map(device, &staging, "texture")?;
    Ok(bytes.chunks_exact(padded as usize).flat_map(|r| &r[..row as usize]).copied().collect())
}

fn staging_buffer(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("gpu.readback"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn map(device: &wgpu::Device, staging: &wgpu::Buffer, label: &str) -> Result<Vec<u8>, ReadbackError> {
    let (sender, receiver) = std::sync::mpsc::channel();
    staging.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver only goes away when this function has already returned an error.
        let _ = sender.send(result);
    });
    let wait = |message: String| ReadbackError::Wait { label: label.into(), message };
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| wait(e.to_string()))?;
    receiver
        .recv()
        .map_err(|e| wait(e.to_string()))?
        .map_err(|source| ReadbackError::Map { label: label.into(), source })?;
    let bytes = staging.get_mapped_range(..).map_err(|e| wait(e.to_string()))?.to_vec();
    staging.unmap();
    Ok(bytes)
}
