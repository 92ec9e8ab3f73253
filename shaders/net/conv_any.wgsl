// Any convolution: 1×1 and strided ones, whose taps share little, and each phase of a transposed
// one. From the prelude: KERNEL_W, KERNEL_H, STRIDE.

fn convolve(first: u32, count: u32) {
    let s = i32(STRIDE);
    let pad = padding(place.phase);
    for (var ky = 0u; ky < KERNEL_H; ky++) {
        for (var kx = 0u; kx < KERNEL_W; kx++) {
            let x = i32(corner.x * STRIDE + kx) - pad.x;
            let y = i32(corner.y * STRIDE + ky) - pad.y;
            let t0 = tap(x, y); let t1 = tap(x + s, y);
            let t2 = tap(x, y + s); let t3 = tap(x + s, y + s);
            let t4 = tap(x, y + 2 * s); let t5 = tap(x + s, y + 2 * s);
            let t6 = tap(x, y + 3 * s); let t7 = tap(x + s, y + 3 * s);
            var w = first + (ky * KERNEL_W + kx) * VECTORS;
            for (var i = 0u; i < count; i++) {
                take(w, Eight(load(t0 + i), load(t1 + i), load(t2 + i), load(t3 + i),
                              load(t4 + i), load(t5 + i), load(t6 + i), load(t7 + i)));
                w += KERNEL_H * KERNEL_W * VECTORS;
            }
        }
    }
}
