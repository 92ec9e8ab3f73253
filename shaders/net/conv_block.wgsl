// Any convolution: eight pixels of a column and eight output channels a thread. For 1×1 and strided kernels, whose taps
// share little, and for each phase of a transposed one. From the prelude: KERNEL_W, KERNEL_H, STRIDE, IN_VECTORS.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let y = id.y * 8u;
    if any(vec2u(id.x, y) >= made()) { return; }
    let first = id.z * (1u + KERNEL_W * KERNEL_H * IN_VECTORS * 2u);
    let bias = weight(first);
    var p0 = bias[0]; var q0 = bias[1];
    var p1 = bias[0]; var q1 = bias[1];
    var p2 = bias[0]; var q2 = bias[1];
    var p3 = bias[0]; var q3 = bias[1];
    var p4 = bias[0]; var q4 = bias[1];
    var p5 = bias[0]; var q5 = bias[1];
    var p6 = bias[0]; var q6 = bias[1];
    var p7 = bias[0]; var q7 = bias[1];
    for (var kx = 0u; kx < KERNEL_W; kx++) {
        for (var ky = 0u; ky < KERNEL_H; ky++) {
            let x = i32(id.x * STRIDE + kx) - step.pad.x;
            let top = i32(y * STRIDE + ky) - step.pad.y;
            let s = i32(STRIDE);
            let t0 = tap(x, top);
            let t1 = tap(x, top + 1 * s);
            let t2 = tap(x, top + 2 * s);
            let t3 = tap(x, top + 3 * s);
            let t4 = tap(x, top + 4 * s);
            let t5 = tap(x, top + 5 * s);
            let t6 = tap(x, top + 6 * s);
            let t7 = tap(x, top + 7 * s);
            var w = first + 1u + (kx * IN_VECTORS * KERNEL_H + ky) * 2u;
            for (var c = 0u; c < IN_VECTORS; c++) {
                var m: mat4x4f;
                let a0 = load(t0 + c);
                let a1 = load(t1 + c);
                let a2 = load(t2 + c);
                let a3 = load(t3 + c);
                let a4 = load(t4 + c);
                let a5 = load(t5 + c);
                let a6 = load(t6 + c);
                let a7 = load(t7 + c);
                m = weight(w);
                p0 += m * a0; p1 += m * a1; p2 += m * a2; p3 += m * a3;
                p4 += m * a4; p5 += m * a5; p6 += m * a6; p7 += m * a7;
                m = weight(w + 1u);
                q0 += m * a0; q1 += m * a1; q2 += m * a2; q3 += m * a3;
                q4 += m * a4; q5 += m * a5; q6 += m * a6; q7 += m * a7;
                w += KERNEL_H * 2u;
            }
        }
    }
    finish_column(id, array(p0, p1, p2, p3, p4, p5, p6, p7), array(q0, q1, q2, q3, q4, q5, q6, q7));
}
