// What the blocked convolutions share: a thread makes two columns by four rows of pixels and
// VECTORS (1 to 4) vectors of output channels of them. Tiles are counted row by row through the
// whole picture, so a workgroup of a small picture is full too. From the prelude: KERNEL_W,
// KERNEL_H, VECTORS; place.wgsl and whole.wgsl or measured.wgsl come before, make.wgsl after.

const TILE = vec2u(2u, 4u);

// One vector of each pixel of the tile, row by row.
struct Eight { p0: vec4f, p1: vec4f, p2: vec4f, p3: vec4f, p4: vec4f, p5: vec4f, p6: vec4f, p7: vec4f }

var<private> place: Place;
// The tile's first pixel among those of its phase, and where the channels begin that the group
// reads.
var<private> corner: vec2u;
var<private> inputs: u32;
// The tile's sums: one `Eight` an output vector.
var<private> a: Eight;
var<private> b: Eight;
var<private> c: Eight;
var<private> d: Eight;

// Index of the first vector that the group reads of pixel (x, y), or of the arena's zeros outside
// the picture.
fn tap(x: i32, y: i32) -> u32 { return vector_of(inputs, x, y); }

fn all_of(v: vec4f) -> Eight { return Eight(v, v, v, v, v, v, v, v); }

fn sum(s: Eight, m: mat4x4f, v: Eight) -> Eight {
    return Eight(s.p0 + m * v.p0, s.p1 + m * v.p1, s.p2 + m * v.p2, s.p3 + m * v.p3,
                 s.p4 + m * v.p4, s.p5 + m * v.p5, s.p6 + m * v.p6, s.p7 + m * v.p7);
}

// Adds one input vector of each pixel under one tap, whose VECTORS matrices begin at `at`.
fn take(at: u32, v: Eight) {
    a = sum(a, weight(at), v);
    if VECTORS > 1u { b = sum(b, weight(at + 1u), v); }
    if VECTORS > 2u { c = sum(c, weight(at + 2u), v); }
    if VECTORS > 3u { d = sum(d, weight(at + 3u), v); }
}

// Begins the sums with the bias.
fn begin(bias: mat4x4f) {
    a = all_of(bias[0]);
    b = all_of(bias[1]);
    c = all_of(bias[2]);
    d = all_of(bias[3]);
}

// Writes the vectors that exist of the pixels that exist. Loops on purpose: unrolled they are most
// of a kernel's compilation.
fn write(tile: u32, me: u32) {
    let first = place.block * VECTORS;
    let size = made(place.phase);
    var sums = array(
        a.p0, a.p1, a.p2, a.p3, a.p4, a.p5, a.p6, a.p7, b.p0, b.p1, b.p2, b.p3, b.p4, b.p5, b.p6, b.p7,
        c.p0, c.p1, c.p2, c.p3, c.p4, c.p5, c.p6, c.p7, d.p0, d.p1, d.p2, d.p3, d.p4, d.p5, d.p6, d.p7,
    );
    for (var v = 0u; v < VECTORS; v++) {
        let end = select(0u, 8u, first + v < step.out_vectors);
        for (var i = 0u; i < end; i++) {
            let at = corner + vec2u(i % 2u, i / 2u);
            if all(at < size) {
                let pixel = at * SPREAD + place.phase;
                done(sums[v * 8u + i], place.part, pixel.y * step.out_size.x + pixel.x, first + v);
            }
        }
        close(v, me);
    }
    gather(first, 1u, tile, me);
}
