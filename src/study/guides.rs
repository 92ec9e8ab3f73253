//! What a training sample holds at full resolution, on request: guides for the way back from cells
//! to pixels, and all that puts the picture together again once the light is known.

use super::error::DatasetError;
use crate::gi::cpu::oct_decode;
use crate::{
    gpu::{Gpu, readback},
    render::Targets,
};
use half::f16;
use safetensors::{Dtype, tensor::TensorView};

/// Planes `[channel][row][column]` of a picture of `size` pixels.
///
/// picture = albedo · (direct + occlusion · E) + rest, E the light that a method adds; exact for E
/// = `guess` and `rest` as it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Guides {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Distance along the view axis, metres; 0 on background.
    pub depth: Vec<f32>,
    /// World normal, three planes; zero on background.
    pub normal: Vec<f16>,
    /// Diffuse reflectance as sRGB bytes, and occlusion as a byte: four planes.
    pub albedo: Vec<u8>,
    /// Direct diffuse light, E/π, three planes.
    pub direct: Vec<f16>,
    /// What method `gather` adds, E/π, three planes.
    pub guess: Vec<f16>,
    /// Specular light of all kinds and emission; on background the surroundings. Radiance, three
    /// planes.
    pub rest: Vec<f16>,
}

impl Guides {
    /// Reads what the last frame left in `targets`, drawn by a camera whose near plane is `near`
    /// metres away. Blocks.
    ///
    /// # Errors
    /// [`DatasetError::Readback`].
    pub fn read(gpu: &Gpu, targets: &Targets, near: f32) -> Result<Self, DatasetError> {
        let read = |texture: &wgpu::Texture| readback::texture(&gpu.device, &gpu.queue, texture);
        let floats = |texture: &wgpu::Texture| -> Result<Vec<f16>, DatasetError> {
            Ok(read(texture)?.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]])).collect())
        };
        let depth: Vec<f32> = read(&targets.depth.texture)?
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .map(|d| if d > 0.0 { near / d } else { 0.0 })
            .collect();
        let on_surface = |i: usize| depth[i] > 0.0;
        let coded = floats(&targets.normal.texture)?;
        let normals: Vec<[f16; 3]> = coded
            .chunks_exact(2)
            .enumerate()
            .map(|(i, n)| {
                let n = oct_decode([n[0].to_f32(), n[1].to_f32()]);
                if on_surface(i) { n.map(f16::from_f32) } else { [f16::ZERO; 3] }
            })
            .collect();
        let mut albedo = read(&targets.albedo.texture)?;
        for (i, texel) in albedo.chunks_exact_mut(4).enumerate() {
            if !on_surface(i) {
                texel.fill(0);
            }
        }
        let [direct, guess, direct_specular, specular, emissive, hdr] = [
            &targets.direct_diffuse,
            &targets.indirect,
            &targets.direct_specular,
            &targets.indirect_specular,
            &targets.emissive,
            &targets.hdr,
        ]
        .map(|t| floats(&t.texture));
        let (direct_specular, specular, emissive, hdr) = (direct_specular?, specular?, emissive?, hdr?);
        let rest: Vec<f16> = (0..4 * depth.len())
            .map(|i| {
                let occlusion = f32::from(albedo[i | 3]) / 255.0;
                let sum = direct_specular[i].to_f32() + specular[i].to_f32() * occlusion + emissive[i].to_f32();
                if on_surface(i / 4) { f16::from_f32(sum) } else { hdr[i] }
            })
            .collect();
        Ok(Self {
            size: targets.size,
            normal: planes(normals.as_flattened(), 3, 3),
            albedo: planes(&albedo, 4, 4),
            direct: planes(&direct?, 4, 3),
            guess: planes(&guess?, 4, 3),
            rest: planes(&rest, 4, 3),
            depth,
        })
    }

    /// Name and view of each tensor, for a sample's file.
    ///
    /// # Errors
    /// [`DatasetError::Serialize`] where a plane has the wrong length.
    pub fn tensors(&self) -> Result<Vec<(&'static str, TensorView<'_>)>, DatasetError> {
        let [w, h] = self.size.map(|n| n as usize);
        let half = |name, values| (name, Dtype::F16, vec![3, h, w], bytemuck::cast_slice::<f16, u8>(values));
        [
            ("guide_depth", Dtype::F32, vec![h, w], bytemuck::cast_slice(&self.depth)),
            half("guide_normal", &self.normal),
            ("guide_albedo", Dtype::U8, vec![4, h, w], &self.albedo),
            half("guide_direct", &self.direct),
            half("guide_guess", &self.guess),
            half("guide_rest", &self.rest),
        ]
        .into_iter()
        .map(|(name, dtype, shape, bytes)| {
            let view = TensorView::new(dtype, shape, bytes).map_err(|e| DatasetError::Serialize(e.to_string()))?;
            Ok((name, view))
        })
        .collect()
    }

    /// Bytes of a picture's guides.
    pub fn bytes(size: [u32; 2]) -> u64 {
        u64::from(size[0]) * u64::from(size[1]) * (4 + 4 + 4 * 3 * 2)
    }
}

/// The first `kept` of each pixel's `channels` values, as planes.
fn planes<T: Copy>(texels: &[T], channels: usize, kept: usize) -> Vec<T> {
    (0..kept).flat_map(|c| texels.iter().skip(c).step_by(channels).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::planes;

    #[test]
    fn texels_become_planes() {
        assert_eq!(planes(&[1, 2, 3, 4, 5, 6, 7, 8], 4, 3), [1, 5, 2, 6, 3, 7]);
    }
}
