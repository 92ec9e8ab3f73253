//! What hosts hand over, what a method is, and what can go wrong: nothing here knows any method.

mod conventions;
mod error;
pub mod technique;

pub use conventions::{
    AlbedoEncoding, Conventions, Depth, Forward, Jitter, LightScale, MotionJitter, MotionSense, MotionUnits,
    NormalEncoding, NormalRange, NormalSpace,
};
pub use error::GiError;

/// The camera's part of a method's inputs, column-major as in WGSL.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMatrices {
    /// View space (looking down −Z, unless [`Conventions::forward`] says otherwise) from world
    /// space.
    pub view_from_world: [[f32; 4]; 4],
    /// Clip space from view space: a perspective whose depth and jitter are as [`Conventions`] say.
    pub clip_from_view: [[f32; 4]; 4],
}

/// What a method reads. All textures have the same size and usage TEXTURE_BINDING; how their texels
/// are to be read, [`Conventions`] say. [`Inputs::new`] has what every method needs; what is left
/// out has the fallback that its field names.
///
/// ```
/// use bouncelight::gi::{CameraMatrices, Conventions, Depth, Inputs};
/// use bouncelight::wgpu::TextureView;
///
/// fn inputs<'a>([depth, normal, motion]: [&'a TextureView; 3], camera: CameraMatrices, cut: bool) -> Inputs<'a> {
///     let conventions = Conventions { depth: Depth::Forward, ..Default::default() };
///     Inputs { motion: Some(motion), conventions, reset: cut, ..Inputs::new([1280, 720], depth, normal, camera) }
/// }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// Width and height of all textures, pixels.
    pub size: [u32; 2],
    /// Depth: a depth format or `R32Float`. Of a format with a stencil, a view of the depth alone.
    pub depth: &'a wgpu::TextureView,
    /// Normals: `Rg16Float` by default, else any format that has the numbers of
    /// [`Conventions::normal_encoding`].
    pub normal: &'a wgpu::TextureView,
    /// Diffuse reflectance in [0, 1] (rgb), 8 or 10 bits or float. Alpha is not read: whoever
    /// multiplies the light with albedo applies the textures' ambient occlusion, too. `gather` reads it
    /// only for what mirrors show ([`Inputs::specular`]), and does without: mirrors then show each
    /// triangle's mean colour. The others end with [`GiError::Missing`] without.
    pub albedo: Option<&'a wgpu::TextureView>,
    /// Emitted radiance, `Rgba16Float`, `Rgba32Float` or `Rg11b10Ufloat`. `gather` reads it as it does albedo; for the others `None`
    /// counts as no surface that glows.
    pub emissive: Option<&'a wgpu::TextureView>,
    /// Direct diffuse light of the analytic lights as E/π, albedo not multiplied in, in a format
    /// as `emissive`. Not read by `gather`, needed by the others.
    pub direct: Option<&'a wgpu::TextureView>,
    /// The camera that drew them.
    pub camera: CameraMatrices,
    /// How texels and matrices are to be read.
    pub conventions: Conventions,
    /// Radiance of the constant environment, W/(m²·sr).
    pub environment: [f32; 3],
    /// The analytic lights, for methods that light more than the picture; `None` counts as no
    /// lights there.
    pub lights: Option<Lights<'a>>,
    /// The scene as rays meet it, for methods that ask it
    /// ([`Method::needs_rays`](super::Method::needs_rays)).
    pub rays: Option<Rays<'a>>,
    /// Where each pixel's surface was in the frame before: texture coordinates then minus now, y
    /// down, free of jitter, unless [`Conventions`] say otherwise; `Rg16Float`, `Rg32Float`,
    /// `Rgba16Float` or `Rgba32Float`. For methods that remember frames. `None` counts as everything at rest: what
    /// moves on the screen starts anew where plane or normal differ, and drags its light where not.
    pub motion: Option<&'a wgpu::TextureView>,
    /// `Rgba8Unorm(Srgb)`: F0 and perceptual roughness, for methods that find what lobes show
    /// ([`Outputs::specular`]). `None`: no lobes.
    pub specular: Option<&'a wgpu::TextureView>,
    /// The picture has nothing to do with the one before (a cut): what is remembered of pixels is
    /// forgotten first.
    pub reset: bool,
}

impl<'a> Inputs<'a> {
    /// What `gather` cannot do without, in this crate's own conventions; everything else is left
    /// out.
    pub fn new(
        size: [u32; 2],
        depth: &'a wgpu::TextureView,
        normal: &'a wgpu::TextureView,
        camera: CameraMatrices,
    ) -> Self {
        Self {
            size,
            depth,
            normal,
            albedo: None,
            emissive: None,
            direct: None,
            camera,
            conventions: Conventions::default(),
            environment: [0.0; 3],
            lights: None,
            rays: None,
            motion: None,
            specular: None,
            reset: false,
        }
    }
}

/// Where a method writes: `Rgba16Float`, usage STORAGE_BINDING, the inputs' size.
#[derive(Debug, Clone, Copy)]
pub struct Outputs<'a> {
    /// Becomes the light that direct lighting misses, as E/π; 0 on the background.
    pub light: &'a wgpu::TextureView,
    /// Becomes what specular lobes reflect of surroundings and bounces, W/(m²·sr), to be added to
    /// the picture; 0 on the background. Of methods that send rays into lobes, with
    /// [`Inputs::specular`]; others leave it as it was
    /// ([`Technique::writes_specular`](technique::Technique::writes_specular)).
    pub specular: Option<&'a wgpu::TextureView>,
}

impl<'a> From<&'a wgpu::TextureView> for Outputs<'a> {
    fn from(light: &'a wgpu::TextureView) -> Self {
        Self { light, specular: None }
    }
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
    /// [`crate::lights::LightGpu`] for each.
    pub buffer: &'a wgpu::Buffer,
    /// How many.
    pub count: u32,
    /// Some of them stand in for emissive surfaces, and their light is in [`Inputs::direct`].
    pub has_emissive_proxies: bool,
    /// To be raised whenever a light changes. What is not announced leaves old light for many
    /// frames.
    pub version: u64,
}
