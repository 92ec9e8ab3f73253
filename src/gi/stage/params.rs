//! The uniform that every stage of `gi/` reads: camera, size, and the host's conventions resolved
//! into numbers.

use crate::gi::interface::{
    AlbedoEncoding, CameraMatrices, Conventions, Depth, Forward, GiError, Inputs, Jitter, LightScale, MotionJitter,
    MotionSense, MotionUnits, NormalEncoding, NormalRange, NormalSpace,
};
use glam::{Mat3, Mat4, Vec3};
use std::hash::{Hash, Hasher};

/// Normals are vectors, or x and y of such, not octahedral. These bits and the next ones:
/// `STORED_*` of `inputs.wgsl`.
const XYZ: u32 = 1;
const XY: u32 = 2;
/// They are v · ½ + ½.
const UNSIGNED: u32 = 4;
/// They are along the camera's axes.
const IN_VIEW: u32 = 8;
/// Albedo is read sRGB-encoded.
const SRGB: u32 = 16;
/// Light is multiplied by an exposure. A bit, since a factor of 1 would change how compilers round
/// sums with light.
const EXPOSED: u32 = 32;
/// In view space they are along axes of which z points away from the eye.
const AHEAD: u32 = 64;

/// Pixels on a side of a cell; `CELL` in `shaders/gi/inputs.wgsl`.
pub const CELL: u32 = 4;

/// Width and height of the low resolution: `ceil(size / 4)`.
pub fn cells_of(size: [u32; 2]) -> [u32; 2] {
    size.map(|n| n.div_ceil(CELL))
}

/// The pixel that stands for a cell of a picture of `size` pixels: `sample_pixel` of
/// `shaders/gi/inputs.wgsl`.
pub fn sample_pixel(cell: [u32; 2], size: [u32; 2]) -> [u32; 2] {
    std::array::from_fn(|i| (CELL * cell[i] + CELL / 2).min(size[i] - 1))
}

/// `Params` of `shaders/gi/inputs.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Params {
    /// Pixels.
    pub size: [u32; 2],
    /// Cells.
    pub cells: [u32; 2],
    /// 1/p00, 1/p11, p02, p12 of the projection (row, column).
    pub unproject: [f32; 4],
    /// View distance = `depth[0] / (texel + depth[1])`; the background's texel; by how much of
    /// itself a metre of distance is wrong for each metre, because texels are rounded (0 where that
    /// is a constant share: reversed floats).
    pub depth: [f32; 4],
    /// Environment radiance (rgb), finite and not negative; one spare.
    pub environment: [f32; 4],
    /// Columns of the rotation from view space to the gravity frame.
    pub gravity_from_view: [[f32; 4]; 3],
    /// Columns of the rotation from world space to the gravity frame.
    pub gravity_from_world: [[f32; 4]; 3],
    /// Columns of the rotation from view space to world space.
    pub world_from_view: [[f32; 4]; 3],
    /// The eye in world space, metres; one spare.
    pub eye: [f32; 4],
    /// Texture coordinates, then minus now = texel · xy + zw.
    pub motion: [f32; 4],
    /// `STORED_*` of the shader.
    pub flags: u32,
    /// What direct and emitted light are multiplied by as they are read: one over the exposure.
    pub light_scale: f32,
    /// To 256 bytes.
    pub pad: [u32; 2],
}

impl Params {
    /// Parameters of one recording in this crate's own conventions.
    ///
    /// # Errors
    /// [`GiError::Size`] for an empty picture, [`GiError::Camera`] for anything but a finite
    /// reversed-Z perspective.
    pub fn new(size: [u32; 2], camera: &CameraMatrices, environment: [f32; 3]) -> Result<Self, GiError> {
        Self::with(size, camera, environment, &Conventions::default())
    }

    /// Parameters of one recording of `inputs`. `last` is [`Params::shift`] of the frame before, if
    /// there was one.
    ///
    /// # Errors
    /// As [`Params::new`], and [`GiError::Conventions`].
    pub fn of(inputs: &Inputs<'_>, last: Option<[f32; 2]>) -> Result<Self, GiError> {
        let (size, c) = (inputs.size, &inputs.conventions);
        let mut params = Self::with(size, &inputs.camera, inputs.environment, c)?;
        let step = depth_step(inputs.depth.texture().format(), c.depth);
        params.depth[3] = step / params.depth[0].abs();
        if inputs.motion.is_some() {
            params.motion = motion(size, c);
            if c.motion_jitter == MotionJitter::Included {
                let (now, last) = (params.shift(), last.unwrap_or(params.shift()));
                (params.motion[2], params.motion[3]) = (now[0] - last[0], now[1] - last[1]);
            }
        }
        Ok(params)
    }

    fn with(size: [u32; 2], camera: &CameraMatrices, environment: [f32; 3], c: &Conventions) -> Result<Self, GiError> {
        if size.contains(&0) {
            return Err(GiError::Size { size, reason: "it is empty".into() });
        }
        let mut p = Mat4::from_cols_array_2d(&camera.clip_from_view);
        let mut view = Mat4::from_cols_array_2d(&camera.view_from_world);
        if c.forward == Forward::PositiveZ {
            // The same camera, looking down −Z.
            view = Mat4::from_scale(Vec3::new(1.0, 1.0, -1.0)) * view;
            p.z_axis = -p.z_axis;
        }
        if let Jitter::Pixels([x, y]) = c.jitter {
            // What is drawn at x / w moves by 2 x / width, and w is -z.
            p.z_axis.x -= 2.0 * x / size[0] as f32;
            p.z_axis.y += 2.0 * y / size[1] as f32;
        }
        if !p.is_finite() || !view.is_finite() {
            return Err(GiError::Camera("a matrix holds NaN or infinity"));
        }
        if p.z_axis.w != -1.0 || p.w_axis.w != 0.0 {
            return Err(GiError::Camera(match c.forward {
                Forward::NegativeZ => "the projection is not a perspective that looks down -Z",
                Forward::PositiveZ => "the projection is not a perspective that looks down +Z",
            }));
        }
        if p.x_axis.x == 0.0 || p.y_axis.y == 0.0 {
            return Err(GiError::Camera("the projection has no width or no height"));
        }
        let depth = distance_by_depth(p.z_axis.z, p.w_axis.z, c.depth)?;
        let gravity_from_world = gravity_from_world(&view)?;
        let view_from_world = Mat3::from_cols(view.x_axis.truncate(), view.y_axis.truncate(), view.z_axis.truncate());
        let world_from_view = view_from_world.transpose();
        let gravity_from_view = gravity_from_world * world_from_view;
        let eye = -(world_from_view * view.w_axis.truncate());
        let clean = environment.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 });
        Ok(Self {
            size,
            cells: cells_of(size),
            unproject: [1.0 / p.x_axis.x, 1.0 / p.y_axis.y, p.z_axis.x, p.z_axis.y],
            depth: [depth[0], depth[1], if c.depth == Depth::Reversed { 0.0 } else { 1.0 }, 0.0],
            environment: [clean[0], clean[1], clean[2], 0.0],
            gravity_from_view: columns(gravity_from_view),
            gravity_from_world: columns(gravity_from_world),
            world_from_view: columns(world_from_view),
            eye: eye.extend(0.0).to_array(),
            motion: [1.0, 1.0, 0.0, 0.0],
            flags: flags(c)?,
            light_scale: light_scale(c)?,
            pad: [0; 2],
        })
    }

    /// The eye in world space.
    pub fn eye_position(&self) -> [f32; 3] {
        [self.eye[0], self.eye[1], self.eye[2]]
    }

    /// A number that differs whenever the camera does, but for jitter.
    pub(crate) fn view(&self) -> u64 {
        let mut hasher = std::hash::DefaultHasher::new();
        bytemuck::bytes_of(&self.eye).hash(&mut hasher);
        bytemuck::bytes_of(&self.world_from_view).hash(&mut hasher);
        bytemuck::bytes_of(&[self.unproject[0], self.unproject[1]]).hash(&mut hasher);
        hasher.finish()
    }

    /// Tangent of half the vertical field of view.
    pub(crate) fn tan_half_height(&self) -> f32 {
        self.unproject[1].abs()
    }

    /// How far jitter and a lens that is off its axis shift the picture, texture coordinates.
    pub fn shift(&self) -> [f32; 2] {
        [-0.5 * self.unproject[2], 0.5 * self.unproject[3]]
    }
}

/// Numerator and offset of the distance: with z = −d, clip z over w is −a + b/d.
fn distance_by_depth(a: f32, b: f32, depth: Depth) -> Result<[f32; 2], GiError> {
    let reversed = b > 0.0 && a >= 0.0;
    match depth {
        Depth::Reversed if reversed => Ok([b, a]),
        Depth::Reversed => Err(GiError::Camera("the projection's depth is not reversed (1 near, 0 far)")),
        _ if b >= 0.0 || a > -1.0 => Err(GiError::Camera("the projection's depth does not go from 0 near to 1 far")),
        Depth::Forward => Ok([b, a]),
        Depth::ForwardGl => Ok([0.5 * b, 0.5 * (a - 1.0)]),
    }
}

/// Texels are no nearer to each other than this, where they are not floats that grow finer with the
/// distance.
fn depth_step(format: wgpu::TextureFormat, depth: Depth) -> f32 {
    use wgpu::TextureFormat as F;
    match format {
        F::Depth16Unorm => 1.0 / 65535.0,
        F::Depth24Plus | F::Depth24PlusStencil8 => 6e-8,
        _ if depth == Depth::Reversed => 0.0,
        _ => 6e-8,
    }
}

fn motion(size: [u32; 2], c: &Conventions) -> [f32; 4] {
    let [x, y] = match c.motion_units {
        MotionUnits::Uv => [1.0, 1.0],
        MotionUnits::Pixels => size.map(|n| 1.0 / n as f32),
        MotionUnits::Ndc => [0.5, -0.5],
    };
    let sign = if c.motion_sense == MotionSense::ToPast { 1.0 } else { -1.0 };
    [sign * x, sign * y, 0.0, 0.0]
}

fn flags(c: &Conventions) -> Result<u32, GiError> {
    if c.normal_encoding == NormalEncoding::Xy && c.normal_space == NormalSpace::World {
        let reason = "x and y leave open where z points, unless they are in view space";
        return Err(GiError::Conventions { name: "normal", reason });
    }
    let encoding = match c.normal_encoding {
        NormalEncoding::Octahedral => 0,
        NormalEncoding::Xyz => XYZ,
        NormalEncoding::Xy => XY,
    };
    let bit = |on: bool, bit: u32| if on { bit } else { 0 };
    Ok(encoding
        | bit(c.normal_range == NormalRange::Unsigned, UNSIGNED)
        | bit(c.normal_space == NormalSpace::View, IN_VIEW)
        | bit(c.albedo == AlbedoEncoding::Srgb, SRGB)
        | bit(c.light != LightScale::Radiance, EXPOSED)
        // Of x and y alone the prelude makes a normal that points to the eye.
        | bit(c.forward == Forward::PositiveZ && c.normal_encoding != NormalEncoding::Xy, AHEAD))
}

fn light_scale(c: &Conventions) -> Result<f32, GiError> {
    match c.light {
        LightScale::Radiance => Ok(1.0),
        LightScale::PreExposed(e) if e > 0.0 && e.is_finite() && (1.0 / e).is_finite() => Ok(1.0 / e),
        LightScale::PreExposed(_) => {
            Err(GiError::Conventions { name: "direct", reason: "an exposure is finite and above 0" })
        }
    }
}

fn columns(m: Mat3) -> [[f32; 4]; 3] {
    [m.x_axis, m.y_axis, m.z_axis].map(|c| c.extend(0.0).to_array())
}

/// The camera's frame with the tilt taken out: x = horizontal right, y = world up, z = horizontal
/// backward. The network should not have to learn that down is down at every tilt. A camera that
/// looks straight down or up has no horizontal backward; the top of its picture says which way is
/// forward (down) or backward (up), which is the limit of tilting it there. In a left-handed world
/// the frame is left-handed, too, so that x is the picture's right.
fn gravity_from_world(view_from_world: &Mat4) -> Result<Mat3, GiError> {
    let up = view_from_world.row(1).truncate().try_normalize();
    let back = view_from_world.row(2).truncate().try_normalize();
    let (Some(up), Some(back)) = (up, back) else {
        return Err(GiError::Camera("the view matrix has no orientation"));
    };
    let flat = |v: Vec3| Vec3::new(v.x, 0.0, v.z);
    let horizontal = if flat(back).length() > 1e-3 { flat(back) } else { flat(up) * -back.y.signum() };
    let z = horizontal.try_normalize().unwrap_or(Vec3::Z);
    let y = Vec3::Y;
    let hand = Mat3::from_mat4(*view_from_world).determinant().signum();
    Ok(Mat3::from_cols(hand * y.cross(z), y, z).transpose())
}
