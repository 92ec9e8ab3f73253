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
            aspect: None,
            near: if distance > 0.0 { NEAR * distance } else { NEAR },
            far: f32::INFINITY,
        }
    }

    /// This camera for pictures of `size` pixels. Where they are narrower than [`Camera::aspect`],
    /// the vertical field of view grows so that the horizontal one stays and the sides are not cut
    /// off.
    pub fn for_picture(&self, size: [u32; 2]) -> Camera {
        let shape = size[0].max(1) as f32 / size[1].max(1) as f32;
        match self.aspect.filter(|aspect| *aspect > shape) {
            Some(aspect) => Camera { yfov: 2.0 * ((0.5 * self.yfov).tan() * (aspect / shape)).atan(), ..self.clone() },
            None => self.clone(),
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
