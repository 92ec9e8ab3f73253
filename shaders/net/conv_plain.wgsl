// Any convolution, one pixel and four output channels a thread: the plain form, kept as the yardstick for the blocked ones.
// From the prelude: as tile.wgsl and conv_any.wgsl.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let at = id.xy * SPREAD + step.phase;
    if any(at >= step.out_size) { return; }
    let block = id.z / VECTORS;
    let half = id.z % VECTORS;
    let out_vector = (step.first_block + block) * VECTORS + half;
    if out_vector >= OUT_VECTORS { return; }
    var w = block * (1u + KERNEL_W * KERNEL_H * IN_VECTORS * VECTORS);
    var sum = weight(w)[half];
    w += 1u + half;
    let corner = vec2i(id.xy * STRIDE) - step.pad;
    for (var c = 0u; c < IN_VECTORS; c++) {
        for (var ky = 0u; ky < KERNEL_H; ky++) {
            for (var kx = 0u; kx < KERNEL_W; kx++) {
                let p = corner + vec2i(vec2u(kx, ky));
                if all(p >= vec2i(0)) && all(p < vec2i(step.in_size * NEAREST)) {
                    let q = vec2u(p) / NEAREST;
                    sum += weight(w) * load(step.input + (q.y * step.in_size.x + q.x) * IN_PITCH + c);
                }
                w += VECTORS;
            }
        }
    }
    finish(sum, at.y * step.out_size.x + at.x, out_vector);
}
