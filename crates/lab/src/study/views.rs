//! Cameras to look at a scene from: turned around its own place, or scattered through the scene.

use bouncelight::numbers::SplitMix;
use bouncelight::scene::{Camera, Scene, bounds::world_bounds};
use glam::{Mat4, Vec3};

/// `camera` turned about the vertical through the origin by a fraction of a full turn,
/// counter-clockwise from above.
pub fn turned(camera: &Camera, fraction: f32) -> Camera {
    let turn = Mat4::from_rotation_y(fraction * std::f32::consts::TAU);
    let transform = turn * Mat4::from_cols_array_2d(&camera.transform);
    Camera { transform: transform.to_cols_array_2d(), ..camera.clone() }
}

/// An endless row of cameras inside the scene's bounds, looking at points inside them, with the
/// field of view of the scene's first camera. The same seed gives the same row. Empty for a scene
/// without triangles or cameras.
pub fn around(scene: &Scene, seed: u64) -> impl Iterator<Item = Camera> {
    let place = world_bounds(scene).zip(scene.cameras.first().cloned());
    let mut numbers = SplitMix::new(seed);
    place.into_iter().flat_map(move |((low, high), own)| {
        let (low, size) = (Vec3::from(low), Vec3::from(high) - Vec3::from(low));
        let mut numbers = std::mem::replace(&mut numbers, SplitMix::new(0));
        std::iter::repeat_with(move || {
            // Eyes keep away from the outer walls and the floor; targets may be anywhere.
            let mut within = |margin: f32| {
                let at = Vec3::from_array(std::array::from_fn(|_| margin + (1.0 - 2.0 * margin) * numbers.next()));
                low + size * at
            };
            let (eye, target) = (within(0.15), within(0.02));
            // A nearly vertical look has no horizon; the person who looks around a room rarely does
            // that.
            let target = Vec3::new(target.x, eye.y + 0.5 * (target.y - eye.y), target.z);
            let aim = if eye.distance(target) > 1e-3 * size.length() { target } else { eye + Vec3::NEG_Z };
            Camera { name: "around".into(), ..Camera::look_at(eye.into(), aim.into(), own.yfov) }
        })
    })
}
