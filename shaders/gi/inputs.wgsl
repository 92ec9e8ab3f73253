//#import lib/octahedral.wgsl

// What every stage of gi/ reads: the G-buffer, the direct light and the camera (group 0), and how
// texels become numbers, in whichever of a host's conventions (`gi::Conventions`). Everything that
// leaves this file is finite, whatever the textures hold.

// `gi::inputs::Params` is the Rust side.
struct Params {
    size: vec2u,                  // pixels
    cells: vec2u,                 // ceil(size / 4)
    unproject: vec4f,             // 1/p00, 1/p11, p02, p12 of the projection
    depth: vec4f,                 // distance = depth.x / (texel + depth.y); background's texel; error a metre, squared
    environment: vec4f,           // radiance, finite and not negative
    gravity_from_view: mat3x3f,
    gravity_from_world: mat3x3f,
    world_from_view: mat3x3f,
    eye: vec4f,                   // world space, metres
    motion: vec4f,                // texture coordinates, then minus now = texel * xy + zw
    flags: u32,                   // STORED_*
    light_scale: f32,             // one over the exposure of light_at and emissive_at
    pad: vec2u,
}

// Normals are vectors, or x and y of such, not octahedral; they are v / 2 + 1/2; they are in view
// space.
const STORED_XYZ = 1u;
const STORED_XY = 2u;
const STORED_UNSIGNED = 4u;
const STORED_IN_VIEW = 8u;
// Albedo is read sRGB-encoded.
const STORED_SRGB = 16u;
// Light is multiplied by an exposure.
const STORED_EXPOSED = 32u;
// In view space z points away from the eye.
const STORED_AHEAD = 64u;

// `gi::exposure::Exposure` is the Rust side and documents the fields.
struct Exposure {
    s: f32,
    ln_m: f32,
    hit_fraction: f32,
    nonfinite: u32,
    red: f32,
    green: f32,
    blue: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Not texture_depth_2d: GLSL has no plain load from those, so the GL backends would refuse it.
@group(0) @binding(1) var depth_map: texture_2d<f32>;
@group(0) @binding(2) var normal_map: texture_2d<f32>;
@group(0) @binding(3) var albedo_map: texture_2d<f32>;
@group(0) @binding(4) var emissive_map: texture_2d<f32>;
@group(0) @binding(5) var direct_map: texture_2d<f32>;

const CELL = 4;
const EXPONENT = 0x7f800000u;
// Half floats end at 65504; a rounded-up store would become infinite.
const LARGEST = 65000.0;

// By bits: comparisons with NaN may be optimised away.
fn is_finite3(v: vec3f) -> bool {
    return all((bitcast<vec3u>(v) & vec3u(EXPONENT)) != vec3u(EXPONENT));
}

fn finite(x: f32) -> f32 {
    return select(0.0, x, (bitcast<u32>(x) & EXPONENT) != EXPONENT);
}

fn finite3(v: vec3f) -> vec3f {
    return select(vec3f(0.0), v, (bitcast<vec3u>(v) & vec3u(EXPONENT)) != vec3u(EXPONENT));
}

fn finite4(v: vec4f) -> vec4f {
    return select(vec4f(0.0), v, (bitcast<vec4u>(v) & vec4u(EXPONENT)) != vec4u(EXPONENT));
}

fn luminance(c: vec3f) -> f32 {
    return dot(c, vec3f(0.2126, 0.7152, 0.0722));
}

// The pixel that stands for a cell. One real pixel, never an average over an edge.
fn sample_pixel(cell: vec2i) -> vec2i {
    return min(CELL * cell + CELL / 2, vec2i(params.size) - 1);
}

// The pixel that stands for a texel of half resolution, ceil(size / 2).
fn half_pixel(texel: vec2i) -> vec2i {
    return min(2 * texel + 1, vec2i(params.size) - 1);
}

// Radiance, of light as it is stored.
fn unexposed(light: vec3f) -> vec3f {
    return light * select(1.0, params.light_scale, (params.flags & STORED_EXPOSED) != 0u);
}

fn light_at(pixel: vec2i) -> vec3f {
    return unexposed(max(finite3(textureLoad(direct_map, pixel, 0).rgb), vec3f(0.0)));
}

fn emissive_at(pixel: vec2i) -> vec3f {
    return unexposed(max(finite3(textureLoad(emissive_map, pixel, 0).rgb), vec3f(0.0)));
}

// Diffuse reflectance.
fn albedo_at(pixel: vec2i) -> vec3f {
    let texel = finite3(textureLoad(albedo_map, pixel, 0).rgb);
    // The texel is asked, too: Mesa's CPU driver compiles what uniforms alone branch on anew for
    // each dispatch.
    if all(texel <= vec3f(0.0)) | ((params.flags & STORED_SRGB) == 0u) { return texel; }
    return select(pow((texel + 0.055) / 1.055, vec3f(2.4)), texel / 12.92, texel <= vec3f(0.04045));
}

// Metres along the view axis; 0 on the background.
fn distance_at(pixel: vec2i) -> f32 {
    let read = textureLoad(depth_map, pixel, 0).r;
    let background = params.depth.z;
    let texel = select(background, read, (bitcast<u32>(read) & EXPONENT) != EXPONENT);
    return select(0.0, clamp(params.depth.x / (texel + params.depth.y), 1e-9, 1e9), texel != background);
}

// Metres from the eye in the gravity frame.
fn position_at(pixel: vec2i, distance: f32) -> vec3f {
    let uv = (vec2f(pixel) + 0.5) / vec2f(params.size);
    let ndc = vec2f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
    let ray = vec3f((ndc + params.unproject.zw) * params.unproject.xy, -1.0);
    return params.gravity_from_view * (ray * distance);
}

// Unit normal along the axes that it is stored along: the world's, or the camera's, which looks
// down -Z.
fn stored_normal(pixel: vec2i) -> vec3f {
    let n = stored_vector(pixel);
    let turned = (params.flags & (STORED_IN_VIEW | STORED_AHEAD)) == (STORED_IN_VIEW | STORED_AHEAD);
    return select(n, vec3f(n.xy, -n.z), turned);
}

// Chosen, not branched: normals are read at many places, and each branch there costs compilers more
// than it saves threads.
fn stored_vector(pixel: vec2i) -> vec3f {
    let texel = finite3(textureLoad(normal_map, pixel, 0).rgb);
    let v = select(texel, 2.0 * texel - 1.0, (params.flags & STORED_UNSIGNED) != 0u);
    let z = select(v.z, sqrt(max(1.0 - dot(v.xy, v.xy), 0.0)), (params.flags & STORED_XY) != 0u);
    let normal = vec3f(v.xy, z);
    let length = length(normal);
    let unit = select(vec3f(0.0, 0.0, 1.0), normal / length, length > 1e-6);
    return select(unit, oct_decode(v.xy), (params.flags & (STORED_XYZ | STORED_XY)) == 0u);
}

// Unit normal in the gravity frame.
fn normal_at(pixel: vec2i) -> vec3f {
    let n = stored_normal(pixel);
    let in_view = (params.flags & STORED_IN_VIEW) != 0u;
    return select(params.gravity_from_world * n, params.gravity_from_view * n, in_view);
}

// Unit normal in the world.
fn world_normal_at(pixel: vec2i) -> vec3f {
    let n = stored_normal(pixel);
    return select(n, params.world_from_view * n, (params.flags & STORED_IN_VIEW) != 0u);
}
