//! What each light gives to a view, reckoned on the CPU: who gets shadow maps where there are not
//! enough for all, and from what distance on a lamp is left out.
//!
//! Nobody reads back what a frame shows, so that the same view has the same picture however fast
//! frames come. Instead light is taken at points where surfaces may be: on rays through the
//! picture, at distances in even steps of their logarithm within the scene's bounds. Walls between
//! are not known: a lamp behind one counts for what it would give.

use super::view::View;
use crate::gpu_scene::Bounds;
use crate::lights::LightGpu;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Treatment of many lights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightOptions {
    /// Lights from which on each tile of 16×16 pixels has a list of those that reach it. Default 9;
    /// fewer cost the pass `lights`, more cost `direct` time for each light and pixel.
    pub tiled_from: u32,
    /// Light that may be left out, as a share of the view's irradiance (geometric mean over where
    /// surfaces may be, without shadows), 0 to 1. With nine lights or more, distant lamps are left out as long as
    /// at any place all of them together stay below it. Default 1/1024; 0 leaves none out, 0.1 darkens
    /// visibly.
    ///
    /// 1/1024: with an exposure that shows the mean as middle grey (0.18) that is a radiance of
    /// 0.0002, and a step of 8 bits above black is 0.0003.
    pub cut: f32,
}

impl Default for LightOptions {
    fn default() -> Self {
        Self { tiled_from: FEW as u32 + 1, cut: 1.0 / 1024.0 }
    }
}

/// What of a light depends on the view; laid out as `LightShadow` in `shaders/lib/light_list.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct LightShadowGpu {
    /// First of its shadow views.
    pub first: u32,
    /// How many there are; none means no shadow.
    pub count: u32,
    /// Distance from which on it is left out, metres.
    pub reach: f32,
    /// Unused.
    pub pad: u32,
}

/// So few lights are drawn wherever they reach.
pub(super) const FEW: usize = 8;
/// Farther than anything, and its square is still a number.
pub(super) const NO_END: f32 = 1e18;
/// Rays across and down, and points on each.
const RAYS: [u32; 2] = [8, 6];
const STEPS: u32 = 6;
/// Points are on average as far from a light as this share of their distance from the eye: they
/// stand for all between.
const SPREAD: f32 = 0.05;
/// What a spot counts for beside its cone, since points are far between.
const BESIDE: f32 = 0.05;
/// A light that has shadow maps keeps them until another one gives so much more.
const KEEPS: f32 = 1.5;

/// What lights give to a view.
pub(super) struct Estimate {
    /// Mean over the points of each light's irradiance, W/m².
    pub given: Vec<f32>,
    /// Geometric mean over the points of all lights' irradiance.
    pub mean: f32,
}

impl Estimate {
    /// Of `lights`, for those for whom `counts` holds.
    pub fn new(view: &View, bounds: Option<Bounds>, lights: &[LightGpu], counts: &[bool]) -> Self {
        let mut given = vec![0.0; lights.len()];
        let points = bounds.map_or(Vec::new(), |b| points(view, b));
        let mut logs = 0.0;
        for &(p, soft) in &points {
            let mut sum = 0.0;
            for ((light, given), _) in lights.iter().zip(&mut given).zip(counts).filter(|(_, counts)| **counts) {
                let e = irradiance(light, p, soft);
                *given += e / points.len() as f32;
                sum += e;
            }
            logs += sum.max(f32::MIN_POSITIVE).ln();
        }
        let mean = if points.is_empty() { 0.0 } else { (logs / points.len() as f32).exp() };
        Self { given, mean }
    }

    /// From what distance on a lamp of `light`'s strength is left out, if `lamps` share what may
    /// be.
    pub fn reach(&self, light: &LightGpu, lamps: usize, cut: f32) -> f32 {
        let least = cut * self.mean / lamps.max(1) as f32;
        let most = Vec3::from(light.color).max_element();
        if least > 0.0 { (most / least).sqrt().min(NO_END) } else { NO_END }
    }
}

/// Points where surfaces may be, each with the square of the distance within which it stands for
/// others.
fn points(view: &View, (low, high): Bounds) -> Vec<(Vec3, f32)> {
    let (low, high, eye) = (Vec3::from(low), Vec3::from(high), Vec3::from(view.eye()));
    let mut points = Vec::with_capacity((RAYS[0] * RAYS[1] * STEPS) as usize);
    for i in 0..RAYS[0] * RAYS[1] {
        let at = |k: u32, n: u32| (2 * k + 1) as f32 / n as f32 - 1.0;
        let ndc = [at(i % RAYS[0], RAYS[0]), at(i / RAYS[0], RAYS[1])];
        let along = view.frustum_point(ndc, 1.0) - eye;
        let (a, b) = ((low - eye) / along, (high - eye) / along);
        // Where a ray runs along a side's plane these are infinite, or no numbers, which minimum
        // and maximum pass over.
        let near = a.min(b).to_array().into_iter().fold(0.0, f32::max);
        let far = a.max(b).to_array().into_iter().fold(f32::INFINITY, f32::min);
        if !(far > near && far.is_finite()) {
            continue;
        }
        let near = near.max(far / 64.0);
        for step in 0..STEPS {
            let t = near * (far / near).powf((step as f32 + 0.5) / STEPS as f32);
            points.push((eye + along * t, (SPREAD * t).powi(2)));
        }
    }
    points
}

/// Irradiance of `light` around `p`, facing it, W/m²: as `sample_light` in
/// `shaders/lib/lights.wgsl`, but no more than at the distance whose square is `soft`.
fn irradiance(light: &LightGpu, p: Vec3, soft: f32) -> f32 {
    let strength = Vec3::from(light.color).dot(Vec3::new(0.2126, 0.7152, 0.0722));
    if light.kind == 0 {
        return strength;
    }
    let to = Vec3::from(light.position) - p;
    let d2 = to.length_squared().max(light.radius * light.radius).max(soft);
    let mut e = strength / d2.max(f32::MIN_POSITIVE);
    if light.range > 0.0 {
        let q = d2 / (light.range * light.range);
        e *= (1.0 - q * q).max(0.0);
    }
    if light.kind == 2 {
        let cosine = -to.normalize_or_zero().dot(light.direction.into());
        let ramp = (cosine * light.cone_scale + light.cone_offset).clamp(0.0, 1.0);
        e *= (ramp * ramp).max(BESIDE);
    }
    e
}

/// Who gets shadow maps: those that give most, as long as there are maps. `maps`: how many each
/// needs; `held`: who has some now.
pub(super) fn choose(given: &[f32], maps: &[u32], held: &[bool], room: u32) -> Vec<bool> {
    let worth = |i: usize| given[i] * if held[i] { KEEPS } else { 1.0 };
    let mut order: Vec<usize> = (0..given.len()).filter(|&i| maps[i] > 0).collect();
    order.sort_by(|&a, &b| worth(b).total_cmp(&worth(a)));
    let (mut chosen, mut left) = (vec![false; given.len()], room);
    for i in order {
        // Who does not fit leaves no gap for weaker ones, which would come and go with it.
        let Some(rest) = left.checked_sub(maps[i]) else { break };
        (chosen[i], left) = (true, rest);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Light, LightKind};

    fn lamp(at: [f32; 3], intensity: f32) -> LightGpu {
        let kind = LightKind::Point { position: at, intensity, radius: 0.05, range: None };
        LightGpu::new(&Light::from(kind))
    }

    #[test]
    fn nearer_and_stronger_lamps_give_more_whatever_the_unit() {
        let lights = |k: f32| {
            let at = |p: [f32; 3]| p.map(|v| v * k);
            [
                lamp(at([0.0, 2.0, 0.0]), k * k),
                lamp(at([0.0, 2.0, 0.0]), 2.0 * k * k),
                lamp(at([0.0, 2.0, -40.0]), k * k),
                lamp(at([0.0, 2.0, 60.0]), k * k),
            ]
        };
        let estimate = |k: f32| {
            let view =
                View::new(&Camera::look_at([0.0, 1.6 * k, 6.0 * k], [0.0, 1.0 * k, 0.0], 0.9), [160, 90], [0.0; 2]);
            let bounds = ([-50.0 * k, 0.0, -50.0 * k], [50.0 * k, 5.0 * k, 50.0 * k]);
            let lights = lights(k).map(|mut l| {
                l.radius *= k;
                l
            });
            Estimate::new(&view, Some(bounds), &lights, &[true; 4])
        };
        let one = estimate(1.0);
        println!("{:?}, mean {}", one.given, one.mean);
        assert!((one.given[1] / one.given[0] - 2.0).abs() < 1e-4);
        // In sight and near, in sight and far, behind the eye.
        assert!(one.given[0] > 2.0 * one.given[2] && one.given[2] > one.given[3], "{:?}", one.given);
        for k in [1e-3, 1e3] {
            let other = estimate(k);
            for (a, b) in one.given.iter().zip(&other.given) {
                assert!((b / a - 1.0).abs() < 1e-2, "x{k}: {b} against {a}");
            }
        }
        let near = one.reach(&lamp([0.0; 3], 1.0), 4, 1.0 / 1024.0);
        assert!((one.mean / 4096.0 - near.powi(-2)).abs() < 1e-6 * one.mean, "all of them at that distance: {near}");
        assert_eq!(one.reach(&lamp([0.0; 3], 1.0), 4, 0.0), NO_END);
    }

    #[test]
    fn who_has_maps_keeps_them_until_another_gives_clearly_more() {
        let maps = [6, 6, 1, 0];
        let none = [false; 4];
        assert_eq!(choose(&[3.0, 2.0, 1.0, 9.0], &maps, &none, 7), [true, false, false, false]);
        assert_eq!(choose(&[3.0, 2.0, 2.5, 9.0], &maps, &none, 7), [true, false, true, false]);
        assert_eq!(choose(&[3.0, 2.0, 1.0, 9.0], &maps, &none, 13), [true, true, true, false]);
        // Whoever goes back and forth between two lamps does not see their shadows flip.
        let mut held = choose(&[1.0, 0.9, 0.0, 0.0], &maps, &none, 6);
        for given in [[0.9, 1.0, 0.0, 0.0], [1.0, 0.9, 0.0, 0.0], [0.8, 1.1, 0.0, 0.0]] {
            held = choose(&given, &maps, &held, 6);
            assert_eq!(held, [true, false, false, false], "{given:?}");
        }
        assert_eq!(choose(&[0.5, 1.0, 0.0, 0.0], &maps, &held, 6), [false, true, false, false]);
    }
}
