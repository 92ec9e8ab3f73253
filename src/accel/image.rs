//! Pictures made small, for what rays see of them: linear colours, and for cut-out materials the
//! share of each texel that is above the cutoff.

use crate::scene::{AlphaMode, Image, Material, Sampler, Scene, TextureRef, Wrap};
use glam::Vec2;
use std::{collections::HashMap, sync::Arc};

/// Longest side of a reduced picture, texels. Charts of a few texels of a 4k atlas blur into their
/// neighbours at this size; four times the texels would cost 1 MiB of memory a picture while a
/// scene loads.
const SIDE: usize = 256;

/// A small linear picture.
#[derive(Debug, Clone)]
pub struct Reduced {
    size: [usize; 2],
    texels: Arc<Vec<[f32; 4]>>,
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
        Some(Self { size, texels: Arc::new(texels) })
    }

    /// How many of its texels lie in a triangle of texture space.
    pub fn texels_in(&self, at: &[Vec2; 3]) -> f32 {
        let area = 0.5 * (at[1] - at[0]).perp_dot(at[2] - at[0]).abs();
        area * (self.size[0] * self.size[1]) as f32
    }

    /// The texel at texture coordinates `at`.
    pub fn read(&self, at: Vec2, sampler: &Sampler) -> [f32; 4] {
        let place = |v: f32, wrap: Wrap, side: usize| {
            let v = if v.is_finite() { v } else { 0.0 };
            let v = match wrap {
                Wrap::Repeat => v - v.floor(),
                Wrap::MirroredRepeat => 1.0 - ((v * 0.5 - (v * 0.5).floor()) * 2.0 - 1.0).abs(),
                Wrap::ClampToEdge => v.clamp(0.0, 1.0),
            };
            ((v * side as f32) as usize).min(side - 1)
        };
        let [x, y] = [0, 1].map(|i| place([at.x, at.y][i], sampler.wrap[i], self.size[i]));
        self.texels[y * self.size[0] + x]
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
