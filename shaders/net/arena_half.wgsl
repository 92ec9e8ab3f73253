// The arena in 16 bits: one element is a vector of four halves. Values beyond their range become
// the largest half.
@group(0) @binding(1) var<storage, read_write> arena: array<vec2u>;

// Elements of a vector that is 32 bits in either arena.
const FULL = 2u;

fn store(at: u32, v: vec4f) {
    let c = clamp(v, vec4f(-65504.0), vec4f(65504.0));
    arena[at] = vec2u(pack2x16float(c.xy), pack2x16float(c.zw));
}

fn load_full(at: u32) -> vec4f {
    return vec4f(bitcast<vec2f>(arena[at]), bitcast<vec2f>(arena[at + 1u]));
}

fn store_full(at: u32, v: vec4f) {
    arena[at] = bitcast<vec2u>(v.xy);
    arena[at + 1u] = bitcast<vec2u>(v.zw);
}
