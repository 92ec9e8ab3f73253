// Columns of weight matrices in 16 bits.
@group(0) @binding(2) var<storage, read> weights: array<vec2u>;

fn column(at: u32) -> vec4f { return vec4f(unpack2x16float(weights[at].x), unpack2x16float(weights[at].y)); }
