//! Types of bindings that passes have.

pub const UNIFORM: wgpu::BindingType = wgpu::BindingType::Buffer {
    ty: wgpu::BufferBindingType::Uniform,
    has_dynamic_offset: false,
    min_binding_size: None,
};

pub const READ: wgpu::BindingType = storage(true);
pub const READ_WRITE: wgpu::BindingType = storage(false);

const fn storage(read_only: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

/// A colour or depth texture read with `textureLoad`.
pub const LOAD: wgpu::BindingType = texture(LOADED, wgpu::TextureViewDimension::D2);
/// Layers of depth read with `textureLoad`.
pub const LOAD_ARRAY: wgpu::BindingType = texture(LOADED, wgpu::TextureViewDimension::D2Array);
/// Layers of depth read through a comparison sampler.
pub const COMPARE_ARRAY: wgpu::BindingType =
    texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2Array);

// Depth, too: GLSL has no plain load from a depth texture, so the GL backends would refuse `Depth`
// here.
const LOADED: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

const fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

/// A colour texture read through a filtering sampler.
pub const SAMPLE: wgpu::BindingType =
    texture(wgpu::TextureSampleType::Float { filterable: true }, wgpu::TextureViewDimension::D2);
/// The sampler for it.
pub const SAMPLER: wgpu::BindingType = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);

/// An `Rgba16Float` texture written by a compute shader.
pub const STORE_HALF: wgpu::BindingType = wgpu::BindingType::StorageTexture {
    access: wgpu::StorageTextureAccess::WriteOnly,
    format: wgpu::TextureFormat::Rgba16Float,
    view_dimension: wgpu::TextureViewDimension::D2,
};
