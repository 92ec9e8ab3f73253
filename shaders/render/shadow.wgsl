//#import lib/hash.wgsl
//#import lib/material.wgsl

// Depth from a light, reversed: 1 at the near plane, 0 where there is nothing.

struct ShadowCamera {
    clip_from_world: mat4x4f,
    seed: vec4u,
}

@group(0) @binding(0) var<uniform> camera: ShadowCamera;

struct ShadowVarying {
    @builtin(position) position: vec4f,
    @location(0) uv: vec4f,
    @location(1) alpha: f32,
}

struct ShadowVertex {
    @location(0) position: vec3f,
    @location(3) uv0: vec2f,
    @location(4) uv1: vec2f,
    @location(5) color: vec4f,
    @location(6) row0: vec4f,
    @location(7) row1: vec4f,
    @location(8) row2: vec4f,
}

fn clip(position: vec3f, row0: vec4f, row1: vec4f, row2: vec4f) -> vec4f {
    let p = vec4f(position, 1.0);
    return camera.clip_from_world * vec4f(dot(row0, p), dot(row1, p), dot(row2, p), 1.0);
}

// Opaque casters: positions only, no fragment stage.
@vertex
fn opaque(
    @location(0) position: vec3f,
    @location(6) row0: vec4f,
    @location(7) row1: vec4f,
    @location(8) row2: vec4f,
) -> @builtin(position) vec4f {
    return clip(position, row0, row1, row2);
}

// Masked and blended casters.
@vertex
fn covered(v: ShadowVertex) -> ShadowVarying {
    return ShadowVarying(clip(v.position, v.row0, v.row1, v.row2), vec4f(v.uv0, v.uv1), v.color.a);
}

@fragment
fn coverage(in: ShadowVarying) {
    let alpha = material.base_color.a * in.alpha
        * textureSample(base_texture, base_sampler, coordinates(material.base_use, in.uv, in.position.xy)).a;
    let q = vec2u(in.position.xy);
    if alpha < cutoff(hash01(q.x, q.y, camera.seed.x, bitcast<u32>(in.position.z))) {
        discard;
    }
}
