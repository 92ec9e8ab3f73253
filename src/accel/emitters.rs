//! Triangles that glow, in the world, with a table from which a light sample chooses one by its power.

use super::alias::alias;
use super::surfaces::{DOUBLE_SIDED, Surface, from_shared_exponent, shared_exponent};
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3};

/// The twin of `Emitter` in `shaders/accel/surface.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct EmitterGpu {
    /// First corner, world space.
    pub origin: [f32; 3],
    /// A second random number below it takes this entry of the table, else `other`.
    pub threshold: f32,
    /// From the first corner to the second.
    pub edge1: [f32; 3],
    /// The entry instead.
    pub other: u32,
    /// From the first corner to the third.
    pub edge2: [f32; 3],
    /// Unused.
    pub pad: f32,
    /// W/(m²·sr).
    pub radiance: [f32; 3],
    /// As of its surface.
    pub flags: u32,
}

/// A glowing triangle of a mesh, in the mesh's space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glow {
    /// Corners.
    pub corners: [[f32; 3]; 3],
    /// Radiance as the rays read it, and flags.
    pub surface: (Vec3, u32),
}

/// What of a mesh's triangles glows.
pub fn glowing(surfaces: &[Surface], corners: &[[[f32; 3]; 3]]) -> Vec<Glow> {
    let glow = |(s, corners): (&Surface, &[[f32; 3]; 3])| {
        let radiance = from_shared_exponent(shared_exponent(s.emission)) * s.coverage;
        (luminance(radiance) > 0.0).then_some(Glow { corners: *corners, surface: (radiance, s.flags) })
    };
    surfaces.iter().zip(corners).filter_map(glow).collect()
}

/// What chooses a glowing triangle for its power; `emission_density` of `shaders/accel/surface.wgsl` says the same.
pub fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The table, and one over the sum of luminance × area × sides of everything in it (0 for nothing). At most `most` of the strongest.
pub fn table<'a>(placed: impl Iterator<Item = (&'a [Glow], Mat4)>, most: usize) -> (Vec<EmitterGpu>, f32) {
    let mut all = Vec::new();
    for (glows, world) in placed {
        for glow in glows {
            let [a, b, c] = glow.corners.map(|p| world.transform_point3(p.into()));
            let (radiance, flags) = glow.surface;
            let sides = if flags & DOUBLE_SIDED != 0 { 2.0 } else { 1.0 };
            let area = 0.5 * (b - a).as_dvec3().cross((c - a).as_dvec3()).length();
            let power = area * f64::from(luminance(radiance) * sides);
            if power > 0.0 && power.is_finite() {
                // A mirrored instance turns the winding round, but not which side is the front.
                let (b, c) = if world.determinant() < 0.0 { (c, b) } else { (b, c) };
                all.push((power, a, b - a, c - a, radiance, flags));
            }
        }
    }
    if all.len() > most {
        all.sort_by(|x, y| y.0.total_cmp(&x.0));
        tracing::warn!("of {} glowing triangles the strongest {most} light the scene", all.len());
        all.truncate(most);
    }
    let total: f64 = all.iter().map(|e| e.0).sum();
    let choices: Vec<(u32, f64)> = (0u32..).zip(&all).map(|(i, e)| (i, e.0 / total)).collect();
    let entries = alias(&choices);
    let emitters = all.iter().zip(entries).map(|((_, origin, edge1, edge2, radiance, flags), entry)| EmitterGpu {
        origin: origin.to_array(),
        threshold: entry[0],
        edge1: edge1.to_array(),
        other: entry[1].to_bits(),
        edge2: edge2.to_array(),
        pad: 0.0,
        radiance: radiance.to_array(),
        flags: *flags,
    });
    (emitters.collect(), if total > 0.0 { (1.0 / total) as f32 } else { 0.0 })
}
