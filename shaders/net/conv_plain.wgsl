// Any convolution, one pixel and four output channels a thread: the plain form, kept as the
// yardstick for the blocked ones. From the prelude: as conv_any.wgsl and VECTORS.

fn convolve(place: Place, corner: vec2i, half: u32) -> vec4f {
    var w = place.stored * (1u + KERNEL_W * KERNEL_H * step.in_vectors * VECTORS);
    var sum = weight(w)[half];
    w += 1u + half;
    for (var c = 0u; c < step.in_vectors; c++) {
        for (var ky = 0u; ky < KERNEL_H; ky++) {
            for (var kx = 0u; kx < KERNEL_W; kx++) {
                let start = vector_of(step.input, corner.x + i32(kx), corner.y + i32(ky));
                if start != 0u { sum += weight(w) * load(start + c); }
                w += VECTORS;
            }
        }
    }
    return sum;
}

@compute @workgroup_size(16, 4)
fn main(
    @builtin(global_invocation_id) id: vec3u, @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) me: u32
) {
    let place = place_of(id.z / VECTORS);
    let at = id.xy * SPREAD + place.phase;
    let vector = place.block * VECTORS + id.z % VECTORS;
    if all(at < step.out_size) && vector < step.out_vectors {
        let sum = convolve(place, vec2i(id.xy * STRIDE) - padding(place.phase), id.z % VECTORS);
        done(sum, 0u, at.y * step.out_size.x + at.x, vector);
    }
    let tiles = groups.x * groups.y;
    close(0u, me);
    gather(vector, 1u, (place.phase.y * SPREAD + place.phase.x) * tiles + group.y * groups.x + group.x, me);
}
