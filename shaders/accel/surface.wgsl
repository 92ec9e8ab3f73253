// What rays know of triangles: colours averaged over each, and the triangles that glow. `accel::surfaces` and `accel::emitters`
// are the Rust side. Whoever joins this file binds `surfaces: array<vec4u>` and `emitters: array<Emitter>`.

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

struct Met {
    // Base colour of the diffuse part, reflectance at normal incidence, emitted radiance.
    diffuse: vec3f,
    f0: vec3f,
    emission: vec3f,
    roughness: f32,
    flags: u32,
    // Luminance of the emission times coverage times sides: a light sample's choice goes by it.
    by_area: f32,
}

const MET_DOUBLE_SIDED = 1u;
const MET_UNLIT = 2u;

fn met(triangle: u32) -> Met {
    let packed = surfaces[triangle];
    let d = unpack4x8unorm(packed.x);
    let f = unpack4x8unorm(packed.y);
    let scale = exp2(f32(i32(packed.z >> 27u) - 24));
    let e = vec3f(vec3u(packed.z, packed.z >> 9u, packed.z >> 18u) & vec3u(511u)) * scale;
    return Met(d.rgb * d.rgb, f.rgb * f.rgb, e, d.a, packed.y >> 24u, bitcast<f32>(packed.w));
}
