//! What passes share: the G-buffer as shaders read it, cells, the mean light of a picture, groups
//! kept by view.

pub mod cells;
pub mod exposure;
mod formats;
pub mod inputs;
mod params;
mod view_cache;

pub(crate) use view_cache::ViewCache;

/// One texel that reads as 0, bound where a host has nothing.
pub(crate) fn dummy_view(device: &wgpu::Device, label: &str, format: wgpu::TextureFormat) -> wgpu::TextureView {
    texel(device, label, format, wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC)
}

/// One texel, bound where nobody asks for a picture: stores beyond it are lost.
pub(crate) fn dummy_storage(device: &wgpu::Device, label: &str) -> wgpu::TextureView {
    texel(device, label, wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::STORAGE_BINDING)
}

fn texel(
    device: &wgpu::Device,
    label: &str,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
