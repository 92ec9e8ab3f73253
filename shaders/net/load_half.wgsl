// Reads a vector of a tensor in the arena's precision, here 16 bits.
fn load(at: u32) -> vec4f {
    let v = arena[at];
    return vec4f(unpack2x16float(v.x), unpack2x16float(v.y));
}
