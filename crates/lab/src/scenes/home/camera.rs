//! Where a person would stand to look: away from walls and furniture.

use super::builder::Builder;
use bouncelight::scene::Camera;
use glam::Vec3;

/// Nothing is nearer to the eye than this, metres, by boxes parallel to the axes.
const CLEAR: f32 = 0.3;
/// Nor in the middle of the picture than this, where it can be helped.
const AHEAD: f32 = 0.9;
/// Proposals that are looked at for a camera.
const TRIES: usize = 160;

/// A place to look from.
pub(super) struct Proposal {
    pub eye: Vec3,
    pub target: Vec3,
    /// Mean depth of the picture's middle from which on it will do, metres.
    pub depth: f32,
}

/// The first of the proposals that keeps clear and sees far enough, or the best of all. Fields of
/// view are 45° to 75°.
pub(super) fn choose(b: &mut Builder, name: &str, mut propose: impl FnMut(&mut Builder) -> Proposal) {
    let mut best: Option<(f32, Camera)> = None;
    for _ in 0..TRIES {
        let Proposal { eye, target, depth } = propose(b);
        let yfov = b.between(45.0, 75.0).to_radians();
        if b.solids.iter().any(|s| s.grown(CLEAR).holds(eye)) {
            continue;
        }
        let camera = Camera::look_at(eye.into(), target.into(), yfov);
        let (nearest, mean) = depths(b, &camera);
        let score = mean / depth + 4.0 * (nearest / AHEAD).min(1.0);
        if best.as_ref().is_none_or(|(s, _)| score > *s) {
            best = Some((score, Camera { name: name.to_owned(), near: 0.03, far: 200.0, ..camera }));
        }
        if nearest >= AHEAD && mean >= depth {
            break;
        }
    }
    b.scene.cameras.extend(best.map(|(_, camera)| camera));
}

/// Least and mean distance of what the middle of the picture shows, metres; nothing counts as 30.
fn depths(b: &Builder, camera: &Camera) -> (f32, f32) {
    let [right, up, back, _] = camera.transform.map(|[x, y, z, _]| Vec3::new(x, y, z));
    let slope = 0.6 * (0.5 * camera.yfov).tan();
    let (mut nearest, mut sum) = (f32::INFINITY, 0.0);
    for (x, y) in [-1.0, 0.0, 1.0].into_iter().flat_map(|x| [-1.0, 0.0, 1.0].map(|y| (x, y))) {
        let direction = (right * (1.6 * slope * x) + up * (slope * y) - back).normalize();
        let hits = b.solids.iter().map(|s| s.distance(camera.eye().into(), direction));
        let distance = hits.fold(30.0, f32::min);
        nearest = nearest.min(distance);
        sum += distance;
    }
    (nearest, sum / 9.0)
}
