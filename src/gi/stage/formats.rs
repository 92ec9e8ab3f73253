//! Which formats a host's textures may have, in the conventions that it names.

use crate::gi::interface::{GiError, Inputs, NormalEncoding, NormalRange, Outputs};
use wgpu::TextureFormat as F;

const DEPTH: &[F] =
    &[F::Depth32Float, F::Depth24Plus, F::Depth16Unorm, F::Depth32FloatStencil8, F::Depth24PlusStencil8, F::R32Float];
const ALBEDO: &[F] = &[F::Rgba8UnormSrgb, F::Bgra8UnormSrgb, F::Rgb10a2Unorm, F::Rgba16Float];
const LIGHT: &[F] = &[F::Rgba16Float, F::Rgba32Float, F::Rg11b10Ufloat];
const MOTION: &[F] = &[F::Rg16Float, F::Rg32Float, F::Rgba16Float, F::Rgba32Float];

/// Formats of normals. A texture of four floats is not taken for two numbers: it holds something
/// else.
fn normal_formats(encoding: NormalEncoding, range: NormalRange) -> &'static [F] {
    match (encoding, range) {
        (NormalEncoding::Xyz, NormalRange::Signed) => &[F::Rgba16Float, F::Rgba32Float, F::Rgba8Snorm],
        (NormalEncoding::Xyz, NormalRange::Unsigned) => {
            &[F::Rgb10a2Unorm, F::Rgba8Unorm, F::Bgra8Unorm, F::Rgba16Float]
        }
        (_, NormalRange::Signed) => &[F::Rg16Float, F::Rg32Float, F::Rg16Snorm, F::Rg8Snorm],
        (_, NormalRange::Unsigned) => {
            &[F::Rg8Unorm, F::Rg16Unorm, F::Rg16Float, F::Rgb10a2Unorm, F::Rgba8Unorm, F::Bgra8Unorm]
        }
    }
}

/// Whether every texture of `inputs` that is there fits.
///
/// # Errors
/// [`GiError::Texture`] for the first that does not.
pub(super) fn check_inputs(inputs: &Inputs<'_>) -> Result<(), GiError> {
    let bound = wgpu::TextureUsages::TEXTURE_BINDING;
    let c = &inputs.conventions;
    let rows: [(&'static str, Option<&wgpu::TextureView>, &[F]); 7] = [
        ("depth", Some(inputs.depth), DEPTH),
        ("normal", Some(inputs.normal), normal_formats(c.normal_encoding, c.normal_range)),
        ("albedo", inputs.albedo, ALBEDO),
        ("emissive", inputs.emissive, LIGHT),
        ("direct", inputs.direct, LIGHT),
        ("motion", inputs.motion, MOTION),
        ("specular", inputs.specular, &[F::Rgba8UnormSrgb]),
    ];
    for (name, view, formats) in rows {
        if let Some(view) = view {
            check_any(name, view, inputs.size, formats, bound)?;
        }
    }
    Ok(())
}

/// An error in our words instead of a validation error in the host's device.
pub(crate) fn check(
    name: &'static str,
    view: &wgpu::TextureView,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> Result<(), GiError> {
    check_any(name, view, size, &[format], usage)
}

fn check_any(
    name: &'static str,
    view: &wgpu::TextureView,
    size: [u32; 2],
    formats: &[wgpu::TextureFormat],
    usage: wgpu::TextureUsages,
) -> Result<(), GiError> {
    let texture = view.texture();
    let wrong = |expected: String, found: String| Err(GiError::Texture { name, expected, found });
    // A view may reinterpret sRGB as linear; which it does cannot be asked of the view.
    let plain = texture.format().remove_srgb_suffix();
    if !formats.iter().any(|f| f.remove_srgb_suffix() == plain) {
        let names: Vec<_> = formats.iter().map(|f| format!("{f:?}")).collect();
        return wrong(format!("format {}", names.join(" or ")), format!("format {:?}", texture.format()));
    }
    if !texture.usage().contains(usage) {
        return wrong(format!("usage {usage:?}"), format!("usage {:?}", texture.usage()));
    }
    // Of a view on a texture with mips the level is unknown, so only plain textures are measured.
    let found = [texture.width(), texture.height()];
    if texture.mip_level_count() == 1 && found != size {
        return wrong(format!("{}x{} pixels", size[0], size[1]), format!("{}x{} pixels", found[0], found[1]));
    }
    Ok(())
}

/// The output of every method.
pub(crate) fn check_outputs(outputs: Outputs<'_>, size: [u32; 2]) -> Result<(), GiError> {
    let one = |name, view: &wgpu::TextureView| {
        check(name, view, size, wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::STORAGE_BINDING)
    };
    one("output", outputs.light)?;
    outputs.specular.map_or(Ok(()), |view| one("output of specular light", view))
}
