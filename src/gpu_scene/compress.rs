//! Textures in blocks of 4×4 texels (BC7, one byte a texel instead of four), encoded by Intel's
//! kernels as the crate `block_compression` has them: as shaders on a card, on all cores where the
//! device is one itself, whose driver takes two minutes and a half to compile them.

use crate::scene::mips::Level;
#[cfg(feature = "compression")]
use block_compression::{BC7Settings, CompressionVariant, GpuBlockCompressor, encode::compress_rgba8};

/// Texels of a block's side.
const BLOCK: u32 = 4;
/// Rows of blocks in a buffer begin at multiples of 256 bytes, which are 16 blocks of 16 bytes.
#[cfg(feature = "compression")]
const STRIDE: u32 = 64;
/// Texels whose encoding is waited for, so that large scenes do not lie on the device twice.
#[cfg(feature = "compression")]
const WAIT: u64 = 16 << 20;

/// Whether a picture can be kept in blocks: its sides are whole numbers of them.
pub(super) fn takes(width: u32, height: u32) -> bool {
    width.is_multiple_of(BLOCK) && height.is_multiple_of(BLOCK)
}

/// Bytes of a level in blocks.
pub(super) fn bytes(width: u32, height: u32) -> u64 {
    u64::from(width.div_ceil(BLOCK)) * u64::from(height.div_ceil(BLOCK)) * 16
}

/// Without the encoders there is none.
#[cfg(not(feature = "compression"))]
pub(super) enum Compressor {}

#[cfg(not(feature = "compression"))]
impl Compressor {
    pub fn new(_: &wgpu::Device, _: &wgpu::Queue) -> Option<Self> {
        None
    }

    pub fn write(&mut self, _: &wgpu::Texture, _: u32, _: &Level<'_>) {
        match *self {}
    }
}

/// Encodes textures one after the other.
#[cfg(feature = "compression")]
pub(super) struct Compressor {
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// The shaders, unless the CPU is the device.
    shaders: Option<GpuBlockCompressor>,
    /// Texels since the device was waited for.
    pending: u64,
}

#[cfg(feature = "compression")]
impl Compressor {
    /// `None` on a device that cannot sample such textures.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        let can = device.features().contains(wgpu::Features::TEXTURE_COMPRESSION_BC);
        let software = crate::gpu::is_software(&device.adapter_info());
        can.then(|| Self {
            device: device.clone(),
            queue: queue.clone(),
            shaders: (!software).then(|| GpuBlockCompressor::new(device.clone(), queue.clone())),
            pending: 0,
        })
    }

    /// Encodes level `mip` of `texture`, which is of a BC7 format.
    pub fn write(&mut self, texture: &wgpu::Texture, mip: u32, level: &Level<'_>) {
        let target = wgpu::TexelCopyTextureInfo { mip_level: mip, ..texture.as_image_copy() };
        let whole = extent([level.width, level.height].map(|n| n.next_multiple_of(BLOCK)));
        if self.shaders.is_some() {
            self.on_device(target, whole, level);
        } else {
            let (data, row) = blocks(level);
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
            self.queue.write_texture(target, &data, layout, whole);
        }
    }

    fn on_device(&mut self, target: wgpu::TexelCopyTextureInfo<'_>, whole: wgpu::Extent3d, level: &Level<'_>) {
        let Some(shaders) = &mut self.shaders else { return };
        let size = [level.width.next_multiple_of(STRIDE), level.height.next_multiple_of(BLOCK)];
        let source = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("scene.uncompressed"),
            size: extent(size),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            // Bytes as they are, whatever they mean.
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout =
            |row: u32| wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        self.queue.write_texture(source.as_image_copy(), &padded(level, size), layout(4 * size[0]), extent(size));
        let variant = variant();
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("scene.blocks"),
            size: variant.blocks_byte_size(size[0], size[1]) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let view = source.create_view(&Default::default());
        shaders.add_compression_task(variant, &view, size[0], size[1], &buffer, None, None);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        shaders.compress(&mut encoder.begin_compute_pass(&Default::default()));
        let from = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout: layout(variant.bytes_per_row(size[0])) };
        encoder.copy_buffer_to_texture(from, target, whole);
        self.queue.submit([encoder.finish()]);
        self.pending += u64::from(size[0]) * u64::from(size[1]);
        if self.pending >= WAIT {
            self.pending = 0;
            let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
        }
    }
}

#[cfg(feature = "compression")]
fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}

/// Four channels: alpha is coverage.
#[cfg(feature = "compression")]
fn variant() -> CompressionVariant {
    CompressionVariant::BC7(BC7Settings::alpha_fast())
}

/// Blocks of a level, row by row, and the bytes of a row of them; what lacks to whole blocks
/// repeats the last column and row.
#[cfg(feature = "compression")]
fn blocks(level: &Level<'_>) -> (Vec<u8>, u32) {
    let variant = variant();
    let [width, height] = [level.width, level.height].map(|n| n.next_multiple_of(BLOCK));
    let padded = padded(level, [width, height]);
    let (stride, row) = (4 * width, variant.bytes_per_row(width));
    let mut out = vec![0; variant.blocks_byte_size(width, height)];
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let rows = (height / BLOCK).div_ceil(cores as u32).max(1);
    std::thread::scope(|scope| {
        let bands = out.chunks_mut((row * rows) as usize).zip(padded.chunks((stride * BLOCK * rows) as usize));
        for (blocks, texels) in bands {
            let height = texels.len() as u32 / stride;
            scope.spawn(move || compress_rgba8(variant, texels, blocks, width, height, stride));
        }
    });
    (out, row)
}

/// A level with its last column and row repeated up to `size`.
#[cfg(feature = "compression")]
fn padded(level: &Level<'_>, [width, height]: [u32; 2]) -> Vec<u8> {
    let mut out = Vec::with_capacity(4 * width as usize * height as usize);
    for y in 0..height {
        let start = 4 * level.width as usize * y.min(level.height - 1) as usize;
        let row = &level.rgba[start..start + 4 * level.width as usize];
        out.extend_from_slice(row);
        for _ in level.width..width {
            out.extend_from_slice(&row[row.len() - 4..]);
        }
    }
    out
}

#[cfg(all(test, feature = "compression"))]
mod tests {
    use super::*;
    use std::borrow::Cow;

    #[test]
    fn edges_are_repeated_up_to_whole_blocks() {
        let rgba: Vec<u8> = (0..24).collect();
        let level = Level { width: 3, height: 2, rgba: Cow::Owned(rgba) };
        let wide = padded(&level, [8, 4]);
        let at = |x: usize, y: usize| &wide[4 * (8 * y + x)..][..4];
        assert_eq!((at(2, 0), at(7, 0), at(1, 3)), (&[8u8, 9, 10, 11][..], &[8, 9, 10, 11][..], &[16, 17, 18, 19][..]));
        assert!(takes(8, 4) && !takes(6, 4));
    }

    #[test]
    fn bands_make_the_blocks_that_one_band_makes() {
        let rgba: Vec<u8> = (0..4 * 64 * 52u32).map(|i| (i * i / 97 + 31 * i) as u8).collect();
        let (ours, row) = super::blocks(&Level { width: 64, height: 52, rgba: Cow::Borrowed(&rgba) });
        let variant = variant();
        let mut whole = vec![0; 16 * 16 * 13];
        compress_rgba8(variant, &rgba, &mut whole, 64, 52, 256);
        assert_eq!(row, 256);
        assert!(ours == whole);
    }
}
