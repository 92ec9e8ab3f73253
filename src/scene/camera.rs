//! Cameras made from a point of view instead of a file.

use glam::{Mat4, Vec3};

use super::Camera;

impl Camera {
    /// A camera at `eye` that looks at `target` with +Y up (−Z up where it looks straight down or up).
    ///
    /// `yfov` is the vertical field of view in radians. The near plane is 0.1 % of the distance,
    /// between 1 mm and 0.1 m; the far plane is infinite. When `eye` equals `target` the camera
    /// looks along −Z.
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
            near: (distance * 1e-3).clamp(1e-3, 0.1),
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
