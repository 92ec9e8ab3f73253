//! Noise averaged away for a look at a picture of few samples; never for a truth, since what is
//! averaged is no longer unbiased.
//!
//! Light divided by colour is averaged over neighbours on the same plane by five à-trous steps,
//! whose tolerance is the noise that each pixel's surroundings show (Dammertz et al. 2010; Schied
//! et al. 2017, its filter in space). Colour, emission and surroundings stay as they were traced.

use super::{Layer, NO_DEPTH, Traced};
use bouncelight::accel::luminance;
use bouncelight::scene::Camera;
use glam::Vec3;

/// Layers that [`denoise`] reads.
pub const READ: [Layer; 12] = [
    Layer::Combined,
    Layer::DiffDir,
    Layer::DiffInd,
    Layer::DiffCol,
    Layer::GlossDir,
    Layer::GlossInd,
    Layer::GlossCol,
    Layer::Emit,
    Layer::Env,
    Layer::Normal,
    Layer::Depth,
    Layer::Position,
];

/// Steps, each over 5×5 taps twice as far apart as the one before: 63 pixels in all.
const STEPS: u32 = 5;
/// Deviations that two pixels of the same light may differ by.
const DEVIATIONS: f32 = 4.0;
/// A pixel brighter than its neighbours' mean by more than so many of their deviations is a spark.
const SPARK: f32 = 3.0;
/// Power of the cosine between normals.
const FACING: i32 = 32;
/// Binomial weights of five taps.
const TAPS: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];

/// Surfaces that pixels show.
struct Surfaces<'a> {
    size: [i32; 2],
    normal: &'a [f32],
    position: &'a [f32],
    depth: &'a [f32],
    /// Width of a pixel over its depth.
    pixel: f32,
}

impl Surfaces<'_> {
    fn at(values: &[f32], i: usize) -> Vec3 {
        Vec3::from_slice(&values[3 * i..3 * i + 3])
    }

    fn is_there(&self, i: usize) -> bool {
        self.depth[i] > 0.0 && self.depth[i] < 0.5 * NO_DEPTH
    }

    /// How much pixel `j`, `step` pixels away, shows of what `i` shows.
    fn alike(&self, i: usize, j: usize, step: f32) -> f32 {
        let n = Self::at(self.normal, i).normalize_or_zero();
        let facing = n.dot(Self::at(self.normal, j).normalize_or_zero()).max(0.0).powi(FACING);
        let off = n.dot(Self::at(self.position, j) - Self::at(self.position, i));
        let foot = self.pixel * self.depth[i] * step;
        facing * (-off.abs() / foot.max(f32::MIN_POSITIVE)).exp()
    }

    /// Pixels with a surface within two taps to each side of `i`: their index, and the taps'
    /// weight.
    fn around(&self, i: usize, step: i32) -> impl Iterator<Item = (usize, f32)> + '_ {
        let [width, height] = self.size;
        let (x, y) = (i as i32 % width, i as i32 / width);
        (0..25).filter_map(move |k| {
            let (dx, dy) = (k % 5 - 2, k / 5 - 2);
            let (px, py) = (x + step * dx, y + step * dy);
            let inside = (0..width).contains(&px) && (0..height).contains(&py);
            let j = if inside { (py * width + px) as usize } else { return None };
            self.is_there(j).then(|| (j, TAPS[(dx + 2) as usize] * TAPS[(dy + 2) as usize]))
        })
    }
}

/// The picture, RGBA, made of averaged light. `None` where a layer of [`READ`] is missing.
pub fn denoise(traced: &Traced, camera: &Camera) -> Option<Vec<f32>> {
    let [width, height] = traced.size;
    let layer = |l| traced.layer(l);
    let surfaces = Surfaces {
        size: [width as i32, height as i32],
        normal: layer(Layer::Normal)?,
        position: layer(Layer::Position)?,
        depth: layer(Layer::Depth)?,
        pixel: 2.0 * (0.5 * camera.yfov).tan() / height as f32,
    };
    let sum = |a: &[f32], b: &[f32]| -> Vec<Vec3> {
        a.chunks_exact(3).zip(b.chunks_exact(3)).map(|(a, b)| Vec3::from_slice(a) + Vec3::from_slice(b)).collect()
    };
    let [diffuse, gloss] = [[Layer::DiffDir, Layer::DiffInd], [Layer::GlossDir, Layer::GlossInd]]
        .map(|[direct, indirect]| Some(averaged(&surfaces, sum(layer(direct)?, layer(indirect)?))));
    let (diffuse, gloss) = (diffuse?, gloss?);
    let [diff_col, gloss_col, emit, env] = [Layer::DiffCol, Layer::GlossCol, Layer::Emit, Layer::Env].map(layer);
    let (diff_col, gloss_col, emit, env) = (diff_col?, gloss_col?, emit?, env?);
    let mut picture = layer(Layer::Combined)?.to_vec();
    for (i, out) in picture.chunks_exact_mut(4).enumerate() {
        let of = |values| Surfaces::at(values, i);
        let c = of(diff_col) * diffuse[i] + of(gloss_col) * gloss[i] + of(emit) + of(env);
        out[..3].copy_from_slice(&c.to_array());
    }
    Some(picture)
}

/// Light averaged over what shows the same.
fn averaged(surfaces: &Surfaces<'_>, light: Vec<Vec3>) -> Vec<Vec3> {
    let (mut light, mut variance) = without_sparks(surfaces, light);
    for step in (0..STEPS).map(|s| 1 << s) {
        let one = |i: usize| {
            if !surfaces.is_there(i) {
                return (light[i], variance[i]);
            }
            // One pixel's variance is noise itself.
            let near = surfaces.around(i, 1).fold([0.0; 2], |[v, t], (j, w)| [v + w * variance[j], t + w]);
            let tolerance = DEVIATIONS * (near[0] / near[1]).sqrt() + 1e-6 * luminance(light[i]).abs() + 1e-30;
            let (mut sum, mut squares, mut total) = (Vec3::ZERO, 0.0, 0.0);
            for (j, tap) in surfaces.around(i, step) {
                let apart = luminance(light[j] - light[i]).abs();
                let w = tap * if i == j { 1.0 } else { surfaces.alike(i, j, step as f32) * (-apart / tolerance).exp() };
                sum += w * light[j];
                squares += w * w * variance[j];
                total += w;
            }
            (sum / total, squares / (total * total))
        };
        (light, variance) = (0..light.len()).map(one).unzip();
    }
    light
}

/// Light whose sparks are as bright as their neighbours allow, and the variance of each pixel's
/// luminance, told from its neighbours.
fn without_sparks(surfaces: &Surfaces<'_>, light: Vec<Vec3>) -> (Vec<Vec3>, Vec<f32>) {
    let one = |i: usize| {
        if !surfaces.is_there(i) {
            return (light[i], 0.0);
        }
        let [mut total, mut mean, mut square] = [0.0f32; 3];
        for (j, _) in surfaces.around(i, 1).filter(|(j, _)| *j != i) {
            let (w, l) = (surfaces.alike(i, j, 1.0), luminance(light[j]));
            (total, mean, square) = (total + w, mean + w * l, square + w * l * l);
        }
        if total < 1e-3 {
            return (light[i], 0.0);
        }
        (mean, square) = (mean / total, square / total);
        let deviation = (square - mean * mean).max(0.0).sqrt();
        let (own, most) = (luminance(light[i]), mean + SPARK * deviation);
        let kept = if own > most && own > 0.0 { light[i] * (most / own) } else { light[i] };
        let apart = luminance(kept) - mean;
        (kept, (deviation * deviation).max(0.25 * apart * apart))
    };
    (0..light.len()).map(one).unzip()
}
