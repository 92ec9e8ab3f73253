// Any convolution, one pixel and four output channels a thread: the plain form, kept as the yardstick for the blocked ones.
// From the prelude: as conv_any.wgsl and VECTORS.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = place_of(id.z / VECTORS);
    let at = id.xy * SPREAD + place.phase;
    if any(at >= step.out_size) { return; }
    let half = id.z % VECTORS;
    let out_vector = place.block * VECTORS + half;
    if out_vector >= step.out_vectors { return; }
    var w = place.stored * (1u + KERNEL_W * KERNEL_H * step.in_vectors * VECTORS);
    var sum = weight(w)[half];
    w += 1u + half;
    let corner = vec2i(id.xy * STRIDE) - padding(place.phase);
    for (var c = 0u; c < step.in_vectors; c++) {
        for (var ky = 0u; ky < KERNEL_H; ky++) {
            for (var kx = 0u; kx < KERNEL_W; kx++) {
                let start = vector_of(step.input, corner.x + i32(kx), corner.y + i32(ky));
                if start != 0u { sum += weight(w) * load(start + c); }
                w += VECTORS;
            }
        }
    }
    finish(sum, at.y * step.out_size.x + at.x, out_vector);
}
