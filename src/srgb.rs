//! The transfer function of sRGB (IEC 61966-2-1).

/// Linear value of a display-encoded one in [0, 1].
pub fn decode(v: f32) -> f32 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Display-encoded value of a linear one, clamped to [0, 1].
pub fn encode(linear: f32) -> f32 {
    let v = linear.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// CIE XYZ as linear Rec.709; the white of both is D65.
pub fn from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_are_each_others_inverse_and_known_values_hold() {
        for byte in 0..=255 {
            let v = byte as f32 / 255.0;
            assert!((encode(decode(v)) - v).abs() < 1e-6, "{byte}");
        }
        // Middle grey of the standard's table.
        assert!((decode(0.5) - 0.214_041).abs() < 1e-6);
        assert_eq!((encode(-1.0), encode(2.0)), (0.0, encode(1.0)));
    }
}
