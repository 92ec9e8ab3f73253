//! The environment as a lat-long texture.

use crate::scene::environment::{Environment, EnvironmentImage};
use crate::scene::{Light, LightKind};
use thiserror::Error;

/// A picture of the surroundings whose values do not fit its size.
#[derive(Debug, Error)]
#[error("image `{image}`: {reason}")]
pub struct SkyError {
    /// The picture's name.
    pub image: String,
    /// What is wrong.
    pub reason: String,
}

/// The surroundings on the GPU.
pub struct Sky {
    /// A picture's rest, once its sun is taken out; alpha is what the eye sees beside that, as a
    /// multiple: 0 but for the sun's texels.
    pub view: wgpu::TextureView,
    pub bytes: u64,
    /// With the rest's mean.
    pub environment: Environment,
    /// A sun that the picture held.
    pub sun: Option<Light>,
}

/// Texels, with what is taken out of each as a multiple of what is left.
fn texels(image: &EnvironmentImage, rest: Option<&EnvironmentImage>) -> Vec<[f32; 4]> {
    let rest = rest.map_or(&image.rgb, |r| &r.rgb);
    let both = image.rgb.chunks_exact(3).zip(rest.chunks_exact(3));
    both.map(|(whole, left)| {
        let (all, kept) = (whole.iter().sum::<f32>(), left.iter().sum::<f32>());
        let more = if all > kept && kept > 0.0 { all / kept - 1.0 } else { 0.0 };
        [left[0], left[1], left[2], more]
    })
    .collect()
}

/// `Rgba32Float`, without mip levels: nothing filters it but `shaders/lib/environment.wgsl`.
/// Pictures larger than the device allows are halved until they fit, with a warning.
pub fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    environment: &Environment,
    warnings: &mut Vec<String>,
) -> Result<Sky, SkyError> {
    upload_with(device, queue, environment, true, warnings)
}

/// The same; a sun is only looked for if `take_sun`, else it stays in the picture.
fn upload_with(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    environment: &Environment,
    take_sun: bool,
    warnings: &mut Vec<String>,
) -> Result<Sky, SkyError> {
    let [r, g, b] = environment.radiance;
    let (mut own, mut light) = (environment.clone(), None);
    let (mut width, mut height, mut texels) = (1, 1, vec![[r, g, b, 0.0]]);
    if let Some(image) = &environment.image {
        (width, height) = (image.width, image.height);
        if image.rgb.len() as u64 != 3 * u64::from(width) * u64::from(height) || image.rgb.is_empty() {
            let reason = format!("{} values for {width}×{height} pixels", image.rgb.len());
            return Err(SkyError { image: image.name.clone(), reason });
        }
        let sun = if take_sun { image.sun() } else { None };
        texels = self::texels(image, sun.as_ref().map(|s| &s.rest));
        if let Some(sun) = sun {
            if let LightKind::Directional { irradiance, angle, .. } = sun.light.kind {
                let wide = angle.to_degrees();
                tracing::info!("{}: {irradiance:.3} W/m² from {wide:.2}° of it are a light of their own", image.name);
            }
            own.radiance = sun.rest.mean();
            light = Some(sun.light);
        }
        let limit = device.limits().max_texture_dimension_2d;
        while width > limit || height > limit {
            (width, height, texels) = halved(width, height, &texels);
        }
        if width != image.width {
            warnings.push(format!(
                "environment `{}` is {}×{}, more than the device's {limit}: shown at {width}×{height}",
                image.name, image.width, image.height
            ));
        }
    }
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("scene.environment"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    queue.write_texture(
        texture.as_image_copy(),
        bytemuck::cast_slice(&texels),
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width), rows_per_image: None },
        size,
    );
    let bytes = std::mem::size_of_val(texels.as_slice()) as u64;
    Ok(Sky { view: texture.create_view(&Default::default()), bytes, environment: own, sun: light })
}

/// The surroundings as a lat-long picture (`SceneGpu::environment_view`), a sun in it left where
/// it is.
pub fn whole_sky(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    environment: &Environment,
) -> Result<wgpu::TextureView, SkyError> {
    Ok(upload_with(device, queue, environment, false, &mut Vec::new())?.view)
}

/// Averages of 2×2 pixels; an odd last row or column is dropped.
fn halved(width: u32, height: u32, texels: &[[f32; 4]]) -> (u32, u32, Vec<[f32; 4]>) {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let at = |x: u32, y: u32| texels[(y.min(height - 1) * width + x.min(width - 1)) as usize];
    let mut out = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        for x in 0..w {
            let taps = [at(2 * x, 2 * y), at(2 * x + 1, 2 * y), at(2 * x, 2 * y + 1), at(2 * x + 1, 2 * y + 1)];
            let mut texel: [f32; 4] = std::array::from_fn(|c| taps.iter().map(|t| 0.25 * t[c]).sum());
            // What is seen beside the rest is a multiple of it.
            let sum = |t: &[f32; 4]| t[0] + t[1] + t[2];
            let seen = taps.iter().map(|t| 0.25 * t[3] * sum(t)).sum::<f32>();
            texel[3] = if seen > 0.0 { seen / sum(&texel) } else { 0.0 };
            out.push(texel);
        }
    }
    (w, h, out)
}

#[cfg(test)]
mod tests {
    #[test]
    fn halving_averages() {
        let texels: Vec<[f32; 4]> = (0..8).map(|i| [i as f32, 1.0, 0.0, 0.0]).collect();
        let (w, h, out) = super::halved(4, 2, &texels);
        assert_eq!((w, h), (2, 1));
        assert_eq!(out, [[2.5, 1.0, 0.0, 0.0], [4.5, 1.0, 0.0, 0.0]]);
    }
}
