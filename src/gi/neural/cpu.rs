//! The slow, obvious CPU reference of `gi/`'s shaders, function by function under the same names.
//! No wgpu. Tests compare the shaders with it; nothing else uses it. Formulas are documented in the
//! shaders and in `gi::features`.

use super::features::FeatureSet;
use super::reconstruct::{Answer, LOST, MOST_ADDED, TRUST};
use crate::accel::luminance;
use crate::gi::screen::ambient::{BOUNCE, SKY};
use crate::gi::stage::exposure::Exposure;
use crate::gi::stage::inputs::{CELL, Params};
use crate::gi::stage::weights::{NORMAL_FLOOR, NORMAL_POWER, PLANE_TOLERANCE, WEIGHT_FLOOR};
use glam::{IVec2, Mat3, Vec2, Vec3, Vec3Swizzles};

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
    /// What method `gather` answers, E/π.
    pub guess: Vec<[f32; 3]>,
}

/// A picture as the shaders see it.
pub struct Picture<'a> {
    buffers: &'a GBuffer,
    params: Params,
    size: IVec2,
    cells: IVec2,
}

struct Surface {
    position: Vec3,
    normal: Vec3,
    distance: f32,
}

fn finite3(v: Vec3) -> Vec3 {
    Vec3::from_array(v.to_array().map(|x| if x.is_finite() { x } else { 0.0 }))
}

fn matrix(columns: &[[f32; 4]; 3]) -> Mat3 {
    let [x, y, z] = columns.map(|c| Vec3::new(c[0], c[1], c[2]));
    Mat3::from_cols(x, y, z)
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

    fn guess_at(&self, pixel: IVec2) -> Vec3 {
        finite3(Vec3::from_array(self.buffers.guess[self.index(pixel)])).max(Vec3::ZERO)
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

    fn position_at(&self, pixel: IVec2, distance: f32) -> Vec3 {
        let uv = (pixel.as_vec2() + 0.5) / self.size.as_vec2();
        let ndc = Vec2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
        let [sx, sy, ox, oy] = self.params.unproject;
        let ray = Vec3::new((ndc.x + ox) * sx, (ndc.y + oy) * sy, -1.0);
        matrix(&self.params.gravity_from_view) * (ray * distance)
    }

    fn normal_at(&self, pixel: IVec2) -> Vec3 {
        let texel = self.buffers.normal[self.index(pixel)].map(|x| if x.is_finite() { x } else { 0.0 });
        matrix(&self.params.gravity_from_world) * Vec3::from_array(oct_decode(texel))
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
        let (s, inv_s) = if s <= 1e-20 { (0.0, 0.0) } else { (s, 1.0 / s) };
        let ln_m = if hits > 0 { (ln_z / f64::from(hits)) as f32 } else { 0.0 };
        let outgoing = outgoing.map(|v| (v / count) as f32);
        Exposure { s, inv_s, ln_m, hit_fraction: (f64::from(hits) / count) as f32, nonfinite, outgoing }
    }

    /// `gi.ambient`: E/π of every pixel, given each pixel's visibility.
    pub fn ambient(&self, exposure: &Exposure, visibility: &[f32]) -> Vec<[f32; 3]> {
        let unseen: [f32; 3] = std::array::from_fn(|c| {
            let [sky, bounce] = [self.params.environment[c], exposure.outgoing[c]];
            SKY * sky + BOUNCE * bounce
        });
        let light = |(pixel, visible): (_, &f32)| {
            if self.distance_at(pixel) <= 0.0 {
                return [0.0; 3];
            }
            unseen.map(|u| (u * visible).min(LARGEST))
        };
        self.all_pixels().zip(visibility).map(light).collect()
    }

    /// `gi.pack`: NHWC, `features.padded()` channels a cell.
    pub fn pack(&self, exposure: &Exposure, features: &FeatureSet) -> Vec<f32> {
        let padded = features.padded() as usize;
        let mut out = Vec::with_capacity(padded * (self.cells.x * self.cells.y) as usize);
        for cell in self.all_cells() {
            let mut row = vec![0.0; padded];
            self.pack_cell(cell, exposure, |name, values: &[f32]| {
                if let Some(at) = features.offset(name) {
                    row[at as usize..][..values.len()].copy_from_slice(values);
                }
            });
            out.extend(row);
        }
        out
    }

    fn pack_cell(&self, cell: IVec2, exposure: &Exposure, mut put: impl FnMut(&str, &[f32])) {
        let compress = |radiance: Vec3| radiance.to_array().map(|x| (1.0 + x * exposure.inv_s).ln());
        let [r, g, b, _] = self.params.environment;
        put("sky", &compress(Vec3::new(r, g, b)));
        let pixel = self.sample_pixel(cell);
        let z = self.distance_at(pixel);
        if z <= 0.0 {
            return;
        }
        let light = self.light_at(pixel);
        let [r, g, b, _] = self.buffers.albedo[self.index(pixel)];
        let albedo = Vec3::new(r, g, b);
        let v = self.position_at(pixel, z) / exposure.ln_m.exp();
        put("direct", &compress(light));
        put("outgoing", &compress(albedo * light + self.emissive_at(pixel)));
        put("albedo", &albedo.to_array());
        put("normal", &self.normal_at(pixel).to_array());
        put("position", &(v / (1.0 + v.length())).to_array());
        put("depth", &[(z.ln() - exposure.ln_m).clamp(-4.0, 4.0)]);
        put("spread", &[self.spread_of(cell, z)]);
        put("hit", &[1.0]);
        put("guess", &compress(self.guess_at(pixel)));
    }

    fn spread_of(&self, cell: IVec2, z: f32) -> f32 {
        let edge = CELL as i32;
        let last = (edge * cell + edge).min(self.size);
        let mut spread = 0.0f32;
        for y in edge * cell.y..last.y {
            for x in edge * cell.x..last.x {
                let other = self.distance_at(IVec2::new(x, y));
                spread = spread.max(if other > 0.0 { (other / z).ln().abs() } else { 1.0 });
            }
        }
        spread.min(1.0)
    }

    /// `gi.reconstruct`: E/π of every pixel from `answers`, one a cell: y or g, and r (zeros for
    /// [`Answer::Light`]).
    pub fn reconstruct(&self, exposure: &Exposure, answer: Answer, answers: &[[f32; 6]]) -> Vec<[f32; 3]> {
        let light = |pixel| {
            let distance = self.distance_at(pixel);
            if distance <= 0.0 {
                return [0.0; 3];
            }
            let here = Surface { position: self.position_at(pixel, distance), normal: self.normal_at(pixel), distance };
            let base = if answer == Answer::Gain { self.guess_at(pixel) } else { Vec3::splat(exposure.s) };
            let (factor, addition) = self.answer_of(pixel, &here, answer, answers);
            (base * factor + exposure.s * addition).clamp(Vec3::ZERO, Vec3::splat(LARGEST)).to_array()
        };
        self.all_pixels().map(light).collect()
    }

    fn agreement(&self, here: &Surface, pixel: IVec2, z: f32) -> f32 {
        let offset = self.position_at(pixel, z) - here.position;
        let off_plane = here.normal.dot(offset).abs() / (PLANE_TOLERANCE * here.distance);
        let lorentz = 1.0 + (off_plane * off_plane).min(1e12);
        let facing = here.normal.dot(self.normal_at(pixel)).max(0.0).powf(NORMAL_POWER);
        facing.max(NORMAL_FLOOR) / (lorentz * lorentz)
    }

    /// Factor and addition times weight, and weight.
    fn tap(&self, here: &Surface, cell: IVec2, spatial: f32, answer: Answer, answers: &[[f32; 6]]) -> Sum {
        let pixel = self.sample_pixel(cell);
        let z = self.distance_at(pixel);
        if z <= 0.0 {
            return Sum::default();
        }
        let [a, b, c, d, e, f] = answers[(cell.y * self.cells.x + cell.x) as usize];
        let [lowest, highest] = answer.range();
        let factor = finite3(Vec3::new(a, b, c)).clamp(Vec3::splat(lowest), Vec3::splat(highest)).exp();
        let addition = finite3(Vec3::new(d, e, f)).clamp(Vec3::splat(-MOST_ADDED), Vec3::splat(MOST_ADDED));
        let weight = spatial * self.agreement(here, pixel, z).max(WEIGHT_FLOOR);
        Sum { factor: factor * weight, addition: addition * weight, weight }
    }

    fn gather(&self, here: &Surface, place: Vec2, radius: i32, answer: Answer, answers: &[[f32; 6]]) -> Sum {
        let base = place.floor().as_ivec2();
        let first = (base - (radius - 1)).max(IVec2::ZERO);
        let last = (base + radius).min(self.cells - 1);
        let mut sum = Sum::default();
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let tent = 1.0 - (IVec2::new(x, y).as_vec2() - place).abs() / (radius as f32 + 1.0);
                sum = sum.plus(self.tap(here, IVec2::new(x, y), tent.x * tent.y, answer, answers));
            }
        }
        sum
    }

    /// Factor and addition at a pixel.
    fn answer_of(&self, pixel: IVec2, here: &Surface, answer: Answer, answers: &[[f32; 6]]) -> (Vec3, Vec3) {
        let edge = CELL as f32;
        let place = (pixel.as_vec2() - edge / 2.0) / edge;
        let base = place.floor().as_ivec2();
        let f = place - place.floor();
        let mut near = Sum::default();
        for (step, wx, wy) in [
            (IVec2::new(0, 0), 1.0 - f.x, 1.0 - f.y),
            (IVec2::new(1, 0), f.x, 1.0 - f.y),
            (IVec2::new(0, 1), 1.0 - f.x, f.y),
            (IVec2::new(1, 1), f.x, f.y),
        ] {
            let cell = (base + step).clamp(IVec2::ZERO, self.cells - 1);
            near = near.plus(self.tap(here, cell, wx * wy, answer, answers));
        }
        if near.weight >= TRUST {
            return near.mean();
        }
        let mut wide = self.gather(here, place, 2, answer, answers);
        if wide.weight < LOST {
            wide = self.gather(here, place, 4, answer, answers);
        }
        if wide.weight <= 0.0 {
            return (Vec3::from_array(answer.fallback()), Vec3::ZERO);
        }
        let (wide, trust, near) = (wide.mean(), near.weight / TRUST, near.mean());
        (wide.0.lerp(near.0, trust), wide.1.lerp(near.1, trust))
    }
}

/// A weighted sum over cells.
#[derive(Clone, Copy, Default)]
struct Sum {
    factor: Vec3,
    addition: Vec3,
    weight: f32,
}

impl Sum {
    fn plus(self, other: Sum) -> Sum {
        Sum {
            factor: self.factor + other.factor,
            addition: self.addition + other.addition,
            weight: self.weight + other.weight,
        }
    }

    fn mean(self) -> (Vec3, Vec3) {
        let weight = self.weight.max(1e-30);
        (self.factor / weight, self.addition / weight)
    }
}
