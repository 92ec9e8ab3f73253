//! Unit vectors in two numbers, as `shaders/lib/octahedral.wgsl` reads them.

/// The octahedral code of `v`, two signed normalised numbers of 16 bits; that of +Z where `v` has
/// no direction.
///
/// Source: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
/// JCGT 3(2), 2014.
pub fn octahedral(v: [f32; 3]) -> [i16; 2] {
    let v = v.map(f64::from);
    let sum = v.iter().map(|c| c.abs()).sum::<f64>();
    let v = if sum > 0.0 && sum.is_finite() { v.map(|c| c / sum) } else { [0.0, 0.0, 1.0] };
    let (mut x, mut y) = (v[0], v[1]);
    if v[2] < 0.0 {
        (x, y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    }
    [x, y].map(|c| (c * f64::from(i16::MAX)).round() as i16)
}

/// [`octahedral`] in one word, as `unpack2x16snorm` has it: x in the low half.
pub fn octahedral_word(v: [f32; 3]) -> u32 {
    let [x, y] = octahedral(v).map(|c| u32::from(c as u16));
    x | y << 16
}
