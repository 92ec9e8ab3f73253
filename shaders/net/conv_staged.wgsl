// Any convolution as the product of two matrices whose pieces a workgroup stages in its memory:
// every input vector is read once for all COLUMNS · VECTORS vectors of output channels, every
// weight once for all pixels of the tile. A thread makes PIXELS (1, 2, 4, 8) pixels by VECTORS (1
// or 2) vectors. Weights come output vector by output vector: the bias, then tap by tap a matrix
// for each input vector. From the prelude besides: COLUMNS (1, 2, 4, 8), KERNEL_W, KERNEL_H,
// STRIDE.

const ROWS = 64u / COLUMNS;
const TILE = ROWS * PIXELS;
// Input vectors staged at a time.
const DEPTH = (COLUMNS + 1u) / 2u;
const STAGED = COLUMNS * VECTORS * DEPTH;

// Of each pixel of the tile, where its first tap lies in the input.
var<workgroup> corners: array<vec2i, TILE>;
var<workgroup> inputs: array<Four, TILE * DEPTH>;
var<workgroup> matrices: array<Four, STAGED * 4u>;

struct Eight { p0: vec4f, p1: vec4f, p2: vec4f, p3: vec4f, p4: vec4f, p5: vec4f, p6: vec4f, p7: vec4f }

fn all_of(v: vec4f) -> Eight { return Eight(v, v, v, v, v, v, v, v); }

// This thread's pixel `i`, of staged input vector `k`.
fn input(k: u32, i: u32, row: u32) -> Four { return inputs[k * TILE + min(i, PIXELS - 1u) * ROWS + row]; }

fn matrix(at: u32) -> Matrix {
    return Matrix(matrices[at * 4u], matrices[at * 4u + 1u], matrices[at * 4u + 2u], matrices[at * 4u + 3u]);
}

// What staged input vector `k` adds to the pixels of one output vector.
fn sum(s: Eight, m: Matrix, k: u32, row: u32) -> Eight {
    var t = s;
    t.p0 += wide(m * input(k, 0u, row));
    if PIXELS > 1u { t.p1 += wide(m * input(k, 1u, row)); }
    if PIXELS > 2u {
        t.p2 += wide(m * input(k, 2u, row));
        t.p3 += wide(m * input(k, 3u, row));
    }
    if PIXELS > 4u {
        t.p4 += wide(m * input(k, 4u, row));
        t.p5 += wide(m * input(k, 5u, row));
        t.p6 += wide(m * input(k, 6u, row));
        t.p7 += wide(m * input(k, 7u, row));
    }
    return t;
}

// Index of the weights of an output vector.
fn weights_of(phase: vec2u, vector: u32) -> u32 {
    let stored = (phase.y * SPREAD + phase.x) * step.out_vectors + min(vector, step.out_vectors - 1u);
    return stored * (1u + KERNEL_W * KERNEL_H * step.in_vectors);
}

// The bias of an output vector, with which the first part of the sum begins.
fn bias(place: Place, vector: u32) -> vec4f {
    return select(vec4f(0.0), column(weights_of(place.phase, vector) * 4u), place.part == 0u);
}

// Stages up to DEPTH vectors from `c` to `end` of the inputs under tap (x, y), and their weights
// for output vectors from `first` on.
fn stage(me: u32, phase: vec2u, first: u32, x: u32, y: u32, c: u32, end: u32) {
    for (var e = me; e < TILE * DEPTH; e += 64u) {
        let k = e % DEPTH;
        let pixel = e / DEPTH;
        let at = corners[pixel] + vec2i(vec2u(x, y));
        let start = vector_of(step.input, at.x, at.y);
        inputs[k * TILE + pixel] = narrow(load(select(0u, start + c + k, start != 0u && c + k < end)));
    }
    for (var e = me; e < STAGED * 4u; e += 64u) {
        // Beyond the end inputs are zero, and any weight will do.
        let k = min(c + e / 4u % DEPTH, end - 1u);
        let start = weights_of(phase, first + e / 4u / DEPTH) + 1u + (y * KERNEL_W + x) * step.in_vectors + k;
        matrices[e] = narrow(column(start * 4u + e % 4u));
    }
}

fn write(s: Eight, place: Place, tile: u32, row: u32, vector: u32) {
    if vector >= step.out_vectors { return; }
    var sums = array(s.p0, s.p1, s.p2, s.p3, s.p4, s.p5, s.p6, s.p7);
    let size = made(place.phase);
    for (var i = 0u; i < PIXELS; i++) {
        let index = tile + i * ROWS + row;
        let at = vec2u(index % size.x, index / size.x);
        if all(at < size) {
            let pixel = at * SPREAD + place.phase;
            done(sums[i], place.part, pixel.y * step.out_size.x + pixel.x, vector);
        }
    }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) me: u32) {
    let place = place_of(group.z);
    let size = made(place.phase);
    let tile = (group.y * groups.x + group.x) * TILE;
    for (var i = me; i < TILE; i += 64u) {
        let at = vec2u((tile + i) % size.x, (tile + i) / size.x);
        // Pixels that do not exist see only what is outside the picture.
        corners[i] = select(vec2i(-16777216), vec2i(at * STRIDE) - padding(place.phase), all(at < size));
    }
    let first = place.block * COLUMNS * VECTORS;
    let row = me / COLUMNS;
    let own = me % COLUMNS * VECTORS;
    let end = end_input(place.part);
    var a = all_of(bias(place, first + own));
    var b = all_of(bias(place, first + own + 1u));
    for (var y = 0u; y < KERNEL_H; y++) {
        for (var x = 0u; x < KERNEL_W; x++) {
            for (var c = first_input(place.part); c < end; c += DEPTH) {
                workgroupBarrier();
                stage(me, place.phase, first, x, y, c, end);
                workgroupBarrier();
                for (var k = 0u; k < DEPTH; k++) {
                    a = sum(a, matrix(own * DEPTH + k), k, row);
                    if VECTORS > 1u { b = sum(b, matrix((own + 1u) * DEPTH + k), k, row); }
                }
            }
        }
    }
    let tiles = groups.x * groups.y;
    let measured = (place.phase.y * SPREAD + place.phase.x) * tiles + group.y * groups.x + group.x;
    write(a, place, tile, row, first + own);
    close(0u, me);
    if VECTORS > 1u {
        write(b, place, tile, row, first + own + 1u);
        close(1u, me);
    }
    gather(first, COLUMNS, measured, me);
}
