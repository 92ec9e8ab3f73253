//! FLIP: how much two pictures differ to an eye that switches between them, pixel by pixel in [0,
//! 1].
//!
//! [`flip`] is for display values (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and
//! Fairchild, HPG 2020): pictures are blurred as the eye would at a viewing distance, colours
//! compared in a perceptual space, and the result raised where edges or points differ. [`hdr_flip`]
//! is for radiance (Andersson, Nilsson, Shirley and Akenine-Möller, Eurographics short papers
//! 2021): the largest [`flip`] over a range of exposures through an ACES curve. Both agree with
//! NVIDIA's `flip-evaluator` 1.7 (`tests/fixtures/metrics/flip`), computing in f32 as it does.

mod color;
mod filter;

use super::{MetricError, Picture, heat_color};
use color::Distance;
use filter::{FeatureKernels, SpatialKernels};
use serde::Serialize;

/// Pixels in a degree of the field of view of somebody who sits 0.7 m from a display that is 3840
/// pixels and 0.7 m wide: FLIP's own default.
pub const PIXELS_PER_DEGREE: f32 = 67.020_645;

/// Most pixels per degree that are taken; the eye resolves about 60, and filters grow with them.
pub const MAX_PIXELS_PER_DEGREE: f32 = 1000.0;

/// What each pixel's difference is.
#[derive(Debug, Clone, PartialEq)]
pub struct FlipMap {
    /// One value in [0, 1] a pixel, rows from the top.
    pub values: Vec<f32>,
}

impl FlipMap {
    /// The number that is reported.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|&v| f64::from(v)).sum::<f64>() / self.values.len() as f64
    }

    /// `3 · width · height` sRGB bytes through [`heat_color`].
    pub fn heat_map(&self) -> Vec<u8> {
        self.values.iter().flat_map(|&v| heat_color(v)).collect()
    }
}

/// The exposures of an HDR-FLIP, in stops.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Exposures {
    /// Makes the reference's brightest pixel 0.85 on the display.
    pub start: f32,
    /// Makes its median pixel 0.85 on the display.
    pub stop: f32,
    /// How many, evenly from `start` to `stop`, both included; at least 2, about one a stop.
    pub count: usize,
}

/// LDR-FLIP of display-encoded sRGB; values outside [0, 1] are clamped. Symmetric.
///
/// # Errors
/// Different sizes; `pixels_per_degree` that is not above 0 and at most [`MAX_PIXELS_PER_DEGREE`].
pub fn flip(a: Picture<'_>, b: Picture<'_>, pixels_per_degree: f32) -> Result<FlipMap, MetricError> {
    let eye = Eye::new(&a, &b, pixels_per_degree)?;
    let linear = |v: f32| bouncelight::srgb::decode(v.clamp(0.0, 1.0));
    Ok(FlipMap { values: eye.difference(&eye.see(a.pixels(), linear), &eye.see(b.pixels(), linear)) })
}

/// HDR-FLIP of linear Rec.709 radiance; negative values count as 0. Not symmetric: `b` chooses the
/// exposures.
///
/// # Errors
/// As [`flip`].
pub fn hdr_flip(a: Picture<'_>, b: Picture<'_>, pixels_per_degree: f32) -> Result<(FlipMap, Exposures), MetricError> {
    let eye = Eye::new(&a, &b, pixels_per_degree)?;
    let exposures = exposures(b);
    let mut values = vec![0.0f32; b.width() * b.height()];
    let step = (exposures.stop - exposures.start) / (exposures.count - 1) as f32;
    for i in 0..exposures.count {
        let gain = (exposures.start + i as f32 * step).exp2();
        let shown = |v: f32| aces(v * gain);
        let map = eye.difference(&eye.see(a.pixels(), shown), &eye.see(b.pixels(), shown));
        values.iter_mut().zip(map).for_each(|(most, v)| *most = most.max(v));
    }
    Ok((FlipMap { values }, exposures))
}

/// Numerator and denominator, in falling powers, of the ACES curve (Narkowicz 2015) without its
/// pre-exposure of 0.6.
const ACES: [[f32; 3]; 2] = [[0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0], [0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14]];

/// Linear display value in [0, 1] of exposed radiance.
fn aces(v: f32) -> f32 {
    // Beyond the bound the curve is flat, and its squares would overflow.
    let v = v.clamp(0.0, 1e9);
    let [above, below] = ACES.map(|[a, b, c]| (a * v + b) * v + c);
    (above / below).clamp(0.0, 1.0)
}

/// The range in which `reference` shows its brightest and its median pixel. A median of zero counts
/// as 1.2e-7 (as in the reference implementation since 1.7), and so does a picture without any
/// light (which that refuses).
pub fn exposures(reference: Picture<'_>) -> Exposures {
    const TARGET: f32 = 0.85;
    let [a, b, c] = [0, 1, 2].map(|i| ACES[0][i] - TARGET * ACES[1][i]);
    let half = -0.5 * b / a;
    let radiance = half + (half * half - c / a).sqrt();
    let luminance = |p: &[f32]| -> f32 {
        let [r, g, b] = [p[0], p[1], p[2]].map(|v| v.max(0.0));
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    let mut all: Vec<f32> = reference.pixels().chunks_exact(3).map(luminance).collect();
    let middle = all.len() / 2;
    let (_, median, brighter) = all.select_nth_unstable_by(middle, f32::total_cmp);
    let (median, brightest) = (*median, brighter.iter().copied().fold(*median, f32::max));
    // The sum of three huge values may not be finite; log2 must be.
    let stops = |y: f32| (radiance / y.clamp(f32::EPSILON, f32::MAX)).max(f32::MIN_POSITIVE).log2();
    let (start, stop) = (stops(brightest), stops(median));
    Exposures { start, stop, count: (stop - start).ceil().max(2.0) as usize }
}

/// A viewer at a distance, who looks at pictures of one width.
struct Eye {
    width: usize,
    spatial: SpatialKernels,
    feature: FeatureKernels,
}

/// A picture as the eye takes it in.
struct Seen {
    /// Hunt-adjusted L*a*b* after the spatial filters.
    colors: Vec<[f32; 3]>,
    /// Strength of edges.
    edges: Vec<f32>,
    /// Strength of points.
    points: Vec<f32>,
}

impl Eye {
    fn new(a: &Picture<'_>, b: &Picture<'_>, pixels_per_degree: f32) -> Result<Self, MetricError> {
        a.same_size(b)?;
        if !(pixels_per_degree > 0.0 && pixels_per_degree <= MAX_PIXELS_PER_DEGREE) {
            return Err(MetricError::PixelsPerDegree { given: pixels_per_degree });
        }
        Ok(Self {
            width: a.width(),
            spatial: SpatialKernels::new(pixels_per_degree),
            feature: FeatureKernels::new(pixels_per_degree),
        })
    }

    /// `linear` gives a linear display value in [0, 1] for each value of `pixels`.
    fn see(&self, pixels: &[f32], linear: impl Fn(f32) -> f32) -> Seen {
        let mut planes = [0, 1, 2].map(|_| Vec::with_capacity(pixels.len() / 3));
        for p in pixels.chunks_exact(3) {
            let opponent = color::opponent_from_linear([linear(p[0]), linear(p[1]), linear(p[2])]);
            (0..3).for_each(|c| planes[c].push(opponent[c]));
        }
        let grey: Vec<f32> = planes[0].iter().map(|y| (y + 16.0) / 116.0).collect();
        let (edges, points) = self.features(&grey);
        Seen { colors: self.colors(&planes), edges, points }
    }

    fn colors(&self, [y, cx, cz]: &[Vec<f32>; 3]) -> Vec<[f32; 3]> {
        let both = |k: &filter::Kernel, plane: &[f32]| k.down(&k.across(plane, self.width), self.width);
        let (y, cx) = (both(&self.spatial.y, y), both(&self.spatial.cx, cx));
        let [first, second] = [0, 1].map(|i| both(&self.spatial.cz[i], cz));
        (0..y.len())
            .map(|i| {
                let rgb = color::linear_from_opponent([y[i], cx[i], first[i] + second[i]]);
                color::hunt_lab(rgb.map(|v| v.clamp(0.0, 1.0)))
            })
            .collect()
    }

    /// Lengths of the first and of the second derivatives of a plane of lightness in [0, 1].
    fn features(&self, grey: &[f32]) -> (Vec<f32>, Vec<f32>) {
        let FeatureKernels { smooth, edge, point } = &self.feature;
        let across_then_smooth = |k: &filter::Kernel| smooth.down(&k.across(grey, self.width), self.width);
        let smoothed = smooth.across(grey, self.width);
        let length = |k: &filter::Kernel| -> Vec<f32> {
            let down = k.down(&smoothed, self.width);
            across_then_smooth(k).iter().zip(down).map(|(x, y)| (x * x + y * y).sqrt()).collect()
        };
        (length(edge), length(point))
    }

    fn difference(&self, a: &Seen, b: &Seen) -> Vec<f32> {
        let distance = Distance::new();
        (0..a.colors.len())
            .map(|i| {
                let color = distance.between(a.colors[i], b.colors[i]);
                let feature = (a.edges[i] - b.edges[i]).abs().max((a.points[i] - b.points[i]).abs());
                // Rounding must not leave [0, 1].
                let exponent = 1.0 - (feature * std::f32::consts::FRAC_1_SQRT_2).sqrt();
                color.powf(exponent.max(0.0)).min(1.0)
            })
            .collect()
    }
}
