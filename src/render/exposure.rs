//! How many stops brighter a picture is shown than its light says: as many as somebody asks for, or
//! measured.
//!
//! The measure is that of a camera: the geometric mean of the luminance of what is in the picture
//! becomes middle grey, 0.18, unless that drove the brightest tenth of it above 1, which is a
//! diffuse white in full light. The darkest and the brightest fiftieth do not count, nor does a
//! background of one colour.

use std::str::FromStr;

/// Luminance that the mean is shown as.
const MIDDLE: f32 = 0.18;
/// Luminance above which the brightest tenth is not driven.
const WHITE: f32 = 1.0;
/// Most stops to either side.
const MOST: f32 = 16.0;
/// Share at each end that does not count.
const ENDS: f32 = 0.02;

/// Exposure of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// Stops: the picture is multiplied by 2 to this power.
    Stops(f32),
    /// Measured, so that the mean is middle grey ([`measure`]).
    Auto,
}

/// A word that is neither a number of stops nor `auto`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a finite number of stops, nor `auto`")]
pub struct UnknownExposure(pub String);

impl FromStr for Exposure {
    type Err = UnknownExposure;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.trim().parse::<f32>() {
            _ if text.eq_ignore_ascii_case("auto") => Ok(Self::Auto),
            Ok(stops) if stops.is_finite() => Ok(Self::Stops(stops)),
            _ => Err(UnknownExposure(text.into())),
        }
    }
}

/// Stops by which a picture of scene-linear radiance is to be shown brighter, in hundredths; 0 for
/// one in which nothing shines. `pixels` have `channels` values each, red, green and blue first;
/// such as are `background`, to a hundredth, do not count.
pub fn measure(pixels: &[f32], channels: usize, background: Option<[f32; 3]>) -> f32 {
    let near = |p: &[f32], b: [f32; 3]| (0..3).all(|c| (p[c] - b[c]).abs() <= 0.01 * b[c]);
    let luminance = |p: &[f32]| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
    let counts = |p: &&[f32]| background.is_none_or(|b| !near(p, b));
    let mut seen: Vec<f32> =
        pixels.chunks_exact(channels).filter(counts).map(luminance).filter(|l| l.is_finite() && *l > 0.0).collect();
    seen.sort_unstable_by(f32::total_cmp);
    let at = |share: f32| ((share * seen.len() as f32) as usize).min(seen.len().saturating_sub(1));
    let middle = &seen[at(ENDS)..at(1.0 - ENDS).max(at(ENDS))];
    let Some(&bright) = seen.get(at(0.9)) else { return 0.0 };
    let mean = match middle.len() {
        0 => f64::from(bright.log2()),
        n => middle.iter().map(|l| f64::from(l.log2())).sum::<f64>() / n as f64,
    };
    let stops = (MIDDLE.log2() - mean as f32).min((WHITE / bright).log2()).clamp(-MOST, MOST);
    (stops * 100.0).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: &[f32]) -> Vec<f32> {
        values.iter().flat_map(|v| [*v; 3]).collect()
    }

    #[test]
    fn a_card_becomes_middle_grey_whatever_light_falls_on_it() {
        for light in [1e-3, 0.18, 40.0] {
            let stops = measure(&grey(&[light; 100]), 3, None);
            assert!((light * stops.exp2() / MIDDLE - 1.0).abs() < 0.01, "{light}: {stops}");
        }
        assert_eq!(measure(&grey(&[0.0; 9]), 3, None), 0.0);
        assert_eq!(measure(&[], 3, None), 0.0);
        assert_eq!(measure(&grey(&[f32::NAN, f32::INFINITY, 0.18]), 3, None), 0.0);
    }

    #[test]
    fn a_background_does_not_count_and_highlights_are_kept() {
        let (card, sky) = ([0.02f32; 50], [0.05f32; 450]);
        let both = grey(&[&card[..], &sky[..]].concat());
        assert_eq!(measure(&both, 3, Some([0.05; 3])), measure(&grey(&card), 3, None));
        // Negative control: as part of the picture it would.
        assert!(measure(&both, 3, None) < measure(&both, 3, Some([0.05; 3])) - 0.5);
        // A fifth of it is a hundred times as bright as the rest: that is held below white.
        let (dark, bright) = ([0.01f32; 80], [1.0f32; 20]);
        assert_eq!(measure(&grey(&[&dark[..], &bright[..]].concat()), 3, None), 0.0);
        // A hundredth of it is a lamp: it may burn out.
        assert!(measure(&grey(&[&[0.01; 99][..], &[1.0; 1]].concat()), 3, None) > 4.0);
    }

    #[test]
    fn words() {
        assert_eq!("auto".parse(), Ok(Exposure::Auto));
        assert_eq!("-0.5".parse(), Ok(Exposure::Stops(-0.5)));
        for bad in ["", "bright", "inf", "NaN"] {
            assert!(bad.parse::<Exposure>().unwrap_err().to_string().contains("stops"), "{bad}");
        }
    }
}
