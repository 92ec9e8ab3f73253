// Reads a vector of a tensor in the arena's precision, here 32 bits.
fn load(at: u32) -> vec4f { return arena[at]; }
