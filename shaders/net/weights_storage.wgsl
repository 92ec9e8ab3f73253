// A layer's weights as a storage buffer: layers too wide for a uniform binding.
@group(0) @binding(2) var<storage, read> weights: array<mat4x4f>;

fn weight(at: u32) -> mat4x4f { return weights[at]; }
