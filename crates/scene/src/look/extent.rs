//! What of a scene is worth being framed: nearly all of it, but not one thing that lies far away, a
//! ground plane that reaches to the horizon, or a dome for the sky.

use crate::triangles;
use bouncelight::scene::{Scene, bounds::world_bounds};
use glam::Vec3;

/// Share of the triangles that is near enough to each other; what lies apart from them is left out
/// …
const MOST: f32 = 0.75;
/// … if it is so many times as far from their middle as they reach.
const APART: f32 = 4.0;

/// Steps of the histogram of distances in each doubling.
const STEPS: f32 = 8.0;

/// The box around what is framed.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    pub low: Vec3,
    pub high: Vec3,
}

impl Extent {
    /// `None` where nothing is placed.
    ///
    /// Distances are measured from the median of the triangles, per axis, to each triangle's
    /// farthest corner.
    pub fn of(scene: &Scene) -> Option<Self> {
        let (low, high) = world_bounds(scene)?;
        let all = Self { low: low.into(), high: high.into() };
        let mut places: [Vec<f32>; 3] = Default::default();
        for ([a, b, c], _) in triangles::of(scene) {
            let middle = (a + b + c) / 3.0;
            (0..3).for_each(|axis| places[axis].push(middle[axis]));
        }
        let middle = Vec3::from(places.map(|mut p| {
            let half = p.len() / 2;
            if p.is_empty() { 0.0 } else { *p.select_nth_unstable_by(half, f32::total_cmp).1 }
        }));
        let far = |corners: &[Vec3; 3]| corners.iter().map(|p| p.distance(middle)).fold(0.0, f32::max);
        let most = far(&[all.low, all.high, all.low]).max(f32::MIN_POSITIVE) * 2.0;
        // Logarithmic bins below the largest distance; what is nearer than the last lies in it.
        let bin = |d: f32| ((most / d.max(f32::MIN_POSITIVE)).log2() * STEPS).clamp(0.0, 199.0) as usize;
        let mut bins = [0u32; 200];
        triangles::of(scene).for_each(|(corners, _)| bins[bin(far(&corners))] += 1);
        let total: u32 = bins.iter().sum();
        let (mut inside, mut empty) = (total, 0);
        let mut reach = f32::INFINITY;
        // From far to near, for the outermost gap that is wide enough and has enough inside it.
        for (i, count) in bins.iter().enumerate() {
            if *count > 0 {
                if f32::from(empty) >= APART.log2() * STEPS && inside < total && inside as f32 >= MOST * total as f32 {
                    reach = most * (-(i as f32) / STEPS).exp2();
                }
                empty = 0;
            } else {
                empty += 1u8;
            }
            inside -= count;
        }
        if reach.is_infinite() {
            return Some(all);
        }
        let near = triangles::of(scene).map(|(corners, _)| corners).filter(|c| far(c) <= reach);
        let empty = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };
        let core = near.flatten().fold(empty, |b, p| Self { low: b.low.min(p), high: b.high.max(p) });
        Some(if core.low.x <= core.high.x { core } else { all })
    }

    pub fn middle(&self) -> Vec3 {
        0.5 * (self.low + self.high)
    }

    /// Its diagonal.
    pub fn size(&self) -> f32 {
        self.low.distance(self.high).max(f32::MIN_POSITIVE)
    }

    /// Whether a point lies in it, but for rounding.
    pub fn holds(&self, p: Vec3) -> bool {
        let slack = 1e-4 * self.size();
        p.cmpge(self.low - slack).all() && p.cmple(self.high + slack).all()
    }
}
