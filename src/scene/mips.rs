//! Images at half their size, and half of that.

use super::ColorSpace;
use std::borrow::Cow;

/// An image at one of its sizes.
pub struct Level<'a> {
    pub width: u32,
    pub height: u32,
    /// Four bytes a pixel.
    pub rgba: Cow<'a, [u8]>,
}

impl Level<'_> {
    /// The next mip level: averages of 2×2 pixels in linear light, the last row or column dropped
    /// when odd.
    pub fn halved(&self, space: ColorSpace) -> Level<'static> {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let decode: Vec<f32> = (0..=255u8).map(|b| decode(b, space)).collect();
        let at = |x: u32, y: u32, c: usize| {
            let (x, y) = (x.min(self.width - 1), y.min(self.height - 1));
            self.rgba[(y as usize * self.width as usize + x as usize) * 4 + c]
        };
        let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
        for y in 0..height {
            for x in 0..width {
                for c in 0..4 {
                    let taps = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| at(2 * x + i, 2 * y + j, c));
                    rgba.push(if c == 3 {
                        (taps.iter().map(|&t| u32::from(t)).sum::<u32>() as f32 / 4.0).round() as u8
                    } else {
                        encode(taps.iter().map(|&t| decode[usize::from(t)]).sum::<f32>() / 4.0, space)
                    });
                }
            }
        }
        Level { width, height, rgba: Cow::Owned(rgba) }
    }
}

/// A normal map as it is drawn: alpha holds √(1 − r), r the length of the mean of the normals that
/// a texel stands for (Toksvig 2005). None are averaged at full size, so r is 1 whatever the length
/// that eight bits leave of a normal.
pub fn normals<'a>(level: &Level<'a>) -> Level<'a> {
    let mut rgba = level.rgba.to_vec();
    rgba.iter_mut().skip(3).step_by(4).for_each(|a| *a = 0);
    Level { width: level.width, height: level.height, rgba: Cow::Owned(rgba) }
}

/// The next mip level of [`normals`]: directions of means of 2×2 normals, and how much shorter than
/// 1 those are.
pub fn halved_normals(level: &Level<'_>) -> Level<'static> {
    let (width, height) = ((level.width / 2).max(1), (level.height / 2).max(1));
    let mean = |x: u32, y: u32| {
        let (x, y) = (x.min(level.width - 1), y.min(level.height - 1));
        let at = (y as usize * level.width as usize + x as usize) * 4;
        let [x, y, z, a] = [0, 1, 2, 3].map(|c| f32::from(level.rgba[at + c]) / 255.0);
        glam::Vec3::new(x, y, z).mul_add(glam::Vec3::splat(2.0), glam::Vec3::NEG_ONE).normalize_or(glam::Vec3::Z)
            * (1.0 - a * a)
    };
    let mut rgba = Vec::with_capacity(width as usize * height as usize * 4);
    for y in 0..height {
        for x in 0..width {
            let sum: glam::Vec3 =
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| mean(2 * x + i, 2 * y + j)).iter().sum();
            let m = sum / 4.0;
            let short = (1.0 - m.length()).max(0.0).sqrt();
            let n = m.normalize_or(glam::Vec3::Z) * 0.5 + 0.5;
            rgba.extend([n.x, n.y, n.z, short].map(|v| (v * 255.0).round().clamp(0.0, 255.0) as u8));
        }
    }
    Level { width, height, rgba: Cow::Owned(rgba) }
}

fn decode(byte: u8, space: ColorSpace) -> f32 {
    space.decode(f32::from(byte) / 255.0)
}

fn encode(x: f32, space: ColorSpace) -> u8 {
    let y = match space {
        ColorSpace::Linear => x,
        ColorSpace::Srgb => crate::srgb::encode(x),
    };
    (y * 255.0).round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mips_average_light_not_codes() {
        let rgba = [0, 0, 0, 255, 255, 255, 255, 255].repeat(2);
        let level = Level { width: 2, height: 2, rgba: Cow::Owned(rgba) };
        assert_eq!(level.halved(ColorSpace::Srgb).rgba[0], 188);
        assert_eq!(level.halved(ColorSpace::Linear).rgba[0], 128);
        let odd = Level { width: 5, height: 1, rgba: Cow::Owned(vec![7; 20]) }.halved(ColorSpace::Srgb);
        assert_eq!((odd.width, odd.height, odd.rgba.len()), (2, 1, 8));
    }

    #[test]
    fn mips_of_normals_point_where_the_mean_does_and_know_its_length() {
        // Tilted to both sides by 60°: the mean has half of a normal's length.
        let tilted = |x: f32| [0.5 + 0.5 * x, 0.5, 0.75, 1.0].map(|v: f32| (v * 255.0).round() as u8);
        let (s, n) = (0.75_f32.sqrt(), [128u8, 128, 255]);
        let rgba = [tilted(s), tilted(-s)].concat().repeat(2);
        let full = normals(&Level { width: 2, height: 2, rgba: Cow::Owned(rgba) });
        assert!(full.rgba.chunks_exact(4).all(|t| t[3] == 0));
        let near = |a: u8, b: u8| a.abs_diff(b) <= 1;
        let one = halved_normals(&full);
        assert!((0..3).all(|c| near(one.rgba[c], n[c])), "{:?}", one.rgba);
        assert!((f32::from(one.rgba[3]) / 255.0 - 0.5_f32.sqrt()).abs() < 0.01, "{:?}", one.rgba);
        // Equal ones keep their length, and lengths go on from level to level.
        let rgba = one.rgba.repeat(4);
        let again = halved_normals(&Level { width: 2, height: 2, rgba: Cow::Owned(rgba) });
        assert!(near(again.rgba[3], one.rgba[3]), "{:?}", again.rgba);
        let even = normals(&Level { width: 2, height: 2, rgba: Cow::Owned(tilted(s).repeat(4)) });
        assert!(halved_normals(&even).rgba[3] <= 8);
    }
}
