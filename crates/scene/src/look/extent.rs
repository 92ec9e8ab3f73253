//! What of a scene is worth being framed: nearly all of it, but not one thing that lies far away, a
//! ground plane that reaches to the horizon, or a dome for the sky.

use super::strays;
use crate::triangles;
use bouncelight::scene::{Scene, bounds::world_bounds};
use glam::Vec3;
use std::collections::HashMap;

/// Share of the triangles that is near enough to each other; what lies apart from them is left out
/// …
const MOST: f32 = 0.75;
/// … if it is so many times as far from their middle as they reach.
const APART: f32 = 4.0;

/// How many times as large as all the rest a flat thing is that is not framed.
const BEYOND: f32 = 1.75;
/// A thing is flat that is no thicker than this share of its diagonal.
const FLAT: f32 = 0.02;

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
        let near = || triangles::of(scene).map(|(corners, _)| corners).filter(|c| far(c) <= reach);
        let core = near().fold(Self::EMPTY, |b, c| b.with(&Self::around(&c)));
        if !core.is_placed() {
            return Some(all);
        }
        // Of a huge scene not all triangles are met.
        let whole = if reach.is_infinite() && all.size() < 1.1 * core.size() { all } else { core };
        Some(strays::cut([core.low, core.high], near()).map_or(whole, |[low, high]| Self { low, high }))
    }

    /// Without flat things that reach far beyond all others, as the floor and the wall behind a
    /// product do, two at most: more of them make a room.
    pub fn without_planes(self, scene: &Scene) -> Self {
        let mut boxes: HashMap<usize, (Self, usize)> = HashMap::new();
        for (corners, owner) in triangles::of(scene) {
            let one = Self::around(&corners);
            if self.holds(one.low) && self.holds(one.high) {
                let (all, count) = boxes.entry(owner.instance).or_insert((Self::EMPTY, 0));
                (*all, *count) = (all.with(&one), *count + 1);
            }
        }
        let total: usize = boxes.values().map(|(_, count)| count).sum();
        let mut boxes: Vec<(Self, usize)> = boxes.into_values().collect();
        boxes.sort_by(|(a, _), (b, _)| b.size().total_cmp(&a.size()));
        for planes in 1..=2 {
            let Some((large, rest)) = boxes.split_at_checked(planes).filter(|(_, rest)| !rest.is_empty()) else {
                break;
            };
            let rest = rest.iter().fold(Self::EMPTY, |b, (other, _)| b.with(other));
            let beyond = |plane: &Self| plane.is_flat() && plane.size() >= BEYOND * rest.size();
            let count: usize = large.iter().map(|(_, count)| count).sum();
            if large.iter().all(|(plane, _)| beyond(plane)) && count as f32 <= (1.0 - MOST) * total as f32 {
                return rest;
            }
        }
        self
    }

    /// Around nothing.
    const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    fn around(corners: &[Vec3; 3]) -> Self {
        let [a, b, c] = *corners;
        Self { low: a.min(b).min(c), high: a.max(b).max(c) }
    }

    fn with(&self, other: &Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn is_placed(&self) -> bool {
        self.low.cmple(self.high).all()
    }

    fn is_flat(&self) -> bool {
        (self.high - self.low).min_element() <= FLAT * self.size()
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
