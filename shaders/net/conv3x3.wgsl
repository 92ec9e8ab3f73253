// 3×3 convolution, stride 1, padding 1: eight pixels of a column and eight output channels a thread. The ten rows that the
// three vertical taps share are read once. Weights come tap column by tap column (see kernels.rs), as six matrices an input vector.
// From the prelude: IN_VECTORS.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let y = id.y * 8u;
    if any(vec2u(id.x, y) >= made()) { return; }
    var w = id.z * (1u + 18u * IN_VECTORS);
    let bias = weight(w);
    w += 1u;
    var p0 = bias[0]; var q0 = bias[1];
    var p1 = bias[0]; var q1 = bias[1];
    var p2 = bias[0]; var q2 = bias[1];
    var p3 = bias[0]; var q3 = bias[1];
    var p4 = bias[0]; var q4 = bias[1];
    var p5 = bias[0]; var q5 = bias[1];
    var p6 = bias[0]; var q6 = bias[1];
    var p7 = bias[0]; var q7 = bias[1];
    for (var kx = 0; kx < 3; kx++) {
        let x = i32(id.x) + kx - 1;
        let top = i32(y) - 1;
        let t0 = tap(x, top);
        let t1 = tap(x, top + 1);
        let t2 = tap(x, top + 2);
        let t3 = tap(x, top + 3);
        let t4 = tap(x, top + 4);
        let t5 = tap(x, top + 5);
        let t6 = tap(x, top + 6);
        let t7 = tap(x, top + 7);
        let t8 = tap(x, top + 8);
        let t9 = tap(x, top + 9);
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
            let a8 = load(t8 + c);
            let a9 = load(t9 + c);
            m = weight(w);
            p0 += m * a0; p1 += m * a1; p2 += m * a2; p3 += m * a3;
            p4 += m * a4; p5 += m * a5; p6 += m * a6; p7 += m * a7;
            m = weight(w + 1u);
            q0 += m * a0; q1 += m * a1; q2 += m * a2; q3 += m * a3;
            q4 += m * a4; q5 += m * a5; q6 += m * a6; q7 += m * a7;
            m = weight(w + 2u);
            p0 += m * a1; p1 += m * a2; p2 += m * a3; p3 += m * a4;
            p4 += m * a5; p5 += m * a6; p6 += m * a7; p7 += m * a8;
            m = weight(w + 3u);
            q0 += m * a1; q1 += m * a2; q2 += m * a3; q3 += m * a4;
            q4 += m * a5; q5 += m * a6; q6 += m * a7; q7 += m * a8;
            m = weight(w + 4u);
            p0 += m * a2; p1 += m * a3; p2 += m * a4; p3 += m * a5;
            p4 += m * a6; p5 += m * a7; p6 += m * a8; p7 += m * a9;
            m = weight(w + 5u);
            q0 += m * a2; q1 += m * a3; q2 += m * a4; q3 += m * a5;
            q4 += m * a6; q5 += m * a7; q6 += m * a8; q7 += m * a9;
            w += 6u;
        }
    }
    finish_column(id, array(p0, p1, p2, p3, p4, p5, p6, p7), array(q0, q1, q2, q3, q4, q5, q6, q7));
}
