// The film of one half-buffer: sums over the samples of each point that stay exact over millions of
// samples.
//
// A point has 16 vec4f: 8 sums and the 8 carries that belong to them. A sum is the pair sum +
// carry; every addition is Knuth's TwoSum, whose rounding error goes into the carry (Ogita, Rump
// and Oishi 2005, algorithm Sum2: as if summed in twice the precision). What the slots hold is told
// in `reference::film`.
//
// Call `film_add` once for every finished sample and slot, not once a dispatch: then the result
// does not depend on how the work was cut into dispatches, bit for bit.

@group(1) @binding(2) var<storage, read_write> film: array<vec4f>;

// Vectors of a point, and how far its carries lie behind its sums.
const FILM_STRIDE: u32 = 16u;
const FILM_CARRY: u32 = 8u;

const FILM_DIFF_DIR: u32 = 0u;
const FILM_DIFF_IND: u32 = 1u;
const FILM_GLOSS_DIR: u32 = 2u;
const FILM_GLOSS_IND: u32 = 3u;
const FILM_EMIT: u32 = 4u;
const FILM_DIFF_COL: u32 = 5u;
const FILM_GLOSS_COL: u32 = 6u;
const FILM_ANALYTIC: u32 = 7u;

// The same bits, but the compiler cannot know that: `zero` comes from memory and is 0. Mesa's
// compiler (and others) reckons with real numbers: without this it finds that every rounding error
// is nil, and the carries stay empty.
fn film_opaque(v: vec4f, zero: u32) -> vec4f {
    return bitcast<vec4f>(bitcast<vec4u>(v) ^ vec4u(zero));
}

// True for NaN and infinity; by the bits, for the same reason.
fn film_broken(v: vec4f) -> vec4<bool> {
    return (bitcast<vec4u>(v) & vec4u(0x7f800000u)) == vec4u(0x7f800000u);
}

// Adds `value` to slot `slot` of the film's point number `point` (counted from the film's first).
// One invocation a point. Components that are no numbers are left out and counted in the last
// component of FILM_ANALYTIC, which callers give as 0.
fn film_add(point: u32, slot: u32, value: vec4f) {
    let at = FILM_STRIDE * point + slot;
    // The carry of that count is never written: it stays 0.
    let zero = bitcast<u32>(film[FILM_STRIDE * point + FILM_ANALYTIC + FILM_CARRY].w);
    let broken = film_broken(value);
    if any(broken) {
        film[FILM_STRIDE * point + FILM_ANALYTIC].w += 1.0;
    }
    let y = select(value, vec4f(0.0), broken);
    let s = film[at];
    let t = film_opaque(s + y, zero);
    let y_got = film_opaque(t - s, zero);
    let s_got = film_opaque(t - y_got, zero);
    let error = (s - s_got) + (y - y_got);
    let carry = film[at + FILM_CARRY] + error;
    if slot == FILM_ANALYTIC {
        film[at] = vec4f(t.xyz, s.w);
        film[at + FILM_CARRY] = vec4f(carry.xyz, 0.0);
    } else {
        film[at] = t;
        film[at + FILM_CARRY] = carry;
    }
}
