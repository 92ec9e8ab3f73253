// Display transforms: scene-linear Rec.709 in, display-encoded sRGB in [0, 1] out.

fn srgb_encode(c: vec3f) -> vec3f {
    let x = saturate(c);
    return select(1.055 * pow(x, vec3f(1.0 / 2.4)) - 0.055, x * 12.92, x <= vec3f(0.0031308));
}

fn tonemap(kind: u32, rgb: vec3f) -> vec3f {
    return srgb_encode(rgb);
}
