// What rays know of triangles: colours averaged over each, and the triangles that glow. `accel::surfaces` and `accel::emitters`
// are the Rust side. Whoever joins this file binds `surfaces: array<vec4u>` and `emitters: array<Emitter>`.

struct Emitter {
    origin: vec3f,
    threshold: f32,
    edge1: vec3f,
    other: u32,
    edge2: vec3f,
    pad: f32,
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
}

const MET_DOUBLE_SIDED = 1u;
const MET_UNLIT = 2u;

fn met(triangle: u32) -> Met {
    let packed = surfaces[triangle];
    let d = unpack4x8unorm(packed.x);
    let f = unpack4x8unorm(packed.y);
    let scale = exp2(f32(i32(packed.z >> 27u) - 24));
    let e = vec3f(vec3u(packed.z, packed.z >> 9u, packed.z >> 18u) & vec3u(511u)) * scale;
    return Met(d.rgb * d.rgb, f.rgb * f.rgb, e, d.a, packed.y >> 24u);
}

// Chance per area with which a light sample takes a point of a surface that sends `emission`; `inverse_power` as
// `SceneRays::inverse_power`.
fn emission_density(emission: vec3f, flags: u32, inverse_power: f32) -> f32 {
    let sides = select(1.0, 2.0, (flags & MET_DOUBLE_SIDED) != 0u);
    return dot(emission, vec3f(0.2126, 0.7152, 0.0722)) * sides * inverse_power;
}
