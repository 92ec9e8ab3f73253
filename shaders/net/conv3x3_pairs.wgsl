// 3×3 convolution, stride 1, padding 1, by Winograd's F(2, 3) along rows: two neighbours of a row
// cost four products a tap row instead of six. Weights come transformed (see pack.rs): tap row by
// tap row the matrices g0, (g0 + g1 + g2) / 2, (g0 − g1 + g2) / 2 and g2. The tile is two pairs of
// neighbours in each of four rows. Before: conv3x3_rows.wgsl. KERNEL_W is 4.

// The results of both pairs.
struct Both { left: Rows, right: Rows }
struct Inputs { a: Both, b: Both, c: Both, d: Both }

// What a result of the transform adds to four rows of both pairs.
struct Sums { left: vec4f, right: vec4f }

// The three tap rows of one result for one output channel; an input channel a lane.
fn products(w0: vec4f, w1: vec4f, w2: vec4f, v: Both) -> Sums {
    let l = v.left;
    let r = v.right;
    var p = w0.x * vec4f(l.r0.x, l.r1.x, l.r2.x, l.r3.x);
    var q = w0.x * vec4f(r.r0.x, r.r1.x, r.r2.x, r.r3.x);
    p += w0.y * vec4f(l.r0.y, l.r1.y, l.r2.y, l.r3.y);
    q += w0.y * vec4f(r.r0.y, r.r1.y, r.r2.y, r.r3.y);
    p += w0.z * vec4f(l.r0.z, l.r1.z, l.r2.z, l.r3.z);
    q += w0.z * vec4f(r.r0.z, r.r1.z, r.r2.z, r.r3.z);
    p += w0.w * vec4f(l.r0.w, l.r1.w, l.r2.w, l.r3.w);
    q += w0.w * vec4f(r.r0.w, r.r1.w, r.r2.w, r.r3.w);
    p += w1.x * vec4f(l.r1.x, l.r2.x, l.r3.x, l.r4.x);
    q += w1.x * vec4f(r.r1.x, r.r2.x, r.r3.x, r.r4.x);
    p += w1.y * vec4f(l.r1.y, l.r2.y, l.r3.y, l.r4.y);
    q += w1.y * vec4f(r.r1.y, r.r2.y, r.r3.y, r.r4.y);
    p += w1.z * vec4f(l.r1.z, l.r2.z, l.r3.z, l.r4.z);
    q += w1.z * vec4f(r.r1.z, r.r2.z, r.r3.z, r.r4.z);
    p += w1.w * vec4f(l.r1.w, l.r2.w, l.r3.w, l.r4.w);
    q += w1.w * vec4f(r.r1.w, r.r2.w, r.r3.w, r.r4.w);
    p += w2.x * vec4f(l.r2.x, l.r3.x, l.r4.x, l.r5.x);
    q += w2.x * vec4f(r.r2.x, r.r3.x, r.r4.x, r.r5.x);
    p += w2.y * vec4f(l.r2.y, l.r3.y, l.r4.y, l.r5.y);
    q += w2.y * vec4f(r.r2.y, r.r3.y, r.r4.y, r.r5.y);
    p += w2.z * vec4f(l.r2.z, l.r3.z, l.r4.z, l.r5.z);
    q += w2.z * vec4f(r.r2.z, r.r3.z, r.r4.z, r.r5.z);
    p += w2.w * vec4f(l.r2.w, l.r3.w, l.r4.w, l.r5.w);
    q += w2.w * vec4f(r.r2.w, r.r3.w, r.r4.w, r.r5.w);
    return Sums(p, q);
}

struct Weights { a: Taps, b: Taps, c: Taps, d: Taps }

fn weights_at(w: u32) -> Weights {
    return Weights(taps(w), taps(w + VECTORS), taps(w + 2u * VECTORS), taps(w + 3u * VECTORS));
}

// Adds the four results of the transform to the pixels that they belong to.
fn joined(s: Tile, a: Sums, b: Sums, c: Sums, d: Sums) -> Tile {
    return Tile(s.x0 + a.left + b.left + c.left, s.x1 + b.left - c.left - d.left,
                s.x2 + a.right + b.right + c.right, s.x3 + b.right - c.right - d.right);
}

fn low0(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(low(w.a.t0.x), low(w.a.t1.x), low(w.a.t2.x), v.a),
                  products(low(w.b.t0.x), low(w.b.t1.x), low(w.b.t2.x), v.b),
                  products(low(w.c.t0.x), low(w.c.t1.x), low(w.c.t2.x), v.c),
                  products(low(w.d.t0.x), low(w.d.t1.x), low(w.d.t2.x), v.d));
}
fn low1(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(low(w.a.t0.y), low(w.a.t1.y), low(w.a.t2.y), v.a),
                  products(low(w.b.t0.y), low(w.b.t1.y), low(w.b.t2.y), v.b),
                  products(low(w.c.t0.y), low(w.c.t1.y), low(w.c.t2.y), v.c),
                  products(low(w.d.t0.y), low(w.d.t1.y), low(w.d.t2.y), v.d));
}
fn low2(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(low(w.a.t0.z), low(w.a.t1.z), low(w.a.t2.z), v.a),
                  products(low(w.b.t0.z), low(w.b.t1.z), low(w.b.t2.z), v.b),
                  products(low(w.c.t0.z), low(w.c.t1.z), low(w.c.t2.z), v.c),
                  products(low(w.d.t0.z), low(w.d.t1.z), low(w.d.t2.z), v.d));
}
fn low3(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(low(w.a.t0.w), low(w.a.t1.w), low(w.a.t2.w), v.a),
                  products(low(w.b.t0.w), low(w.b.t1.w), low(w.b.t2.w), v.b),
                  products(low(w.c.t0.w), low(w.c.t1.w), low(w.c.t2.w), v.c),
                  products(low(w.d.t0.w), low(w.d.t1.w), low(w.d.t2.w), v.d));
}
fn low_all(s: Four, w: Weights, v: Inputs) -> Four {
    return Four(low0(s.o0, w, v), low1(s.o1, w, v), low2(s.o2, w, v), low3(s.o3, w, v));
}

fn high0(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(high(w.a.t0.x), high(w.a.t1.x), high(w.a.t2.x), v.a),
                  products(high(w.b.t0.x), high(w.b.t1.x), high(w.b.t2.x), v.b),
                  products(high(w.c.t0.x), high(w.c.t1.x), high(w.c.t2.x), v.c),
                  products(high(w.d.t0.x), high(w.d.t1.x), high(w.d.t2.x), v.d));
}
fn high1(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(high(w.a.t0.y), high(w.a.t1.y), high(w.a.t2.y), v.a),
                  products(high(w.b.t0.y), high(w.b.t1.y), high(w.b.t2.y), v.b),
                  products(high(w.c.t0.y), high(w.c.t1.y), high(w.c.t2.y), v.c),
                  products(high(w.d.t0.y), high(w.d.t1.y), high(w.d.t2.y), v.d));
}
fn high2(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(high(w.a.t0.z), high(w.a.t1.z), high(w.a.t2.z), v.a),
                  products(high(w.b.t0.z), high(w.b.t1.z), high(w.b.t2.z), v.b),
                  products(high(w.c.t0.z), high(w.c.t1.z), high(w.c.t2.z), v.c),
                  products(high(w.d.t0.z), high(w.d.t1.z), high(w.d.t2.z), v.d));
}
fn high3(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s, products(high(w.a.t0.w), high(w.a.t1.w), high(w.a.t2.w), v.a),
                  products(high(w.b.t0.w), high(w.b.t1.w), high(w.b.t2.w), v.b),
                  products(high(w.c.t0.w), high(w.c.t1.w), high(w.c.t2.w), v.c),
                  products(high(w.d.t0.w), high(w.d.t1.w), high(w.d.t2.w), v.d));
}
fn high_all(s: Four, w: Weights, v: Inputs) -> Four {
    return Four(high0(s.o0, w, v), high1(s.o1, w, v), high2(s.o2, w, v), high3(s.o3, w, v));
}

fn convolve(first: u32, count: u32) {
    let x = i32(corner.x) - 1;
    let y = i32(corner.y) - 1;
    let t00 = tap(x + 0, y + 0); let t01 = tap(x + 1, y + 0); let t02 = tap(x + 2, y + 0);
    let t03 = tap(x + 3, y + 0); let t04 = tap(x + 4, y + 0); let t05 = tap(x + 5, y + 0);
    let t10 = tap(x + 0, y + 1); let t11 = tap(x + 1, y + 1); let t12 = tap(x + 2, y + 1);
    let t13 = tap(x + 3, y + 1); let t14 = tap(x + 4, y + 1); let t15 = tap(x + 5, y + 1);
    let t20 = tap(x + 0, y + 2); let t21 = tap(x + 1, y + 2); let t22 = tap(x + 2, y + 2);
    let t23 = tap(x + 3, y + 2); let t24 = tap(x + 4, y + 2); let t25 = tap(x + 5, y + 2);
    let t30 = tap(x + 0, y + 3); let t31 = tap(x + 1, y + 3); let t32 = tap(x + 2, y + 3);
    let t33 = tap(x + 3, y + 3); let t34 = tap(x + 4, y + 3); let t35 = tap(x + 5, y + 3);
    let t40 = tap(x + 0, y + 4); let t41 = tap(x + 1, y + 4); let t42 = tap(x + 2, y + 4);
    let t43 = tap(x + 3, y + 4); let t44 = tap(x + 4, y + 4); let t45 = tap(x + 5, y + 4);
    let t50 = tap(x + 0, y + 5); let t51 = tap(x + 1, y + 5); let t52 = tap(x + 2, y + 5);
    let t53 = tap(x + 3, y + 5); let t54 = tap(x + 4, y + 5); let t55 = tap(x + 5, y + 5);
    var w = first;
    for (var i = 0u; i < count; i++) {
        let v00 = load(t00 + i); let v01 = load(t01 + i); let v02 = load(t02 + i);
        let v03 = load(t03 + i); let v04 = load(t04 + i); let v05 = load(t05 + i);
        let v10 = load(t10 + i); let v11 = load(t11 + i); let v12 = load(t12 + i);
        let v13 = load(t13 + i); let v14 = load(t14 + i); let v15 = load(t15 + i);
        let v20 = load(t20 + i); let v21 = load(t21 + i); let v22 = load(t22 + i);
        let v23 = load(t23 + i); let v24 = load(t24 + i); let v25 = load(t25 + i);
        let v30 = load(t30 + i); let v31 = load(t31 + i); let v32 = load(t32 + i);
        let v33 = load(t33 + i); let v34 = load(t34 + i); let v35 = load(t35 + i);
        let v40 = load(t40 + i); let v41 = load(t41 + i); let v42 = load(t42 + i);
        let v43 = load(t43 + i); let v44 = load(t44 + i); let v45 = load(t45 + i);
        let v50 = load(t50 + i); let v51 = load(t51 + i); let v52 = load(t52 + i);
        let v53 = load(t53 + i); let v54 = load(t54 + i); let v55 = load(t55 + i);
        let v = Inputs(
            Both(Rows(v00 - v02, v10 - v12, v20 - v22, v30 - v32, v40 - v42, v50 - v52),
                 Rows(v02 - v04, v12 - v14, v22 - v24, v32 - v34, v42 - v44, v52 - v54)),
            Both(Rows(v01 + v02, v11 + v12, v21 + v22, v31 + v32, v41 + v42, v51 + v52),
                 Rows(v03 + v04, v13 + v14, v23 + v24, v33 + v34, v43 + v44, v53 + v54)),
            Both(Rows(v02 - v01, v12 - v11, v22 - v21, v32 - v31, v42 - v41, v52 - v51),
                 Rows(v04 - v03, v14 - v13, v24 - v23, v34 - v33, v44 - v43, v54 - v53)),
            Both(Rows(v01 - v03, v11 - v13, v21 - v23, v31 - v33, v41 - v43, v51 - v53),
                 Rows(v03 - v05, v13 - v15, v23 - v25, v33 - v35, v43 - v45, v53 - v55)),
        );
        let near = weights_at(w);
        a = low_all(a, near, v);
        if VECTORS > 1u { b = high_all(b, near, v); }
        if VECTORS > 2u {
            let far = weights_at(w + 2u);
            c = low_all(c, far, v);
            if VECTORS > 3u { d = high_all(d, far, v); }
        }
        w += 12u * VECTORS;
    }
}
