//! The slow, obvious CPU reference of `gi/`'s shaders, function by function under the same names.
//! No wgpu. Tests compare the shaders with it; nothing else uses it. Formulas are documented in the
//! shaders.

use crate::accel::luminance;
use crate::gi::screen::ambient::{BOUNCE, SKY};
use crate::gi::stage::exposure::Exposure;
use crate::gi::stage::inputs::{CELL, Params};
use glam::{IVec2, Vec3, Vec3Swizzles};

/// Largest value that is stored in the half-float output.
pub const LARGEST: f32 = 65000.0;

/// What the input textures hold, as plain numbers, row-major from the top; each list has
/// `width × height` entries.
#[derive(Debug, Clone, Default)]
pub struct GBuffer {
    /// Reversed-Z depth; 0 on the background.
    pub depth: Vec<f32>,
    /// Octahedral world normal.
    pub normal: Vec<[f32; 2]>,
    /// Linear reflectance and ambient occlusion.
    pub albedo: Vec<[f32; 4]>,
    /// Emitted radiance.
    pub emissive: Vec<[f32; 3]>,
    /// Direct diffuse light, E/π.
    pub direct: Vec<[f32; 3]>,
}

/// A picture as the shaders see it.
pub struct Picture<'a> {
    buffers: &'a GBuffer,
    params: Params,
    size: IVec2,
    cells: IVec2,
}

fn finite3(v: Vec3) -> Vec3 {
    Vec3::from_array(v.to_array().map(|x| if x.is_finite() { x } else { 0.0 }))
}

/// Inverse of [`oct_encode`].
pub fn oct_decode(e: [f32; 2]) -> [f32; 3] {
    let mut n = Vec3::new(e[0], e[1], 1.0 - e[0].abs() - e[1].abs());
    let t = (-n.z).max(0.0);
    n.x += if n.x >= 0.0 { -t } else { t };
    n.y += if n.y >= 0.0 { -t } else { t };
    n.normalize().to_array()
}

/// Octahedral encoding of a unit vector into [−1, 1]².
pub fn oct_encode(n: [f32; 3]) -> [f32; 2] {
    let n = Vec3::from_array(n);
    let p = n.xy() / n.abs().element_sum();
    if n.z >= 0.0 {
        return p.to_array();
    }
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    [(1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y)]
}

impl<'a> Picture<'a> {
    /// Joins texels and camera. `params` comes from [`Params::new`], like the shaders'.
    pub fn new(buffers: &'a GBuffer, params: Params) -> Self {
        let vec = |v: [u32; 2]| IVec2::new(v[0] as i32, v[1] as i32);
        Self { buffers, params, size: vec(params.size), cells: vec(params.cells) }
    }

    fn index(&self, pixel: IVec2) -> usize {
        (pixel.y * self.size.x + pixel.x) as usize
    }

    fn sample_pixel(&self, cell: IVec2) -> IVec2 {
        let edge = CELL as i32;
        (edge * cell + edge / 2).min(self.size - 1)
    }

    fn light_at(&self, pixel: IVec2) -> Vec3 {
        finite3(Vec3::from_array(self.buffers.direct[self.index(pixel)])).max(Vec3::ZERO)
    }

    fn emissive_at(&self, pixel: IVec2) -> Vec3 {
        finite3(Vec3::from_array(self.buffers.emissive[self.index(pixel)])).max(Vec3::ZERO)
    }

    fn distance_at(&self, pixel: IVec2) -> f32 {
        let texel = self.buffers.depth[self.index(pixel)];
        if !texel.is_finite() || texel <= 0.0 {
            return 0.0;
        }
        (self.params.depth[0] / (texel + self.params.depth[1])).clamp(1e-9, 1e9)
    }

    fn all_cells(&self) -> impl Iterator<Item = IVec2> + use<> {
        let cells = self.cells;
        (0..cells.y).flat_map(move |y| (0..cells.x).map(move |x| IVec2::new(x, y)))
    }

    fn all_pixels(&self) -> impl Iterator<Item = IVec2> + use<> {
        let size = self.size;
        (0..size.y).flat_map(move |y| (0..size.x).map(move |x| IVec2::new(x, y)))
    }

    /// `gi.exposure`, summed in f64.
    pub fn exposure(&self) -> Exposure {
        let (mut light, mut ln_z, mut hits, mut nonfinite) = (0.0f64, 0.0f64, 0u32, 0u32);
        let mut outgoing = [0.0f64; 3];
        for cell in self.all_cells() {
            let pixel = self.sample_pixel(cell);
            let i = self.index(pixel);
            let b = self.buffers;
            let sound = b.depth[i].is_finite()
                && b.normal[i].iter().chain(&b.direct[i]).chain(&b.emissive[i]).all(|x| x.is_finite());
            nonfinite += u32::from(!sound);
            let z = self.distance_at(pixel);
            if z > 0.0 {
                light += f64::from(luminance(self.light_at(pixel)) + luminance(self.emissive_at(pixel)));
                let [r, g, blue, _] = b.albedo[i];
                let sent = Vec3::new(r, g, blue) * self.light_at(pixel) + self.emissive_at(pixel);
                (0..3).for_each(|c| outgoing[c] += f64::from(sent[c]));
                ln_z += f64::from(z).ln();
                hits += 1;
            }
        }
        let count = f64::from(self.cells.x) * f64::from(self.cells.y);
        let [r, g, b, _] = self.params.environment;
        let s = (light / count + f64::from(luminance(Vec3::new(r, g, b)))) as f32;
        let s = if s <= 1e-20 { 0.0 } else { s };
        let ln_m = if hits > 0 { (ln_z / f64::from(hits)) as f32 } else { 0.0 };
        let outgoing = outgoing.map(|v| (v / count) as f32);
        Exposure { s, ln_m, hit_fraction: (f64::from(hits) / count) as f32, nonfinite, outgoing }
    }

    /// `gi.ambient`: E/π of every pixel, given each pixel's visibility.
    pub fn ambient(&self, exposure: &Exposure, visibility: &[f32]) -> Vec<[f32; 3]> {
        let ambient_term: [f32; 3] = std::array::from_fn(|c| {
            let [sky, bounce] = [self.params.environment[c], exposure.outgoing[c]];
            SKY * sky + BOUNCE * bounce
        });
        let light = |(pixel, visible): (_, &f32)| {
            if self.distance_at(pixel) <= 0.0 {
                return [0.0; 3];
            }
            ambient_term.map(|u| (u * visible).min(LARGEST))
        };
        self.all_pixels().zip(visibility).map(light).collect()
    }
}
