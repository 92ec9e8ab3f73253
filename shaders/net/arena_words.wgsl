// The arena in 32 bits, as vectors of two words of 64 (an optional feature): drivers on processors
// store word by word, thread by thread, and half as many words take two thirds of the time.
@group(0) @binding(1) var<storage, read_write> arena: array<vec2<u64>>;

// A texture with a vector of this precision in each texel.
alias Texels = texture_storage_2d<rgba32float, read>;

// Elements of a vector that is 32 bits in either arena.
const FULL = 1u;

fn word(v: vec2u) -> u64 { return u64(v.x) | (u64(v.y) << 32u); }
fn numbers(w: u64) -> vec2f { return vec2f(bitcast<f32>(u32(w & 0xfffffffflu)), bitcast<f32>(u32(w >> 32u))); }

fn store(at: u32, v: vec4f) { arena[at] = vec2<u64>(word(bitcast<vec2u>(v.xy)), word(bitcast<vec2u>(v.zw))); }
fn store_full(at: u32, v: vec4f) { store(at, v); }
fn load_full(at: u32) -> vec4f {
    let words = arena[at];
    return vec4f(numbers(words.x), numbers(words.y));
}
