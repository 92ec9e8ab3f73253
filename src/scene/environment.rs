//! Light from beyond the scene: one radiance from everywhere, or a picture of the whole sphere of
//! directions.
//!
//! Pictures are lat-long (equirectangular), as panorama cameras and sky libraries deliver them. The
//! row tells the angle from +Y, the column the turn about it; the middle column looks along +X and
//! columns to its right turn towards +Z. Blender (whose +X is the same axis) and three.js read such
//! pictures in the same way.

mod sun;

pub use sun::SkySun;

use std::f32::consts::{PI, TAU};
use std::sync::Arc;
use thiserror::Error;

/// Light from beyond the scene.
///
/// ```
/// use bouncelight::scene::environment::{Environment, EnvironmentImage};
/// let sky = EnvironmentImage { name: "two rows".into(), width: 1, height: 2, rgb: vec![1.0, 1.0, 1.0, 0.0, 0.0, 0.0] };
/// let sky = Environment::from_image(sky)?;
/// assert!((sky.radiance[0] - 0.5).abs() < 1e-6, "bright above, black below");
/// # Ok::<_, bouncelight::scene::environment::EnvironmentError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Environment {
    /// Radiance from every direction, W/(m²·sr); with an image, its mean over the sphere of
    /// directions, which is what methods use that know no directions.
    pub radiance: [f32; 3],
    /// Radiance by direction.
    pub image: Option<Arc<EnvironmentImage>>,
}

/// Radiance by direction as a lat-long picture.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentImage {
    /// File name, for messages.
    pub name: String,
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1; the first one is up (+Y).
    pub height: u32,
    /// `3 · width · height` radiances, W/(m²·sr), finite and not negative.
    pub rgb: Vec<f32>,
}

/// Reasons why a picture cannot be an environment.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum EnvironmentError {
    /// The numbers do not fill the picture.
    #[error("{name}: {found} numbers for {width}×{height} pixels of three")]
    Shape { name: String, width: u32, height: u32, found: usize },
    /// A radiance that no light can have.
    #[error("{name}: the radiance at column {x}, row {y} is {value}; it must be finite and not negative")]
    Radiance { name: String, x: usize, y: usize, value: f32 },
}

impl Environment {
    /// Creates an environment with one radiance, W/(m²·sr), from every direction.
    pub fn constant(radiance: [f32; 3]) -> Self {
        Self { radiance, image: None }
    }

    /// Radiance by direction.
    pub fn from_image(image: EnvironmentImage) -> Result<Self, EnvironmentError> {
        let EnvironmentImage { name, width, height, rgb } = &image;
        let (width, height) = (*width, *height);
        if rgb.is_empty() || rgb.len() as u64 != 3 * u64::from(width) * u64::from(height) {
            return Err(EnvironmentError::Shape { name: name.clone(), width, height, found: rgb.len() });
        }
        if let Some(i) = rgb.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
            let (x, y) = (i / 3 % width as usize, i / 3 / width as usize);
            return Err(EnvironmentError::Radiance { name: name.clone(), x, y, value: rgb[i] });
        }
        Ok(Self { radiance: image.mean(), image: Some(Arc::new(image)) })
    }

    /// Returns the environment turned about the vertical by `degrees`, from +X towards +Z.
    pub fn turned(&self, degrees: f32) -> Self {
        let image = self.image.as_ref().map(|i| Arc::new(i.turned(degrees / 360.0)));
        Self { image: if degrees == 0.0 { self.image.clone() } else { image }, ..*self }
    }
}

/// What an overflown half float is taken for, at least: the largest of them.
const BRIGHTEST_HALF: f32 = 65_504.0;

/// Brightest radiance of a texel, as of a glowing material; squares of it are finite.
const BRIGHTEST: f32 = 1e9;

impl EnvironmentImage {
    /// Repairs up to a hundredth of the radiances and says how many; a picture with more is left as
    /// it is, and refused later.
    pub fn repair(&mut self) -> Option<String> {
        let bad = |v: f32| !(0.0..=BRIGHTEST).contains(&v);
        let count = self.rgb.iter().filter(|v| bad(**v)).count();
        // One texel is always forgiven.
        if count == 0 || count > (self.rgb.len() / 100).max(3) {
            return None;
        }
        let largest = self.rgb.iter().copied().filter(|v| !bad(*v)).fold(BRIGHTEST_HALF, f32::max);
        for v in self.rgb.iter_mut().filter(|v| bad(**v)) {
            *v = match *v {
                v if v == f32::INFINITY => largest,
                v if v > 0.0 => BRIGHTEST,
                _ => 0.0,
            };
        }
        Some(format!("{}: {count} radiances are negative or not finite and were clamped", self.name))
    }

    /// Mean over the sphere of directions: rows weighted with the solid angle they cover.
    pub fn mean(&self) -> [f32; 3] {
        let mut sum = [0.0f64; 3];
        for (y, row) in self.rgb.chunks_exact(3 * self.width as usize).enumerate() {
            let edge = |y: usize| (std::f64::consts::PI * y as f64 / f64::from(self.height)).cos();
            let weight = 0.5 * (edge(y) - edge(y + 1)) / f64::from(self.width);
            for pixel in row.chunks_exact(3) {
                for (s, v) in sum.iter_mut().zip(pixel) {
                    *s += weight * f64::from(*v);
                }
            }
        }
        sum.map(|s| s as f32)
    }

    /// Returns the picture turned about the vertical by `turns` whole turns, from +X towards +Z; columns in
    /// between are interpolated.
    pub fn turned(&self, turns: f32) -> Self {
        let width = self.width as usize;
        let shift = turns.rem_euclid(1.0) * self.width as f32;
        let (whole, part) = (shift as usize, shift.fract());
        let mut rgb = Vec::with_capacity(self.rgb.len());
        for row in self.rgb.chunks_exact(3 * width) {
            for x in 0..width {
                let from = 3 * ((x + width - whole % width) % width);
                let before = 3 * ((x + 2 * width - whole % width - 1) % width);
                rgb.extend((0..3).map(|c| row[from + c] * (1.0 - part) + row[before + c] * part));
            }
        }
        Self { name: self.name.clone(), rgb, ..*self }
    }

    /// Radiance from `direction` (unit vector, away from the eye), bilinear, wrapping around and
    /// held at the poles; `shaders/lib/environment.wgsl` says the same.
    pub fn radiance(&self, direction: [f32; 3]) -> [f32; 3] {
        let [u, v] = coordinates(direction);
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (tx, ty) = (x - x.floor(), y - y.floor());
        let at = |dx: f32, dy: f32| -> [f32; 3] {
            let column = (x.floor() + dx).rem_euclid(self.width as f32) as usize % self.width as usize;
            let row = (y.floor() + dy).clamp(0.0, self.height as f32 - 1.0) as usize;
            let i = 3 * (row * self.width as usize + column);
            [self.rgb[i], self.rgb[i + 1], self.rgb[i + 2]]
        };
        let corners = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)];
        let weights = [(1.0 - tx) * (1.0 - ty), tx * (1.0 - ty), (1.0 - tx) * ty, tx * ty];
        std::array::from_fn(|c| corners.iter().zip(weights).map(|(p, w)| p[c] * w).sum())
    }
}

/// Texture coordinates of a unit direction, origin at the top left.
pub fn coordinates([x, y, z]: [f32; 3]) -> [f32; 2] {
    [z.atan2(x) / TAU + 0.5, y.clamp(-1.0, 1.0).acos() / PI]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, at: impl Fn(u32, u32) -> [f32; 3]) -> EnvironmentImage {
        let rgb = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| at(x, y)).collect();
        EnvironmentImage { name: "test".into(), width, height, rgb }
    }

    #[test]
    fn directions_fall_where_blender_has_them() {
        let close = |d: [f32; 3], uv: [f32; 2]| {
            let [u, v] = coordinates(d);
            assert!((u - uv[0]).abs() < 1e-6 && (v - uv[1]).abs() < 1e-6, "{d:?}: {u} {v}");
        };
        close([1.0, 0.0, 0.0], [0.5, 0.5]);
        close([0.0, 0.0, 1.0], [0.75, 0.5]);
        close([0.0, 0.0, -1.0], [0.25, 0.5]);
        assert!(coordinates([0.0, 1.0, 0.0])[1] < 1e-6 && coordinates([0.0, -1.0, 0.0])[1] > 1.0 - 1e-6);
    }

    #[test]
    fn the_mean_weighs_rows_by_solid_angle() {
        // y² over the sphere has the mean 1/3.
        let squares = image(8, 256, |_, y| {
            let c = (std::f32::consts::PI * (y as f32 + 0.5) / 256.0).cos();
            [c * c, 1.0, 0.0]
        });
        let [r, g, b] = squares.mean();
        assert!((r - 1.0 / 3.0).abs() < 1e-4 && (g - 1.0).abs() < 1e-6 && b == 0.0, "{r} {g} {b}");
        // Negative control: the plain mean of the pixels is 1/2.
        let plain = squares.rgb.iter().step_by(3).sum::<f32>() / (8.0 * 256.0);
        assert!((plain - 0.5).abs() < 1e-3);
    }

    #[test]
    fn looking_up_wraps_around_and_meets_pixel_centres() {
        let i = image(4, 2, |x, y| [x as f32, y as f32, 1.0]);
        let direction = |u: f32, v: f32| {
            let (phi, theta) = ((u - 0.5) * TAU, v * PI);
            [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()]
        };
        for (x, y) in [(0, 0), (3, 1), (2, 0)] {
            let [r, g, b] = i.radiance(direction((x as f32 + 0.5) / 4.0, (y as f32 + 0.5) / 2.0));
            assert!((r - x as f32).abs() < 1e-5 && (g - y as f32).abs() < 1e-5 && (b - 1.0).abs() < 1e-6);
        }
        // Between the last column and the first.
        let [r, ..] = i.radiance(direction(0.0, 0.25));
        assert!((r - 1.5).abs() < 1e-4, "{r}");
    }

    #[test]
    fn a_quarter_turn_brings_what_was_at_x_to_z() {
        let sun = image(8, 4, |x, _| [if x == 4 { 1.0 } else { 0.0 }; 3]);
        let quarter = sun.turned(0.25);
        assert_eq!(quarter.rgb[3 * 6], 1.0);
        assert_eq!(sun.turned(1.0).rgb, sun.rgb);
        assert_eq!(sun.turned(-0.75).rgb, quarter.rgb);
        // Half a column: half to each.
        let between = sun.turned(1.0 / 16.0);
        assert_eq!((between.rgb[3 * 4], between.rgb[3 * 5]), (0.5, 0.5));
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(near(between.mean(), sun.mean()), "no light is lost");
    }

    #[test]
    fn impossible_pictures_are_refused() {
        let mut bad = image(4, 2, |_, _| [1.0; 3]);
        bad.rgb[3 * 5 + 1] = f32::NAN;
        let message = Environment::from_image(bad).unwrap_err().to_string();
        assert!(message.contains("column 1, row 1"), "{message}");
        let mut short = image(4, 2, |_, _| [1.0; 3]);
        short.rgb.pop();
        assert!(Environment::from_image(short).is_err());
        assert!(Environment::from_image(image(1, 1, |_, _| [-1.0; 3])).is_err());
    }

    #[test]
    fn single_bad_texels_are_mended() {
        let mut spoilt = image(40, 20, |_, _| [1.0; 3]);
        (spoilt.rgb[7], spoilt.rgb[8], spoilt.rgb[100], spoilt.rgb[101]) = (f32::INFINITY, -1.0, f32::NAN, 2e38);
        let told = spoilt.repair().expect("a sentence");
        assert!(told.contains("test: 4 radiances"), "{told}");
        assert_eq!((spoilt.rgb[7], spoilt.rgb[8], spoilt.rgb[100], spoilt.rgb[101]), (65_504.0, 0.0, 0.0, 1e9));
        assert!(spoilt.rgb.iter().filter(|v| **v == 1.0).count() == spoilt.rgb.len() - 4);
        assert!(spoilt.repair().is_none() && Environment::from_image(spoilt).is_ok());
        // Negative control: where much is bad, something else is wrong with the picture.
        let mut broken = image(40, 20, |x, _| [if x == 3 { -1.0 } else { 1.0 }; 3]);
        assert!(broken.repair().is_none() && Environment::from_image(broken).is_err());
    }
}
