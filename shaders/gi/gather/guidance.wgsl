//#import gi/inputs.wgsl

// The network's guidance for a cell: three vectors, of which the last two numbers are not read. All
// zeros is the filter without a network.
struct Guidance {
    // Positions of the cell in two spaces, for the blur and for the à-trous step. Cells count for
    // each other by 1/(1 + distance²)².
    near: vec4f,
    far: vec4f,
    // Logarithms: weight for its neighbours, and factor on the noise that is allowed.
    trust: f32,
    tolerance: f32,
}

// Length of history up to which guidance counts in full: the network was trained on histories of up
// to 20 frames. Longer ones need it less.
const GUIDED_FRAMES = 32.0;
const MAX_LOG = 4.0;

fn limited(x: f32) -> f32 {
    return clamp(finite(x), -MAX_LOG, MAX_LOG);
}

fn guidance_from(a: vec4f, b: vec4f, c: vec4f) -> Guidance {
    return Guidance(finite4(a), finite4(b), limited(c.x), limited(c.y));
}

fn guided_share(history_length: f32) -> f32 {
    return min(1.0, GUIDED_FRAMES / max(history_length, 1.0));
}

// Learned weight of two cells for each other, by their positions.
fn affinity(a: vec4f, b: vec4f, share: f32) -> f32 {
    let apart = share * (a - b);
    let once = 1.0 + min(dot(apart, apart), 1e12);
    return 1.0 / (once * once);
}
