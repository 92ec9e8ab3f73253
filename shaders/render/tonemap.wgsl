// From scene-linear radiance to a display target.

struct Tonemap {
    // exposure = 2^EV
    exposure: f32,
    kind: u32,
    // 1 where the target encodes sRGB itself.
    linear_target: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> options: Tonemap;
@group(0) @binding(1) var hdr: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn srgb_decode(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let radiance = textureLoad(hdr, vec2u(position.xy), 0).rgb;
    var shown = tonemap(options.kind, radiance * options.exposure);
    if options.linear_target != 0u {
        shown = srgb_decode(shown);
    }
    return vec4f(shown, 1.0);
}
