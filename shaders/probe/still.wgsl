// Fragments that all read the same place of a picture, through a sampler with an anisotropic filter.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var filtered: sampler;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.5, 1.0);
}

@fragment
fn still() -> @location(0) vec4f {
    return textureSample(picture, filtered, vec2f(0.5, 0.25));
}
