//! Everything that shines, with alias tables (Walker 1977; Vose 1991) from which light samples
//! choose.
//!
//! Chances follow power with a share for everybody: what lights a closed room may be a weak lamp
//! beside a strong sun outside. Wrong chances cost noise, never correctness.

use super::sky;
use super::triangles::Flat;
use super::{ANALYTIC_APART, SceneInfo};
use bouncelight::accel::alias::alias;
use bouncelight::lights::LightGpu;
use bouncelight::scene::{AlphaMode, LightKind, Scene};
use bouncelight_scene::defaults::mean_emission;
use bytemuck::Zeroable;
use glam::Vec3;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Marks an entry of a table that is a triangle, not an analytic light.
const TRIANGLE: u32 = 1 << 31;
/// What all groups (each analytic light, the glowing triangles, the surroundings) share evenly.
const EVEN: f64 = 0.3;

/// The lights' buffer and what the scene's uniform says about it.
pub(super) struct Lights {
    pub vectors: Vec<[f32; 4]>,
    pub info: SceneInfo,
    /// Chance per area with which each glowing triangle is sampled, 1/m².
    pub densities: HashMap<u32, f32>,
}

/// Something to choose.
struct Choice {
    id: u32,
    power: f64,
}

pub(super) fn pack(scene: &Scene, flat: &Flat) -> Lights {
    let reach = extent(flat);
    let analytic: Vec<Choice> =
        (0u32..).zip(&scene.lights).map(|(id, l)| Choice { id, power: power(&l.kind, l.color, reach) }).collect();
    let glowing = emitters(scene, flat);
    let sky = scene.environment.radiance.map(f64::from);
    // The disc that the scene shows to each direction, times the sphere of directions.
    let sky_power = luminance(sky) * 4.0 * PI * PI * reach * reach;

    let true_lights = analytic.iter().filter(|c| !scene.lights[c.id as usize].is_emissive_proxy && c.power > 0.0);
    let mut groups: Vec<Vec<(u32, f64)>> = true_lights.map(|c| vec![(c.id, c.power)]).collect();
    if !glowing.is_empty() {
        groups.push(glowing.iter().map(|e| (TRIANGLE | e.id, e.power)).collect());
    }
    let chosen = chances(&groups);
    let truth: Vec<(u32, f64)> = groups
        .iter()
        .zip(&chosen)
        .flat_map(|(group, chance)| {
            let total: f64 = group.iter().map(|g| g.1).sum();
            group.iter().map(move |&(id, power)| (id, chance * power / total))
        })
        .collect();
    let areas: HashMap<u32, f64> = glowing.iter().map(|e| (e.id, e.area)).collect();
    let densities = truth
        .iter()
        .filter(|(id, _)| id & TRIANGLE != 0)
        .map(|&(id, chance)| (id & !TRIANGLE, (chance / areas[&(id & !TRIANGLE)]) as f32))
        .collect();
    let rasterised = chances(&analytic.iter().map(|c| vec![(c.id, c.power)]).collect::<Vec<_>>());

    let apart = truth.iter().any(|t| t.0 & TRIANGLE != 0) || scene.lights.iter().any(|l| l.is_emissive_proxy);
    let known: f64 = groups.iter().flatten().map(|g| g.1).sum();
    // A constant sky is found as well by the rays that leave anyway; it takes no light samples.
    let alone = match (truth.is_empty(), sky_power > 0.0) {
        (_, false) => 0.0,
        (true, true) => 1.0,
        (false, true) => (1.0 - EVEN) * sky_power / (sky_power + known) + EVEN * 0.5,
    };
    let mut vectors: Vec<[f32; 4]> = Vec::new();
    for (id, light) in (0u32..).zip(&scene.lights) {
        let mut gpu = LightGpu::new(light);
        // Rays that hit a light want to know how it would have been sampled; 0 tells that it is not
        // there in truth.
        gpu.chance = truth.iter().find(|t| t.0 == id).map_or(0.0, |t| t.1 as f32);
        vectors.extend_from_slice(bytemuck::cast_slice(bytemuck::bytes_of(&gpu)));
    }
    let truth_table = vectors.len() as u32;
    vectors.extend(alias(&truth));
    let analytic_table = vectors.len() as u32;
    vectors.extend(alias(&analytic.iter().zip(rasterised).map(|(c, p)| (c.id, p)).collect::<Vec<_>>()));
    let sky_cells = scene.environment.image.as_ref().and_then(|image| sky::cells(image));
    let environment_table = vectors.len() as u32;
    let mut environment_cells = [0; 2];
    if let Some((size, chances)) = sky_cells {
        environment_cells = size;
        vectors.extend(alias(&(0u32..).zip(chances).collect::<Vec<_>>()));
    }
    let info = SceneInfo {
        environment: scene.environment.radiance,
        flags: if apart { ANALYTIC_APART } else { 0 },
        light_count: scene.lights.len() as u32,
        truth_table,
        truth_count: truth.len() as u32,
        analytic_table,
        // A picture may hold a small sun, which rays that leave anyway would hardly find.
        environment_share: if environment_cells == [0; 2] { 0.0 } else { alone as f32 },
        environment_share_alone: alone as f32,
        environment_table,
        environment_cells,
        ..SceneInfo::zeroed()
    };
    Lights { vectors, info, densities }
}

/// Half the diagonal of what is there, metres; at least a millimetre.
fn extent(flat: &Flat) -> f64 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for p in flat.positions.iter().flatten().map(|&p| Vec3::from(p)).filter(|p| p.is_finite()) {
        (low, high) = (low.min(p), high.max(p));
    }
    if low.x > high.x { 1e-3 } else { f64::from(low.distance(high) * 0.5).max(1e-3) }
}

fn luminance(c: [f64; 3]) -> f64 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

/// What a light sends into the scene, watts.
fn power(kind: &LightKind, color: [f32; 3], reach: f64) -> f64 {
    let strength = match *kind {
        LightKind::Directional { irradiance, .. } => f64::from(irradiance) * PI * reach * reach,
        LightKind::Point { intensity, .. } => f64::from(intensity) * 4.0 * PI,
        LightKind::Spot { intensity, outer_angle, .. } => {
            f64::from(intensity) * 2.0 * PI * (1.0 - f64::from(outer_angle).cos()).max(1e-3)
        }
    };
    let power = strength * luminance(color.map(f64::from));
    if power.is_finite() { power.max(0.0) } else { 0.0 }
}

/// A glowing triangle.
struct Emitter {
    id: u32,
    area: f64,
    power: f64,
}

fn emitters(scene: &Scene, flat: &Flat) -> Vec<Emitter> {
    let radiance: Vec<f64> = scene
        .materials
        .iter()
        .map(|m| {
            let sides = if m.double_sided { 2.0 } else { 1.0 };
            let cover = if m.alpha_mode == AlphaMode::Blend { f64::from(m.base_color[3]) } else { 1.0 };
            let glow = Vec3::from(m.emissive) * mean_emission(scene, m);
            let l = luminance(glow.to_array().map(f64::from)) * sides * cover;
            if m.unlit || !l.is_finite() { 0.0 } else { l }
        })
        .collect();
    let mut out = Vec::new();
    for (id, (p, &material)) in (0u32..).zip(flat.positions.iter().zip(&flat.materials)) {
        let l = radiance[material as usize];
        if l > 0.0 {
            let [a, b, c] = p.map(|p| Vec3::from(p).as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            if area > 0.0 && area.is_finite() {
                out.push(Emitter { id, area, power: PI * area * l });
            }
        }
    }
    out
}

/// Chance of each group: by power, with an even share for all.
fn chances(groups: &[Vec<(u32, f64)>]) -> Vec<f64> {
    let powers: Vec<f64> = groups.iter().map(|g| g.iter().map(|c| c.1).sum()).collect();
    let total: f64 = powers.iter().sum();
    let even = 1.0 / powers.len().max(1) as f64;
    powers.iter().map(|p| if total > 0.0 { (1.0 - EVEN) * p / total + EVEN * even } else { even }).collect()
}
