//! Global-illumination methods, cheapest first. Each turns the G-buffer and the analytic lights' direct light into
//! one full-resolution texture: the diffuse light that direct lighting misses (sky and every bounce), as E/π.

/// The camera's part of a method's inputs, column-major as in WGSL.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMatrices {
    /// View space (right-handed, looking down −Z) from world space.
    pub view_from_world: [[f32; 4]; 4],
    /// Clip space from view space: reversed Z (1 at the near plane, 0 at the background), jitter included.
    pub clip_from_view: [[f32; 4]; 4],
}

/// What a method reads. All textures have the same size; `render::gbuffer` says what their texels mean.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// Width and height of all textures, pixels.
    pub size: [u32; 2],
    /// Reversed-Z depth, `Depth32Float`; 0 where nothing was hit.
    pub depth: &'a wgpu::TextureView,
    /// World normal, octahedral, `Rg16Float`.
    pub normal: &'a wgpu::TextureView,
    /// Diffuse reflectance in [0, 1] (rgb) and ambient occlusion from textures (a), `Rgba8UnormSrgb`.
    pub albedo: &'a wgpu::TextureView,
    /// Emitted radiance, `Rgba16Float`.
    pub emissive: &'a wgpu::TextureView,
    /// Direct diffuse light of the analytic lights as E/π, albedo not multiplied in, `Rgba16Float`.
    pub direct: &'a wgpu::TextureView,
    /// The camera that drew them.
    pub camera: CameraMatrices,
    /// Radiance of the constant environment, W/(m²·sr).
    pub environment: [f32; 3],
}
