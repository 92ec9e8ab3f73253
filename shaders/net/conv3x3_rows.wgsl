// What the 3×3 convolutions by Winograd's algorithm along rows (Lavin and Gray 2016) share: the
// tile and its sums. A thread makes four by four pixels.
//
// Written for processors, which have few registers and whose compilers keep the order: all that one
// weight is multiplied with comes at once, several products into sums of one output channel, and
// inputs are operands from memory. Before: weights_lanes.wgsl, place.wgsl and whole.wgsl,
// parts.wgsl or measured.wgsl; after: conv3x3_pairs.wgsl or conv3x3_fours.wgsl, and make.wgsl. From
// the prelude: VECTORS.

const TILE = vec2u(4u, 4u);

var<private> place: Place;
// The tile's first pixel, and where the channels begin that the group reads.
var<private> corner: vec2u;
var<private> inputs: u32;

// Of one output channel the four columns of the tile, a row a lane.
struct Tile { x0: vec4f, x1: vec4f, x2: vec4f, x3: vec4f }
// Of four output channels.
struct Four { o0: Tile, o1: Tile, o2: Tile, o3: Tile }
// The sums.
var<private> a: Four;
var<private> b: Four;
var<private> c: Four;
var<private> d: Four;

fn tap(x: i32, y: i32) -> u32 { return vector_of(inputs, x, y); }

fn all_of(v: f32) -> Tile { return Tile(vec4f(v), vec4f(v), vec4f(v), vec4f(v)); }
fn four_of(v: vec4f) -> Four { return Four(all_of(v.x), all_of(v.y), all_of(v.z), all_of(v.w)); }

// Begins the sums with the bias.
fn begin(bias: mat4x4f) {
    a = four_of(bias[0]);
    b = four_of(bias[1]);
    c = four_of(bias[2]);
    d = four_of(bias[3]);
}

// Six rows of an input vector, transformed along rows: one of the transform's results.
struct Rows { r0: vec4f, r1: vec4f, r2: vec4f, r3: vec4f, r4: vec4f, r5: vec4f }
// Of the weights of one result, tap row by tap row: an output channel a lane, a column of the two matrices a thread.
struct Taps { t0: vec4f, t1: vec4f, t2: vec4f }

fn taps(w: u32) -> Taps { return Taps(own(w), own(w + KERNEL_W * VECTORS), own(w + 2u * KERNEL_W * VECTORS)); }

// One number of each of the first four threads, or of the second four.
fn low(v: f32) -> vec4f {
    return vec4f(subgroupBroadcast(v, 0u), subgroupBroadcast(v, 1u), subgroupBroadcast(v, 2u),
        subgroupBroadcast(v, 3u));
}
fn high(v: f32) -> vec4f {
    return vec4f(subgroupBroadcast(v, 4u), subgroupBroadcast(v, 5u), subgroupBroadcast(v, 6u),
        subgroupBroadcast(v, 7u));
}

// A pixel's four channels.
struct Column { y0: vec4f, y1: vec4f, y2: vec4f, y3: vec4f }

fn column(a: vec4f, b: vec4f, c: vec4f, d: vec4f) -> Column {
    let m = transpose(mat4x4f(a, b, c, d));
    return Column(m[0], m[1], m[2], m[3]);
}

fn write_one(s: Four, vector: u32) {
    if vector >= step.out_vectors { return; }
    let m0 = column(s.o0.x0, s.o1.x0, s.o2.x0, s.o3.x0);
    let m1 = column(s.o0.x1, s.o1.x1, s.o2.x1, s.o3.x1);
    let m2 = column(s.o0.x2, s.o1.x2, s.o2.x2, s.o3.x2);
    let m3 = column(s.o0.x3, s.o1.x3, s.o2.x3, s.o3.x3);
    var pixels = array(m0.y0, m1.y0, m2.y0, m3.y0, m0.y1, m1.y1, m2.y1, m3.y1, m0.y2, m1.y2, m2.y2, m3.y2, m0.y3,
        m1.y3, m2.y3, m3.y3);
    // A loop on purpose: unrolled it is most of a kernel's compilation.
    for (var i = 0u; i < 16u; i++) {
        let at = corner + vec2u(i % 4u, i / 4u);
        if all(at < step.out_size) { done(pixels[i], place.part, at.y * step.out_size.x + at.x, vector); }
    }
}

fn write(tile: u32, me: u32) {
    let first = place.block * VECTORS;
    write_one(a, first);
    close(0u, me);
    if VECTORS > 1u {
        write_one(b, first + 1u);
        close(1u, me);
    }
    if VECTORS > 2u {
        write_one(c, first + 2u);
        close(2u, me);
    }
    if VECTORS > 3u {
        write_one(d, first + 3u);
        close(3u, me);
    }
    gather(first, 1u, tile, me);
}
