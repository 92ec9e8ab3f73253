// 3×3 convolution, stride 1, padding 1, by Winograd's F(4, 3) along rows: four neighbours of a row
// cost six products a tap row instead of twelve. Weights come transformed (see pack.rs). 32 bits
// only: in 16 the transform would cost accuracy. Before: conv3x3_rows.wgsl. KERNEL_W is 6.

struct Inputs { a: Rows, b: Rows, c: Rows, d: Rows, e: Rows, f: Rows }

// The three tap rows of one result for one output channel; an input channel a lane.
fn products(w0: vec4f, w1: vec4f, w2: vec4f, v: Rows) -> vec4f {
    var p = w0.x * vec4f(v.r0.x, v.r1.x, v.r2.x, v.r3.x);
    p += w0.y * vec4f(v.r0.y, v.r1.y, v.r2.y, v.r3.y);
    p += w0.z * vec4f(v.r0.z, v.r1.z, v.r2.z, v.r3.z);
    p += w0.w * vec4f(v.r0.w, v.r1.w, v.r2.w, v.r3.w);
    p += w1.x * vec4f(v.r1.x, v.r2.x, v.r3.x, v.r4.x);
    p += w1.y * vec4f(v.r1.y, v.r2.y, v.r3.y, v.r4.y);
    p += w1.z * vec4f(v.r1.z, v.r2.z, v.r3.z, v.r4.z);
    p += w1.w * vec4f(v.r1.w, v.r2.w, v.r3.w, v.r4.w);
    p += w2.x * vec4f(v.r2.x, v.r3.x, v.r4.x, v.r5.x);
    p += w2.y * vec4f(v.r2.y, v.r3.y, v.r4.y, v.r5.y);
    p += w2.z * vec4f(v.r2.z, v.r3.z, v.r4.z, v.r5.z);
    p += w2.w * vec4f(v.r2.w, v.r3.w, v.r4.w, v.r5.w);
    return p;
}

struct Weights { a: Taps, b: Taps, c: Taps, d: Taps, e: Taps, f: Taps }

fn weights_at(w: u32) -> Weights {
    return Weights(taps(w), taps(w + VECTORS), taps(w + 2u * VECTORS), taps(w + 3u * VECTORS),
        taps(w + 4u * VECTORS), taps(w + 5u * VECTORS));
}

// Adds the six results of the transform to the pixels that they belong to.
fn joined(s: Tile, a: vec4f, b: vec4f, c: vec4f, d: vec4f, e: vec4f, f: vec4f) -> Tile {
    let p = b + c;
    let q = b - c;
    let u = d + e;
    let v = d - e;
    return Tile(s.x0 + a + p + u, s.x1 + q + 2.0 * v, s.x2 + p + 4.0 * u, s.x3 + q + 8.0 * v + f);
}

fn low0(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(low(w.a.t0.x), low(w.a.t1.x), low(w.a.t2.x), v.a),
                  products(low(w.b.t0.x), low(w.b.t1.x), low(w.b.t2.x), v.b),
                  products(low(w.c.t0.x), low(w.c.t1.x), low(w.c.t2.x), v.c),
                  products(low(w.d.t0.x), low(w.d.t1.x), low(w.d.t2.x), v.d),
                  products(low(w.e.t0.x), low(w.e.t1.x), low(w.e.t2.x), v.e),
                  products(low(w.f.t0.x), low(w.f.t1.x), low(w.f.t2.x), v.f));
}
fn low1(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(low(w.a.t0.y), low(w.a.t1.y), low(w.a.t2.y), v.a),
                  products(low(w.b.t0.y), low(w.b.t1.y), low(w.b.t2.y), v.b),
                  products(low(w.c.t0.y), low(w.c.t1.y), low(w.c.t2.y), v.c),
                  products(low(w.d.t0.y), low(w.d.t1.y), low(w.d.t2.y), v.d),
                  products(low(w.e.t0.y), low(w.e.t1.y), low(w.e.t2.y), v.e),
                  products(low(w.f.t0.y), low(w.f.t1.y), low(w.f.t2.y), v.f));
}
fn low2(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(low(w.a.t0.z), low(w.a.t1.z), low(w.a.t2.z), v.a),
                  products(low(w.b.t0.z), low(w.b.t1.z), low(w.b.t2.z), v.b),
                  products(low(w.c.t0.z), low(w.c.t1.z), low(w.c.t2.z), v.c),
                  products(low(w.d.t0.z), low(w.d.t1.z), low(w.d.t2.z), v.d),
                  products(low(w.e.t0.z), low(w.e.t1.z), low(w.e.t2.z), v.e),
                  products(low(w.f.t0.z), low(w.f.t1.z), low(w.f.t2.z), v.f));
}
fn low3(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(low(w.a.t0.w), low(w.a.t1.w), low(w.a.t2.w), v.a),
                  products(low(w.b.t0.w), low(w.b.t1.w), low(w.b.t2.w), v.b),
                  products(low(w.c.t0.w), low(w.c.t1.w), low(w.c.t2.w), v.c),
                  products(low(w.d.t0.w), low(w.d.t1.w), low(w.d.t2.w), v.d),
                  products(low(w.e.t0.w), low(w.e.t1.w), low(w.e.t2.w), v.e),
                  products(low(w.f.t0.w), low(w.f.t1.w), low(w.f.t2.w), v.f));
}
fn low_all(s: Four, w: Weights, v: Inputs) -> Four {
    return Four(low0(s.o0, w, v), low1(s.o1, w, v), low2(s.o2, w, v), low3(s.o3, w, v));
}

fn high0(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(high(w.a.t0.x), high(w.a.t1.x), high(w.a.t2.x), v.a),
                  products(high(w.b.t0.x), high(w.b.t1.x), high(w.b.t2.x), v.b),
                  products(high(w.c.t0.x), high(w.c.t1.x), high(w.c.t2.x), v.c),
                  products(high(w.d.t0.x), high(w.d.t1.x), high(w.d.t2.x), v.d),
                  products(high(w.e.t0.x), high(w.e.t1.x), high(w.e.t2.x), v.e),
                  products(high(w.f.t0.x), high(w.f.t1.x), high(w.f.t2.x), v.f));
}
fn high1(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(high(w.a.t0.y), high(w.a.t1.y), high(w.a.t2.y), v.a),
                  products(high(w.b.t0.y), high(w.b.t1.y), high(w.b.t2.y), v.b),
                  products(high(w.c.t0.y), high(w.c.t1.y), high(w.c.t2.y), v.c),
                  products(high(w.d.t0.y), high(w.d.t1.y), high(w.d.t2.y), v.d),
                  products(high(w.e.t0.y), high(w.e.t1.y), high(w.e.t2.y), v.e),
                  products(high(w.f.t0.y), high(w.f.t1.y), high(w.f.t2.y), v.f));
}
fn high2(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(high(w.a.t0.z), high(w.a.t1.z), high(w.a.t2.z), v.a),
                  products(high(w.b.t0.z), high(w.b.t1.z), high(w.b.t2.z), v.b),
                  products(high(w.c.t0.z), high(w.c.t1.z), high(w.c.t2.z), v.c),
                  products(high(w.d.t0.z), high(w.d.t1.z), high(w.d.t2.z), v.d),
                  products(high(w.e.t0.z), high(w.e.t1.z), high(w.e.t2.z), v.e),
                  products(high(w.f.t0.z), high(w.f.t1.z), high(w.f.t2.z), v.f));
}
fn high3(s: Tile, w: Weights, v: Inputs) -> Tile {
    return joined(s,
                  products(high(w.a.t0.w), high(w.a.t1.w), high(w.a.t2.w), v.a),
                  products(high(w.b.t0.w), high(w.b.t1.w), high(w.b.t2.w), v.b),
                  products(high(w.c.t0.w), high(w.c.t1.w), high(w.c.t2.w), v.c),
                  products(high(w.d.t0.w), high(w.d.t1.w), high(w.d.t2.w), v.d),
                  products(high(w.e.t0.w), high(w.e.t1.w), high(w.e.t2.w), v.e),
                  products(high(w.f.t0.w), high(w.f.t1.w), high(w.f.t2.w), v.f));
}
fn high_all(s: Four, w: Weights, v: Inputs) -> Four {
    return Four(high0(s.o0, w, v), high1(s.o1, w, v), high2(s.o2, w, v), high3(s.o3, w, v));
}

// The six results of the transform of a row of six pixels.
struct Six { a: vec4f, b: vec4f, c: vec4f, d: vec4f, e: vec4f, f: vec4f }

fn transformed(v0: vec4f, v1: vec4f, v2: vec4f, v3: vec4f, v4: vec4f, v5: vec4f) -> Six {
    let p = v4 - 4.0 * v2;
    let q = v3 - 4.0 * v1;
    let r = v4 - v2;
    let s = 2.0 * (v3 - v1);
    return Six(4.0 * (v0 - v2) + r, p + q, p - q, r + s, r - s, 4.0 * (v1 - v3) + v5 - v3);
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
        let s0 = transformed(load(t00 + i), load(t01 + i), load(t02 + i), load(t03 + i), load(t04 + i), load(t05 + i));
        let s1 = transformed(load(t10 + i), load(t11 + i), load(t12 + i), load(t13 + i), load(t14 + i), load(t15 + i));
        let s2 = transformed(load(t20 + i), load(t21 + i), load(t22 + i), load(t23 + i), load(t24 + i), load(t25 + i));
        let s3 = transformed(load(t30 + i), load(t31 + i), load(t32 + i), load(t33 + i), load(t34 + i), load(t35 + i));
        let s4 = transformed(load(t40 + i), load(t41 + i), load(t42 + i), load(t43 + i), load(t44 + i), load(t45 + i));
        let s5 = transformed(load(t50 + i), load(t51 + i), load(t52 + i), load(t53 + i), load(t54 + i), load(t55 + i));
        let v = Inputs(
            Rows(s0.a, s1.a, s2.a, s3.a, s4.a, s5.a),
            Rows(s0.b, s1.b, s2.b, s3.b, s4.b, s5.b),
            Rows(s0.c, s1.c, s2.c, s3.c, s4.c, s5.c),
            Rows(s0.d, s1.d, s2.d, s3.d, s4.d, s5.d),
            Rows(s0.e, s1.e, s2.e, s3.e, s4.e, s5.e),
            Rows(s0.f, s1.f, s2.f, s3.f, s4.f, s5.f),
        );
        let near = weights_at(w);
        a = low_all(a, near, v);
        if VECTORS > 1u { b = high_all(b, near, v); }
        if VECTORS > 2u {
            let far = weights_at(w + 2u);
            c = low_all(c, far, v);
            if VECTORS > 3u { d = high_all(d, far, v); }
        }
        w += 18u * VECTORS;
    }
}
