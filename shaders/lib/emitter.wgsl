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
    // `haze` where it is.
    haze: f32,
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
    // The box that the scene's small objects fill: middle, and one over its half size.
    clutter_middle: vec3f,
    // Half of the share of light that they stop on each metre inside it.
    half_extinction: f32,
    clutter_scale: vec3f,
    pad2: f32,
}

// Half of what the scene's small objects take of light on each metre around `p`, so that the sum over both ends of a
// segment, at least 0, is what they take on each of its metres. From the middle of the box to beyond its top the sum is
// in proportion to the part that lies inside; between ends outside it is 0 or less from twice the box's size on.
fn haze(counts: Counts, p: vec3f) -> f32 {
    let m = abs(p - counts.clutter_middle) * counts.clutter_scale;
    return counts.half_extinction * (2.0 / max(max(m.x, m.y), max(m.z, 1.0)) - 1.0);
}

// Emitters of reflective shadow maps know where their light came from, so their specular lobe has a direction. At a
// glancing sun it is a fifth of what a wall sends on, and most of what the floor in front gets. cos^8 around the
// mirrored ray is as wide as GGX at roughness 0.5; (8 + 1) / 2 keeps the power.
fn lobe(mirror: vec3f, ray: vec3f) -> f32 {
    let c = max(dot(mirror, ray), 0.0);
    let c2 = c * c;
    return 4.5 * c2 * c2 * c2 * c2;
}

// What a disc sends to a receiver.
struct Arrival {
    // Unit vector from the receiver to the disc.
    towards: vec3f,
    // Form factor of a diffuse disc without the receiver's cosine; in the distance cosine · area / (π d²).
    factor: f32,
    // The same without the disc's cosine; 0 behind the disc.
    plain: f32,
    // Metres between the two.
    distance: f32,
}

// `p` and `n` are the receiver's. The term behind the plus keeps the form factor below 1 close up: a disc seen from its
// axis is exactly that, and with both cosines in it a wall cut into discs gives the floor beside it what it should (with
// 4.4 m discs 2 m away 0.473 of 0.475; without them 0.406).
fn arrival(at: vec3f, normal: vec3f, rest: f32, area: f32, p: vec3f, n: vec3f) -> Arrival {
    let v = at - p;
    let d2 = max(dot(v, v), 1e-12);
    let inverse = inverseSqrt(d2);
    let towards = v * inverse;
    let facing = -dot(normal, towards);
    let cosine = max(facing, 0.0) + rest;
    let plain = area / (PI * d2 + area * cosine * max(dot(n, towards), 0.0));
    return Arrival(towards, cosine * plain, select(0.0, plain, facing > 0.0), d2 * inverse);
}
