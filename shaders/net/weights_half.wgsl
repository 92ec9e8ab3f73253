// A layer's weights in 16 bits: two columns of a matrix in each half of an element.
struct Matrix { a: vec4u, b: vec4u }

@group(0) @binding(2) var<storage, read> weights: array<Matrix>;

fn column(low: u32, high: u32) -> vec4f { return vec4f(unpack2x16float(low), unpack2x16float(high)); }

fn weight(at: u32) -> mat4x4f {
    let m = weights[at];
    return mat4x4f(column(m.a.x, m.a.y), column(m.a.z, m.a.w), column(m.b.x, m.b.y), column(m.b.z, m.b.w));
}
