// The arena in 32 bits: one element is a vector.
@group(0) @binding(1) var<storage, read_write> arena: array<vec4f>;

// Elements of a vector that is 32 bits in either arena.
const FULL = 1u;

fn store(at: u32, v: vec4f) { arena[at] = v; }
fn load_full(at: u32) -> vec4f { return arena[at]; }
fn store_full(at: u32, v: vec4f) { arena[at] = v; }
