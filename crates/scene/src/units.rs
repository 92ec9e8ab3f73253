//! Files whose unit of length is no metre, or whose vertical is not +Y.

use bouncelight::scene::{Scene, bounds::world_bounds};
use glam::{Mat4, Quat, Vec3};
use std::f32::consts::FRAC_PI_2;

/// Which axis of a file points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Up {
    /// As glTF has it.
    #[default]
    Y,
    /// As many OBJ files have it: z becomes y, and y becomes −z.
    Z,
}

/// How a file's lengths and directions become the scene's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Metres of the file's unit of length.
    pub scale: f32,
    /// The axis that points up.
    pub up: Up,
}

impl Default for Units {
    fn default() -> Self {
        Self { scale: 1.0, up: Up::Y }
    }
}

impl Units {
    /// From the file's up to +Y.
    pub(crate) fn turn(self) -> Quat {
        match self.up {
            Up::Y => Quat::IDENTITY,
            Up::Z => Quat::from_rotation_x(-FRAC_PI_2),
        }
    }

    /// Scene space from the file's.
    pub(crate) fn matrix(self) -> Mat4 {
        Mat4::from_scale_rotation_translation(Vec3::splat(self.scale), self.turn(), Vec3::ZERO)
    }
}

/// What has a longer side than this many metres, or a shorter one, gets a warning about its unit.
const STRANGE: [f32; 2] = [0.005, 1000.0];

/// Says so where a file is so large or so small that its unit may be no metre and nobody has said
/// what it is.
pub(super) fn tell(scene: &mut Scene, units: Units) {
    let Some((low, high)) = world_bounds(scene).filter(|_| units.scale == 1.0) else { return };
    let size = (Vec3::from(high) - Vec3::from(low)).max_element();
    let hint = if size > STRANGE[1] {
        "if its unit is the millimetre, --scale 0.001 says so (0.01 for centimetres)"
    } else if size < STRANGE[0] {
        "if its unit is the kilometre, --scale 1000 says so"
    } else {
        return;
    };
    let name = &scene.name;
    let size = if size > STRANGE[1] { format!("{:.1} km", size / 1e3) } else { format!("{:.2} mm", size * 1e3) };
    scene.warnings.push(format!("'{name}' is {size} across; {hint}"));
}
