// 3×3 convolution, stride 1, padding 1, by Winograd's F(2, 3) along rows (Lavin and Gray 2016): two neighbours of a row cost four products a
// tap row instead of six. Weights come transformed (see pack.rs): tap row by tap row the matrices g0, (g0 + g1 + g2) / 2,
// (g0 − g1 + g2) / 2 and g2. A pair of pixels is finished before the next, so that sums stay in registers: for processors, which have few
// of them and whose compilers keep the order. From the prelude: as tile.wgsl; KERNEL_W is 4.

// Four neighbours of a row, transformed.
struct Row { a: vec4f, b: vec4f, c: vec4f, d: vec4f }

fn row(x0: vec4f, x1: vec4f, x2: vec4f, x3: vec4f) -> Row { return Row(x0 - x2, x1 + x2, x2 - x1, x1 - x3); }

// The matrices of three tap rows for two output vectors.
struct Taps { a0: Pair, b0: Pair, c0: Pair, d0: Pair, a1: Pair, b1: Pair, c1: Pair, d1: Pair, a2: Pair, b2: Pair, c2: Pair, d2: Pair }

fn taps(w: u32) -> Taps {
    return Taps(pair(w), pair(w + VECTORS), pair(w + 2u * VECTORS), pair(w + 3u * VECTORS),
                pair(w + 4u * VECTORS), pair(w + 5u * VECTORS), pair(w + 6u * VECTORS), pair(w + 7u * VECTORS),
                pair(w + 8u * VECTORS), pair(w + 9u * VECTORS), pair(w + 10u * VECTORS), pair(w + 11u * VECTORS));
}

// What three rows add to two neighbours.
struct Two { left: vec4f, right: vec4f }

fn lower(m: Taps, r: Row, s: Row, t: Row) -> Two {
    let a = m.a0.first * r.a + m.a1.first * s.a + m.a2.first * t.a;
    let b = m.b0.first * r.b + m.b1.first * s.b + m.b2.first * t.b;
    let c = m.c0.first * r.c + m.c1.first * s.c + m.c2.first * t.c;
    let d = m.d0.first * r.d + m.d1.first * s.d + m.d2.first * t.d;
    return Two(a + b + c, b - c - d);
}

fn upper(m: Taps, r: Row, s: Row, t: Row) -> Two {
    let a = m.a0.second * r.a + m.a1.second * s.a + m.a2.second * t.a;
    let b = m.b0.second * r.b + m.b1.second * s.b + m.b2.second * t.b;
    let c = m.c0.second * r.c + m.c1.second * s.c + m.c2.second * t.c;
    let d = m.d0.second * r.d + m.d1.second * s.d + m.d2.second * t.d;
    return Two(a + b + c, b - c - d);
}

fn joined(s: Eight, r0: Two, r1: Two, r2: Two, r3: Two) -> Eight {
    return Eight(s.p0 + r0.left, s.p1 + r0.right, s.p2 + r1.left, s.p3 + r1.right,
                 s.p4 + r2.left, s.p5 + r2.right, s.p6 + r3.left, s.p7 + r3.right);
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
        let r0 = row(load(t00 + i), load(t01 + i), load(t02 + i), load(t03 + i));
        let r1 = row(load(t10 + i), load(t11 + i), load(t12 + i), load(t13 + i));
        let r2 = row(load(t20 + i), load(t21 + i), load(t22 + i), load(t23 + i));
        let r3 = row(load(t30 + i), load(t31 + i), load(t32 + i), load(t33 + i));
        let r4 = row(load(t40 + i), load(t41 + i), load(t42 + i), load(t43 + i));
        let r5 = row(load(t50 + i), load(t51 + i), load(t52 + i), load(t53 + i));
        let low = taps(w);
        a = joined(a, lower(low, r0, r1, r2), lower(low, r1, r2, r3), lower(low, r2, r3, r4), lower(low, r3, r4, r5));
        if VECTORS > 1u { b = joined(b, upper(low, r0, r1, r2), upper(low, r1, r2, r3), upper(low, r2, r3, r4), upper(low, r3, r4, r5)); }
        if VECTORS > 2u {
            let high = taps(w + 2u);
            c = joined(c, lower(high, r0, r1, r2), lower(high, r1, r2, r3), lower(high, r2, r3, r4), lower(high, r3, r4, r5));
            if VECTORS > 3u { d = joined(d, upper(high, r0, r1, r2), upper(high, r1, r2, r3), upper(high, r2, r3, r4), upper(high, r3, r4, r5)); }
        }
        w += 12u * VECTORS;
    }
}
