// What the blocked convolutions share: a thread makes eight pixels of a column and eight output channels (two vectors).

// Index of the first vector of pixel (x, y), or of the arena's zeros outside the picture.
fn tap(x: i32, y: i32) -> u32 {
    let inside = x >= 0 && y >= 0 && x < i32(step.in_size.x) && y < i32(step.in_size.y);
    return select(0u, step.input + (u32(y) * step.in_size.x + u32(x)) * IN_VECTORS, inside);
}

// Writes a column that starts at pixel (id.x, 8 id.y), vectors 2 id.z and 2 id.z + 1 of this dispatch, as far as they exist.
fn finish_column(id: vec3u, even: array<vec4f, 8>, odd: array<vec4f, 8>) {
    var p = even;
    var q = odd;
    let vector = (step.first_block + id.z) * 2u;
    let pair = vector + 1u < OUT_VECTORS;
    let end = min(8u, step.out_size.y - id.y * 8u);
    for (var i = 0u; i < end; i++) {
        let at = ((id.y * 8u + i) * step.out_size.x + id.x) * OUT_VECTORS + vector;
        finish(p[i], at);
        if pair { finish(q[i], at + 1u); }
    }
}
