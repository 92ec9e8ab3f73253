//#import lib/frame.wgsl
//#import lib/hash.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/material.wgsl
//#import lib/direct_light.wgsl
//#import render/mesh.wgsl
//#import render/surface.wgsl

// Surfaces that cover a share of what is behind them, drawn over the picture.

@group(0) @binding(0) var<uniform> frame: Frame;
// Of the surface behind: E/π of sky and bounces, and a of 0 where there is none.
@group(0) @binding(1) var indirect: texture_2d<f32>;
@group(0) @binding(2) var emitted: texture_2d<f32>;

// The largest finite half: brighter radiance is held there instead of becoming infinite.
const HALF_MAX: f32 = 65504.0;

@vertex
fn vertex(v: Vertex) -> Varying {
    return placed(v, frame.clip_from_world);
}

// Radiance times coverage, and coverage.
@fragment
fn fragment(in: Varying, @builtin(front_facing) facing: bool) -> @location(0) vec4f {
    let s = surface_at(in, facing);
    // The rest is in the G-buffer.
    if s.alpha >= SOLID || s.alpha <= 0.0 { discard; }
    let pixel = vec2u(in.position.xy);
    let v = to_eye(frame, pixel);
    let direct = direct_light(in.world, s.normal, s.normal, v, s.specular, pixel, true);
    // Light from all around is taken to be that of what is behind, or the sky's: no cell looks out
    // from here.
    let open = textureLoad(emitted, pixel, 0).a <= 0.0;
    let around = select(textureLoad(indirect, pixel, 0).rgb, frame.environment, open) * s.shade;
    let mirrored = env_brdf(s.specular.rgb, s.specular.a, max(dot(s.normal, v), 0.0));
    let radiance = s.albedo * (direct.diffuse + around) + direct.specular + mirrored * around + s.emissive;
    return vec4f(min(radiance, vec3f(HALF_MAX)) * s.alpha, s.alpha);
}
