//! Radiance as bytes of a PNG, and what a picture's file tells of how it was made.

use bouncelight::gpu::Gpu;
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight_lab::study::device::Device;
use bouncelight_scene::image_io::Metadata;

/// Program, device, and the command that draws the same.
pub(crate) fn metadata(gpu: &Gpu, command: String) -> Metadata {
    let Device { adapter, backend, driver, .. } = Device::of(gpu);
    let software = format!("bouncelight {}", env!("CARGO_PKG_VERSION"));
    let facts = [software, command, adapter, backend, driver];
    ["Software", "Command", "Adapter", "Backend", "Driver"].map(String::from).into_iter().zip(facts).collect()
}

/// 8-bit sRGB of linear RGB, `ev` stops brighter, through the view transform.
pub(crate) fn rgb(linear: &[f32], ev: f32, tonemap: Tonemap) -> Vec<u8> {
    let gain = ev.exp2();
    tonemap.apply_to_bytes(&linear.iter().map(|v| v * gain).collect::<Vec<_>>())
}

/// The same of RGBA; with alpha where something of it is not covered, else RGB.
pub(crate) fn rgba(linear: &[f32], ev: f32, tonemap: Tonemap) -> Vec<u8> {
    let pixels = || linear.chunks_exact(4);
    let covered = pixels().all(|p| p[3] >= 1.0);
    // Radiance is multiplied by alpha, a PNG's colours are not.
    let plain = |p: &[f32]| match p[3] {
        _ if covered => [p[0], p[1], p[2]],
        a if a > 0.0 => [p[0] / a, p[1] / a, p[2] / a],
        _ => [0.0; 3],
    };
    let bytes = rgb(&pixels().flat_map(plain).collect::<Vec<_>>(), ev, tonemap);
    if covered {
        return bytes;
    }
    let alpha = pixels().map(|p| (p[3].clamp(0.0, 1.0) * 255.0).round() as u8);
    bytes.chunks_exact(3).zip(alpha).flat_map(|(p, a)| [p[0], p[1], p[2], a]).collect()
}
