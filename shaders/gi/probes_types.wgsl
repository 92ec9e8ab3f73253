// What the passes of gi.probes share. `gi::probes::gpu::ProbeParams` is the Rust side.

struct ProbeParams {
    // Surfels; the parts of the sky and the black surfel follow them in the lists of light.
    surfels: u32,
    // Links of a surfel, and how many of them carry the light that bounces on.
    rays: u32,
    inner_rays: u32,
    light_count: u32,
    // Mean radiance of the environment.
    environment: vec3f,
    // Edge of the field's cubes, metres.
    side: f32,
    // Where the field's cubes are counted from, metres.
    centre: vec3f,
    // Entries of the field's table less 1.
    table_mask: u32,
    // The largest spacing of surfels, metres.
    spacing: f32,
    // Of the bake's random numbers.
    seed: u32,
    pad0: u32,
    pad1: u32,
}

// A 32-bit hash; twin of `gi::probes::random::hash`.
fn hash(word: u32) -> u32 {
    var x = word;
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return x ^ (x >> 16u);
}

// A number in [0, 1) from the high digits.
fn unit(digits: u32) -> f32 {
    return f32(digits >> 8u) / 16777216.0;
}

// Two axes in the plane of `n`; twin of `gi::probes::field::frame`.
fn frame(n: vec3f) -> mat2x3f {
    let s = select(1.0, -1.0, n.z < 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return mat2x3f(vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3f(b, s + n.y * n.y * a, -n.y));
}

// Parts of the sky.
const SKY = 64u;
