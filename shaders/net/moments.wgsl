// The first level of a norm: for each tile of 256 pixels and each channel the mean and the sum of squared deviations from
// it, in two passes, the second of which also mends the rounding of the first. From the prelude: IN_PITCH, IN_VECTORS.

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) local: u32) {
    // Vectors of a tile side by side, so that a workgroup is full whatever their number.
    let index = (group.y * groups.x + group.x) * 64u + local;
    let vector = index % IN_VECTORS;
    let tile = index / IN_VECTORS;
    if tile >= step.tiles { return; }
    let first = tile * 256u;
    let count = min(256u, step.in_size.x * step.in_size.y - first);
    let start = step.input + first * IN_PITCH + vector;
    var sum = vec4f(0.0);
    for (var i = 0u; i < count; i++) { sum += load(start + i * IN_PITCH); }
    let guess = sum / f32(count);
    var rest = vec4f(0.0);
    var squares = vec4f(0.0);
    for (var i = 0u; i < count; i++) {
        let d = load(start + i * IN_PITCH) - guess;
        rest += d;
        squares += d * d;
    }
    let mend = rest / f32(count);
    let to = step.output + (tile * 2u * IN_VECTORS + vector) * FULL;
    store_full(to, guess + mend);
    store_full(to + IN_VECTORS * FULL, max(squares - rest * mend, vec4f(0.0)));
}
