//! How far a picture is from its reference: the light itself, and the metrics of what is shown.

use super::truth::Reference;
use crate::metrics::{self, Comparison, MetricError, Options, Picture, Views};
use crate::reference::Layer;
use bouncelight::render::tonemap_curve::Tonemap;

/// Depths from here on are nothing's, metres.
pub(super) const NOTHING: f32 = 1e9;
/// Edge of the blocks that light is compared over, pixels.
pub const BLOCK: usize = 4;
/// Least diffuse reflectance at which diffuse light is looked at.
const LEAST_ALBEDO: f32 = 0.01;
/// Where the reference has less than this share of its median light, nothing is compared:
/// coincident faces, which show black.
const LEAST_LIGHT: f32 = 0.02;

/// What is found of the light that a GI method has to add.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightError {
    /// Σ|ours − reference| / Σ|reference| over blocks of 4×4 pixels and channels.
    pub error: f64,
    /// Σ(ours − reference) / Σ|reference|: above 0 where ours is too bright.
    pub bias: f64,
    /// What `error` would be of the reference's own noise, were ours perfect; an estimate from its
    /// two halves.
    pub floor: f64,
}

/// Compares `light` (rgb a pixel, E/π: [`Frame::added`](super::session::Frame::added), or another
/// tracing's [`Layer::Gi`]) with the reference's [`Layer::Gi`] as docs/results/accuracy.md says: on pixels
/// with a surface, diffuse reflectance above 0.01 and at least 2 % of the reference's median light,
/// pooled over blocks of 4×4. `None` where no block is left or the reference has no light there.
pub fn light_error(light: &[f32], reference: &Reference) -> Option<LightError> {
    let [width, height] = reference.size.map(|n| n as usize);
    let wanted = reference.layer(Layer::Gi);
    assert_eq!(light.len(), wanted.len(), "the picture has the reference's size");
    let weight = weights(reference)?;
    let (blocks_x, blocks_y) = (width / BLOCK, height / BLOCK);
    let (mut apart, mut signed, mut all) = (0.0, 0.0, 0.0);
    for block in 0..blocks_x * blocks_y {
        let (x0, y0) = (block % blocks_x * BLOCK, block / blocks_x * BLOCK);
        let pixels = (0..BLOCK * BLOCK).map(|i| (y0 + i / BLOCK) * width + x0 + i % BLOCK);
        let (mut count, mut sums) = (0.0, [[0.0f64; 3]; 2]);
        for pixel in pixels.filter(|&p| weight[p]) {
            count += 1.0;
            for c in 0..3 {
                sums[0][c] += f64::from(light[3 * pixel + c]);
                sums[1][c] += f64::from(wanted[3 * pixel + c]);
            }
        }
        // Half a block at least: the rim of an object is no place to judge light at.
        if count > (BLOCK * BLOCK / 2) as f64 {
            for (ours, theirs) in sums[0].iter().zip(sums[1]).map(|(ours, theirs)| (ours / count, theirs / count)) {
                apart += (ours - theirs).abs();
                signed += ours - theirs;
                all += theirs.abs();
            }
        }
    }
    // Of a Gaussian the mean |Δ| is √(2/π) of the root mean square.
    let noise = reference.light_noise() / BLOCK as f64;
    let floor = noise * std::f64::consts::FRAC_2_PI.sqrt();
    (all > 0.0).then(|| LightError { error: apart / all, bias: signed / all, floor })
}

/// Which pixels count.
fn weights(reference: &Reference) -> Option<Vec<bool>> {
    let (depth, albedo) = (reference.layer(Layer::Depth), reference.layer(Layer::DiffCol));
    let (direct, indirect) = (reference.layer(Layer::DiffDir), reference.layer(Layer::DiffInd));
    let mean = |rgb: &[f32], p: usize| rgb[3 * p..3 * p + 3].iter().sum::<f32>() / 3.0;
    let light = |p: usize| mean(direct, p) + mean(indirect, p);
    let surface = |p: usize| depth[p] < NOTHING && albedo[3 * p..3 * p + 3].iter().all(|c| *c > LEAST_ALBEDO);
    let mut lit: Vec<f32> = (0..depth.len()).filter(|&p| surface(p)).map(light).collect();
    if lit.is_empty() {
        return None;
    }
    let middle = lit.len() / 2;
    let least = LEAST_LIGHT * *lit.select_nth_unstable_by(middle, f32::total_cmp).1;
    Some((0..depth.len()).map(|p| surface(p) && light(p) >= least).collect())
}

/// Every metric of what is shown through Filmic in 8-bit steps, as a saved picture would be, and of
/// radiance. `rgb`: linear, of the reference's size. FLIP takes as long as all others together and
/// is left out unless asked for.
///
/// # Errors
/// Values that are no numbers; fewer than 7 pixels in width or height.
pub fn compare(rgb: &[f32], reference: &Reference, flip: bool) -> Result<Comparison, MetricError> {
    with_views(&shown(rgb), Some(rgb), reference, flip)
}

/// The same for a picture that is known as it is shown only, display values in [0, 1]: without the
/// metrics of radiance.
///
/// # Errors
/// As [`compare`].
pub fn compare_shown(display: &[f32], reference: &Reference, flip: bool) -> Result<Comparison, MetricError> {
    with_views(display, None, reference, flip)
}

/// What a saved picture of linear radiance shows: through Filmic, in 8-bit steps, shares of 255.
pub(super) fn shown(linear: &[f32]) -> Vec<f32> {
    Tonemap::Filmic.apply_to_bytes(linear).into_iter().map(|b| f32::from(b) / 255.0).collect()
}

fn with_views(
    display: &[f32],
    linear: Option<&[f32]>,
    reference: &Reference,
    flip: bool,
) -> Result<Comparison, MetricError> {
    let [width, height] = reference.size.map(|n| n as usize);
    let theirs = reference.rgb();
    let theirs_shown = shown(&theirs);
    let ours = |pixels| Picture::new("picture", width, height, pixels);
    let truth = |pixels| Picture::new("reference", width, height, pixels);
    let a = Views { display: ours(display)?, linear: linear.map(ours).transpose()? };
    let b = Views { display: truth(&theirs_shown)?, linear: Some(truth(&theirs)?) };
    let options = Options { flip, hdr_flip: false, ..Options::default() };
    Ok(metrics::compare_with(a, b, options)?.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::Noise;

    fn reference(light: f32, depth: f32, albedo: f32) -> Reference {
        let pixels = 64;
        let rgb = |v: f32| vec![v; 3 * pixels];
        let layers = vec![
            (Layer::Combined, vec![light * albedo; 4 * pixels]),
            (Layer::DiffDir, rgb(0.0)),
            (Layer::DiffInd, rgb(light)),
            (Layer::DiffCol, rgb(albedo)),
            (Layer::Gi, rgb(light)),
            (Layer::Depth, vec![depth; pixels]),
        ];
        let noise = Noise { mean: 1.0, pixel: 0.04, pixel_at_most: 0.05, picture: 0.001 };
        Reference { size: [8, 8], layers, noise: [noise; 3], samples: [16; 2], seconds: 1.0, kept: false }
    }

    #[test]
    fn light_is_compared_where_there_is_some() {
        let truth = reference(2.0, 1.0, 0.5);
        let same = light_error(&[2.0; 192], &truth).unwrap();
        assert_eq!((same.error, same.bias), (0.0, 0.0));
        assert!((same.floor - 0.01 * 0.797_88).abs() < 1e-6);
        let dark = light_error(&[1.0; 192], &truth).unwrap();
        assert!((dark.error - 0.5).abs() < 1e-9 && (dark.bias + 0.5).abs() < 1e-9);
        // Noise that differs from pixel to pixel is gone in blocks, a wrong block is not.
        let noisy: Vec<f32> = (0..192).map(|i| if i / 3 % 2 == 0 { 2.5 } else { 1.5 }).collect();
        assert!(light_error(&noisy, &truth).unwrap().error < 1e-6);
        let uneven: Vec<f32> = (0..192).map(|i| if i / 3 % 8 < 4 { 3.0 } else { 1.0 }).collect();
        let uneven = light_error(&uneven, &truth).unwrap();
        assert!((uneven.error - 0.5).abs() < 1e-6 && uneven.bias.abs() < 1e-6);
        for nothing in [reference(0.0, 1.0, 0.5), reference(2.0, 1e10, 0.5), reference(2.0, 1.0, 0.0)] {
            assert_eq!(light_error(&[1.0; 192], &nothing), None);
        }
    }

    #[test]
    fn pictures_are_compared_as_they_are_shown() {
        let truth = reference(2.0, 1.0, 0.5);
        let same = compare(&truth.rgb(), &truth, true).unwrap();
        assert_eq!((same.display.mean_absolute_error, same.flip), (0.0, Some(0.0)));
        let other = compare(&[0.5; 192], &truth, false).unwrap();
        assert!(other.display.mean_absolute_error > 0.05 && other.flip.is_none());
    }
}
