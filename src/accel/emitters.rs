//! Triangles that glow, in the world, with a table from which a light sample chooses one by its
//! power.

use super::alias::alias;
use super::build;
use super::surfaces::Surface;
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3};

/// Laid out as `Emitter` in `shaders/accel/surface.wgsl`.
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
    /// Luminance of the radiance times sides.
    pub by_area: f32,
    /// W/(m²·sr), coverage multiplied in.
    pub radiance: [f32; 3],
    /// As of its surface.
    pub flags: u32,
}

/// A glowing triangle of a mesh, in the mesh's space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glow {
    /// Corners.
    pub corners: [[f32; 3]; 3],
    /// As of its surface.
    pub radiance: Vec3,
    /// Luminance of that times sides: what chooses it, times its area.
    pub by_area: f32,
    /// As of its surface.
    pub flags: u32,
}

/// What of a mesh's triangles glows and can be met.
pub fn glowing(surfaces: &[Surface], corners: &[[[f32; 3]; 3]]) -> Vec<Glow> {
    let glow = |(s, corners): (&Surface, &[[f32; 3]; 3])| {
        let by_area = s.glow_by_area();
        (by_area > 0.0 && build::is_good(corners)).then_some(Glow {
            corners: *corners,
            radiance: s.glow(),
            by_area,
            flags: s.flags,
        })
    };
    surfaces.iter().zip(corners).filter_map(glow).collect()
}

/// The table, and one over the sum of luminance × area × sides of everything in it (0 for nothing).
/// Empty where there are more than `most`: then only rays that happen to meet them find them, which
/// is right in the mean.
pub fn table<'a>(placed: impl Iterator<Item = (&'a [Glow], Mat4)>, most: usize) -> (Vec<EmitterGpu>, f32) {
    let mut all = Vec::new();
    for (glows, world) in placed {
        for glow in glows {
            let [a, b, c] = glow.corners.map(|p| world.transform_point3(p.into()));
            let area = 0.5 * (b - a).as_dvec3().cross((c - a).as_dvec3()).length();
            let power = area * f64::from(glow.by_area);
            if power > 0.0 && power.is_finite() {
                // A mirrored instance turns the winding round, but not which side is the front.
                let (b, c) = if world.determinant() < 0.0 { (c, b) } else { (b, c) };
                all.push((power, a, b - a, c - a, *glow));
            }
        }
    }
    if all.len() > most {
        tracing::warn!("{} glowing triangles are more than the {most} that this device binds: noise", all.len());
        all.clear();
    }
    let total: f64 = all.iter().map(|e| e.0).sum();
    let choices: Vec<(u32, f64)> = (0u32..).zip(&all).map(|(i, e)| (i, e.0 / total)).collect();
    let entries = alias(&choices);
    let emitters = all.iter().zip(entries).map(|((_, origin, edge1, edge2, glow), entry)| EmitterGpu {
        origin: origin.to_array(),
        threshold: entry[0],
        edge1: edge1.to_array(),
        other: entry[1].to_bits(),
        edge2: edge2.to_array(),
        by_area: glow.by_area,
        radiance: glow.radiance.to_array(),
        flags: glow.flags,
    });
    (emitters.collect(), if total > 0.0 { (1.0 / total) as f32 } else { 0.0 })
}
