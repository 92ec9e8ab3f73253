// The first level of a norm whose input no convolution has measured: for each tile of 256 pixels
// and each channel the number of values, their mean and the sum of squared deviations from it, in
// two passes, the second of which also mends the rounding of the first.

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    // Vectors of a tile side by side, so that a workgroup is full whatever their number.
    let index = (group.y * groups.x + group.x) * 64u + local;
    let vector = index % step.in_vectors;
    let tile = index / step.in_vectors;
    if tile >= step.tiles { return; }
    let first = tile * 256u;
    let count = min(256u, step.in_size.x * step.in_size.y - first);
    let start = step.input + first * step.in_pitch + vector;
    var sum = vec4f(0.0);
    for (var i = 0u; i < count; i++) { sum += load(start + i * step.in_pitch); }
    let guess = sum / f32(count);
    var rest = vec4f(0.0);
    var squares = vec4f(0.0);
    for (var i = 0u; i < count; i++) {
        let d = load(start + i * step.in_pitch) - guess;
        rest += d;
        squares += d * d;
    }
    let mend = rest / f32(count);
    let to = step.output + (tile * 3u * step.in_vectors + vector) * FULL;
    store_full(to, vec4f(f32(count)));
    store_full(to + step.in_vectors * FULL, guess + mend);
    store_full(to + 2u * step.in_vectors * FULL, max(squares - rest * mend, vec4f(0.0)));
}
