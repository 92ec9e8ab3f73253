// What a network says of a cell, three vectors, the last two numbers of which are not read; all
// zeros is the filter without one.
struct Guidance {
    // Places of the cell in two spaces: cells count for each other by 1/(1 + distance²)² there,
    // among its neighbours and among those further away.
    near: vec4f,
    far: vec4f,
    // Logarithms: how much it counts for its neighbours, how much noise it allows for.
    trust: f32,
    tolerance: f32,
}

// Frames up to which what a network says counts in full: it has learnt from moments up to the 20th.
// Later by so much less, since what is known well needs no filter.
const GUIDED_FRAMES = 32.0;
const MOST_LOG = 4.0;

fn limited(x: f32) -> f32 {
    return clamp(finite(x), -MOST_LOG, MOST_LOG);
}

fn finite4(v: vec4f) -> vec4f {
    return select(vec4f(0.0), v, (bitcast<vec4u>(v) & vec4u(EXPONENT)) != vec4u(EXPONENT));
}

fn guidance_from(a: vec4f, b: vec4f, c: vec4f) -> Guidance {
    return Guidance(finite4(a), finite4(b), limited(c.x), limited(c.y));
}

fn guided_share(frames: f32) -> f32 {
    return min(1.0, GUIDED_FRAMES / max(frames, 1.0));
}

fn kinship(a: vec4f, b: vec4f, share: f32) -> f32 {
    let apart = share * (a - b);
    let once = 1.0 + min(dot(apart, apart), 1e12);
    return 1.0 / (once * once);
}
