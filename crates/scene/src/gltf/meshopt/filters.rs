//! Filters of unpacked attributes. Values that no encoder writes give some number, never a panic:
//! conversions saturate.

/// Signed components of 1 or 2 bytes.
fn component(bytes: &[u8]) -> i32 {
    match *bytes {
        [a, b] => i32::from(i16::from_le_bytes([a, b])),
        _ => i32::from(bytes[0] as i8),
    }
}

/// Writes the lowest bytes of `value`.
fn store(bytes: &mut [u8], value: i32) {
    let width = bytes.len();
    bytes.copy_from_slice(&value.to_le_bytes()[..width]);
}

/// Unit vectors in octahedral form, elements of 4 or 8 bytes; the third component says what 1 is,
/// the fourth stays.
pub(super) fn octahedral(data: &mut [u8], stride: usize) {
    let width = stride / 4;
    let scale = if width == 1 { 127.0 } else { 32_767.0 };
    for element in data.chunks_exact_mut(stride) {
        let value = |i: usize| component(&element[i * width..(i + 1) * width]) as f32;
        let one = value(2);
        let (x, y) = (value(0) / one, value(1) / one);
        let z = 1.0 - x.abs() - y.abs();
        let fold = z.min(0.0);
        let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
        let length = (x * x + y * y + z * z).sqrt();
        for (i, v) in [x, y, z].into_iter().enumerate() {
            store(&mut element[i * width..(i + 1) * width], (v / length * scale).round() as i32);
        }
    }
}

/// Unit quaternions without their largest component, elements of 8 bytes.
pub(super) fn quaternion(data: &mut [u8]) {
    for element in data.chunks_exact_mut(8) {
        let value = |i: usize| component(&element[2 * i..2 * i + 2]);
        let one = (value(3) | 3) as f32;
        let largest = (value(3) & 3) as usize;
        let rest = [0, 1, 2].map(|i| value(i) as f32 / one * std::f32::consts::FRAC_1_SQRT_2);
        let missing = (1.0 - rest.iter().map(|v| v * v).sum::<f32>()).max(0.0).sqrt();
        for (i, v) in rest.into_iter().chain([missing]).enumerate() {
            let at = 2 * ((largest + i + 1) % 4);
            store(&mut element[at..at + 2], (v * 32_767.0).round() as i32);
        }
    }
}

/// Floats as 24 bits of mantissa and 8 of exponent.
pub(super) fn exponential(data: &mut [u8]) {
    for word in data.chunks_exact_mut(4) {
        let packed = i32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        // The specification allows −100 to 100; a float's own range is kept beyond.
        let exponent = (packed >> 24).clamp(-126, 127);
        let power = f32::from_bits(((exponent + 127) as u32) << 23);
        let value = (packed << 8 >> 8) as f32 * power;
        word.copy_from_slice(&value.to_le_bytes());
    }
}

/// Colours as Y, Co, Cg and alpha of K bits, elements of 4 or 8 bytes; alpha's highest bit tells K.
pub(super) fn color(data: &mut [u8], stride: usize) {
    let width = stride / 4;
    let (mask, most) = if width == 1 { (0xff, 255.0) } else { (0xffff, 65_535.0) };
    for element in data.chunks_exact_mut(stride) {
        let value = |i: usize| component(&element[i * width..(i + 1) * width]);
        let alpha = value(3) & mask;
        let full = (1 << (32 - alpha.leading_zeros())) - 1;
        let (y, co, cg) = (value(0) & mask, value(1), value(2));
        let alpha = alpha & full >> 1;
        let alpha = alpha << 1 | alpha & 1;
        let scale = most / full.max(1) as f32;
        for (i, v) in [y + co - cg, y + cg, y - co - cg, alpha].into_iter().enumerate() {
            let v = (v as f32 * scale).round().clamp(0.0, most) as i32;
            store(&mut element[i * width..(i + 1) * width], v);
        }
    }
}
