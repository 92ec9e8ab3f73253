// A convolution that measures what it makes, for the norm after it: of each workgroup and channel the number of values, their mean and the
// sum of their squared deviations from it. A thread adds up by how much its values differ from its first one, so that nothing is lost
// however far from zero they lie; threads are merged two at a time, always in the same order (Chan, Golub and LeVeque 1983).
// Otherwise as whole.wgsl. From the prelude: THREADS.

var<workgroup> counts: array<f32, THREADS>;
var<workgroup> means: array<vec4f, THREADS>;
var<workgroup> squares: array<vec4f, THREADS>;

// Of this thread's values of one vector how many there are, the first, and sums of the differences from it and of their squares.
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

// Writes what thread `me` and all others whose index leaves the same rest divided by `columns` have seen of vector `vector` as
// tile `tile`. The whole workgroup comes here.
fn close(vector: u32, columns: u32, tile: u32, me: u32) {
    let mean = away / max(seen, 1.0);
    counts[me] = seen;
    means[me] = origin + mean;
    squares[me] = max(away2 - away * mean, vec4f(0.0));
    seen = 0.0;
    away = vec4f(0.0);
    away2 = vec4f(0.0);
    for (var reach = THREADS / 2u; reach >= columns; reach /= 2u) {
        workgroupBarrier();
        if me < reach {
            let n = counts[me] + counts[me + reach];
            let share = counts[me + reach] / max(n, 1.0);
            let d = means[me + reach] - means[me];
            squares[me] += squares[me + reach] + d * d * counts[me] * share;
            means[me] += d * share;
            counts[me] = n;
        }
    }
    if me < columns && vector < step.out_vectors {
        let to = step.moments + (tile * 3u * step.out_vectors + vector) * FULL;
        store_full(to, vec4f(counts[me]));
        store_full(to + step.out_vectors * FULL, means[me]);
        store_full(to + 2u * step.out_vectors * FULL, squares[me]);
    }
    workgroupBarrier();
}
