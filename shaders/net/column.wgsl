// What the blocked convolutions share: a thread makes eight pixels of a column and eight output channels (two vectors).
// From the prelude: IN_PITCH, NEAREST (factor by which the input is enlarged), SPREAD (distance of a thread's output pixels:
// 1, or the stride of a transposed convolution), OUT_VECTORS.

// Index of the first vector of pixel (x, y), or of the arena's zeros outside the picture.
fn tap(x: i32, y: i32) -> u32 {
    let size = vec2i(step.in_size * NEAREST);
    let inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    return select(0u, step.input + (u32(y) / NEAREST * step.in_size.x + u32(x) / NEAREST) * IN_PITCH, inside);
}

// Columns and rows that a dispatch makes.
fn made() -> vec2u { return (step.out_size - step.phase + SPREAD - 1u) / SPREAD; }

// Writes a column that starts at pixel (id.x, 8 id.y), vectors 2 id.z and 2 id.z + 1 of this dispatch, as far as they exist.
fn finish_column(id: vec3u, even: array<vec4f, 8>, odd: array<vec4f, 8>) {
    var p = even;
    var q = odd;
    let vector = (step.first_block + id.z) * 2u;
    let pair = vector + 1u < OUT_VECTORS;
    let end = min(8u, made().y - id.y * 8u);
    let x = id.x * SPREAD + step.phase.x;
    for (var i = 0u; i < end; i++) {
        let pixel = ((id.y * 8u + i) * SPREAD + step.phase.y) * step.out_size.x + x;
        finish(p[i], pixel, vector);
        if pair { finish(q[i], pixel, vector + 1u); }
    }
}
