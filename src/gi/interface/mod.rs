//! What hosts hand over, what a method is, and what can go wrong: nothing here knows any method.

mod conventions;
mod error;
pub mod technique;

pub use conventions::{
    AlbedoEncoding, Conventions, Depth, Forward, Jitter, LightScale, MotionJitter, MotionSense, MotionUnits,
    NormalEncoding, NormalRange, NormalSpace,
};
pub use error::GiError;

/// The camera's matrices, column-major as in WGSL. They must be those that drew the inputs: with
/// others, positions are wrong, and light moves with the camera or leaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMatrices {
    /// View space (looking down −Z, unless [`Conventions::forward`] says otherwise) from world
    /// space.
    pub view_from_world: [[f32; 4]; 4],
    /// Clip space from view space: a perspective whose depth and jitter are as [`Conventions`] say.
    pub clip_from_view: [[f32; 4]; 4],
}

/// Inputs of a method. All textures have the same size and usage TEXTURE_BINDING; [`Conventions`]
/// say how to read their texels. [`Inputs::new`] has what every method needs; each further field
/// names what happens without it. [`View::check`](crate::gi::View::check) finds most mistakes.
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
    /// Width and height of all textures, pixels: 1 to the device's limit. Another size than before
    /// drops all history.
    pub size: [u32; 2],
    /// Depth: a depth format or `R32Float`. Of a format with a stencil, a view of the depth alone.
    /// Too coarse (16 bits of far depth) makes surfaces look stepped, and light blotchy.
    pub depth: &'a wgpu::TextureView,
    /// Shading normals: `Rg16Float` by default, else any format that has the numbers of
    /// [`Conventions::normal_encoding`]. With 8 bits, smooth surfaces show bands.
    pub normal: &'a wgpu::TextureView,
    /// Diffuse reflectance (rgb) in [0, 1], 8 or 10 bits or float; values beyond are clamped. Alpha
    /// is not read: whoever multiplies the light with albedo applies ambient occlusion maps, too.
    /// `gather` reads it only for what mirrors show ([`Inputs::specular`]). Default `None`: mirrors
    /// show each triangle's mean colour; `ambient` and `ssgi` end with [`GiError::Missing`].
    pub albedo: Option<&'a wgpu::TextureView>,
    /// Emitted radiance, W/(m²·sr), 0 or more; `Rgba16Float`, `Rgba32Float` or `Rg11b10Ufloat`.
    /// `gather` reads it as it does albedo. Default `None`: nothing emits for the other methods.
    pub emissive: Option<&'a wgpu::TextureView>,
    /// Direct diffuse light of the analytic lights, E/π in W/(m²·sr), not multiplied by albedo; a
    /// format as `emissive`. `gather` does not read it. Default `None`: the others end with
    /// [`GiError::Missing`]. Multiplied by albedo, bounces are too dark.
    pub direct: Option<&'a wgpu::TextureView>,
    /// The camera that drew them.
    pub camera: CameraMatrices,
    /// How texels and matrices are to be read. Default: those of this crate's renderer.
    pub conventions: Conventions,
    /// Radiance of the constant environment, W/(m²·sr), 0 or more. Default 0, no sky. [`View`]
    /// takes that of its [`World`] instead.
    ///
    /// [`View`]: crate::gi::View
    /// [`World`]: crate::gi::World
    pub environment: [f32; 3],
    /// The analytic lights, for methods that light what rays hit. Default `None`: no lights there,
    /// so that what only a bounce lights is black.
    pub lights: Option<Lights<'a>>,
    /// The scene for rays, which methods with [`Method::needs_rays`](super::Method::needs_rays)
    /// read. Default `None`: they end with [`GiError::Rays`], or a [`View`](crate::gi::View) lets
    /// `ssgi` draw.
    pub rays: Option<Rays<'a>>,
    /// Motion vectors: texture coordinates of each pixel's surface in the last frame minus now, y
    /// down, without jitter, unless [`Conventions`] say otherwise; `Rg16Float`, `Rg32Float`,
    /// `Rgba16Float` or `Rgba32Float`. Default `None`, everything at rest: what moves on the screen
    /// starts anew where plane or normal differ, and drags its light along where not.
    pub motion: Option<&'a wgpu::TextureView>,
    /// F0 (rgb) and perceptual roughness (a) in [0, 1], `Rgba8Unorm(Srgb)`, for methods that write
    /// [`Outputs::specular`]. Default `None`: no specular light.
    pub specular: Option<&'a wgpu::TextureView>,
    /// Whether this frame has nothing to do with the last (a camera cut): the history of pixels is
    /// dropped. Default `false`. Set in every frame, pictures stay noisy; forgotten at a cut, old
    /// light shows for a few frames where surfaces happen to agree.
    pub reset: bool,
    /// A promise that whatever changes in depth and normals, camera and jitter aside, is also told by
    /// `rays` or `lights`: no skin, wind or dither beyond what rays meet. Then a still view may
    /// [show its cells again](super::gather::Options::rest). Default `false`. Broken, what moves
    /// shows light of up to three frames ago.
    pub moves_with_world: bool,
}

impl<'a> Inputs<'a> {
    /// Inputs that every method needs, in this crate's own conventions, without the others.
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
            moves_with_world: false,
        }
    }
}

/// Outputs of a method: `Rgba16Float`, usage STORAGE_BINDING, the inputs' size.
#[derive(Debug, Clone, Copy)]
pub struct Outputs<'a> {
    /// The light that direct lighting misses, E/π in W/(m²·sr); 0 on the background. Add albedo
    /// times it to the picture.
    pub light: &'a wgpu::TextureView,
    /// Specular radiance of surroundings and bounces, W/(m²·sr), to be added to the picture; 0 on
    /// the background. Written by methods that trace specular rays, with [`Inputs::specular`];
    /// others leave it as it was
    /// ([`Technique::writes_specular`](technique::Technique::writes_specular)).
    pub specular: Option<&'a wgpu::TextureView>,
}

impl<'a> From<&'a wgpu::TextureView> for Outputs<'a> {
    fn from(light: &'a wgpu::TextureView) -> Self {
        Self { light, specular: None }
    }
}

/// The scene for rays.
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
    /// How many lights the buffer holds; those beyond are not read.
    pub count: u32,
    /// Whether some are emissive proxies, whose light is in [`Inputs::direct`]. Set wrongly, light of
    /// emissive surfaces counts twice or not at all.
    pub has_emissive_proxies: bool,
    /// A number that differs whenever a light changes. Without it old light stays for many frames;
    /// changed in every frame, histories are short and pictures noisy.
    pub version: u64,
}
