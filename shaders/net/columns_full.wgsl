// Columns of weight matrices in 32 bits.
@group(0) @binding(2) var<storage, read> weights: array<vec4f>;

fn column(at: u32) -> vec4f { return weights[at]; }
