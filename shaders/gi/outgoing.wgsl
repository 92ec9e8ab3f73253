//#import lib/frame.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl

// What both stages of specular light on the screen read (group 0), and the light that a pixel's surface sends out.

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL
// backends would refuse one.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var normal_texture: texture_2d<f32>;
@group(0) @binding(3) var specular_texture: texture_2d<f32>;
@group(0) @binding(4) var albedo_texture: texture_2d<f32>;
@group(0) @binding(5) var emissive_texture: texture_2d<f32>;
@group(0) @binding(6) var direct_diffuse: texture_2d<f32>;
@group(0) @binding(7) var indirect: texture_2d<f32>;

fn normal_of(pixel: vec2u) -> vec3f {
    return oct_decode(textureLoad(normal_texture, pixel, 0).xy);
}

// Share of even light all around that the pixel's specular lobe shows.
fn lobe_share(pixel: vec2u, n: vec3f) -> vec3f {
    let surface = textureLoad(specular_texture, pixel, 0);
    return env_brdf(surface.rgb, surface.a, dot(n, to_eye(frame, pixel)));
}

// Radiance of a hit pixel, taken as the same in every direction: diffuse and emitted light, and its
// own reflections by the split sum.
fn outgoing(pixel: vec2u) -> vec3f {
    let albedo = textureLoad(albedo_texture, pixel, 0);
    let around = textureLoad(indirect, pixel, 0).rgb * albedo.a;
    return albedo.rgb * (textureLoad(direct_diffuse, pixel, 0).rgb + around)
        + lobe_share(pixel, normal_of(pixel)) * around
        + textureLoad(emissive_texture, pixel, 0).rgb;
}
