// Discs that send light on, and how much of it arrives. An emitter takes 80 bytes, `EMITTER_BYTES` of `gi::emitters`.
// What a pair needs is worked out once an emitter: a gather evaluates millions of pairs.

struct Emitter {
    position: vec3f,
    // m²; 0 for an emitter that is not there.
    area: f32,
    // Minus the mean of its normals (shorter than 1 where they differ), times area/π.
    back: vec3f,
    // A quarter of what that mean falls short of 1, the cosine that the rest of the normals shows to any direction, times
    // area/π.
    rest: f32,
    // Radiance sent to everywhere in front.
    radiance: vec3f,
    // `haze` where it is.
    haze: f32,
    // Where the light's rays go on to when the surface mirrors them: mean of unit vectors.
    mirror: vec3f,
    // `least_facing`, 0 for what is never seen from close by.
    least: f32,
    // Radiance by which the specular lobe around it would send the same power if it were diffuse, times LOBE · area/π.
    gloss: vec3f,
    // `closeness` of a fine one, without an upper end for what is never seen from close by.
    closeness: f32,
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
    // Corners of the scene.
    low: vec3f,
    pad3: f32,
    high: vec3f,
    pad4: f32,
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
const LOBE: f32 = 4.5;

fn lobe(cosine: f32) -> f32 {
    let c = max(cosine, 0.0);
    let c2 = c * c;
    let c4 = c2 * c2;
    return c4 * c4;
}

// Of a disc of `area` seen from closer by than its own width, its middle does not say how much of it faces the receiver: at
// the foot of a wall the floor's discs are all but edge-on, yet fill half of the hemisphere. So a disc that faces a
// receiver at all does so as from 0.3 widths above it (0.3: two rows of squares give a wall 0.2, 0.4 and 0.8 m above them
// 0.46, 0.40 and 0.39 of the hemisphere; exact are 0.47, 0.44 and 0.38; without it 0.22, 0.35 and 0.39).
fn least_facing(area: f32) -> f32 {
    return 0.3 * sqrt(area) * area / PI;
}

// One over the square of half the width of a disc of `area`. What faces a lit disc from nearer than that would keep the light off it:
// the disc's texels are not where its middle says, as with those of a ring that is thinner than they are. It then counts
// by the square of its distance in these terms, at most 1. (Without: spots of five times the light inside rings.)
fn closeness(area: f32) -> f32 {
    return 4.0 / max(area, 1e-12);
}

// cosine · area/π · distance of a disc, given the same without a lower end.
fn at_least(facing: f32, least: f32) -> f32 {
    return select(0.0, max(facing, least), facing > 0.0);
}

// The squared distance between a disc and a receiver at `v` from each other, kept above 0.
fn squared(v: vec3f) -> f32 {
    return max(dot(v, v), 1e-12);
}

// What a disc of cosine · area/π = `a` / distance at `v` from the receiver sends, without `a`: times a · dot(n, v) it is the
// form factor, `r` being dot(n, v). 0 below the receiver's horizon.
// The term behind the plus keeps the form factor below 1 close up: a disc seen from its
// axis is exactly that, and with both cosines in it a wall cut into discs gives the floor beside it what it should (with
// 4.4 m discs 2 m away 0.473 of 0.475; without them 0.406).
// `vague`, m⁴: what is added where a disc's area is not to be believed close up.
fn nearness(a: f32, r: f32, d2: f32, vague: f32) -> f32 {
    return select(0.0, 1.0 / (d2 * d2 + a * r + vague), r > 0.0);
}
