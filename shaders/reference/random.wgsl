//#import lib/brdf.wgsl
//#import reference/types.wgsl
//#import lib/sampling.wgsl

// Random numbers: Owen-scrambled Sobol points, two dimensions at a time (Burley 2020, "Practical
// Hash-based Owen Scrambling"). Each pair of dimensions has its own scrambling and its own order of
// the points, both from a hash of seed, half, point and dimension; so the halves are independent,
// and so are different points of the picture.

var<private> random_point: u32;
var<private> random_sample: u32;

// Pairs of dimensions: 0 the pixel filter, then these for each vertex of the path.
const PAIR_LOBE: u32 = 1u;
const PAIR_SCATTER: u32 = 2u;
const PAIR_LIGHT: u32 = 3u;
const PAIR_LIGHT_POINT: u32 = 4u;
const PAIR_ANALYTIC: u32 = 5u;
const PAIR_ANALYTIC_POINT: u32 = 6u;
const PAIRS: u32 = 6u;

fn start_random(point: u32, sample: u32) {
    random_point = pcg3(vec3u(point, job.seed, job.half)).x;
    random_sample = sample;
}

// Owen scrambling of a number whose bits are reversed (Laine and Karras 2011 with Vegdahl's
// constants).
fn scramble_reversed(x: u32, seed: u32) -> u32 {
    var v = x ^ (x * 0x3d20adeau);
    v += seed;
    v *= (seed >> 16u) | 1u;
    v ^= v * 0x05526c56u;
    v ^= v * 0x53a22864u;
    return v;
}

// Two numbers of [0, 1) for `pair` of dimensions.
fn random2(pair: u32) -> vec2f {
    if (job.flags & JOB_PLAIN_RANDOM) != 0u {
        let v = pcg3(vec3u(random_point, random_sample, pair));
        return vec2f(unit_float(v.x), unit_float(v.y));
    }
    let seeds = pcg3(vec3u(random_point, pair, 0x68bc21ebu));
    let i = reverseBits(scramble_reversed(reverseBits(random_sample), seeds.x));
    // Sobol's first dimension is the index itself with reversed bits; the second multiplies by
    // Pascal's triangle modulo 2: bit k is the parity of all bits whose number contains k (Lucas).
    var j = i;
    j ^= (j >> 1u) & 0x55555555u;
    j ^= (j >> 2u) & 0x33333333u;
    j ^= (j >> 4u) & 0x0f0f0f0fu;
    j ^= (j >> 8u) & 0x00ff00ffu;
    j ^= j >> 16u;
    let x = reverseBits(scramble_reversed(i, seeds.y));
    let y = reverseBits(scramble_reversed(j, seeds.z));
    return vec2f(unit_float(x), unit_float(y));
}

// One plain random number of [0, 1) for whether a ray passes a triangle; `salt` tells rays of one
// path apart.
fn random_pass(triangle: u32, salt: u32) -> f32 {
    return unit_float(pcg3(vec3u(random_point ^ salt, random_sample, triangle)).z);
}

// Uniform in the unit disc (Shirley and Chiu 1997).
fn in_disc(u: vec2f) -> vec2f {
    let p = 2.0 * u - 1.0;
    if all(p == vec2f(0.0)) { return p; }
    let wide = abs(p.x) > abs(p.y);
    let r = select(p.y, p.x, wide);
    let angle = select(0.5 * PI - 0.25 * PI * (p.x / p.y), 0.25 * PI * (p.y / p.x), wide);
    return r * vec2f(cos(angle), sin(angle));
}

// A point off the surface at p on the side of n, so that rays from there do not meet the surface
// again: steps in units of the last place, not metres (Wächter and Binder 2019, Ray Tracing Gems
// 6). Near 0 these are too small, and a length is taken: theirs, which suits places up to 16 units
// from the origin, and more in proportion where the place is further away along another axis, since
// the hit's rounding grows with that (scenes in millimetres).
fn off_surface(p: vec3f, n: vec3f) -> vec3f {
    let steps = vec3i(n * 256.0);
    let moved = bitcast<vec3f>(bitcast<vec3i>(p) + select(steps, -steps, p < vec3f(0.0)));
    let scale = max(max(max(abs(p.x), abs(p.y)), abs(p.z)) / 16.0, 1.0);
    return select(moved, p + n * (scale / 65536.0), abs(p) < vec3f(scale / 32.0));
}
