//! Colour as FLIP sees it: opponent channels for filtering, then Hunt-adjusted L*a*b* for
//! distances.

/// Linear Rec.709 to XYZ, each row divided by its sum: XYZ relative to the white point (D65).
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [0.433_895_4, 0.376_242_37, 0.189_862_24],
    [0.212_636_82, 0.715_182_98, 0.072_180_2],
    [0.017_752_42, 0.109_465_63, 0.872_781_95],
];

/// The inverse.
const RGB_FROM_XYZ: [[f32; 3]; 3] = [
    [3.080_342, -1.537_399, -0.542_943],
    [-0.921_178_4, 1.875_93, 0.045_248_41],
    [0.052_881_293, -0.204_011_2, 1.151_129_9],
];

/// Exponent that compresses colour distances.
const COMPRESSION: f32 = 0.7;
/// Share of the largest distance that is spread over most of the range …
const SHARE: f32 = 0.4;
/// … namely up to here.
const MOST: f32 = 0.95;

fn product(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|i| m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2])
}

/// YCxCz of linear Rec.709: L*a*b* without its cube roots, so that it can be filtered.
pub fn opponent_from_linear(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = product(&XYZ_FROM_RGB, rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Inverse of [`opponent_from_linear`].
pub fn linear_from_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    product(&RGB_FROM_XYZ, [y + cx / 500.0, y, y - cz / 200.0])
}

/// L*a*b* of linear Rec.709 in [0, 1], a* and b* scaled by lightness: colours differ more where it
/// is bright (Hunt).
pub fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    const KNEE: f32 = 6.0 / 29.0;
    let root = |v: f32| if v > KNEE * KNEE * KNEE { v.cbrt() } else { v / (3.0 * KNEE * KNEE) + 4.0 / 29.0 };
    let [x, y, z] = product(&XYZ_FROM_RGB, rgb).map(root);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Colour distances between Hunt-adjusted L*a*b* colours, in [0, 1].
pub struct Distance {
    largest: f32,
}

impl Distance {
    /// Scaled by the distance of green and blue, the largest there is.
    pub fn new() -> Self {
        Self { largest: compressed(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])) }
    }

    /// 0 for equal colours, 0.95 at 40 % of the largest (compressed) distance, 1 at the largest.
    pub fn between(&self, a: [f32; 3], b: [f32; 3]) -> f32 {
        let distance = compressed(a, b);
        let most = SHARE * self.largest;
        if distance < most {
            distance * MOST / most
        } else {
            MOST + (distance - most) / (self.largest - most) * (1.0 - MOST)
        }
    }
}

/// HyAB distance (city blocks in lightness, straight in colour; right for large distances),
/// compressed.
fn compressed(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = [0, 1, 2].map(|i| a[i] - b[i]);
    (d[0].abs() + (d[1] * d[1] + d[2] * d[2]).sqrt()).powf(COMPRESSION)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opponents_return_and_white_has_no_colour() {
        for rgb in [[0.0; 3], [1.0; 3], [0.2, 0.7, 0.05], [1.0, 0.0, 0.3]] {
            let back = linear_from_opponent(opponent_from_linear(rgb));
            assert!((0..3).all(|c| (back[c] - rgb[c]).abs() < 1e-5), "{rgb:?} {back:?}");
        }
        let white = hunt_lab([1.0; 3]);
        assert!((white[0] - 100.0).abs() < 1e-4 && white[1].abs() < 1e-3 && white[2].abs() < 1e-3, "{white:?}");
        assert!(hunt_lab([0.0; 3]).iter().all(|v| v.abs() < 1e-4));
    }

    #[test]
    fn distances_reach_from_0_to_1() {
        let d = Distance::new();
        let [green, blue, white] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]].map(hunt_lab);
        assert_eq!((d.between(green, green), d.between(green, blue)), (0.0, 1.0));
        let grey = d.between(white, hunt_lab([0.0; 3]));
        assert!(grey > 0.9 && grey < 1.0, "{grey}");
    }
}
