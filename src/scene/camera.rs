//! Cameras made from a point of view instead of a file.

use glam::{Mat4, Vec3};

use super::Camera;

/// Near plane of a camera that was not made by a file, as a share of the distance to what it looks
/// at.
const NEAR: f32 = 1e-5;

impl Camera {
    /// A camera at `eye` that looks at `target` with +Y up (−Z up where it looks straight down or
    /// up).
    ///
    /// `yfov` is the vertical field of view in radians. The near plane is at a 100,000th of the
    /// distance, whatever the unit: whoever looks at the horizon still sees what is before the eye,
    /// and depth, which is reversed and a float, is no coarser for it. The far plane is infinite.
    /// When `eye` equals `target` the camera looks along −Z.
    pub fn look_at(eye: [f32; 3], target: [f32; 3], yfov: f32) -> Camera {
        let (eye, target) = (Vec3::from(eye), Vec3::from(target));
        let distance = eye.distance(target);
        let back = (eye - target).try_normalize().unwrap_or(Vec3::Z);
        let up = if back.y.abs() > 0.999_99 { Vec3::NEG_Z } else { Vec3::Y };
        let right = up.cross(back).normalize();
        let up = back.cross(right);
        let world = Mat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0));
        Camera {
            name: "look-at".to_owned(),
            transform: world.to_cols_array_2d(),
            yfov,
            near: if distance > 0.0 { NEAR * distance } else { NEAR },
            far: f32::INFINITY,
        }
    }

    /// Where the camera is, metres.
    pub fn eye(&self) -> [f32; 3] {
        let [x, y, z, _] = self.transform[3];
        [x, y, z]
    }

    /// Unit vector along which the camera looks.
    pub fn forward(&self) -> [f32; 3] {
        let [x, y, z, _] = self.transform[2];
        [-x, -y, -z]
    }
}
