// A convolution that measures what it makes, for the norm after it: of each workgroup and channel
// the number of values, their mean and the sum of their squared deviations from it. A thread adds
// up by how much its values differ from its first one, so that nothing is lost however far from
// zero they lie; threads are merged one after the other (Chan, Golub and LeVeque 1983). Otherwise
// as whole.wgsl. From the prelude: THREADS, and MADE, the vectors that a thread makes.

var<workgroup> counts: array<f32, MADE * THREADS>;
var<workgroup> means: array<vec4f, MADE * THREADS>;
var<workgroup> squares: array<vec4f, MADE * THREADS>;

// Of this thread's values of one vector how many there are, the first, and sums of the differences
// from it and of their squares.
var<private> seen: f32;
var<private> origin: vec4f;
var<private> away: vec4f;
var<private> away2: vec4f;

fn first_input(part: u32) -> u32 { return 0u; }
fn end_input(part: u32) -> u32 { return step.in_vectors; }

fn done(value: vec4f, part: u32, pixel: u32, vector: u32) {
    let v = finish(value, pixel, vector);
    if seen == 0.0 { origin = v; }
    let d = v - origin;
    seen += 1.0;
    away += d;
    away2 += d * d;
}

// Hands on what thread `me` has seen of its `i`th vector.
fn close(i: u32, me: u32) {
    let mean = away / max(seen, 1.0);
    let at = i * THREADS + me;
    counts[at] = seen;
    means[at] = origin + mean;
    squares[at] = max(away2 - away * mean, vec4f(0.0));
    seen = 0.0;
    away = vec4f(0.0);
    away2 = vec4f(0.0);
}

// Writes the moments of tile `tile`. The whole workgroup comes here. Threads lie in rows of
// `columns`, and those in a column make the same MADE vectors, the first column from `first` on.
fn gather(first: u32, columns: u32, tile: u32, me: u32) {
    workgroupBarrier();
    let column = me % columns;
    let i = me / columns;
    let vector = first + column * MADE + i;
    if i >= MADE || vector >= step.out_vectors { return; }
    var n = 0.0;
    var mean = vec4f(0.0);
    var square = vec4f(0.0);
    for (var at = i * THREADS + column; at < i * THREADS + THREADS; at += columns) {
        let count = counts[at];
        let d = means[at] - mean;
        let share = count / max(n + count, 1.0);
        square += squares[at] + d * d * n * share;
        mean += d * share;
        n += count;
    }
    let to = step.moments + (tile * 3u * step.out_vectors + vector) * FULL;
    store_full(to, vec4f(n));
    store_full(to + step.out_vectors * FULL, mean);
    store_full(to + 2u * step.out_vectors * FULL, square);
}
