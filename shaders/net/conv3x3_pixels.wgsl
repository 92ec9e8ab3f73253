// As conv3x3.wgsl, but a pixel's nine products follow each other, so that its sum stays in registers: for processors, which have few of
// them. (The drivers' compilers keep the order.) The matrices of two output vectors lie ready meanwhile.

// The matrices of nine taps, row by row, for two output vectors.
struct Taps { t0: Pair, t1: Pair, t2: Pair, t3: Pair, t4: Pair, t5: Pair, t6: Pair, t7: Pair, t8: Pair }

fn taps(w: u32) -> Taps {
    return Taps(pair(w), pair(w + VECTORS), pair(w + 2u * VECTORS), pair(w + 3u * VECTORS), pair(w + 4u * VECTORS),
                pair(w + 5u * VECTORS), pair(w + 6u * VECTORS), pair(w + 7u * VECTORS), pair(w + 8u * VECTORS));
}

// Three rows of three pixels.
struct Nine { a: vec4f, b: vec4f, c: vec4f, d: vec4f, e: vec4f, f: vec4f, g: vec4f, h: vec4f, i: vec4f }

fn lower(s: vec4f, m: Taps, n: Nine) -> vec4f {
    return s + m.t0.first * n.a + m.t1.first * n.b + m.t2.first * n.c + m.t3.first * n.d + m.t4.first * n.e
             + m.t5.first * n.f + m.t6.first * n.g + m.t7.first * n.h + m.t8.first * n.i;
}

fn upper(s: vec4f, m: Taps, n: Nine) -> vec4f {
    return s + m.t0.second * n.a + m.t1.second * n.b + m.t2.second * n.c + m.t3.second * n.d + m.t4.second * n.e
             + m.t5.second * n.f + m.t6.second * n.g + m.t7.second * n.h + m.t8.second * n.i;
}

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
        let n0 = Nine(v00, v01, v02, v10, v11, v12, v20, v21, v22);
        let n1 = Nine(v01, v02, v03, v11, v12, v13, v21, v22, v23);
        let n2 = Nine(v10, v11, v12, v20, v21, v22, v30, v31, v32);
        let n3 = Nine(v11, v12, v13, v21, v22, v23, v31, v32, v33);
        let n4 = Nine(v20, v21, v22, v30, v31, v32, v40, v41, v42);
        let n5 = Nine(v21, v22, v23, v31, v32, v33, v41, v42, v43);
        let n6 = Nine(v30, v31, v32, v40, v41, v42, v50, v51, v52);
        let n7 = Nine(v31, v32, v33, v41, v42, v43, v51, v52, v53);
        let low = taps(w);
        a = Eight(lower(a.p0, low, n0), lower(a.p1, low, n1), lower(a.p2, low, n2), lower(a.p3, low, n3),
                  lower(a.p4, low, n4), lower(a.p5, low, n5), lower(a.p6, low, n6), lower(a.p7, low, n7));
        if VECTORS > 1u {
            b = Eight(upper(b.p0, low, n0), upper(b.p1, low, n1), upper(b.p2, low, n2), upper(b.p3, low, n3),
                      upper(b.p4, low, n4), upper(b.p5, low, n5), upper(b.p6, low, n6), upper(b.p7, low, n7));
        }
        if VECTORS > 2u {
            let high = taps(w + 2u);
            c = Eight(lower(c.p0, high, n0), lower(c.p1, high, n1), lower(c.p2, high, n2), lower(c.p3, high, n3),
                      lower(c.p4, high, n4), lower(c.p5, high, n5), lower(c.p6, high, n6), lower(c.p7, high, n7));
            if VECTORS > 3u {
                d = Eight(upper(d.p0, high, n0), upper(d.p1, high, n1), upper(d.p2, high, n2), upper(d.p3, high, n3),
                          upper(d.p4, high, n4), upper(d.p5, high, n5), upper(d.p6, high, n6), upper(d.p7, high, n7));
            }
        }
        w += 9u * VECTORS;
    }
}
