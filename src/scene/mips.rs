//! Images at half their size, and half of that.

use super::ColorSpace;
use std::borrow::Cow;

/// An image at one of its sizes.
pub(crate) struct Level<'a> {
    pub width: u32,
    pub height: u32,
    /// Four bytes a pixel.
    pub rgba: Cow<'a, [u8]>,
}

impl Level<'_> {
    /// The next mip level: averages of 2×2 pixels in linear light, the last row or column dropped when odd.
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
}
