// The work of a thread of a blocked convolution, whose tile comes from tile.wgsl or
// conv3x3_rows.wgsl: TILE, begin, convolve, write. From the prelude: THREADS, of a workgroup.

// First input vector that a block from output vector `vector` on reads. Where groups begin within a
// vector it reads neighbours too, with weights of zero.
fn first_read(vector: u32) -> u32 {
    let first = vector * 4u / step.group * step.group_inputs / 4u;
    return min(first, (step.in_channels + 3u) / 4u - step.in_vectors);
}

// The whole work of thread `local` of workgroup `group`. `convolve(first, count)` adds what the
// taps see of `count` input vectors, the weights of this block of output channels beginning at
// `first`.
fn make(group: vec3u, groups: vec3u, local: u32) {
    place = place_of(group.z);
    let size = made(place.phase);
    let across = (size.x + TILE.x - 1u) / TILE.x;
    let tile = (group.y * groups.x + group.x) * THREADS + local;
    corner = vec2u(tile % across, tile / across) * TILE;
    let each = KERNEL_W * KERNEL_H * VECTORS;
    let first = place.stored * (1u + each * step.in_vectors);
    let start = first_input(place.part);
    inputs = step.input + first_read(place.block * VECTORS) + start;
    // The first part of the sum begins with the bias.
    begin(weight(first) * select(0.0, 1.0, place.part == 0u));
    // Threads without a tile add nothing, but where threads exchange weights they stay with the others.
    let count = end_input(place.part) - start;
    convolve(first + 1u + start * each, select(0u, count, any_here(corner.y < size.y)));
    let tiles = groups.x * groups.y;
    write((place.phase.y * SPREAD + place.phase.x) * tiles + group.y * groups.x + group.x, local);
}
