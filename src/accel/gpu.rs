//! The structure in a texture.
//!
//! Why a texture: drivers read it at scattered places at least as fast as a storage buffer, and Mesa's CPU driver does so
//! about three times as fast (`docs/performance.md`).

use super::wide::{Block, WORDS};
use super::{Accel, AccelError};

/// Blocks in a row of the texture, four texels each, as in `traverse.wgsl`. Every WebGPU device has textures this wide.
pub(super) const ROW: u32 = 2048;

/// Texels of a block, 16 bytes each.
const TEXELS: u32 = WORDS as u32 / 4;

/// A block's number has 24 bits in the traversal's stack.
const MOST: u64 = 1 << 24;

/// Nodes and leaves on the GPU.
#[derive(Debug)]
pub struct AccelGpu {
    blocks: wgpu::TextureView,
}

impl AccelGpu {
    /// The binding in `traverse.wgsl`, group 0.
    pub const BINDING: u32 = 1;

    /// Uploads `accel`.
    ///
    /// # Errors
    /// [`AccelError::TooLarge`] when the device's textures are too small, [`AccelError::OutOfMemory`] when its memory is.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, accel: &Accel) -> Result<Self, AccelError> {
        Self::of_blocks(device, queue, &accel.blocks)
    }

    /// Uploads blocks, of which the first is the root.
    pub(super) fn of_blocks(device: &wgpu::Device, queue: &wgpu::Queue, all: &[Block]) -> Result<Self, AccelError> {
        let side = device.limits().max_texture_dimension_2d;
        let blocks = all.len() as u64;
        let rows = blocks.div_ceil(u64::from(ROW));
        let limit = if side < ROW * TEXELS { 0 } else { (u64::from(ROW) * u64::from(side)).min(MOST) };
        if blocks > limit {
            return Err(AccelError::TooLarge { blocks, limit, side });
        }
        let scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let texture = texture(device, rows as u32);
        write(queue, &texture, 0, all);
        let blocks = texture.create_view(&Default::default());
        match pollster::block_on(scope.pop()) {
            Some(error) => Err(AccelError::OutOfMemory { bytes: size_of_val(all) as u64, message: error.to_string() }),
            None => Ok(Self { blocks }),
        }
    }

    /// Overwrites blocks from the start of row `row` on.
    pub(super) fn write(&self, queue: &wgpu::Queue, row: u32, blocks: &[Block]) {
        write(queue, self.blocks.texture(), row, blocks);
    }

    /// The texture.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.blocks
    }

    /// Layout entry of the binding.
    pub fn layout_entry() -> wgpu::BindGroupLayoutEntry {
        wgpu::BindGroupLayoutEntry {
            binding: Self::BINDING,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        }
    }

    /// Bind group entry that fits [`AccelGpu::layout_entry`].
    pub fn entry(&self) -> wgpu::BindGroupEntry<'_> {
        wgpu::BindGroupEntry { binding: Self::BINDING, resource: wgpu::BindingResource::TextureView(&self.blocks) }
    }
}

fn texture(device: &wgpu::Device, rows: u32) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("accel blocks"),
        size: wgpu::Extent3d { width: ROW * TEXELS, height: rows, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Whole rows at once, then the last one: no padded copy of everything is made.
fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, row: u32, blocks: &[Block]) {
    let whole = blocks.len() as u32 / ROW;
    let (body, tail) = blocks.split_at((whole * ROW) as usize);
    for (data, y, width, height) in [(body, 0, ROW, whole), (tail, whole, tail.len() as u32, 1)] {
        if data.is_empty() {
            continue;
        }
        queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: row + y, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(data),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(ROW * WORDS as u32 * 4),
                rows_per_image: None,
            },
            wgpu::Extent3d { width: width * TEXELS, height, depth_or_array_layers: 1 },
        );
    }
}
