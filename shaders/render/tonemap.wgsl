//#import lib/screen.wgsl
//#import lib/tonemap.wgsl

// From scene-linear radiance to a display target.

struct Tonemap {
    // exposure = 2^EV
    exposure: f32,
    kind: u32,
    // 1 where the target encodes sRGB itself.
    linear_target: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> curve: Tonemap;
@group(0) @binding(1) var hdr: texture_2d<f32>;

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let radiance = textureLoad(hdr, vec2u(position.xy), 0).rgb;
    return screen_color(tonemap(curve.kind, radiance * curve.exposure), curve.linear_target);
}
