//! View transforms from radiance to display values: the CPU form of `shaders/lib/tonemap.wgsl`, same names, same
//! constants.
//!
//! Filmic and AgX stand near Blender's views of these names (look None, display sRGB). Filmic's
//! constants are fitted to greys and bright colours sent through Blender 4.5's own transform. AgX
//! is not fitted: its steps and matrices are the published ones (inset as in Blender's
//! configuration), Neutral is Khronos' specification. `tests/fixtures/tonemap/make.py` fits, and
//! measures against Blender what is left, in parts of 255:
//!
//! | | rendered references: mean, worst 99.9th percentile | all colours to 2⁶: mean, 99.9th percentile |
//! |---|---|---|
//! | Filmic | 0.06, 0.2 | 0.2, 3.4 |
//! | AgX | 0.3, 12 | 0.5, 11 |
//! | Neutral | 0.2, 3 | 0.8, 7 |
//!
//! What is left of AgX is mostly the interpolation in Blender's own table: at its nodes the formula
//! agrees to 0.1 in the mean; between nodes the darkest channel of saturated colours goes astray
//! there. Blender's Neutral is a table, too. Negative components count as zero (Blender bends them
//! into the gamut), NaN as zero, light above 65504 as 65504.
//!
//! ```
//! use bouncelight::render::tonemap_curve::Tonemap;
//! let [black, white, bright] = Tonemap::None.apply([0.0, 1.0, 4.0]);
//! assert!(black == 0.0 && white > 0.999 && bright == white);
//! assert!(Tonemap::Filmic.apply([4.0; 3])[0] < 1.0);
//! ```

use crate::srgb;
use std::fmt;
use std::str::FromStr;

/// View transform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Tonemap {
    /// Blender's Filmic view, look None; what the paper's pictures were shown with.
    #[default]
    Filmic,
    /// Blender's AgX view, look None.
    Agx,
    /// Khronos PBR Neutral.
    Neutral,
    /// sRGB transfer function and clamping only.
    None,
}

impl Tonemap {
    /// All of them, in the order of [`Self::kind`].
    pub const ALL: [Tonemap; 4] = [Tonemap::Filmic, Tonemap::Agx, Tonemap::Neutral, Tonemap::None];

    /// The shader's number for it.
    pub fn kind(self) -> u32 {
        self as u32
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        ["filmic", "agx", "neutral", "none"][self as usize]
    }

    /// Display-encoded sRGB in [0, 1] of linear Rec.709 light.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        // Infinity minus infinity further down would make a new NaN.
        let light = rgb.map(|v| if v.is_nan() { 0.0 } else { v.clamp(0.0, LIGHT_MAX) });
        match self {
            Tonemap::Filmic => filmic(light),
            Tonemap::Agx => agx(light),
            Tonemap::Neutral => neutral(light),
            Tonemap::None => light.map(srgb::encode),
        }
    }

    /// [`Self::apply`] to interleaved pixels, rounded to bytes; values beyond the last whole pixel
    /// are left out.
    pub fn apply_to_bytes(self, rgb: &[f32]) -> Vec<u8> {
        let byte = |v: f32| (v * 255.0 + 0.5) as u8;
        rgb.chunks_exact(3).flat_map(|p| self.apply([p[0], p[1], p[2]]).map(byte)).collect()
    }
}

impl fmt::Display for Tonemap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no tonemap.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a tonemap; choose filmic, agx, neutral or none")]
pub struct UnknownTonemap(pub String);

impl FromStr for Tonemap {
    type Err = UnknownTonemap;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Self::ALL.into_iter().find(|t| t.name().eq_ignore_ascii_case(text));
        found.ok_or_else(|| UnknownTonemap(text.into()))
    }
}

/// Largest half float: what a picture can hold.
const LIGHT_MAX: f32 = 65504.0;

/// Black lies at 2^-12.47, white 16.5 stops above. Far above white Blender's table desaturates: the
/// darker channels are drawn towards the brightest. Then one curve for each channel over the
/// logarithm, here a fitted rational function.
fn filmic(light: [f32; 3]) -> [f32; 3] {
    let peak = max3(light).min(5898.24);
    let share = (4.018_064e-5 * (peak.powf(1.216_194_7) - 19.186_78)).clamp(0.0, 1.0);
    light.map(|v| {
        let lifted = v + share * (peak - v).max(0.0);
        let stops = lifted.max(1e-9).log2() + 12.473_931;
        let u = (stops / 8.25 - 1.0).clamp(-1.0, 1.0);
        let p = 0.283_640_78 + u * (0.635_621_86 + u * (0.531_259_6 + u * 0.180_867_61));
        let q = 1.0 + u * (-0.834_277_15 + u * 1.464_878_4);
        (p / q).clamp(0.0, 1.0)
    })
}

/// Rec.709 to Rec.2020 with AgX's inset primaries, rows.
const AGX_INTO: [[f32; 3]; 3] = [
    [0.544_814_76, 0.373_787_36, 0.081_397_89],
    [0.140_416_95, 0.754_137_6, 0.105_445_5],
    [0.088_810_39, 0.178_871_75, 0.732_317_87],
];

/// Outset primaries back to Rec.709, rows.
const AGX_BACK: [[f32; 3]; 3] = [
    [1.964_887_4, -0.855_988_4, -0.108_899],
    [-0.299_313_4, 1.326_398, -0.027_084_57],
    [-0.164_352_64, -0.238_183_98, 1.402_536_6],
];

/// Luminance of Rec.709 primaries as AgX weighs them.
const AGX_LUMA: [f32; 3] = [0.206_759_49, 0.658_125_3, 0.135_115_2];

/// Inset primaries, sigmoid over −10 … +6.5 stops around middle grey, three fifths of the hue held,
/// outset primaries, negative channels raised while the light stays the same.
fn agx(light: [f32; 3]) -> [f32; 3] {
    let inset = mul(AGX_INTO, light).map(|v| v.max(1e-10));
    let formed = inset.map(agx_sigmoid);
    // With highest and lowest channel kept, hue is where the middle one lies between them.
    let (low0, span0) = low_and_span(inset);
    let (low, span) = low_and_span(formed);
    let held = [0, 1, 2].map(|i| {
        let before = (inset[i] - low0) / span0.max(1e-12);
        let after = (formed[i] - low) / span.max(1e-12);
        low + span * (before + 0.4 * (after - before))
    });
    let out = mul(AGX_BACK, held);
    let raise = (-min3(out)).max(0.0);
    let raised = out.map(|v| v + raise);
    let scale = (agx_weight(out) / agx_weight(raised).max(1e-9)).min(1.0);
    raised.map(|v| srgb::encode(v * scale))
}

/// Hyperbolas of power 1.5 below and above middle grey, where display value and slope are given
/// (0.18^(1/2.4), 2.4); decoded by the power 2.4.
fn agx_sigmoid(v: f32) -> f32 {
    let t = ((v / 0.18).log2() / 16.5 + 10.0 / 16.5).clamp(0.0, 1.0);
    let a = 2.4 * (t - 10.0 / 16.5);
    let scale = if a < 0.0 { 0.565_675_6 } else { 0.715_198_3 };
    let h = a.abs() / scale;
    let bend = scale * h / (1.0 + h * h.sqrt()).powf(1.0 / 1.5);
    let encoded = 0.489_437_1 + if a < 0.0 { -bend } else { bend };
    encoded.max(0.0).powf(2.4)
}

/// Luminance plus how far the opponent colour's lies below its own peak.
fn agx_weight(c: [f32; 3]) -> f32 {
    let (high, low) = (max3(c), min3(c));
    let luma: f32 = [0, 1, 2].into_iter().map(|i| AGX_LUMA[i] * (2.0 * c[i] - high)).sum();
    high - low + luma
}

/// Khronos PBR Neutral: takes the 4 % reflection of dielectrics away, keeps colours as they are up
/// to 0.76 and bends what is brighter towards 1 while desaturating it.
fn neutral(light: [f32; 3]) -> [f32; 3] {
    let low = min3(light);
    let offset = if low < 0.08 { low - 6.25 * low * low } else { 0.04 };
    let base = light.map(|v| v - offset);
    let peak = max3(base);
    if peak < 0.76 {
        return base.map(srgb::encode);
    }
    let top = 1.0 - 0.0576 / (peak - 0.52);
    let keep = 1.0 / (0.15 * (peak - top) + 1.0);
    base.map(|v| srgb::encode(top + (v * top / peak - top) * keep))
}

fn mul(m: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn low_and_span(v: [f32; 3]) -> (f32, f32) {
    (min3(v), max3(v) - min3(v))
}

fn max3(v: [f32; 3]) -> f32 {
    v[0].max(v[1]).max(v[2])
}

fn min3(v: [f32; 3]) -> f32 {
    v[0].min(v[1]).min(v[2])
}
