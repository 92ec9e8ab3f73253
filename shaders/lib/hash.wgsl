// Random numbers without state: PCG hash (Jarzynski and Olano 2020).

fn pcg(v: u32) -> u32 {
    let state = v * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Uniform in [0, 1).
fn hash01(a: u32, b: u32, c: u32, d: u32) -> f32 {
    return f32(pcg(a ^ pcg(b ^ pcg(c ^ pcg(d)))) >> 8u) / 16777216.0;
}
