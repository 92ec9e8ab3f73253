//! What a test sees of a frame, whoever drew it.

use crate::study::judge::NOTHING;
use bouncelight::render::View;
use bouncelight::scene::Camera;
use glam::{Mat4, Vec3, Vec4};

/// One frame: indirect light, picture and places.
#[derive(Debug, Clone)]
pub struct Observation {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// What the method added, E/π, rgb interleaved. Of generators, which know no light: their picture.
    pub light: Vec<f32>,
    /// The picture, linear radiance, rgb interleaved.
    pub rgb: Vec<f32>,
    /// Distance along the view axis, metres; at least 1e9 where there is no surface.
    pub depth: Vec<f32>,
    /// Normals, world space, xyz interleaved.
    pub normal: Vec<f32>,
    /// Values that are no numbers.
    pub broken: usize,
    /// From where.
    pub camera: Camera,
}

/// How far from the plane of a place another may be and still be of the same surface, as a share of
/// its distance.
const PLANE: f32 = 0.01;

impl Observation {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.depth.len()
    }

    /// Whether there is a surface.
    pub fn is_surface(&self, pixel: usize) -> bool {
        self.depth[pixel] < NOTHING
    }

    /// Indirect light of a pixel.
    pub fn light_at(&self, pixel: usize) -> [f32; 3] {
        std::array::from_fn(|c| self.light[3 * pixel + c])
    }

    /// The normal of a pixel.
    pub fn normal_at(&self, pixel: usize) -> Vec3 {
        Vec3::from_slice(&self.normal[3 * pixel..3 * pixel + 3])
    }

    /// World positions of the pixels; `None` where there is no surface.
    pub fn positions(&self) -> Vec<Option<Vec3>> {
        let view = View::new(&self.camera, self.size, [0.0; 2]);
        let [w, h] = self.size;
        let place = |pixel: usize| {
            let (x, y) = (pixel as u32 % w, pixel as u32 / w);
            let ndc = [2.0 * (x as f32 + 0.5) / w as f32 - 1.0, 1.0 - 2.0 * (y as f32 + 0.5) / h as f32];
            self.is_surface(pixel).then(|| view.frustum_point(ndc, self.depth[pixel]))
        };
        (0..self.pixels()).map(place).collect()
    }

    /// Mean of the light over surfaces.
    pub fn mean(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0f64);
        for pixel in (0..self.pixels()).filter(|&p| self.is_surface(p)) {
            sum += self.light_at(pixel).iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
            count += 1.0;
        }
        sum / count.max(1.0)
    }
}

/// How far off a pixel's middle rounding may put a place that is there, pixels.
const ROUNDING: f32 = 1e-3;

/// The light of one look at the places that another one shows.
pub(super) struct Fetch<'a> {
    from: &'a Observation,
    positions: Vec<Option<Vec3>>,
    clip_from_world: Mat4,
}

impl<'a> Fetch<'a> {
    pub fn new(from: &'a Observation) -> Self {
        let view = View::new(&from.camera, from.size, [0.0; 2]);
        let clip_from_world = Mat4::from_cols_array_2d(&view.clip_from_world);
        Self { from, positions: from.positions(), clip_from_world }
    }

    /// Light at a place of a surface with the given normal, between the four pixels around it that
    /// show the same surface; `None` where it is outside or hidden.
    pub fn at(&self, place: Vec3, normal: Vec3) -> Option<[f32; 3]> {
        let clip = self.clip_from_world * Vec4::from((place, 1.0));
        if clip.w <= 0.0 {
            return None;
        }
        let [w, h] = self.from.size.map(|n| n as f32);
        let x = (clip.x / clip.w * 0.5 + 0.5) * w - 0.5;
        let y = (0.5 - clip.y / clip.w * 0.5) * h - 0.5;
        // Beyond the middles of the outermost pixels there is nothing to be between.
        let inside = |at: f32, count: f32| at > -ROUNDING && at < count - 1.0 + ROUNDING;
        if !inside(x, w) || !inside(y, h) {
            return None;
        }
        let (x0, y0) = (x.floor(), y.floor());
        let (mut sum, mut all) = ([0.0; 3], 0.0);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (px, py) = (x0 + dx, y0 + dy);
            if px < 0.0 || py < 0.0 || px >= w || py >= h {
                continue;
            }
            let pixel = (py * w + px) as usize;
            let Some(there) = self.positions[pixel] else { continue };
            // `clip.w` is the distance along the axis.
            let apart = (there - place).dot(normal).abs();
            if apart > PLANE * clip.w || self.from.normal_at(pixel).dot(normal) < 0.9 {
                continue;
            }
            let weight = (1.0 - (x - px).abs()) * (1.0 - (y - py).abs());
            let light = self.from.light_at(pixel);
            (0..3).for_each(|c| sum[c] += weight * light[c]);
            all += weight;
        }
        (all > 0.5).then(|| sum.map(|v| v / all))
    }
}
