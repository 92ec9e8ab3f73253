//! The structure in a texture.
//!
//! Why a texture: drivers read it at scattered places at least as fast as a storage buffer, and
//! Mesa's CPU driver does so about three times as fast (`docs/log/2026-11-rays.md`).

use super::wide::{Block, WORDS};
use super::{Accel, AccelError};

/// Blocks in a row of the texture, four texels each, as in `traverse.wgsl`. Every WebGPU device has
/// textures this wide.
pub(super) const ROW: u32 = 2048;

/// Texels of a block, 16 bytes each.
const TEXELS: u32 = WORDS as u32 / 4;

/// Texels in a row.
pub(super) const WIDTH: u32 = ROW * TEXELS;

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
    /// [`AccelError::TooLarge`] when the device's textures are too small,
    /// [`AccelError::OutOfMemory`] when its memory is.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, accel: &Accel) -> Result<Self, AccelError> {
        Self::of_blocks(device, queue, &accel.blocks)
    }

    /// Uploads blocks, of which the first is the root.
    pub(super) fn of_blocks(device: &wgpu::Device, queue: &wgpu::Queue, all: &[Block]) -> Result<Self, AccelError> {
        let side = device.limits().max_texture_dimension_2d;
        let blocks = all.len() as u64;
        let limit = if side < WIDTH { 0 } else { (u64::from(ROW) * u64::from(side)).min(MOST) };
        if blocks > limit {
            return Err(AccelError::TooLarge { blocks, limit, side });
        }
        Ok(Self { blocks: texels(device, queue, "accel.blocks", bytemuck::cast_slice(all))? })
    }

    /// Overwrites blocks from block `first` on.
    pub(super) fn write(&self, queue: &wgpu::Queue, first: u32, blocks: &[Block]) {
        write(queue, self.blocks.texture(), TEXELS * first, bytemuck::cast_slice(blocks));
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

/// A texture of `texels`, [`WIDTH`] to a row, the device's textures being wide and high enough.
///
/// # Errors
/// [`AccelError::OutOfMemory`].
pub(super) fn texels(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &'static str,
    texels: &[[u32; 4]],
) -> Result<wgpu::TextureView, AccelError> {
    let scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width: WIDTH,
            height: (texels.len() as u32).div_ceil(WIDTH).max(1),
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    write(queue, &texture, 0, texels);
    let view = texture.create_view(&Default::default());
    match pollster::block_on(scope.pop()) {
        Some(error) => Err(AccelError::OutOfMemory { bytes: size_of_val(texels) as u64, message: error.to_string() }),
        None => Ok(view),
    }
}

/// Overwrites texels from texel `at` on, whole rows at once: no padded copy of everything is made.
pub(super) fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, mut at: u32, mut texels: &[[u32; 4]]) {
    while !texels.is_empty() {
        let (x, y) = (at % WIDTH, at / WIDTH);
        let rows = if x == 0 { texels.len() as u32 / WIDTH } else { 0 };
        let width = if rows > 0 { WIDTH } else { (WIDTH - x).min(texels.len() as u32) };
        let height = rows.max(1);
        let (data, rest) = texels.split_at((width * height) as usize);
        queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x, y, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(data),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(WIDTH * 16), rows_per_image: None },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        (at, texels) = (at + width * height, rest);
    }
}
