// The entry point of the blocked convolutions, whose tile comes from tile.wgsl: TILE, begin,
// convolve, write. From the prelude: THREADS, of a workgroup.

// First input vector that a block from output vector `vector` on reads. Where groups begin within a
// vector it reads neighbours too, with weights of zero.
fn first_read(vector: u32) -> u32 {
    let first = vector * 4u / step.group * step.group_inputs / 4u;
    return min(first, (step.in_channels + 3u) / 4u - step.in_vectors);
}

// `convolve(first, count)` adds what the taps see of `count` input vectors, the weights of this
// block of output channels beginning at `first`.
@compute @workgroup_size(THREADS)
fn main(
    @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32
) {
    place = place_of(group.z);
    let size = made(place.phase);
    let across = (size.x + TILE.x - 1u) / TILE.x;
    let tile = (group.y * groups.x + group.x) * THREADS + local;
    corner = vec2u(tile % across, tile / across) * TILE;
    let first = place.stored * (1u + KERNEL_W * KERNEL_H * VECTORS * step.in_vectors);
    inputs = step.input + first_read(place.block * VECTORS);
    begin(weight(first));
    // Threads without a tile add nothing.
    convolve(first + 1u, select(0u, step.in_vectors, corner.y < size.y));
    let tiles = groups.x * groups.y;
    write((place.phase.y * SPREAD + place.phase.x) * tiles + group.y * groups.x + group.x, local);
}
