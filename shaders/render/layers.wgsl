//#import lib/frame.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl

// Decodes one layer of the G-buffer for a band of rows into linear floats, for capture. Which
// layer: `options.layer`, numbered as `render::capture::Layer`. Light layers leave as products with
// the surface colour; the division, which Blender makes after filtering, happens on the CPU.

struct Options {
    layer: u32,
    first_row: u32,
    rows: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL
// backends would refuse one.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var normal_texture: texture_2d<f32>;
@group(0) @binding(3) var albedo_texture: texture_2d<f32>;
@group(0) @binding(4) var specular_texture: texture_2d<f32>;
@group(0) @binding(5) var emissive_texture: texture_2d<f32>;
@group(0) @binding(6) var motion_texture: texture_2d<f32>;
@group(0) @binding(7) var direct_diffuse: texture_2d<f32>;
@group(0) @binding(8) var direct_specular: texture_2d<f32>;
@group(0) @binding(9) var indirect: texture_2d<f32>;
@group(0) @binding(10) var indirect_specular: texture_2d<f32>;
@group(0) @binding(11) var hdr: texture_2d<f32>;
// No uniform: Mesa's CPU driver 22.3 compiles what uniforms alone branch on anew for each dispatch.
@group(1) @binding(0) var<storage, read> options: Options;
@group(1) @binding(1) var<storage, read_write> out: array<vec4f>;
@group(2) @binding(0) var texture: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn layers(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= frame.size.x || id.y >= options.rows { return; }
    var pixel = vec2u(id.x, id.y + options.first_row);
    if options.layer >= 9u && options.layer <= 11u { pixel = nearest_sample(pixel); }
    out[id.y * frame.size.x + id.x] = decode(pixel);
}

// The pixel whose sample lies nearest to this one's centre: a jitter may be wider than a pixel.
fn nearest_sample(pixel: vec2u) -> vec2u {
    return vec2u(clamp(vec2i(pixel) - vec2i(round(frame.jitter)), vec2i(0), vec2i(frame.size) - 1));
}

// The same into a texture, for temporal anti-aliasing.
@compute @workgroup_size(8, 8)
fn layer_texture(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    textureStore(texture, id.xy, min(decode(id.xy), vec4f(65504.0)));
}

fn decode(pixel: vec2u) -> vec4f {
    if options.layer == 0u {
        let color = textureLoad(hdr, pixel, 0);
        // Exactly 1 where there is a backdrop, whatever blending leaves of it.
        return vec4f(color.rgb, select(1.0, color.a, frame.backdrop == 3u));
    }
    let depth = textureLoad(depth_texture, pixel, 0).x;
    if depth <= 0.0 {
        // Blender's background: no surface, depth 1e10.
        return select(vec4f(0.0), vec4f(1e10, 0.0, 0.0, 0.0), options.layer == 9u);
    }
    let n = oct_decode(textureLoad(normal_texture, pixel, 0).xy);
    let albedo = textureLoad(albedo_texture, pixel, 0);
    let specular = textureLoad(specular_texture, pixel, 0);
    let around = textureLoad(indirect, pixel, 0).rgb * albedo.a;
    let gloss = env_brdf(specular.rgb, specular.a, dot(n, to_eye(frame, pixel)));
    // A channel that eight bits round to 0 still tells what light falls on it; on metal no channel
    // does.
    let weight = select(vec3f(0.0), max(albedo.rgb, vec3f(1.0 / 4096.0)), any(albedo.rgb > vec3f(0.0)));
    switch options.layer {
        case 1u: { return vec4f(weight * textureLoad(direct_diffuse, pixel, 0).rgb, 1.0); }
        case 2u: { return vec4f(weight * around, 1.0); }
        case 3u: { return vec4f(albedo.rgb, 1.0); }
        case 4u: { return vec4f(textureLoad(direct_specular, pixel, 0).rgb, 1.0); }
        case 5u: { return vec4f(textureLoad(indirect_specular, pixel, 0).rgb * albedo.a, 1.0); }
        case 6u: { return vec4f(gloss, 1.0); }
        case 7u: { return vec4f(textureLoad(emissive_texture, pixel, 0).rgb, 1.0); }
        case 8u: { return vec4f(n, 1.0); }
        case 9u: { return vec4f(linear_depth(frame, depth), 0.0, 0.0, 1.0); }
        case 10u: { return vec4f(world_position(frame, pixel, depth), 1.0); }
        case 12u: { return vec4f(weight, 1.0); }
        default: { return vec4f(textureLoad(motion_texture, pixel, 0).xy, 0.0, 1.0); }
    }
}
