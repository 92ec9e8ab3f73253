//! The environment as a lat-long texture.

use super::UploadError;
use crate::scene::Environment;

/// `Rgba32Float`, without mip levels: nothing filters it but `shaders/lib/environment.wgsl`. Pictures larger than the
/// device allows are halved until they fit, with a warning. Returns the view and its bytes.
pub(super) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    environment: &Environment,
    warnings: &mut Vec<String>,
) -> Result<(wgpu::TextureView, u64), UploadError> {
    let [r, g, b] = environment.radiance;
    let (mut width, mut height, mut texels) = (1, 1, vec![[r, g, b, 0.0]]);
    if let Some(image) = &environment.image {
        (width, height) = (image.width, image.height);
        texels = image.rgb.chunks_exact(3).map(|p| [p[0], p[1], p[2], 0.0]).collect();
        if texels.len() as u64 != u64::from(width) * u64::from(height) || texels.is_empty() {
            let reason = format!("{} values for {width}×{height} pixels", image.rgb.len());
            return Err(UploadError::Image { image: image.name.clone(), reason });
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
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    queue.write_texture(
        texture.as_image_copy(),
        bytemuck::cast_slice(&texels),
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width), rows_per_image: None },
        size,
    );
    Ok((texture.create_view(&Default::default()), std::mem::size_of_val(texels.as_slice()) as u64))
}

/// Averages of 2×2 pixels; an odd last row or column is dropped.
fn halved(width: u32, height: u32, texels: &[[f32; 4]]) -> (u32, u32, Vec<[f32; 4]>) {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let at = |x: u32, y: u32| texels[(y.min(height - 1) * width + x.min(width - 1)) as usize];
    let mut out = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        for x in 0..w {
            let taps = [at(2 * x, 2 * y), at(2 * x + 1, 2 * y), at(2 * x, 2 * y + 1), at(2 * x + 1, 2 * y + 1)];
            out.push(std::array::from_fn(|c| taps.iter().map(|t| 0.25 * t[c]).sum()));
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
