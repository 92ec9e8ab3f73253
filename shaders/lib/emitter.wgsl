// Discs that send light on, and how much of it arrives; 80 bytes, `EMITTER_BYTES` of `gi::emitters`.

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
    pad0: f32,
    // Where the light's rays go on to when the surface mirrors them: mean of unit vectors.
    mirror: vec3f,
    pad1: f32,
    // Radiance by which the specular lobe around it would send the same power if it were diffuse.
    gloss: vec3f,
    pad2: f32,
}

// How many of everything there are; the Rust twin is `gi::emitters::Counts`.
struct Counts {
    blocks: u32,
    lights: u32,
    pad0: u32,
    pad1: u32,
}

// Emitters of reflective shadow maps know where their light came from, so their specular lobe has a direction. At a
// glancing sun it is a fifth of what a wall sends on, and most of what the floor in front gets. cos^8 around the
// mirrored ray is as wide as GGX at roughness 0.5; (8 + 1) / 2 keeps the power.
fn lobe(mirror: vec3f, ray: vec3f) -> f32 {
    let c = max(dot(mirror, ray), 0.0);
    let c2 = c * c;
    return 4.5 * c2 * c2 * c2 * c2;
}

// What a disc sends to `p`, not yet times the receiver's cosine.
struct Arrival {
    // Unit vector from the receiver to the disc.
    towards: vec3f,
    // Form factor of a diffuse disc; in the distance cosine · area / (π d²). The area in the denominator keeps it finite
    // close up: a disc seen from its axis is exactly that.
    factor: f32,
    // The same without the disc's cosine; 0 behind the disc.
    plain: f32,
}

fn arrival(at: vec3f, normal: vec3f, rest: f32, area: f32, p: vec3f) -> Arrival {
    let v = at - p;
    let d2 = max(dot(v, v), 1e-12);
    let towards = v * inverseSqrt(d2);
    let cosine = -dot(normal, towards);
    let plain = area / (PI * d2 + area);
    return Arrival(towards, (max(cosine, 0.0) + rest) * plain, select(0.0, plain, cosine > 0.0));
}
