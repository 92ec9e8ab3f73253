//! Which instances a camera or a shadow map can see, by their bounds in the world, and how much of
//! a frame that leaves.
//!
//! What is kept is conservative: an instance is left out where its box lies wholly beyond one side
//! of the pyramid or box that is seen. Between a light and what it shines on nothing is cut away: a
//! map's volume begins at the lamp, or at the top of the scene for a sun.

use crate::gpu_scene::{Bounds, Draw, SceneGpu};
use glam::{Mat4, Vec3, Vec4};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Instances that are not seen are drawn none the less between two that are, where they have no
/// more triangles than this in all: a draw call of its own costs a driver more. (A rule of thumb: a
/// microsecond of a CPU, in which a card sets up a thousand triangles.)
const WORTH_A_DRAW: u64 = 128;
/// Share of a plane's terms that rounding may have taken: bounds as near as that to it count as
/// before it.
const ROUNDING: f32 = 1e-5;

/// What a camera or a map sees: inside of five planes and, for lamps that reach only so far, of a
/// sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// Inside is where `dot(xyz, p) + w` is not negative.
    planes: [Vec4; 5],
    /// Centre and radius.
    sphere: Option<(Vec3, f32)>,
}

impl Volume {
    /// What is seen through a reversed-Z projection (1 at the near plane, nothing cut away far
    /// off).
    pub fn new(clip_from_world: &[[f32; 4]; 4]) -> Self {
        let m = Mat4::from_cols_array_2d(clip_from_world);
        let [x, y, z, w] = [m.row(0), m.row(1), m.row(2), m.row(3)];
        Self { planes: [w + x, w - x, w + y, w - y, w - z], sphere: None }
    }

    /// The same as far as a lamp at `center` reaches.
    pub fn within(self, center: Vec3, radius: f32) -> Self {
        Self { sphere: Some((center, radius)), ..self }
    }

    /// False where nothing of a box can be seen. Boxes with corners that are no numbers are seen.
    pub fn meets(&self, bounds: &Bounds) -> bool {
        let (low, high) = (Vec3::from(bounds.0), Vec3::from(bounds.1));
        let beyond = self.planes.iter().any(|plane| {
            let n = plane.truncate();
            // The corner that lies farthest inside.
            let corner = Vec3::select(n.cmpge(Vec3::ZERO), high, low);
            let terms = n * corner;
            terms.element_sum() + plane.w < -ROUNDING * (terms.abs().element_sum() + plane.w.abs())
        });
        let out_of_reach = self.sphere.is_some_and(|(center, radius)| {
            let nearest = center.clamp(low.min(high), high.max(low));
            nearest.distance_squared(center) > radius * radius * (1.0 + ROUNDING)
        });
        !beyond && !out_of_reach
    }
}

/// Draw calls and triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Count {
    /// Draw calls.
    pub draws: u32,
    /// Triangles that they draw.
    pub triangles: u64,
    /// Triangles that were left out, as nothing of their instances is to be seen.
    pub culled: u64,
}

/// Instances and triangles that a frame drew.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DrawnCount {
    /// For the camera, veils included.
    pub camera: Count,
    /// For the shadow maps that were drawn.
    pub shadows: Count,
    /// How many these are.
    pub maps: u32,
    /// What the other maps, which stay as they are, were drawn of.
    pub kept: Count,
    /// How many these are.
    pub maps_kept: u32,
}

impl std::ops::AddAssign for Count {
    fn add_assign(&mut self, other: Self) {
        self.draws += other.draws;
        self.triangles += other.triangles;
        self.culled += other.culled;
    }
}

impl Count {
    /// Passes on the runs of `draw`'s instances that are to be drawn because `volume` meets one of
    /// them, and counts.
    pub fn runs(&mut self, scene: &SceneGpu, draw: &Draw, volume: &Volume, mut each: impl FnMut(Range<u32>)) {
        let triangles = u64::from(draw.indices.end - draw.indices.start) / 3;
        let seen = |slot: &u32| scene.slots.get(*slot as usize).is_none_or(|s| volume.meets(&s.bounds));
        let mut drawn = 0;
        let mut give = |run: Range<u32>| {
            self.draws += 1;
            drawn += run.len() as u64;
            each(run);
        };
        // A single look at the whole spares looking at each.
        if volume.meets(&draw.bounds) {
            let mut run: Option<Range<u32>> = None;
            for slot in draw.instances.clone().filter(seen) {
                match &mut run {
                    Some(run) if u64::from(slot - run.end) * triangles <= WORTH_A_DRAW => run.end = slot + 1,
                    _ => {
                        if let Some(run) = run.replace(slot..slot + 1) {
                            give(run);
                        }
                    }
                }
            }
            if let Some(run) = run {
                give(run);
            }
        }
        self.triangles += drawn * triangles;
        self.culled += (draw.instances.len() as u64 - drawn) * triangles;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::View;
    use crate::scene::Camera;

    /// Against points: whatever box has a point that projects into the picture is met, and of those
    /// that have none in many draws most are not.
    #[test]
    fn what_can_be_seen_is_met_and_what_cannot_mostly_not() {
        let view = View::new(&Camera::look_at([3.0, 2.0, 5.0], [0.0, 1.0, -2.0], 0.9), [160, 90], [0.3, -0.2]);
        let volume = Volume::new(&view.clip_from_world);
        let clip = Mat4::from_cols_array_2d(&view.clip_from_world);
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(0x0019_660d).wrapping_add(0x3c6e_f35f);
            (seed >> 8) as f32 / (1 << 24) as f32
        };
        let (mut met, mut unseen, mut left_out) = (0, 0, 0);
        for _ in 0..4000 {
            let low = Vec3::from_array(std::array::from_fn(|_| 24.0 * random() - 12.0));
            let high = low + Vec3::from_array(std::array::from_fn(|_| 3.0 * random()));
            let shown = (0..64).any(|_| {
                let p = low + (high - low) * Vec3::from_array(std::array::from_fn(|_| random()));
                let c = clip * p.extend(1.0);
                c.x.abs() <= c.w && c.y.abs() <= c.w && c.z <= c.w
            });
            let meets = volume.meets(&(low.into(), high.into()));
            assert!(meets || !shown, "{low} to {high} is seen");
            met += i32::from(meets && shown);
            unseen += i32::from(!shown);
            left_out += i32::from(!meets);
        }
        assert!(met > 300 && left_out > 8 * unseen / 10, "{met} met, {left_out} of {unseen} left out");
        let far = ([-1e9, -1e9, -1e12], [1e9, 1e9, -1e11]);
        assert!(volume.meets(&far), "nothing is too far away");
        assert!(volume.meets(&([f32::NAN; 3], [f32::NAN; 3])));
        let lamp = volume.within(Vec3::new(0.0, 1.0, -2.0), 1.0);
        let crate_at = |x: f32| ([x, 0.9, -2.1], [x + 0.2, 1.1, -1.9]);
        assert!(lamp.meets(&crate_at(0.9)) && !lamp.meets(&crate_at(1.1)) && volume.meets(&crate_at(1.1)));
    }
}
