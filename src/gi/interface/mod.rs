//! What hosts hand over, what a method is, and what can go wrong: nothing here knows any method.

mod error;
pub mod rung;

pub use error::GiError;

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
    /// Diffuse reflectance in [0, 1] (rgb), `Rgba8UnormSrgb`. Alpha is not read: whoever multiplies the light with albedo
    /// applies the textures' ambient occlusion, too.
    pub albedo: &'a wgpu::TextureView,
    /// Emitted radiance, `Rgba16Float`.
    pub emissive: &'a wgpu::TextureView,
    /// Direct diffuse light of the analytic lights as E/π, albedo not multiplied in, `Rgba16Float`.
    pub direct: &'a wgpu::TextureView,
    /// The camera that drew them.
    pub camera: CameraMatrices,
    /// Radiance of the constant environment, W/(m²·sr).
    pub environment: [f32; 3],
    /// The analytic lights, for methods that light more than the picture; `None` counts as no lights there.
    pub lights: Option<Lights<'a>>,
    /// The scene as rays meet it, for methods that ask it ([`Method::needs_rays`](super::Method::needs_rays)).
    pub rays: Option<Rays<'a>>,
    /// Where each pixel's surface was in the frame before: texture coordinates then minus now, y down, free of jitter, `Rg16Float`;
    /// for methods that remember frames. `None` counts as everything at rest.
    pub motion: Option<&'a wgpu::TextureView>,
    /// `Rgba8Unorm(Srgb)`: F0 and perceptual roughness, for methods that find what lobes show ([`Rung::gloss`](rung::Rung::gloss)).
    pub specular: Option<&'a wgpu::TextureView>,
}

/// The scene as rays meet it.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    /// Its triangles.
    pub scene: &'a crate::accel::SceneRays,
    /// Lat-long picture of the surroundings, `Rgba32Float`; one texel for a constant sky.
    pub environment: &'a wgpu::TextureView,
}

impl std::fmt::Debug for Rays<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rays").field("scene", &self.scene.counts()).finish_non_exhaustive()
    }
}

/// The analytic lights on the GPU.
#[derive(Debug, Clone, Copy)]
pub struct Lights<'a> {
    /// [`crate::scene::upload::LightGpu`] for each.
    pub buffer: &'a wgpu::Buffer,
    /// How many.
    pub count: u32,
    /// Some of them stand for surfaces that glow, and their light is in [`Inputs::direct`].
    pub stand_in: bool,
    /// Another number whenever a light is another than before, so that what is remembered of their light is forgotten sooner.
    pub epoch: u64,
}
