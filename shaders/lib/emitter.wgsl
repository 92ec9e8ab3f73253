// Discs that send light on, and how much of it arrives; 48 bytes, `EMITTER_BYTES` of `gi::emitters`.

struct Emitter {
    position: vec3f,
    // m²; 0 for an emitter that is not there.
    area: f32,
    // Mean of the normals, shorter than 1 where they differ.
    normal: vec3f,
    // A quarter of what it falls short of 1: the cosine that the rest of the normals shows to any direction.
    rest: f32,
    // Radiance sent to everywhere in front.
    radiance: vec3f,
    pad1: f32,
}

// How many of everything there are; the Rust twin is `gi::emitters::Counts`.
struct Counts {
    blocks: u32,
    lights: u32,
    pad0: u32,
    pad1: u32,
}

// Form factor of a disc, not yet times the receiver's cosine, as a vector towards it: E/π = L · max(dot(n, vector), 0).
// In the distance that is area · cosine / (π d²); close up the area in the denominator keeps it finite (a disc seen
// from its axis is exactly that).
fn arrival(at: vec3f, normal: vec3f, rest: f32, area: f32, p: vec3f) -> vec3f {
    let v = at - p;
    let d2 = max(dot(v, v), 1e-12);
    let inverse = inverseSqrt(d2);
    let cosine = max(-dot(normal, v) * inverse, 0.0) + rest;
    return v * (cosine * area * inverse / (PI * d2 + area));
}
