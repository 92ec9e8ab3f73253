//#import accel/traverse.wgsl
//#import lib/octahedral.wgsl

// What rays know of triangles: colours averaged over each, and the triangles that glow.
// `accel::surfaces` and `accel::emitters` are the Rust side. The shader that imports this file
// binds `surfaces: array<vec4u>`, `emitters: array<Emitter>` and `corner_normals: texture_2d<u32>`,
// a texel for each triangle.

struct Emitter {
    origin: vec3f,
    threshold: f32,
    edge1: vec3f,
    other: u32,
    edge2: vec3f,
    by_area: f32,
    radiance: vec3f,
    flags: u32,
}

// Material at a hit.
struct HitMaterial {
    // Base colour of the diffuse part, reflectance at normal incidence, emitted radiance.
    diffuse: vec3f,
    f0: vec3f,
    emission: vec3f,
    roughness: f32,
    flags: u32,
    // Luminance of the emission times coverage times sides: a light sample's choice goes by it.
    by_area: f32,
}

const HIT_DOUBLE_SIDED = 1u;
const HIT_UNLIT = 2u;

fn triangle_material(triangle: u32) -> HitMaterial {
    let packed = surfaces[triangle];
    let d = unpack4x8unorm(packed.x);
    let f = unpack4x8unorm(packed.y);
    let scale = exp2(f32(i32(packed.z >> 27u) - 24));
    let e = vec3f(vec3u(packed.z, packed.z >> 9u, packed.z >> 18u) & vec3u(511u)) * scale;
    return HitMaterial(d.rgb * d.rgb, f.rgb * f.rgb, e, d.a, packed.y >> 24u, bitcast<f32>(packed.w));
}

// Unit normal that the mesh gives the place of the hit, in the space of the ray, on the given side
// of the triangle.
fn hit_normal(hit: Hit, side: vec3f) -> vec3f {
    let corners = textureLoad(corner_normals, vec2u(hit.triangle & 8191u, hit.triangle >> 13u), 0);
    var n = (1.0 - hit.uv.x - hit.uv.y) * oct_decode(unpack2x16snorm(corners.x))
        + hit.uv.x * oct_decode(unpack2x16snorm(corners.y))
        + hit.uv.y * oct_decode(unpack2x16snorm(corners.z));
    n = trace_turned(hit.instance, n);
    let l = length(n);
    if !(l > 1e-6) { return side; }
    return select(n, -n, dot(n, side) < 0.0) / l;
}
