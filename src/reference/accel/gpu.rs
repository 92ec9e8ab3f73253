//! The structure in two textures.

use super::{Accel, AccelError};

/// Texels in a row; `ROW_BITS` in `traverse.wgsl` is its logarithm. Every WebGPU device has textures this wide.
const ROW: u32 = 8192;

/// Bytes of a texel, four words.
const TEXEL: u32 = 16;

/// Nodes and triangles on the GPU.
#[derive(Debug)]
pub struct AccelGpu {
    nodes: wgpu::TextureView,
    triangles: wgpu::TextureView,
}

impl AccelGpu {
    /// Bindings of the two textures in `traverse.wgsl`, group 0.
    pub const BINDINGS: [u32; 2] = [1, 2];

    /// Uploads `accel`.
    ///
    /// # Errors
    /// [`AccelError::TooLarge`] when the device's textures are too small, [`AccelError::OutOfMemory`] when its memory is.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, accel: &Accel) -> Result<Self, AccelError> {
        let scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let nodes = upload(device, queue, "nodes", bytemuck::cast_slice(&accel.nodes));
        let triangles = upload(device, queue, "triangles", bytemuck::cast_slice(&accel.triangles));
        if let Some(error) = pollster::block_on(scope.pop()) {
            return Err(AccelError::OutOfMemory { bytes: accel.bytes(), message: error.to_string() });
        }
        Ok(Self { nodes: nodes?, triangles: triangles? })
    }

    /// Layout entries of the two bindings.
    pub fn layout_entries() -> [wgpu::BindGroupLayoutEntry; 2] {
        Self::BINDINGS.map(|binding| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        })
    }

    /// Bind group entries that fit [`AccelGpu::layout_entries`].
    pub fn entries(&self) -> [wgpu::BindGroupEntry<'_>; 2] {
        let [nodes, triangles] = Self::BINDINGS;
        [
            wgpu::BindGroupEntry { binding: nodes, resource: wgpu::BindingResource::TextureView(&self.nodes) },
            wgpu::BindGroupEntry { binding: triangles, resource: wgpu::BindingResource::TextureView(&self.triangles) },
        ]
    }
}

fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    what: &'static str,
    bytes: &[u8],
) -> Result<wgpu::TextureView, AccelError> {
    let texels = (bytes.len() as u64).div_ceil(u64::from(TEXEL)).max(1);
    let side = device.limits().max_texture_dimension_2d;
    let rows = texels.div_ceil(u64::from(ROW));
    if side < ROW || rows > u64::from(side) {
        let limit = if side < ROW { 0 } else { u64::from(ROW) * u64::from(side) };
        return Err(AccelError::TooLarge { what, texels, limit, side });
    }
    let size = wgpu::Extent3d { width: ROW, height: rows as u32, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(what),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    // Whole rows at once, then the last one: no padded copy of everything is made.
    let row_bytes = (ROW * TEXEL) as usize;
    let whole = (bytes.len() / row_bytes) as u32;
    let (body, tail) = bytes.split_at(whole as usize * row_bytes);
    for (data, y, width, height) in [(body, 0, ROW, whole), (tail, whole, (tail.len() as u32) / TEXEL, 1)] {
        if data.is_empty() {
            continue;
        }
        queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            data,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(ROW * TEXEL), rows_per_image: None },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }
    Ok(texture.create_view(&Default::default()))
}
