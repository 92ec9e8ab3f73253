// 3×3 convolution, stride 1, padding 1: the 24 pixels that a tile's taps share are read once an
// input vector. Weights come tap by tap, row by row, an input vector after the other (see pack.rs).

fn convolve(first: u32, count: u32) {
    let x = i32(corner.x) - 1;
    let y = i32(corner.y) - 1;
    let t00 = tap(x, y); let t01 = tap(x + 1, y); let t02 = tap(x + 2, y); let t03 = tap(x + 3, y);
    let t10 = tap(x, y + 1); let t11 = tap(x + 1, y + 1); let t12 = tap(x + 2, y + 1); let t13 = tap(x + 3, y + 1);
    let t20 = tap(x, y + 2); let t21 = tap(x + 1, y + 2); let t22 = tap(x + 2, y + 2); let t23 = tap(x + 3, y + 2);
    let t30 = tap(x, y + 3); let t31 = tap(x + 1, y + 3); let t32 = tap(x + 2, y + 3); let t33 = tap(x + 3, y + 3);
    let t40 = tap(x, y + 4); let t41 = tap(x + 1, y + 4); let t42 = tap(x + 2, y + 4); let t43 = tap(x + 3, y + 4);
    let t50 = tap(x, y + 5); let t51 = tap(x + 1, y + 5); let t52 = tap(x + 2, y + 5); let t53 = tap(x + 3, y + 5);
    var w = first;
    for (var i = 0u; i < count; i++) {
        let v00 = load(t00 + i); let v01 = load(t01 + i); let v02 = load(t02 + i); let v03 = load(t03 + i);
        let v10 = load(t10 + i); let v11 = load(t11 + i); let v12 = load(t12 + i); let v13 = load(t13 + i);
        let v20 = load(t20 + i); let v21 = load(t21 + i); let v22 = load(t22 + i); let v23 = load(t23 + i);
        let v30 = load(t30 + i); let v31 = load(t31 + i); let v32 = load(t32 + i); let v33 = load(t33 + i);
        let v40 = load(t40 + i); let v41 = load(t41 + i); let v42 = load(t42 + i); let v43 = load(t43 + i);
        let v50 = load(t50 + i); let v51 = load(t51 + i); let v52 = load(t52 + i); let v53 = load(t53 + i);
        take(w, Eight(v00, v01, v10, v11, v20, v21, v30, v31));
        take(w + VECTORS, Eight(v01, v02, v11, v12, v21, v22, v31, v32));
        take(w + 2u * VECTORS, Eight(v02, v03, v12, v13, v22, v23, v32, v33));
        take(w + 3u * VECTORS, Eight(v10, v11, v20, v21, v30, v31, v40, v41));
        take(w + 4u * VECTORS, Eight(v11, v12, v21, v22, v31, v32, v41, v42));
        take(w + 5u * VECTORS, Eight(v12, v13, v22, v23, v32, v33, v42, v43));
        take(w + 6u * VECTORS, Eight(v20, v21, v30, v31, v40, v41, v50, v51));
        take(w + 7u * VECTORS, Eight(v21, v22, v31, v32, v41, v42, v51, v52));
        take(w + 8u * VECTORS, Eight(v22, v23, v32, v33, v42, v43, v52, v53));
        w += 9u * VECTORS;
    }
}
