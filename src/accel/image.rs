//! Pictures made small, for what rays see of them: linear colours, and for cut-out materials the
//! share of each texel that is above the cutoff.

use crate::scene::{AlphaMode, Image, Material, Sampler, Scene, TextureRef};
use glam::Vec2;
use std::{collections::HashMap, sync::Arc};

/// Longest side of a reduced picture, texels. Charts of a few texels of a 4k atlas blur into their
/// neighbours at this size; four times the texels would cost 1 MiB of memory a picture while a
/// scene loads.
const SIDE: usize = 256;

/// A small linear picture.
#[derive(Debug, Clone)]
pub struct Reduced {
    /// Each half as wide and high as the one before, down to one texel.
    levels: Arc<Vec<Level>>,
}

#[derive(Debug)]
struct Level {
    size: [usize; 2],
    texels: Vec<[f32; 4]>,
}

impl Level {
    /// Half as wide and high; texels count by their alpha where what has none has no colour.
    fn halved(&self, by_alpha: bool) -> Self {
        let size = self.size.map(|s| s.div_ceil(2));
        let texel = |i: usize| {
            let (x, y) = (2 * (i % size[0]), 2 * (i / size[0]));
            let (mut sum, mut weight, mut alpha, mut count) = ([0.0f32; 3], 0.0, 0.0, 0.0);
            for row in y..(y + 2).min(self.size[1]) {
                for t in &self.texels[row * self.size[0]..][x..(x + 2).min(self.size[0])] {
                    let w = if by_alpha { t[3] + 1e-4 } else { 1.0 };
                    (0..3).for_each(|c| sum[c] += w * t[c]);
                    (weight, alpha, count) = (weight + w, alpha + t[3], count + 1.0);
                }
            }
            let [r, g, b] = sum.map(|s| s / weight);
            [r, g, b, alpha / count]
        };
        Self { size, texels: (0..size[0] * size[1]).map(texel).collect() }
    }
}

impl Reduced {
    fn new(image: &Image, cutoff: Option<f32>) -> Option<Self> {
        let (width, height) = (image.width as usize, image.height as usize);
        if width == 0 || height == 0 || image.rgba.len() != 4 * width * height {
            return None;
        }
        let step = width.max(height).div_ceil(SIDE).max(1);
        let size = [width.div_ceil(step), height.div_ceil(step)];
        let linear: Vec<f32> = (0..256).map(|b| image.color_space.decode(b as f32 / 255.0)).collect();
        let mut texels = Vec::with_capacity(size[0] * size[1]);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let (mut sum, mut weight, mut alpha, mut count) = ([0.0f32; 3], 0.0, 0.0, 0.0);
                for row in (y * step..((y + 1) * step).min(height)).map(|r| &image.rgba[4 * r * width..][..4 * width]) {
                    for p in row[4 * x * step..(4 * (x + 1) * step).min(4 * width)].chunks_exact(4) {
                        let a = f32::from(p[3]) / 255.0;
                        let a = cutoff.map_or(a, |c| if a >= c { 1.0 } else { 0.0 });
                        // What is cut out has no colour; where all is, any will do.
                        let w = if cutoff.is_some() { a + 1e-4 } else { 1.0 };
                        (0..3).for_each(|c| sum[c] += w * linear[usize::from(p[c])]);
                        (weight, alpha, count) = (weight + w, alpha + a, count + 1.0);
                    }
                }
                let [r, g, b] = sum.map(|s| s / weight);
                texels.push([r, g, b, alpha / count]);
            }
        }
        let mut levels = vec![Level { size, texels }];
        while let Some(last) = levels.last().filter(|l| l.texels.len() > 1) {
            let next = last.halved(cutoff.is_some());
            levels.push(next);
        }
        Some(Self { levels: Arc::new(levels) })
    }

    /// How many of its texels lie in a triangle of texture space.
    pub fn texels_in(&self, at: &[Vec2; 3]) -> f32 {
        let area = 0.5 * (at[1] - at[0]).perp_dot(at[2] - at[0]).abs();
        area * self.levels[0].texels.len() as f32
    }

    /// The level on which so many texels of the finest are one.
    pub fn level_of(&self, texels: f32) -> usize {
        ((0.5 * texels.max(1.0).log2()).round() as usize).min(self.levels.len() - 1)
    }

    /// Mean colour.
    pub fn mean(&self) -> [f32; 4] {
        self.read(Vec2::ZERO, &Sampler::default(), self.levels.len() - 1)
    }

    /// The texel of a level at texture coordinates `at`.
    #[inline(always)]
    pub fn read(&self, at: Vec2, sampler: &Sampler, level: usize) -> [f32; 4] {
        let Level { size, texels } = &self.levels[level];
        let (x, y) = (sampler.wrap[0].texel(at.x, size[0]), sampler.wrap[1].texel(at.y, size[1]));
        texels[y * size[0] + x]
    }
}

/// The cutoff that the alpha of a material's picture is held against, its own factor taken out.
pub fn cutoff(material: &Material) -> Option<f32> {
    match material.alpha_mode {
        AlphaMode::Mask { cutoff } => Some(cutoff / material.base_color[3].max(1e-6)),
        _ => None,
    }
}

/// All pictures of a scene that rays see, made small.
pub struct Reductions(HashMap<(usize, Option<u32>), Reduced>);

impl Reductions {
    /// Reduces the pictures of `scene`, several at once.
    pub fn new(scene: &Scene) -> Self {
        let mut wanted = Vec::new();
        for m in &scene.materials {
            let uses =
                [(m.base_color_texture, cutoff(m)), (m.metallic_roughness_texture, None), (m.emissive_texture, None)];
            for (texture, cutoff) in uses {
                let key = texture.map(|t| (t.image, cutoff.map(f32::to_bits)));
                wanted.extend(key.filter(|k| !wanted.contains(k)));
            }
        }
        let reduce = |&(image, cutoff): &(usize, Option<u32>)| {
            Some(((image, cutoff), Reduced::new(scene.images.get(image)?, cutoff.map(f32::from_bits))?))
        };
        Self(super::threads::map(&wanted, |_| 1, reduce).into_iter().flatten().collect())
    }

    /// The picture of `texture`, reduced against `cutoff`.
    pub fn find(&self, texture: &TextureRef, cutoff: Option<f32>) -> Option<&Reduced> {
        self.0.get(&(texture.image, cutoff.map(f32::to_bits)))
    }
}
