//! Dropout's random numbers: a hash of (seed, operator, value), so that a run is reproducible and
//! the CPU reference and the kernels (`shaders/net/dropout.wgsl`) drop exactly the same values. Not
//! PyTorch's generator: masks differ from its, their distribution does not.

/// PCG hash (Jarzynski and Olano 2020), as in `shaders/lib/hash.wgsl`.
fn pcg(v: u32) -> u32 {
    let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// The part of the hash that one operator's values share: `op` is its position in the graph.
pub fn stream(seed: u32, op: usize) -> u32 {
    pcg(pcg(seed) ^ op as u32)
}

/// Values are dropped whose hash, 24 bits of it, is below this.
pub fn threshold(p: f32) -> u32 {
    (f64::from(p) * f64::from(1 << 24)).round() as u32
}

/// Whether the value at flat index (y · width + x) · channels + c is kept.
pub fn keeps(stream: u32, threshold: u32, index: u32) -> bool {
    pcg(stream ^ index) >> 8 >= threshold
}
