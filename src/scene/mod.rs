//! A scene as plain data: meshes, instances, materials, images, lights, cameras, environment.
//!
//! Scene space is glTF's: right-handed, +Y up, metres; cameras look down −Z. Colours are linear
//! Rec.709. Light is radiometric (W/m², W/sr, W/(m²·sr)); photometric file units are divided by 683
//! lm/W at the border. Nothing here knows wgpu.
//!
//! ```
//! use bouncelight::scene::{Camera, Environment, Instance, LightKind, Material, Mesh, Scene};
//! let up = [0.0, 1.0, 0.0];
//! let floor = Mesh {
//!     positions: vec![[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]],
//!     normals: vec![up; 4],
//!     indices: vec![0, 1, 2, 0, 2, 3],
//!     ..Default::default()
//! };
//! floor.check(1)?;
//! let identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
//! let lamp = LightKind::Point { position: [0.0, 2.0, 0.0], intensity: 5.0, radius: 0.05, range: None };
//! let scene = Scene {
//!     meshes: vec![floor],
//!     instances: vec![Instance { name: "floor".into(), mesh: 0, transform: identity }],
//!     materials: vec![Material::default()],
//!     lights: vec![lamp.into()],
//!     cameras: vec![Camera::look_at([0.0, 1.6, 3.0], [0.0; 3], 0.8)],
//!     environment: Environment::constant([0.1, 0.12, 0.15]),
//!     ..Default::default()
//! };
//! assert_eq!(scene.instances.len(), 1);
//! # Ok::<_, String>(())
//! ```

#[doc(hidden)]
pub mod bounds;
mod camera;
pub mod deform;
pub mod environment;
#[doc(hidden)]
pub mod mips;
#[doc(hidden)]
pub mod octahedral;
pub mod rig;

pub use environment::Environment;

/// A whole scene, ready to be uploaded.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// File stem or bundled name; for messages and metadata.
    pub name: String,
    /// Triangle meshes; one [`Mesh`] is one glTF primitive.
    pub meshes: Vec<Mesh>,
    /// Placements of meshes.
    pub instances: Vec<Instance>,
    /// Materials; never empty when there is a mesh.
    pub materials: Vec<Material>,
    /// Decoded texture images.
    pub images: Vec<Image>,
    /// Lights; a loader adds a default one where the file has none.
    pub lights: Vec<Light>,
    /// Cameras; a loader adds one that frames the scene where the file has none, so index 0 exists.
    pub cameras: Vec<Camera>,
    /// Light from beyond the scene.
    pub environment: Environment,
    /// Names of the variants of materials that the file has; see [`Scene::choose_variant`].
    pub variants: Vec<String>,
    /// Meshes whose vertices move, as they stand now; each is placed by the instances of one node.
    pub deforms: Vec<deform::Deform>,
    /// Animations and joints, if there are any; see [`Scene::pose`].
    pub rig: Option<rig::Rig>,
    /// The sun and the sky are those that the loader adds where a file has no light; see
    /// `bouncelight_scene::defaults::surround`.
    pub default_light: bool,
    /// The file has no lights, only glow if anything, so nobody knows how bright pictures of it are
    /// meant to be: they are exposed by measure unless somebody says otherwise.
    pub lightless: bool,
    /// Repairs and omissions while loading, one plain sentence each, naming the file and
    /// place.
    pub warnings: Vec<String>,
}

/// Triangles with per-vertex attributes. All vertex arrays have the length of `positions` or are
/// empty.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Name in the file, for messages.
    pub name: String,
    /// Object space, metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, object space; always present.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangent and handedness (±1) as in glTF; empty when no normal map needs it.
    pub tangents: Vec<[f32; 4]>,
    /// First texture coordinate set, origin at the top left; empty when absent.
    pub uv0: Vec<[f32; 2]>,
    /// Second texture coordinate set; empty when absent.
    pub uv1: Vec<[f32; 2]>,
    /// Linear vertex colour that multiplies the base colour; empty when absent.
    pub colors: Vec<[f32; 4]>,
    /// Three per triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// The same for each of [`Scene::variants`]; empty where none differs.
    pub variants: Vec<usize>,
}

impl Mesh {
    /// Whether the arrays agree with each other and with a scene of `materials` materials.
    ///
    /// # Errors
    /// What disagrees, in words that follow the mesh's name.
    pub fn check(&self, materials: usize) -> Result<(), String> {
        let n = self.positions.len();
        let arrays = [
            ("normals", self.normals.len(), false),
            ("tangents", self.tangents.len(), true),
            ("uv0", self.uv0.len(), true),
            ("uv1", self.uv1.len(), true),
            ("colors", self.colors.len(), true),
        ];
        for (name, len, optional) in arrays {
            if len != n && !(optional && len == 0) {
                return Err(format!("{len} {name} for {n} positions"));
            }
        }
        if !self.indices.len().is_multiple_of(3) {
            return Err(format!("{} indices do not make whole triangles", self.indices.len()));
        }
        if let Some(i) = self.indices.iter().find(|&&i| i as usize >= n) {
            return Err(format!("index {i} with {n} vertices"));
        }
        if self.material >= materials {
            return Err(format!("material {} of {materials}", self.material));
        }
        Ok(())
    }
}

/// One placement of a mesh.
#[derive(Debug, Clone)]
pub struct Instance {
    /// Node name in the file.
    pub name: String,
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Column-major world-from-object matrix.
    pub transform: [[f32; 4]; 4],
}

/// Use of a material's alpha.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// Fragments below the cutoff are discarded.
    Mask {
        /// Alpha threshold in [0, 1].
        cutoff: f32,
    },
    /// Drawn by stochastic coverage: a fragment survives with probability alpha, so `--samples N`
    /// converges to blending.
    Blend,
}

/// glTF metallic-roughness material.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name in the file, for messages.
    pub name: String,
    /// Linear base colour and alpha.
    pub base_color: [f32; 4],
    /// Multiplies `base_color` (sRGB image).
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness; GGX α is its square.
    pub roughness: f32,
    /// Reflectance of a dielectric at normal incidence: 0.04 for index 1.5; 0 leaves a purely
    /// diffuse surface (KHR_materials_ior, KHR_materials_specular). Metals take their base colour
    /// instead. Where it is coloured, the largest of the three, which is what the diffuse light
    /// loses.
    pub f0: f32,
    /// Colour of that reflectance, the largest component 1: `f0 · specular_tint` at normal
    /// incidence, white at grazing angles. White but for files with KHR_materials_specular or
    /// KHR_materials_pbrSpecularGlossiness.
    pub specular_tint: [f32; 3],
    /// Green multiplies roughness, blue multiplies metallic (linear image).
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map (linear image).
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Red is ambient occlusion (linear image).
    pub occlusion_texture: Option<TextureRef>,
    /// Strength of the occlusion map in [0, 1].
    pub occlusion_strength: f32,
    /// Emitted radiance, W/(m²·sr); the KHR_materials_emissive_strength factor is multiplied in.
    pub emissive: [f32; 3],
    /// Multiplies `emissive` (sRGB image).
    pub emissive_texture: Option<TextureRef>,
    /// Alpha handling.
    pub alpha_mode: AlphaMode,
    /// Back faces are drawn with flipped normals; otherwise they are culled.
    pub double_sided: bool,
    /// KHR_materials_unlit: base colour is shown as it is and takes no light.
    pub unlit: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            f0: DIELECTRIC_F0,
            specular_tint: [1.0; 3],
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: [0.0; 3],
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
        }
    }
}

impl Material {
    /// `emissive` for whoever draws: 0 in channels that are negative or no number.
    pub fn emission(&self) -> [f32; 3] {
        self.emissive.map(|e| if e.is_finite() { e.max(0.0) } else { 0.0 })
    }
}

/// A use of an image by a material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::images`].
    pub image: usize,
    /// Filtering and wrapping.
    pub sampler: Sampler,
    /// 0 reads `uv0`, 1 reads `uv1`.
    pub uv_set: u8,
    /// KHR_texture_transform as rows of a 2×3 affine matrix: `uv' = [m[0]·(u,v,1), m[1]·(u,v,1)]`.
    pub transform: [[f32; 3]; 2],
}

/// Filtering and wrapping of a texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Linear (true) or nearest magnification.
    pub mag_linear: bool,
    /// Linear (true) or nearest minification.
    pub min_linear: bool,
    /// Wrapping in u and v.
    pub wrap: [Wrap; 2],
}

impl Default for Sampler {
    fn default() -> Self {
        Self { mag_linear: true, min_linear: true, wrap: [Wrap::Repeat; 2] }
    }
}

/// Continuation of a texture outside [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Tiles.
    Repeat,
    /// Tiles mirrored.
    MirroredRepeat,
    /// Extends the edge.
    ClampToEdge,
}

impl Wrap {
    /// The texel of `side` in which a coordinate lies; of one that is not finite the first.
    #[inline(always)]
    pub fn texel(self, at: f32, side: usize) -> usize {
        let at = if at.is_finite() { at } else { 0.0 };
        let at = match self {
            Self::Repeat => at - at.floor(),
            Self::MirroredRepeat => 1.0 - ((at * 0.5 - (at * 0.5).floor()) * 2.0 - 1.0).abs(),
            Self::ClampToEdge => at.clamp(0.0, 1.0),
        };
        ((at * side as f32) as usize).min(side.saturating_sub(1))
    }
}

/// Encoding of the bytes of an [`Image`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// sRGB transfer function on red, green and blue.
    Srgb,
    /// Bytes divided by 255.
    Linear,
}

impl ColorSpace {
    /// Linear value of red, green or blue, in [0, 1] both.
    pub fn decode(self, v: f32) -> f32 {
        match self {
            ColorSpace::Srgb => crate::srgb::decode(v),
            ColorSpace::Linear => v,
        }
    }
}

/// A decoded texture image: 8-bit RGBA, rows from the top.
#[derive(Debug, Clone)]
pub struct Image {
    /// Name or path in the file, for messages.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// `4 · width · height` bytes.
    pub rgba: Vec<u8>,
    /// Transfer function of the bytes.
    pub color_space: ColorSpace,
}

/// A light. `color` is a linear tint that multiplies the kind's strength.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// Name in the file.
    pub name: String,
    /// Linear Rec.709 tint.
    pub color: [f32; 3],
    /// Kind, place and strength.
    pub kind: LightKind,
    /// Whether it is an emissive proxy: the rasteriser, which cannot see emission, uses it in place of
    /// an emissive surface; the path tracer leaves it out.
    pub is_emissive_proxy: bool,
}

impl From<LightKind> for Light {
    /// A white light of its own.
    fn from(kind: LightKind) -> Self {
        Self { name: String::new(), color: [1.0; 3], kind, is_emissive_proxy: false }
    }
}

/// Kinds of analytic light, in world space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightKind {
    /// The sun: parallel light with an angular size.
    Directional {
        /// Unit vector along which light travels.
        direction: [f32; 3],
        /// Irradiance on a surface that faces it, W/m².
        irradiance: f32,
        /// Angular diameter, radians.
        angle: f32,
    },
    /// A small sphere that shines in all directions.
    Point {
        /// Centre, metres.
        position: [f32; 3],
        /// Radiant intensity, W/sr.
        intensity: f32,
        /// Radius of the sphere, metres; sets the softness of shadows.
        radius: f32,
        /// Distance beyond which it is cut off (KHR_lights_punctual), if any.
        range: Option<f32>,
    },
    /// A small disc or sphere that shines into a cone.
    Spot {
        /// Centre, metres.
        position: [f32; 3],
        /// Unit vector along the cone's axis, away from the light.
        direction: [f32; 3],
        /// Radiant intensity on the axis, W/sr.
        intensity: f32,
        /// Radius of the source, metres.
        radius: f32,
        /// Cut-off distance, if any.
        range: Option<f32>,
        /// Half angle inside which intensity is full, radians.
        inner_angle: f32,
        /// Half angle outside which there is no light, radians, at most π/2.
        outer_angle: f32,
    },
}

/// A perspective camera that looks down its own −Z.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// Column-major world-from-camera matrix without scale.
    pub transform: [[f32; 4]; 4],
    /// Vertical field of view, radians.
    pub yfov: f32,
    /// Width by height of the picture that its maker framed, if known.
    pub aspect: Option<f32>,
    /// Near plane, metres, above 0.
    pub near: f32,
    /// Far plane, metres; `f32::INFINITY` where the file gives none. Never used to clip.
    pub far: f32,
}

/// Reflectance at normal incidence of a dielectric of index 1.5, which is what glTF materials have
/// by default.
pub const DIELECTRIC_F0: f32 = 0.04;

/// Lumens per watt by which glTF's photometric light units are divided.
pub const LUMENS_PER_WATT: f32 = 683.0;

/// Angular diameter that a directional light gets when its file gives none: the real sun's,
/// radians.
pub const SUN_ANGLE: f32 = 0.00918;
