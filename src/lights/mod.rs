//! Lights and surroundings as shaders read them.

#[doc(hidden)]
pub mod sky;

pub(crate) use sky::whole_sky;

use crate::scene::{Light, LightKind};
use bytemuck::{Pod, Zeroable};

/// A light as `shaders/lib/lights.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct LightGpu {
    /// World position (point, spot).
    pub position: [f32; 3],
    /// 0 sun, 1 point, 2 spot.
    pub kind: u32,
    /// Unit vector along which light travels (sun, spot).
    pub direction: [f32; 3],
    /// Cut-off distance, metres; 0 for none.
    pub range: f32,
    /// Irradiance in W/m² (sun) or radiant intensity in W/sr (point, spot), tint multiplied in.
    pub color: [f32; 3],
    /// Metres (point, spot), or the tangent of half the angular diameter (sun).
    pub radius: f32,
    /// Scale of the cone's ramp.
    pub cone_scale: f32,
    /// Offset of the cone's ramp.
    pub cone_offset: f32,
    /// 1 for a light that stands for a surface that glows: rays meet the surface itself.
    pub is_emissive_proxy: u32,
    /// For whoever draws lights by lot: this light is drawn by numbers of [0, 1) below this and not
    /// below the `chance` of the light before it in the list ([`LightGpu::list`]). (The path tracer
    /// keeps its own chance here.)
    pub chance: f32,
}

/// Lights that a draw by lot looks at. Lists that are no longer are looked at whole.
pub const CANDIDATES: usize = 8;

/// What all lights of a kind share evenly. Power says nothing of how near a light is: a weak lamp
/// may be all the light of a room.
const EVEN: f64 = 0.3;

/// A spot whose half angle is above this gets a cube of shadow maps: one map would waste its texels
/// on the rim.
const WIDEST_SPOT: f32 = 60.0 * std::f32::consts::PI / 180.0;

/// True for lights whose cone fits into one shadow map.
pub fn fits_one_map(kind: &LightKind) -> bool {
    matches!(kind, LightKind::Spot { outer_angle, .. } if *outer_angle <= WIDEST_SPOT)
}

impl LightGpu {
    /// The shader's form of `light`; one with anything that is no number gives none.
    pub fn new(light: &Light) -> Self {
        let dark =
            Self { direction: [0.0, -1.0, 0.0], is_emissive_proxy: light.is_emissive_proxy.into(), ..Self::zeroed() };
        Self::finite(light).unwrap_or(dark)
    }

    /// The shader's form of `light`, if all of it is numbers.
    pub fn finite(light: &Light) -> Option<Self> {
        let made = Self::of(light);
        let [places, rest] =
            [[made.position, made.direction], [made.color, [made.range, made.radius, made.cone_scale]]];
        let finite = places.iter().chain(&rest).flatten().all(|v| v.is_finite()) && made.cone_offset.is_finite();
        finite.then_some(made)
    }

    fn of(light: &Light) -> Self {
        let tint = |strength: f32| light.color.map(|c| c * strength);
        let unit = |v: [f32; 3]| glam::Vec3::from(v).try_normalize().unwrap_or(glam::Vec3::NEG_Y).to_array();
        let zero = Self { is_emissive_proxy: light.is_emissive_proxy.into(), ..Self::zeroed() };
        match light.kind {
            LightKind::Directional { direction, irradiance, angle } => Self {
                direction: unit(direction),
                color: tint(irradiance),
                radius: (angle.clamp(0.0, 3.0) * 0.5).tan(),
                ..zero
            },
            LightKind::Point { position, intensity, radius, range } => {
                Self { position, kind: 1, range: range.unwrap_or(0.0), color: tint(intensity), radius, ..zero }
            }
            LightKind::Spot { position, direction, intensity, radius, range, inner_angle, outer_angle } => {
                let (inner, outer) = (inner_angle.cos(), outer_angle.cos());
                let cone_scale = 1.0 / (inner - outer).max(1e-3);
                Self {
                    position,
                    kind: 2,
                    direction: unit(direction),
                    range: range.unwrap_or(0.0),
                    color: tint(intensity),
                    radius,
                    cone_scale,
                    cone_offset: -outer * cone_scale,
                    ..zero
                }
            }
        }
    }

    /// The shader's form of a list of lights, with the chances by which one is drawn: lamps in
    /// proportion to their power, with a share for everybody. Lamps and suns have nothing to
    /// compare by, so each sun has one of the [`CANDIDATES`] for itself, and where there are many
    /// they share half of them. Lights that stand for surfaces that glow are never drawn: rays meet
    /// the surfaces.
    pub fn list(lights: &[Light]) -> Vec<Self> {
        let mut list: Vec<Self> = lights.iter().map(Self::new).collect();
        let power: Vec<f64> = lights.iter().map(power).collect();
        let shining = (0..list.len()).filter(|&i| power[i] > 0.0);
        let (suns, lamps): (Vec<usize>, Vec<usize>) = shining.partition(|&i| list[i].kind == 0);
        let suns_share = match (suns.len(), lamps.len()) {
            (_, 0) => 1.0,
            (n, _) => n.min(CANDIDATES / 2) as f64 / CANDIDATES as f64,
        };
        let mut shares = vec![0.0; list.len()];
        for (group, share) in [(suns, suns_share), (lamps, 1.0 - suns_share)] {
            let total: f64 = group.iter().map(|&i| power[i]).sum();
            for &i in &group {
                shares[i] = share * ((1.0 - EVEN) * power[i] / total + EVEN / group.len() as f64);
            }
        }
        let all: f64 = shares.iter().sum();
        let mut sum = 0.0;
        for (light, share) in list.iter_mut().zip(shares) {
            sum += share;
            light.chance = if all > 0.0 { (sum / all) as f32 } else { 0.0 };
        }
        list
    }
}

/// What chances go by: watts, or W/m² of a sun.
fn power(light: &Light) -> f64 {
    use std::f64::consts::PI;
    let strength = match light.kind {
        _ if light.is_emissive_proxy => 0.0,
        LightKind::Directional { irradiance, .. } => f64::from(irradiance),
        LightKind::Point { intensity, .. } => f64::from(intensity) * 4.0 * PI,
        LightKind::Spot { intensity, outer_angle, .. } => {
            f64::from(intensity) * 2.0 * PI * (1.0 - f64::from(outer_angle).cos()).max(1e-3)
        }
    };
    let [r, g, b] = light.color.map(f64::from);
    let power = strength * (0.2126 * r + 0.7152 * g + 0.0722 * b);
    if power.is_finite() { power.max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_light_has_its_share_and_suns_do_not_drown() {
        let light = |kind, is_emissive_proxy| Light { name: String::new(), color: [1.0; 3], kind, is_emissive_proxy };
        let lamp = |w| light(LightKind::Point { position: [0.0; 3], intensity: w, radius: 0.1, range: None }, false);
        let sun = light(LightKind::Directional { direction: [0.0, -1.0, 0.0], irradiance: 1.0, angle: 0.0 }, false);
        let mut lights = vec![lamp(1.0), sun, lamp(0.0), lamp(3.0), light(lamp(9.0).kind, true)];
        let shares = |lights: &[Light]| {
            let ends: Vec<f32> = LightGpu::list(lights).iter().map(|l| l.chance).collect();
            ends.iter().enumerate().map(|(i, e)| e - if i > 0 { ends[i - 1] } else { 0.0 }).collect::<Vec<_>>()
        };
        let lamps = |w: f32| 0.875 * (0.7 * w / 4.0 + 0.3 / 2.0);
        let close = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6) && a.len() == b.len();
        let found = shares(&lights);
        assert!(close(&found, &[lamps(1.0), 0.125, 0.0, lamps(3.0), 0.0]), "{found:?}");
        lights.remove(1);
        assert!(close(&shares(&lights), &[lamps(1.0) / 0.875, 0.0, lamps(3.0) / 0.875, 0.0]));
        assert!(close(&shares(&lights[1..2]), &[0.0]) && LightGpu::list(&[]).is_empty());
        // Many suns share one half.
        let many: Vec<Light> =
            (0..12).map(|i| if i < 6 { lights[0].clone() } else { light(sun_of(i), false) }).collect();
        assert!((shares(&many)[6..].iter().sum::<f32>() - 0.5).abs() < 1e-6);
    }

    fn sun_of(i: usize) -> LightKind {
        LightKind::Directional { direction: [i as f32, -1.0, 0.0], irradiance: 1.0 + i as f32, angle: 0.0 }
    }
}
