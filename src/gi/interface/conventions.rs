//! Encodings of a host's G-buffer. The defaults are this crate's own renderer's
//! (`render::gbuffer`).

/// The conventions of [`Inputs`](super::Inputs), resolved into a uniform and read in
/// `shaders/gi/inputs.wgsl`.
///
/// ```
/// use bouncelight::gi::{Conventions, Depth, MotionUnits, NormalEncoding, NormalRange, NormalSpace};
/// // Depth 0 near and 1 far, view-space normals in `Rgb10a2Unorm`, motion in pixels.
/// let conventions = Conventions {
///     depth: Depth::Forward,
///     normal_encoding: NormalEncoding::Xyz,
///     normal_range: NormalRange::Unsigned,
///     normal_space: NormalSpace::View,
///     motion_units: MotionUnits::Pixels,
///     ..Default::default()
/// };
/// assert_ne!(conventions, Conventions::default());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Conventions {
    /// Direction of depth. Default [`Depth::Reversed`]; wrong, everything counts as background or
    /// lies at wrong distances. The projection tells whether the far plane is finite.
    pub depth: Depth,
    /// Encoding of normals. Default [`NormalEncoding::Octahedral`]; wrong, light has the pattern of
    /// false normals.
    pub normal_encoding: NormalEncoding,
    /// Range of their numbers. Default [`NormalRange::Signed`].
    pub normal_range: NormalRange,
    /// Space of their axes. Default [`NormalSpace::World`]; wrong, light turns with the camera.
    pub normal_space: NormalSpace,
    /// Encoding of albedo. Default [`AlbedoEncoding::Linear`]; wrong, bounces are too dark or pale.
    pub albedo: AlbedoEncoding,
    /// Scale of direct and emitted light. Default [`LightScale::Radiance`]; wrong, bounces have
    /// another brightness than the picture.
    pub light: LightScale,
    /// Unit of motion. Default [`MotionUnits::Uv`]; wrong, histories are lost wherever anything
    /// moves.
    pub motion_units: MotionUnits,
    /// Direction of motion. Default [`MotionSense::ToPast`]; wrong, light smears in motion.
    pub motion_sense: MotionSense,
    /// Whether motion includes the difference of the two frames' jitter. Default
    /// [`MotionJitter::Free`]; wrong, a still picture counts as moving and stays noisier.
    pub motion_jitter: MotionJitter,
    /// Place of the jitter. Default [`Jitter::InProjection`]; wrong, edges shimmer.
    pub jitter: Jitter,
    /// Direction in which the camera's matrices look. Default [`Forward::NegativeZ`]; wrong, the
    /// projection is refused.
    pub forward: Forward,
}

/// Direction of depth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Depth {
    /// 1 at the near plane, 0 at the far plane or at infinity; 0 where nothing was hit.
    #[default]
    Reversed,
    /// 0 at the near plane, 1 at the far plane or at infinity; 1 where nothing was hit.
    Forward,
    /// The same, by a projection whose clip space is −w to w (OpenGL's); the texture holds 0 to 1.
    ForwardGl,
}

/// Encoding of normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NormalEncoding {
    /// Two numbers, octahedral (Cigolle et al. 2014; `shaders/lib/octahedral.wgsl`).
    #[default]
    Octahedral,
    /// The vector, of any length.
    Xyz,
    /// x and y of a unit vector in view space that points to the eye, |z| = √(1 − x² − y²).
    Xy,
}

/// Range of a normal's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NormalRange {
    /// −1 to 1 as they are, in floats or a signed format.
    #[default]
    Signed,
    /// 0 to 1, v · ½ + ½.
    Unsigned,
}

/// Space of normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NormalSpace {
    /// The world's.
    #[default]
    World,
    /// The camera's: x right, y up, z to the eye, or away from it with [`Forward::PositiveZ`]
    /// ([`CameraMatrices::view_from_world`](super::CameraMatrices)).
    View,
}

/// Encoding of albedo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AlbedoEncoding {
    /// Linear values: of an sRGB view, which the texture unit decodes, or stored so.
    #[default]
    Linear,
    /// sRGB values: stored by a shader that encoded them, in a texture that is not sRGB.
    Srgb,
}

/// Scale of direct and emitted light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum LightScale {
    /// Nothing: E/π and radiance in W/(m²·sr), as of the world's lights.
    #[default]
    Radiance,
    /// An exposure, above 0. The answer is not: multiply it by the same number.
    PreExposed(f32),
}

/// Unit of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MotionUnits {
    /// Texture coordinates: the picture is 1 wide and 1 high, y down.
    #[default]
    Uv,
    /// Pixels, y down.
    Pixels,
    /// Clip space over w: the picture is 2 wide and 2 high, y up.
    Ndc,
}

/// Direction of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MotionSense {
    /// Where the surface was in the frame before, minus where it is.
    #[default]
    ToPast,
    /// Where it is, minus where it was.
    FromPast,
}

/// Jitter in motion vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MotionJitter {
    /// No: a surface at rest has no motion.
    #[default]
    Free,
    /// Yes: both places are those of jittered pictures.
    Included,
}

/// Place of the jitter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Jitter {
    /// In the projection, if there is any.
    #[default]
    InProjection,
    /// Not in the projection: the picture was drawn this far to the right and down of it, pixels.
    Pixels([f32; 2]),
}

/// Direction in which view space looks. The world may be left-handed, too: its triangles then face where
/// (b − a) × (c − a) points, as they do in a right-handed one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Forward {
    /// Down −Z (OpenGL, Vulkan as glTF has it): w of a perspective is −z.
    #[default]
    NegativeZ,
    /// Down +Z (Direct3D's left-handed matrices): w of a perspective is z.
    PositiveZ,
}
