//#import gi/inputs.wgsl

// From half resolution to a pixel: the mean of the 4x4 texels around it, weighted by how much they
// lie on the pixel's own plane. The 4x4 texels hold every phase of the gather's pattern once, so on
// a plane its noise cancels exactly; that is why the weights fall off with the plane's distance
// only.

@group(1) @binding(0) var half_map: texture_2d<f32>;   // rgb: value, a: distance along the view axis or 0

// Distance from the plane, relative to the view distance, at which a weight has fallen to a
// quarter: half of what a texel covers at 1024x512 and 60 degrees.
const PLANE = 0.002;
const MIN_WEIGHT = 1e-15;

// The value at `pixel`, which lies `z` metres away; `otherwise` where no texel around shows a
// surface.
fn filtered(pixel: vec2i, z: f32, otherwise: vec3f) -> vec3f {
    let here = position_at(pixel, z);
    let normal = normal_at(pixel) / (PLANE * z);
    // The texel left and above of the pixel or on it; the middle of the 4x4 lies at most a pixel
    // away.
    let base = (pixel - 1) >> vec2u(1u);
    let last = vec2i(textureDimensions(half_map)) - 1;
    var sum = vec3f(0.0);
    var weight = 0.0;
    for (var i = 0; i < 16; i++) {
        let texel = clamp(base + vec2i(i & 3, i >> 2u) - 1, vec2i(0), last);
        let value = textureLoad(half_map, texel, 0);
        let off = dot(normal, position_at(half_pixel(texel), value.a) - here);
        let lorentz = 1.0 + min(off * off, 1e12);
        let w = select(0.0, max(1.0 / (lorentz * lorentz), MIN_WEIGHT), value.a > 0.0);
        sum += w * value.rgb;
        weight += w;
    }
    return select(otherwise, sum / max(weight, 1e-30), weight > 0.0);
}
